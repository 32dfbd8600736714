"""Bodies as JSON: the fields of `arc_suite.robots.spec` by name, tuples as lists, defaults left out.

A file holds one object with the fields of a `Body`; a field that is a spec holds an object in turn.
There are no includes, no paths and no markup.
"""

import collections
import dataclasses
import json
import os
import re
from pathlib import Path
from typing import Any

from arc_suite import checks, files
from arc_suite.robots import sources
from arc_suite.robots.spec import MAX_SOURCE, Body, SpecError

MAX_BYTES = 1 << 18  # of a file; a body of 64 legs with 16 links each has fewer
MAX_IMPORTED = MAX_BYTES + 2 * MAX_SOURCE  # of a file with a source, in which line breaks and quotes take two bytes

# Paths of the creatures that come with the suite, by name.
EXAMPLES = {path.stem: path for path in sorted(Path(__file__).with_name("examples").glob("*.json"))}

_NUMBERS = re.compile(r"\[\s+([^\[\]{}\"]*?)\s+\]")


def load_body(path: str | os.PathLike) -> Body:
    """Read a body from a file.

    Args:
        path: of the file, or the name of an example, such as "spider".

    Raises:
        SpecError: not JSON, or no body; the message names the file and the field by its path,
            `legs[2].links[0].radius`.
        ValueError: neither a file nor an example.
        OSError: the file cannot be read.
    """
    if isinstance(path, str) and not Path(path).suffix and not Path(path).is_file():
        path = EXAMPLES[checks.name(path, EXAMPLES, "spec", suggestions=("FILE.json",))]
    with files.reading(path), Path(path).open("rb") as file:
        data = file.read(MAX_IMPORTED + 1)
    try:
        most = MAX_IMPORTED if b'"source"' in data else MAX_BYTES
        if len(data) > most:
            raise SpecError(f"expected at most {most} bytes")
        return body_from_json(data)
    except SpecError as error:
        raise SpecError(f"{path}: {error}") from None


def save_body(body: Body, path: str | os.PathLike) -> None:
    """Write a body to a file; fields that are left open stay open.

    Raises:
        OSError: the file cannot be written.
    """
    Path(path).write_text(body_to_json(body), encoding="utf-8")


def body_to_json(body: Body) -> str:
    """Return a body as the text of a file, ending in a newline; equal bodies give equal texts."""
    text = json.dumps(_plain(body), indent=2, allow_nan=False)
    return _NUMBERS.sub(lambda match: f"[{' '.join(match[1].split())}]", text) + "\n"


def body_from_json(text: str | bytes) -> Body:
    """Return the body that a text describes.

    Raises:
        SpecError: not JSON, or no body.
    """
    if text.lstrip()[:1] in ("<", b"<"):
        raise SpecError(
            "expected a body in JSON, got XML; the name of an MJCF file ends in .xml, that of a URDF file in .urdf"
        )
    try:
        # Integers of any length become floats, which the field's range then refuses.
        value = json.loads(text, object_pairs_hook=_object, parse_int=_integer)
    except SpecError:
        raise
    except RecursionError:
        raise SpecError("expected a body in JSON, got too many brackets within brackets") from None
    except ValueError as error:
        raise SpecError(f"expected a body in JSON: {error}") from None
    return sources.check(_spec(Body, value, ""))


def _object(pairs: list[tuple[str, Any]]) -> dict:
    result = dict(pairs)
    if len(result) < len(pairs):
        counts = collections.Counter(key for key, _ in pairs)
        twice = next(key for key, count in counts.items() if count > 1)
        raise SpecError(f"the key {twice[:40]!r} occurs twice in one object")
    return result


def _integer(digits: str) -> int | float:
    return int(digits) if len(digits) < 20 else float(digits)


def _plain(value: Any) -> Any:
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if dataclasses.is_dataclass(value):
        fields = {field.name: (getattr(value, field.name), field.default) for field in dataclasses.fields(value)}
        return {name: _plain(item) for name, (item, default) in fields.items() if item != default}
    return value


def _spec(kind: type, value: Any, path: str) -> Any:
    """Return the spec of a kind that an object describes; `path` leads to it from the top."""
    if not isinstance(value, dict):
        raise SpecError(f"expected an object with the fields of a {kind.__name__}, got {_shown(value)}", None, path)
    fields = {field.name: field for field in dataclasses.fields(kind)}
    for name in value:
        try:
            checks.name(name[:40], fields, "field")
        except ValueError as error:
            raise SpecError(str(error), None, path) from None
    for field in fields.values():
        if field.default is dataclasses.MISSING and field.name not in value:
            raise SpecError(f"missing; a {kind.__name__} needs it", field.name, path)
    arguments = {name: _field(fields[name], item, f"{path}.{name}".lstrip(".")) for name, item in value.items()}
    try:
        return kind(**arguments)
    except SpecError as error:
        raise SpecError(error.reason, error.field, path) from None


def _field(field: dataclasses.Field, value: Any, path: str) -> Any:
    kind = field.metadata.get("kind")
    if kind is None or (value is None and field.default is None):
        return value
    if not field.metadata["many"]:
        return _spec(kind, value, path)
    if not isinstance(value, list):
        raise SpecError(f"expected a list of {kind.__name__}s, got {_shown(value)}", None, path)
    return [_spec(kind, item, f"{path}[{i}]") for i, item in enumerate(value)]


def _shown(value: Any) -> str:
    plain = {dict: "an object", list: "a list", type(None): "null", bool: "true or false", str: "a string"}
    return plain.get(type(value), "a number")
