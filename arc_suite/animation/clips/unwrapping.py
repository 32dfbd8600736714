"""Texture coordinates of meshes: each side of each shape has a rectangle of its own in one texture, at one scale."""

from collections.abc import Sequence

import numpy as np

from arc_suite.animation.clips import shapes
from arc_suite.animation.clips.shapes import Mesh

_MARGIN = 0.003  # between two rectangles, of the side of a square as large as all of them
_PACKING_ROUNDS = 4  # of widths of the texture, each nearer to a square


def unwrap(meshes: Sequence[Mesh]) -> list[Mesh]:
    """Return convex meshes with coordinates in a texture that they share, seen from the six directions of their axes.

    No two faces overlap in the texture, and nothing is mirrored. A face is at most 1.8 times smaller than it would be
    flat.
    """
    sides_of_meshes = [_split_into_sides(mesh) for mesh in meshes]
    sizes = np.array([np.ptp(side.uv, axis=0) for sides in sides_of_meshes for side in sides])
    corners, texture_side = _pack_rectangles(sizes)
    next_corner = iter(corners)
    textured_meshes = []
    for sides in sides_of_meshes:
        textured_sides = []
        for side in sides:
            uv = side.uv - side.uv.min(axis=0) + next(next_corner)
            textured_sides.append(side._replace(uv=uv / texture_side))
        textured_meshes.append(shapes.join_meshes(textured_sides))
    return textured_meshes


def _split_into_sides(mesh: Mesh) -> list[Mesh]:
    """Return the faces of each of six directions as a mesh, with texture coordinates in m."""
    a, b, c = (mesh.points[mesh.triangles[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    main_axes = abs(normals).argmax(axis=-1)
    signs = np.sign(np.take_along_axis(normals, main_axes[:, None], axis=-1)[:, 0])
    sides = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            faces = mesh.triangles[(main_axes == axis) & (signs == sign)]
            if not len(faces):
                continue
            point_indices, triangles = np.unique(faces, return_inverse=True)
            points = mesh.points[point_indices]
            # glTF's u points to the right in the picture, and v down.
            u = sign * points[:, (axis + 1) % 3]
            v = -points[:, (axis + 2) % 3]
            side = Mesh(
                points=points,
                normals=mesh.normals[point_indices],
                triangles=triangles.reshape(-1, 3),
                uv=np.stack([u, v], axis=-1),
            )
            sides.append(side)
    return sides


def _pack_rectangles(sizes: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the upper left corners (n, 2) of rectangles of sizes (n, 2), and the side of the square that holds them.

    Rectangles lie on shelves. The width of the shelves comes nearer to their total height in each round.
    """
    square_side = np.sqrt(sizes.prod(axis=-1).sum())
    margin = _MARGIN * square_side
    sizes = sizes + margin
    next_width = square_side
    for _ in range(_PACKING_ROUNDS):
        width = max(next_width, sizes[:, 0].max())
        corners, height = _fill_shelves(sizes, width)
        square_side = max(width, height)
        next_width = np.sqrt(width * height)
    return corners + 0.5 * margin, square_side


def _fill_shelves(sizes: np.ndarray, width: float) -> tuple[np.ndarray, float]:
    """Return the upper left corners (n, 2) of rectangles on shelves, the highest first, and the height of all."""
    corners = np.empty_like(sizes)
    x = 0.0
    y = 0.0
    shelf_height = 0.0
    for index in np.argsort(-sizes[:, 1], kind="stable"):
        rectangle_width, rectangle_height = sizes[index]
        if x + rectangle_width > width:  # begin a new shelf
            x = 0.0
            y += shelf_height
            shelf_height = 0.0
        corners[index] = x, y
        x += rectangle_width
        shelf_height = max(shelf_height, rectangle_height)
    return corners, y + shelf_height
