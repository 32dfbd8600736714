"""One-line errors for names that do not exist."""

import difflib
from collections.abc import Iterable


def check(name, valid: Iterable[str], kind: str) -> str:
    """Returns `name` if it is valid.

    Raises:
        ValueError: it is not; the message names it and the nearest valid name.
    """
    valid = list(valid)
    if name in valid:
        return name
    close = difflib.get_close_matches(str(name), valid, n=1, cutoff=0.0)
    hint = f"; did you mean {close[0]!r}?" if close else ""
    raise ValueError(f"unknown {kind} {name!r}{hint} (there are: {', '.join(valid)})")
