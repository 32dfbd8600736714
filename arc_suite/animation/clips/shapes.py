"""MuJoCo's shapes as triangles."""

import math
from typing import NamedTuple

import numpy as np

KINDS = ("sphere", "capsule", "cylinder", "ellipsoid", "box")
MIN_SEGMENTS, _MOST = 8, 32  # segments around a shape


class Mesh(NamedTuple):
    """Triangles, counter-clockwise as seen from outside.

    Attributes:
        points: (n, 3)
        normals: (n, 3) of unit length.
        triangles: (m, 3) indices of points.
        uv: (n, 2) places in a texture, to the right and down; None for a mesh without.
    """

    points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    uv: np.ndarray | None = None

    def transform(self, place: np.ndarray, rotation: np.ndarray) -> "Mesh":
        """Return the mesh turned by a matrix (3, 3), then moved by a vector (3,)."""
        return self._replace(points=self.points @ rotation.T + place, normals=self.normals @ rotation.T)


def join_meshes(meshes: list[Mesh]) -> Mesh:
    """Return several meshes as one."""
    starts = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    triangles = [mesh.triangles + start for mesh, start in zip(meshes, starts[:-1], strict=True)]
    points, normals, _, uv = zip(*meshes, strict=True)
    places = None if uv[0] is None else np.concatenate(uv)
    return Mesh(np.concatenate(points), np.concatenate(normals), np.concatenate(triangles), places)


def shape_mesh(kind: str, size, tolerance: float, fewest: int = MIN_SEGMENTS) -> Mesh:
    """Return a shape about its center.

    Args:
        kind: of `KINDS`.
        size: (3,) half-extents as MuJoCo has them for the kind, m.
        tolerance: m, by which a face may cut into a round shape.
        fewest: segments around it.
    """
    if kind == "box":
        return _box(size)
    radius = sorted(size)[1] if kind == "ellipsoid" else size[0]
    count = segment_count(radius, tolerance, fewest)
    if kind == "cylinder":
        return _cylinder(size[0], size[1], count)
    if kind == "ellipsoid":
        return _ball(count, np.asarray(size), 0.0)
    return _ball(count, np.full(3, size[0]), size[1] if kind == "capsule" else 0.0)


def polyhedron(points: np.ndarray, triangles: np.ndarray) -> Mesh:
    """Return triangles (m, 3) of points (n, 3) with flat faces."""
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-30)
    return Mesh(corners.reshape(-1, 3), np.repeat(normals, 3, axis=0), np.arange(corners[..., 0].size).reshape(-1, 3))


def segment_count(radius: float, tolerance: float, fewest: int = MIN_SEGMENTS) -> int:
    """Return into how many segments, an even number, a circle is cut for a chord to be within a tolerance of it."""
    count = math.pi / math.acos(max(1.0 - tolerance / radius, 0.0))
    return 2 * math.ceil(min(max(count, fewest), _MOST) / 2.0)


def _ball(count: int, radii: np.ndarray, half_length: float) -> Mesh:
    """A ball of three radii, cut in the middle and drawn apart along z by twice a length."""
    rings = count // 4 + 1  # of a half, pole and equator included
    polar = np.linspace(0.0, math.pi / 2.0, rings)
    polar = np.concatenate([polar, math.pi - polar[::-1]]) if half_length else np.linspace(0.0, math.pi, 2 * rings - 1)
    lift = np.where(np.arange(len(polar)) < len(polar) / 2.0, half_length, -half_length)
    around = np.linspace(0.0, 2.0 * math.pi, count, endpoint=False)
    sine = np.sin(polar)
    unit = np.stack(
        [np.outer(sine, np.cos(around)), np.outer(sine, np.sin(around)), np.outer(np.cos(polar), np.ones(count))],
        axis=-1,
    )
    points = unit * radii + lift[:, None, None] * (0.0, 0.0, 1.0)
    normals = unit / radii
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    triangles = _strips(len(polar), count)
    return _compact(points.reshape(-1, 3), normals.reshape(-1, 3), triangles, count)


def _compact(points, normals, triangles, count: int) -> Mesh:
    """Make one point of each pole, and leave out the triangles that this flattens."""
    index = np.arange(len(points))
    index[:count], index[-count:] = 0, index[-1]
    triangles = index[triangles]
    flat = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    used, triangles = np.unique(triangles[~flat], return_inverse=True)
    return Mesh(points[used], normals[used], triangles.reshape(-1, 3))


def _strips(rows: int, count: int) -> np.ndarray:
    """Triangles between rings of `count` points, from the top ring down."""
    ring, place = np.meshgrid(np.arange(rows - 1), np.arange(count), indexing="ij")
    a, b = ring * count + place, ring * count + (place + 1) % count
    c, d = a + count, b + count
    return np.concatenate([np.stack([a, c, b], axis=-1), np.stack([b, c, d], axis=-1)], axis=-1).reshape(-1, 3)


def _cylinder(radius: float, half_length: float, count: int) -> Mesh:
    around = np.linspace(0.0, 2.0 * math.pi, count, endpoint=False)
    circle = np.stack([np.cos(around), np.sin(around), np.zeros(count)], axis=-1)
    up = np.array((0.0, 0.0, 1.0))
    rims = [radius * circle + half_length * up, radius * circle - half_length * up]
    side = Mesh(np.concatenate(rims), np.concatenate([circle, circle]), _strips(2, count))
    fan = np.stack([np.zeros(count - 2, int), np.arange(1, count - 1), np.arange(2, count)], axis=-1)
    top = Mesh(rims[0], np.tile(up, (count, 1)), fan)
    bottom = Mesh(rims[1], np.tile(-up, (count, 1)), fan[:, ::-1])
    return join_meshes([side, top, bottom])


def _box(size) -> Mesh:
    faces = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal = np.zeros(3)
            normal[axis] = sign
            first = np.roll(np.eye(3), 1, axis=0)[axis]
            second = np.cross(normal, first)
            corners = [normal + a * first + b * second for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            triangles = np.array([[0, 1, 2], [0, 2, 3]])
            faces.append(Mesh(np.array(corners) * size, np.tile(normal, (4, 1)), triangles))
    return join_meshes(faces)
