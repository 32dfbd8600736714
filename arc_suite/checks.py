"""Checks of names, seeds and numbers, with one wording of errors."""

import difflib
import json
import math
import operator
import os
import pkgutil
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

MAX_SEED = 2**32 - 1  # that a RandomState takes
_SMALL = 1e-6  # least number that errors name as a bound; a smaller one keeps out 0
_LONGEST_QUOTE = 300  # characters


def name(value, valid: Iterable[str], kind: str, near: Iterable[str] = ()) -> str:
    """Return the value if it is a valid name.

    Args:
        value: the name.
        valid: all names there are.
        kind: what they name, with which an error begins.
        near: names that are valid in its place but are taken out before; an error may mean them too.

    Raises:
        ValueError: it is not; the message names it, a valid name that is near, and all there are.
    """
    valid = list(valid)
    if value in valid:
        return value
    valid += near
    raise ValueError(f"unknown {kind} {preview(value)}{hint(value, valid)} (there are: {', '.join(valid)})")


def names(what: str, value, valid: Iterable[str], kind: str) -> tuple[str, ...]:
    """Return the value as valid names; one name stands for a list of it.

    Args:
        what: name of the value, with which an error about all of it begins.
        value: a name, or a list or tuple of names.
        valid: all names there are.
        kind: what they name.

    Raises:
        ValueError: it is neither, or one of them is not valid; see `name`.
    """
    given = (value,) if isinstance(value, str) else value
    if not isinstance(given, tuple | list):
        raise ValueError(f"{what}: expected names of {kind}s, got {preview(value)}")
    return tuple(name(each, valid, kind) for each in given)


def hint(value, valid: Iterable[str]) -> str:
    """Return how an error goes on that names an unknown value: with a valid one that is near, if there is any."""
    close = difflib.get_close_matches(preview(value).strip("'"), valid, n=1)
    return f"; did you mean {close[0]!r}?" if close else ""


def extension(path: str | os.PathLike, valid: Iterable[str]) -> str:
    """Return the extension of a file to write, in lower case.

    Args:
        path: of the file.
        valid: extensions there are, with their dots.

    Raises:
        ValueError: it is none of them.
    """
    return name(Path(path).suffix.lower(), valid, "extension")


def seed(value) -> int:
    """Return the seed as a Python integer.

    Raises:
        ValueError: it is not an integer from 0 to 2**32 - 1.
    """
    return integer("seed", value, 0, MAX_SEED)


def integer(what: str, value: Any, low: int, high: int | None = None) -> int:
    """Return the value as a Python integer.

    Args:
        what: name of the value, with which an error begins.
        value: a Python or NumPy integer.
        low: least that it may be.
        high: most that it may be; None for no bound.

    Raises:
        ValueError: it is no integer, or out of range.
    """
    try:
        number = low - 1 if isinstance(value, bool) else operator.index(value)
    except TypeError:
        number = low - 1
    if number < low or (high is not None and number > high):
        bounds = f"from {low}" if high is None else f"from {low} to {high}"
        raise ValueError(f"{what}: expected an integer {bounds}, got {preview(value)}")
    return number


def number(what: str, value: Any, low: float = -math.inf, high: float = math.inf) -> float:
    """Return the value as a float.

    Args:
        what: name of the value, with which an error begins.
        value: a Python or NumPy number.
        low: least that it may be.
        high: most that it may be.

    Raises:
        ValueError: it is no finite number, or out of range.
    """
    real = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    try:
        found = float(value) if real else math.nan
    except OverflowError:  # of a large integer
        found = math.inf
    if not math.isfinite(found) or not low <= found <= high:
        raise ValueError(f"{what}: expected a {_numbers(low, high)}, got {preview(value)}")
    return found


def boolean(what: str, value: Any) -> bool:
    """Return the value as a Python boolean.

    Args:
        what: name of the value, with which an error begins.
        value: True or False, of Python or NumPy.

    Raises:
        ValueError: it is neither.
    """
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"{what}: expected true or false, got {preview(value)}")
    return bool(value)


def span(what: str, value: Any, low: float, high: float) -> tuple[float, float]:
    """Return two numbers, the lower first, between which something is drawn; one number stands for both.

    Args:
        what: name of the value, with which an error begins.
        value: a number, or a list or tuple of two.
        low: least that they may be.
        high: most that they may be.

    Raises:
        ValueError: it is neither, or out of range.
    """
    try:
        first, last = value if isinstance(value, tuple | list) else (value, value)
        first = number(what, first, low, high)
        return first, number(what, last, first, high)
    except ValueError:
        raise ValueError(
            f"{what}: expected a {_numbers(low, high)}, or two of them, the lower first, got {preview(value)}"
        ) from None


def _numbers(low: float, high: float) -> str:
    """Return in words which numbers lie in a range."""
    if low == -math.inf:
        return "finite number"
    if 0.0 < low < _SMALL:
        return "finite number above 0" if high == math.inf else f"number above 0, at most {high:g}"
    return f"finite number of at least {low:g}" if high == math.inf else f"number from {low:g} to {high:g}"


def array(what: str, value: Any, size: int, low: float = -math.inf, high: float = math.inf) -> np.ndarray:
    """Return the value as (size,) floats; a single number stands for all of them.

    Args:
        what: name of the value, with which an error begins.
        value: a number, or a list or array of them.
        size: how many.
        low: least that they may be.
        high: most that they may be.

    Raises:
        ValueError: it is neither one finite number nor so many of them, or out of range.
    """
    try:
        numbers = np.asarray(value)
    except (ValueError, RecursionError):  # of unequal lengths, or nested too deeply
        numbers = np.asarray(None)
    fits = numbers.dtype.kind in "if" and numbers.shape in ((), (size,)) and np.isfinite(numbers).all()
    if not (fits and ((low <= numbers) & (numbers <= high)).all()):
        raise ValueError(f"{what}: expected one {_numbers(low, high)} or {size} of them, got {preview(value)}")
    return np.broadcast_to(numbers, size).astype(float)


def mapping(what: str, value: Any) -> Mapping[str, Any]:
    """Return the value if it is a mapping, and an empty one for None.

    Raises:
        ValueError: it is neither.
    """
    if value is None:
        return {}
    if not isinstance(value, Mapping):
        raise ValueError(f"{what}: expected a mapping of names to values, got {preview(value)}")
    return value


def json_text(what: str, value: Any) -> str:
    """Return the value as JSON, with the keys of mappings in order.

    Raises:
        ValueError: it holds something that JSON cannot.
    """
    try:
        return json.dumps(value, sort_keys=True)
    except (TypeError, ValueError, RecursionError) as error:
        raise ValueError(f"{what}: expected values that JSON can hold: {quote(error)}") from None


def quote(value: Any) -> str:
    """Return the beginning of a foreign text, such as another library's error, without line breaks."""
    return " ".join(str(value).split())[:_LONGEST_QUOTE]


def preview(value: Any) -> str:
    """Return how errors write a value of any origin, such as of a file: the beginning of its text, in one line."""
    try:
        return quote(repr(value))
    except Exception:  # nested too deeply, or broken
        return f"a {type(value).__name__} that cannot be shown"


def import_object(path: str, kind: str, resolve: Callable[[str], Any] = pkgutil.resolve_name) -> Any:
    """Return what `module:name` stands for; its module is imported.

    Args:
        path: the module and the name in it.
        kind: of what is wanted, with which an error begins.
        resolve: returns it.

    Raises:
        ValueError: there is none.
    """
    try:
        return resolve(path)
    except (ImportError, ValueError, AttributeError) as error:
        near = hint(error.name, dir(error.obj)) if isinstance(error, AttributeError) else ""
        raise ValueError(f"{kind} {path[:80]!r}: {quote(error)}{near}") from None
