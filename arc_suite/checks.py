"""Checks of names, seeds and numbers, whose errors are one line with one wording."""

import difflib
import operator
from collections.abc import Iterable

_LARGEST_SEED = 2**32 - 1  # that a RandomState takes


def name(value, valid: Iterable[str], kind: str) -> str:
    """Return the value if it is valid.

    Raises:
        ValueError: it is not; the message names it and the nearest valid name.
    """
    valid = list(valid)
    if value in valid:
        return value
    close = difflib.get_close_matches(str(value), valid, n=1, cutoff=0.0)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    raise ValueError(f"unknown {kind} {value!r}{hint} (there are: {', '.join(valid)})")


def seed(value) -> int:
    """Return the seed as a Python integer.

    Raises:
        ValueError: it is not an integer from 0 to 2**32 - 1; one line.
    """
    try:
        number = operator.index(value)
    except TypeError:
        number = -1
    if not 0 <= number <= _LARGEST_SEED:
        raise ValueError(f"seed: expected an integer from 0 to {_LARGEST_SEED}, got {value!r}")
    return number
