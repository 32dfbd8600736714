"""One guard for parsers of files that others may have written: whatever a parser raises becomes one line.

Parsers of other packages raise errors of many classes for damaged files, and their releases add more. A guard around a
parser catches all of them. The caller checks bounds on the work before the parser starts.
"""

import contextlib
import json
from collections.abc import Iterator

from arc_suite import checks, files

# Errors whose texts say what Python did, and not what is wrong with the file.
_REASONS = {
    RecursionError: "nested too deeply",
    MemoryError: "needs more memory than there is",
}
# Errors whose texts make no sense without their class.
_UNEXPLAINED = (IndexError, AttributeError, AssertionError)


@contextlib.contextmanager
def guard(
    place: str,
    cure: str = "",
    passes: tuple[type[Exception], ...] = (),
    raises: type[ValueError] = ValueError,
) -> Iterator[None]:
    """Turn whatever a parser raises into one line: `with guard(f"{path}: no policy"): parse(path)`.

    Args:
        place: file and, within the file, what is parsed; the line begins with it.
        cure: ends the line.
        passes: classes of errors that are left as they are.
        raises: class of the error of one line.

    Raises:
        ValueError: the block raised an error; one line with its reason.
    """
    try:
        yield
    except passes:
        raise
    except Exception as error:
        raise raises(f"{place}: {describe(error)}{cure}") from None


def describe(error: Exception) -> str:
    """Return the reason that an error of a parser gives, in one line."""
    if isinstance(error, json.JSONDecodeError):
        return files.describe_json_error(error)
    for kind, reason in _REASONS.items():
        if isinstance(error, kind):
            return reason
    if isinstance(error, KeyError) and len(error.args) == 1:
        key = checks.quote(error.args[0])
        return key if " " in key else f"{key!r} is missing"  # keys with spaces are sentences of libraries
    text = checks.quote(error)
    if not text:
        return type(error).__name__
    return f"{type(error).__name__}: {text}" if isinstance(error, _UNEXPLAINED) else text
