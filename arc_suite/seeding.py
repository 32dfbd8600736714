"""Seeds: Python and NumPy integers, the same through every interface."""

import operator

_MAX = 2**32 - 1  # the largest that a RandomState takes


def check(seed) -> int:
    """Returns the seed as a Python integer.

    Raises:
        ValueError: it is not an integer from 0 to 2**32 - 1; one line.
    """
    try:
        number = operator.index(seed)
    except TypeError:
        number = -1
    if not 0 <= number <= _MAX:
        raise ValueError(f"seed: expected an integer from 0 to {_MAX}, got {seed!r}")
    return number
