"""Bodies as JSON: the fields of `arc_suite.robots.spec` by name, tuples as lists, defaults left out.

A file holds one object with the fields of a `Body`; a field that is a spec holds an object in turn.
There are no includes, no paths and no markup.
"""

import collections
import dataclasses
import itertools
import json
import os
import re
from pathlib import Path
from typing import Any

from arc_suite import checks, files, parsers
from arc_suite.robots import field_hints, sources
from arc_suite.robots.spec import MAX_SOURCE, Body, SpecError

MAX_BYTES = 1 << 18  # of a file; a body of 64 legs with 16 links each has fewer
MAX_IMPORTED = MAX_BYTES + 2 * MAX_SOURCE  # bytes of a file with a source; its line breaks and quotes take two bytes

# Paths of the bodies that the package contains, by name.
EXAMPLES = {path.stem: path for path in sorted(Path(__file__).with_name("examples").glob("*.json"))}

# Files of other kinds, by extension, and JSON of other kinds, by a key that it has.
_OTHER_FORMAT = "a robot for another simulator, whose maker may have a .urdf or .xml, too"
_KINDS_OF_FILES = {
    ".glb": "clips",
    ".fbx": "clips",
    ".bvh": "a motion",
    ".html": "a page",
    **dict.fromkeys((".png", ".jpg", ".gif", ".webp", ".mp4"), "a picture or a film"),
    ".npz": "arrays, such as a policy or a motion",
    ".onnx": "a policy",
    ".zip": "an archive",
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz", ".sdf"), _OTHER_FORMAT),
    **dict.fromkeys((".obj", ".stl", ".dae", ".ply"), "a mesh, without joints"),
    ".xacro": "a template of a .urdf, which the program xacro makes",
}
_KINDS_OF_JSON = {
    "sketch": "a design: open it in arc-suite studio, and save its spec",
    "clips": "what arc-suite animate tells of clips",
    "frames": "what arc-suite animate tells of a sheet of sprites",
    "algorithm": "the configuration of a run",
    "elites": "the report of a search: its bodies lie in the folder bodies next to it",
}
_BODIES_IN_FOLDERS = ("bodies/*.json", "*.urdf", "*.xml", "*.json", "urdf/*.urdf")  # the first is that of a search
_FILES_OF_RUNS = ("config.json", "policy.npz")

_MAX_FILES = 1000  # of a folder, among which a body is sought
_MAX_QUOTE = 40  # characters of a key in an error
_MAX_DIGITS = 20  # of an integer that is read as such; longer ones are read as floats
_LIST_OF_NUMBERS = re.compile(r"\[\n\s*([^\[\]{}\"]*?)\s+\]")  # texts have no line breaks


def load_body(path: str | os.PathLike[str]) -> Body:
    """Read a body from a file.

    Args:
        path: path of the file, or the name of an example, such as "spider".

    Raises:
        SpecError: the file is no JSON, or describes no valid body; the message names the file and the field by its
            path, `legs[2].links[0].radius`.
        ValueError: there is neither a file nor an example of this name.
        OSError: the file cannot be read.
    """
    if isinstance(path, str) and not Path(path).suffix and not Path(path).is_file():
        path = EXAMPLES[checks.name(path, EXAMPLES, "spec", suggestions=("FILE.json",))]
    refuse_folder(path)
    data = files.read_bytes(path, MAX_IMPORTED)
    check_kind(path)
    max_bytes = MAX_IMPORTED if b'"source"' in data else MAX_BYTES
    try:
        if len(data) > max_bytes:
            raise SpecError(f"expected at most {max_bytes} bytes")
        return body_from_json(data)
    except SpecError as error:
        raise SpecError(f"{path}: {error}") from None


def check_kind(path: str | os.PathLike[str]) -> None:
    """Raise SpecError for the name of a file of another kind, such as clips, which holds no body."""
    suffix = Path(path).suffix.lower()
    if suffix in _KINDS_OF_FILES:
        raise SpecError(f"{path}: expected a body, .json, .xml or .urdf; a {suffix} holds {_KINDS_OF_FILES[suffix]}")


def refuse_folder(path: str | os.PathLike[str]) -> None:
    """Raise OSError for a folder in place of a file, with what it holds."""
    if files.is_folder(os.fspath(path)):
        raise IsADirectoryError(f"cannot read {path}: is a directory{hint_in_folder(path)}")


def hint_in_folder(path: str | os.PathLike[str]) -> str:
    """Return the part of an error that suggests what a folder holds: a run, or a file that may be a body; else ""."""
    folder = Path(path)
    if all((folder / name).is_file() for name in _FILES_OF_RUNS):
        return "; --policy takes the folder of a run"
    for pattern in _BODIES_IN_FOLDERS:
        body_files = sorted(itertools.islice(folder.glob(pattern), _MAX_FILES))
        if body_files:
            return f"; did you mean {checks.quote(body_files[0])}?"
    return ""


def save_body(body: Body, path: str | os.PathLike[str]) -> None:
    """Write a body to a file, atomically; fields that are None stay None.

    Raises:
        OSError: the file cannot be written.
    """
    files.write(path, body_to_json(body))


def body_to_json(body: Body) -> str:
    """Return a body as the text of a file, ending in a newline; equal bodies give equal texts."""
    text = json.dumps(_to_json_value(body), indent=2, allow_nan=False)
    return _LIST_OF_NUMBERS.sub(_put_on_one_line, text) + "\n"


def body_from_json(text: str | bytes) -> Body:
    """Return the body that a text describes.

    Raises:
        SpecError: the text is no JSON, or describes no valid body.
    """
    if text.lstrip()[:1] in ("<", b"<"):
        raise SpecError(
            "expected a body in JSON, got XML; the name of an MJCF file ends in .xml, that of a URDF file in .urdf"
        )
    if not text.strip():
        raise SpecError("expected a body in JSON, got an empty file")
    try:
        fields = json.loads(text, object_pairs_hook=_object_of_pairs, parse_int=_parse_integer)
    except SpecError:
        raise
    except UnicodeDecodeError:
        raise SpecError("expected a body in JSON, got a file that is no text") from None
    except RecursionError:
        raise SpecError("expected a body in JSON, got too many brackets within brackets") from None
    except ValueError as error:
        raise SpecError(f"expected a body in JSON; {parsers.describe(error)}") from None
    for key in _KINDS_OF_JSON.keys() & (fields if isinstance(fields, dict) else {}):
        raise SpecError(f"expected a body in JSON, got {_KINDS_OF_JSON[key]}")
    return sources.check(_make_spec(Body, fields, path=""))


def _to_json_value(value: Any) -> Any:
    """Return a spec as a dictionary of the fields that differ from their defaults, and tuples as lists."""
    if isinstance(value, tuple):
        return [_to_json_value(item) for item in value]
    if not dataclasses.is_dataclass(value):
        return value
    fields = {}
    for field in dataclasses.fields(value):
        field_value = getattr(value, field.name)
        if field_value != field.default:
            fields[field.name] = _to_json_value(field_value)
    return fields


def _put_on_one_line(match: re.Match) -> str:
    """Return the text of a list of numbers, which `json.dumps` has spread over lines, in one line."""
    numbers = match[1].split()
    return f"[{' '.join(numbers)}]"


def _object_of_pairs(pairs: list[tuple[str, Any]]) -> dict:
    """Return a JSON object; a key that occurs twice raises SpecError, where `json` would take the last value."""
    counts = collections.Counter(key for key, _ in pairs)
    for key, count in counts.items():
        if count > 1:
            raise SpecError(f"the key {key[:_MAX_QUOTE]!r} occurs twice in one object")
    return dict(pairs)


def _parse_integer(digits: str) -> int | float:
    """Return an integer; one of many digits as a float, which the range of its field then refuses."""
    return int(digits) if len(digits) < _MAX_DIGITS else float(digits)


def _make_spec(kind: type, value: Any, path: str) -> Any:
    """Return the spec that a JSON object describes.

    Args:
        kind: class of the spec.
        value: the object, or another value, which is an error.
        path: from the body to the spec, for errors; empty for the body itself.

    Raises:
        SpecError: the value is no object, or a field is unknown, missing or not valid.
    """
    if not isinstance(value, dict):
        raise SpecError(f"expected an object with the fields of a {kind.__name__}, got {_json_type(value)}", None, path)
    fields = {field.name: field for field in dataclasses.fields(kind)}
    for name in value:
        if name not in fields:
            raise SpecError(field_hints.describe_unknown(name[:_MAX_QUOTE], kind), None, path)
    for field in fields.values():
        if field.default is dataclasses.MISSING and field.name not in value:
            raise SpecError(f"missing; a {kind.__name__} needs it", field.name, path)

    arguments = {}
    for name, item in value.items():
        field_path = f"{path}.{name}" if path else name
        arguments[name] = _read_field(fields[name], item, field_path)
    try:
        return kind(**arguments)
    except SpecError as error:
        raise SpecError(error.reason, error.field, path) from None


def _read_field(field: dataclasses.Field, value: Any, path: str) -> Any:
    """Return the value of a spec's field: JSON objects become specs where the field contains specs."""
    kind = field.metadata.get("kind")  # see `spec._field`
    if kind is None or (value is None and field.default is None):
        return value
    if not field.metadata["many"]:
        return _make_spec(kind, value, path)
    if not isinstance(value, list):
        raise SpecError(f"expected a list of {kind.__name__}s, got {_json_type(value)}", None, path)
    return [_make_spec(kind, item, f"{path}[{index}]") for index, item in enumerate(value)]


def _json_type(value: Any) -> str:
    """Return how errors call a JSON value."""
    names = {dict: "an object", list: "a list", type(None): "null", bool: "true or false", str: "a string"}
    return names.get(type(value), "a number")
