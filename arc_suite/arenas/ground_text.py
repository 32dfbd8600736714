"""Ground from a file as text: settings of a task hold it in place of the file, so that they need no other file."""

import functools
import json
from collections.abc import Callable, Mapping
from typing import Any

from arc_suite import checks, parsers
from arc_suite.arenas import height_map, solids
from arc_suite.arenas.arena import Arena
from arc_suite.arenas.height_map import HeightMap
from arc_suite.arenas.mapped import MAX_SIDE
from arc_suite.arenas.solids import Solid, Solids
from arc_suite.robots.spec import Body

MAX_TEXT = 1 << 22  # characters
MAX_SOLIDS = 1024
MAX_POINTS = 1 << 14  # corners of all meshes together

_MIN_SIDE = 0.01  # m, of a map
_MAX_NAME = 40  # characters


def is_text(arena: Any) -> bool:
    """Return whether an arena is given as the text of ground."""
    return isinstance(arena, str) and arena.startswith("{")


def to_text(ground: HeightMap | Solids) -> str:
    """Return ground as text.

    Raises:
        ValueError: more ground than a text may have.
    """
    fields = ground._asdict()
    if isinstance(ground, Solids):
        fields["parts"] = [solid._asdict() for solid in ground.parts]
    text = json.dumps(fields)
    from_text(text)
    return text


def name_of(text: str) -> str:
    """Return the name of the file from which a text of ground has been made."""
    return from_text(text).name


def fit(text: str) -> Callable[[Body], Arena]:
    """Return the function from a body to its arena, given ground as text.

    Raises:
        ValueError: a damaged text, or one that asks for too much.
    """
    ground = from_text(text)
    if isinstance(ground, Solids):
        return lambda body: solids.fit(body, ground)
    return lambda body: height_map.fit(body, ground)


@functools.lru_cache(maxsize=8)
def from_text(text: str) -> HeightMap | Solids:
    """Return the ground of a text.

    Raises:
        ValueError: as `fit`.
    """
    if len(text) > MAX_TEXT:
        raise ValueError(f"arena: expected ground of at most {MAX_TEXT} characters, got {len(text)}")
    with parsers.guard("arena: expected a name, a file or ground as JSON"):
        fields = checks.mapping("ground", json.loads(text))
        name = fields["name"]
        if not (isinstance(name, str) and name.isprintable() and 0 < len(name) <= _MAX_NAME):
            raise ValueError(f"name: expected 1 to {_MAX_NAME} characters, got {checks.preview(name)}")
        return _read_map(name, fields) if "heights" in fields else _read_solids(name, fields)


def _read_map(name: str, fields: Mapping[str, Any]) -> HeightMap:
    size = tuple(checks.array("size", fields["size"], 3, 0.0, MAX_SIDE).tolist())
    checks.number("size: length and width", min(size[:2]), _MIN_SIDE)
    rows, columns = fields["shape"]
    for label, count in (("rows", rows), ("columns", columns)):
        checks.integer(label, count, 2, height_map.MAX_NODES)
    height_map.decode(fields["heights"], (rows, columns))  # raises an error for a damaged text
    return HeightMap(name, size, (rows, columns), fields["heights"])


def _read_solids(name: str, fields: Mapping[str, Any]) -> Solids:
    records = fields["parts"]
    if not (isinstance(records, list) and 1 <= len(records) <= MAX_SOLIDS):
        raise ValueError(f"expected 1 to {MAX_SOLIDS} solids")
    scene_solids = tuple(_read_solid(checks.mapping("solid", record)) for record in records)
    if sum(len(solid.points) for solid in scene_solids) > MAX_POINTS:
        raise ValueError(f"expected meshes of at most {MAX_POINTS} corners together")
    return Solids(name, scene_solids)


def _read_solid(record: Mapping[str, Any]) -> Solid:
    kind = checks.name(record["kind"], solids.SIZES, "kind of solid")
    pos = checks.array("pos", record["pos"], 3, -MAX_SIDE, MAX_SIDE)
    quat = checks.array("quat", record["quat"], 4, -1.0, 1.0)
    size = checks.array("size", record["size"], solids.SIZES[kind], 0.0, MAX_SIDE)
    if not (quat @ quat > 0.1 and (size > 0.0).all()):
        raise ValueError(f"{kind}: expected sizes above 0 and a quaternion of length 1")
    points = record["points"] if kind == "mesh" else []
    if kind == "mesh" and not (isinstance(points, list) and 4 <= len(points) <= MAX_POINTS):
        raise ValueError(f"mesh: expected 4 to {MAX_POINTS} points")
    corners = tuple(tuple(checks.array("point", point, 3, -MAX_SIDE, MAX_SIDE).tolist()) for point in points)
    return Solid(kind, tuple(pos.tolist()), tuple(quat.tolist()), tuple(size.tolist()), corners)
