"""Places of faces in one texture: each side of each shape has a rectangle of its own, at one scale."""

from collections.abc import Sequence

import numpy as np

from arc_suite.animation.clips import shapes
from arc_suite.animation.clips.shapes import Mesh

_MARGIN = 0.003  # of the side of a square as large as all rectangles, between two of them
_TRIES = 4  # widths, each nearer to a square


def unwrap(meshes: Sequence[Mesh]) -> list[Mesh]:
    """Return convex meshes with places in a texture that they share, seen from the six directions of their axes.

    No two faces share a place, and nothing is mirrored. A face is at most 1.8 times smaller than it would be flat.
    """
    sides = [_sides(mesh) for mesh in meshes]
    sizes = np.array([np.ptp(side.uv, axis=0) for each in sides for side in each])
    corners, width = _packed(sizes)
    places = iter(corners)
    return [
        shapes.join_meshes([side._replace(uv=(side.uv - side.uv.min(axis=0) + next(places)) / width) for side in each])
        for each in sides
    ]


def _sides(mesh: Mesh) -> list[Mesh]:
    """Return the faces of each of six directions as a mesh whose places are lengths, m."""
    a, b, c = (mesh.points[mesh.triangles[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    axes = abs(normals).argmax(axis=-1)
    signs = np.sign(np.take_along_axis(normals, axes[:, None], axis=-1)[:, 0])
    found = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            faces = mesh.triangles[(axes == axis) & (signs == sign)]
            if not len(faces):
                continue
            used, triangles = np.unique(faces, return_inverse=True)
            points = mesh.points[used]
            # Right and down in the picture, as glTF has them.
            uv = np.stack([sign * points[:, (axis + 1) % 3], -points[:, (axis + 2) % 3]], axis=-1)
            found.append(Mesh(points, mesh.normals[used], triangles.reshape(-1, 3), uv))
    return found


def _packed(sizes: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the upper left corners (n, 2) of rectangles, and the side of the square that they take."""
    side = np.sqrt(sizes.prod(axis=-1).sum())
    margin = _MARGIN * side
    width, sizes = side, sizes + margin
    for _ in range(_TRIES):
        width = max(width, sizes[:, 0].max())
        corners, height = _shelved(sizes, width)
        side, width = max(width, height), np.sqrt(width * height)
    return corners + 0.5 * margin, side


def _shelved(sizes: np.ndarray, width: float) -> tuple[np.ndarray, float]:
    """Return the upper left corners (n, 2) of rectangles on shelves, the highest first, and the height of all."""
    corners, x, y, shelf = np.empty_like(sizes), 0.0, 0.0, 0.0
    for index in np.argsort(-sizes[:, 1], kind="stable"):
        across, down = sizes[index]
        if x + across > width:
            x, y, shelf = 0.0, y + shelf, 0.0
        corners[index] = x, y
        x, shelf = x + across, max(shelf, down)
    return corners, y + shelf
