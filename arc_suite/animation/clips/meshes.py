"""The parts of a body as triangles: fine, or few of them."""

from collections.abc import Sequence

from arc_suite import checks, rotations
from arc_suite.animation.clips import shapes, unwrapping
from arc_suite.animation.clips.shapes import Mesh
from arc_suite.animation.parts import Part, Shape, simplify_hull

_TOLERANCE = 0.004  # of the standing height, by which a face may cut into a round shape
_COARSER = 1.1  # ratio of two tolerances that are tried
_COARSEST = 0.2  # of the largest shape
_FEWEST = 6  # segments around a shape of a coarse mesh
_HULL = 32  # points of a hull in a coarse mesh


def part_meshes(part: Part, tolerance: float) -> dict[str, Mesh]:
    """Return the shapes of a part by material, those of one as one mesh in the part's frame."""
    return _by_material(part, [_mesh(shape, tolerance) for shape in part.shapes])


def body_meshes(
    parts: Sequence[Part], height: float, triangles: int | None = None, uv: bool = False
) -> list[dict[str, Mesh]]:
    """Return the meshes of parts, each by material, in the parts' frames.

    Args:
        parts: of a body.
        height: at which the body stands, m.
        triangles: that all meshes may have together; None for as many as look round. Where these are more, round
            shapes and hulls become coarser, and the smallest are left out.
        uv: whether faces have places in a texture.

    Raises:
        ValueError: the coarsest meshes have more triangles.
    """
    drawn = [[(shape, _mesh(shape, _TOLERANCE * height)) for shape in part.shapes] for part in parts]
    if triangles is not None and _count(drawn) > checks.integer("triangles", triangles, 1):
        drawn = _coarse(parts, height, triangles)
    if uv:
        places = iter(unwrapping.unwrap([mesh for own in drawn for _, mesh in own]))
        drawn = [[(shape, next(places)) for shape, _ in own] for own in drawn]
    return [
        _by_material(part._replace(shapes=tuple(shape for shape, _ in own)), [mesh for _, mesh in own])
        for part, own in zip(parts, drawn, strict=True)
    ]


def _coarse(parts: Sequence[Part], height: float, most: int) -> list[list[tuple[Shape, Mesh]]]:
    """Return the shapes of parts with meshes that have at most a number of triangles together."""
    parts = [part._replace(shapes=tuple(_simple(shape) for shape in part.shapes)) for part in parts]
    tolerance = _TOLERANCE * height
    coarsest = _COARSEST * max(max(shape.size) for part in parts for shape in part.shapes)
    while True:
        drawn = [
            [(each, _mesh(each, tolerance, _FEWEST)) for each in part.shapes if max(each.size) >= 2.0 * tolerance]
            for part in parts
        ]
        if (count := _count(drawn)) <= most:
            return drawn
        if tolerance >= coarsest:
            raise ValueError(f"triangles: expected at least {count}, got {most}")
        tolerance = min(tolerance * _COARSER, coarsest)


def _count(drawn: Sequence[Sequence[tuple[Shape, Mesh]]]) -> int:
    return sum(len(mesh.triangles) for own in drawn for _, mesh in own)


def _simple(shape: Shape) -> Shape:
    return shape._replace(hull=simplify_hull(shape.hull, _HULL)) if shape.hull else shape


def _mesh(shape: Shape, tolerance: float, fewest: int = shapes.MIN_SEGMENTS) -> Mesh:
    """Return a shape in its own frame."""
    return (
        shapes.polyhedron(*shape.hull) if shape.hull else shapes.shape_mesh(shape.kind, shape.size, tolerance, fewest)
    )


def _by_material(part: Part, meshes: Sequence[Mesh]) -> dict[str, Mesh]:
    found: dict[str, list[Mesh]] = {}
    for shape, mesh in zip(part.shapes, meshes, strict=True):
        found.setdefault(shape.material, []).append(mesh.transform(shape.place, rotations.matrix(shape.quaternion)))
    return {material: shapes.join_meshes(several) for material, several in found.items()}
