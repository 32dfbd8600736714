"""The parts of a body as triangles: fine, or few of them."""

from collections.abc import Sequence
from typing import NamedTuple

from arc_suite import checks, rotations
from arc_suite.animation.clips import shapes, unwrapping
from arc_suite.animation.clips.shapes import Mesh
from arc_suite.animation.parts import Part, Shape, simplify_hull

_TOLERANCE = 0.004  # standing heights, by which a face may cut into a round shape
_TOLERANCE_RATIO = 1.1  # of a coarser mesh and the one before
_MAX_TOLERANCE = 0.2  # of the largest shape
_MIN_COARSE_SEGMENTS = 6  # around a shape of a coarse mesh
_MAX_COARSE_HULL_POINTS = 32


class _ShapeMesh(NamedTuple):
    """A shape of a part, and its mesh in the shape's frame."""

    shape: Shape
    mesh: Mesh


def part_meshes(part: Part, tolerance: float) -> dict[str, Mesh]:
    """Return the shapes of a part in its frame, one mesh for each material.

    Args:
        part: part of a body.
        tolerance: m, by which a face may cut into a round shape.
    """
    return _join_by_material([_ShapeMesh(shape, _make_mesh(shape, tolerance)) for shape in part.shapes])


def body_meshes(
    parts: Sequence[Part], height: float, triangles: int | None = None, uv: bool = False
) -> list[dict[str, Mesh]]:
    """Return the meshes of parts, each by material, in the parts' frames.

    Args:
        parts: parts of a body.
        height: height at which the body stands, m.
        triangles: triangles that all meshes may have together; None for as many as look round. Where these are more,
            round shapes and hulls become coarser, and the smallest are left out.
        uv: whether meshes have texture coordinates.

    Raises:
        ValueError: the coarsest meshes have more triangles.
    """
    tolerance = _TOLERANCE * height
    meshes_of_parts = [[_ShapeMesh(shape, _make_mesh(shape, tolerance)) for shape in part.shapes] for part in parts]
    if triangles is not None:
        max_triangles = checks.integer("triangles", triangles, 1)
        if _count_triangles(meshes_of_parts) > max_triangles:
            meshes_of_parts = _make_coarse(parts, tolerance, max_triangles)
    if uv:
        meshes_of_parts = _add_texture_coordinates(meshes_of_parts)
    return [_join_by_material(shape_meshes) for shape_meshes in meshes_of_parts]


def _make_mesh(shape: Shape, tolerance: float, min_segments: int = shapes.MIN_SEGMENTS) -> Mesh:
    """Return the mesh of a shape in its own frame."""
    if shape.hull is not None:
        return shapes.polyhedron(shape.hull.points, shape.hull.triangles)
    return shapes.shape_mesh(shape.kind, shape.size, tolerance, min_segments)


def _count_triangles(meshes_of_parts: Sequence[Sequence[_ShapeMesh]]) -> int:
    return sum(len(mesh.triangles) for shape_meshes in meshes_of_parts for _, mesh in shape_meshes)


def _make_coarse(parts: Sequence[Part], tolerance: float, max_triangles: int) -> list[list[_ShapeMesh]]:
    """Return the shapes of parts with meshes that have at most a number of triangles together.

    Args:
        parts: parts of a body.
        tolerance: m, of the first meshes that are tried.
        max_triangles: largest number of triangles of all meshes.
    """
    shapes_of_parts = [[_simplify(shape) for shape in part.shapes] for part in parts]
    largest_size = max(max(shape.size) for part_shapes in shapes_of_parts for shape in part_shapes)
    max_tolerance = _MAX_TOLERANCE * largest_size
    while True:
        meshes_of_parts = []
        for part_shapes in shapes_of_parts:
            visible_shapes = [shape for shape in part_shapes if max(shape.size) >= 2.0 * tolerance]
            meshes_of_parts.append(
                [_ShapeMesh(shape, _make_mesh(shape, tolerance, _MIN_COARSE_SEGMENTS)) for shape in visible_shapes]
            )
        triangle_count = _count_triangles(meshes_of_parts)
        if triangle_count <= max_triangles:
            return meshes_of_parts
        if tolerance >= max_tolerance:
            raise ValueError(f"triangles: expected at least {triangle_count}, got {max_triangles}")
        tolerance = min(tolerance * _TOLERANCE_RATIO, max_tolerance)


def _simplify(shape: Shape) -> Shape:
    """Return a shape whose hull, if it has one, has few points."""
    if shape.hull is None:
        return shape
    return shape._replace(hull=simplify_hull(shape.hull, _MAX_COARSE_HULL_POINTS))


def _add_texture_coordinates(meshes_of_parts: Sequence[Sequence[_ShapeMesh]]) -> list[list[_ShapeMesh]]:
    """Return the same shapes with meshes that share a texture."""
    all_meshes = [mesh for shape_meshes in meshes_of_parts for _, mesh in shape_meshes]
    unwrapped_meshes = iter(unwrapping.unwrap(all_meshes))
    return [
        [_ShapeMesh(shape, next(unwrapped_meshes)) for shape, _ in shape_meshes] for shape_meshes in meshes_of_parts
    ]


def _join_by_material(shape_meshes: Sequence[_ShapeMesh]) -> dict[str, Mesh]:
    """Return the shapes of a part in its frame, one mesh for each material."""
    meshes_of_material: dict[str, list[Mesh]] = {}
    for shape, mesh in shape_meshes:
        mesh_in_part = mesh.transform(shape.place, rotations.matrix(shape.quaternion))
        meshes_of_material.setdefault(shape.material, []).append(mesh_in_part)
    return {material: shapes.join_meshes(meshes) for material, meshes in meshes_of_material.items()}
