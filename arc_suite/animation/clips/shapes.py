"""MuJoCo's shapes as triangles."""

import math
from typing import NamedTuple

import numpy as np

KINDS = ("sphere", "capsule", "cylinder", "ellipsoid", "box")
MIN_SEGMENTS = 8  # around a shape
_MAX_SEGMENTS = 32


class Mesh(NamedTuple):
    """Triangles, counter-clockwise as seen from outside.

    Attributes:
        points: (n, 3)
        normals: (n, 3) normals of unit length.
        triangles: (m, 3) indices of points.
        uv: (n, 2) texture coordinates, to the right and down; None for a mesh without.
    """

    points: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    uv: np.ndarray | None = None

    def transform(self, position: np.ndarray, rotation: np.ndarray) -> "Mesh":
        """Return the mesh turned by a matrix (3, 3), then moved by a vector (3,)."""
        return self._replace(points=self.points @ rotation.T + position, normals=self.normals @ rotation.T)


def join_meshes(meshes: list[Mesh]) -> Mesh:
    """Return several meshes as one; all or none have texture coordinates."""
    triangles = []
    point_count = 0
    for mesh in meshes:
        triangles.append(mesh.triangles + point_count)
        point_count += len(mesh.points)
    uv = None
    if meshes[0].uv is not None:
        uv = np.concatenate([mesh.uv for mesh in meshes])
    return Mesh(
        points=np.concatenate([mesh.points for mesh in meshes]),
        normals=np.concatenate([mesh.normals for mesh in meshes]),
        triangles=np.concatenate(triangles),
        uv=uv,
    )


def shape_mesh(kind: str, size, tolerance: float, min_segments: int = MIN_SEGMENTS) -> Mesh:
    """Return the mesh of a shape about its center.

    Args:
        kind: kind of `KINDS`.
        size: (3,) half-extents as MuJoCo has them for the kind, m.
        tolerance: m, by which a face may cut into a round shape.
        min_segments: around a round shape.
    """
    if kind == "box":
        return _box(size)
    if kind == "ellipsoid":
        middle_radius = sorted(size)[1]
        return _ball(segment_count(middle_radius, tolerance, min_segments), np.asarray(size), half_length=0.0)
    radius = size[0]
    half_length = size[1]  # of a cylinder or a capsule
    segments = segment_count(radius, tolerance, min_segments)
    if kind == "cylinder":
        return _cylinder(radius, half_length, segments)
    if kind == "capsule":
        return _ball(segments, np.full(3, radius), half_length)
    return _ball(segments, np.full(3, radius), half_length=0.0)


def polyhedron(points: np.ndarray, triangles: np.ndarray) -> Mesh:
    """Return triangles (m, 3) of points (n, 3) with flat faces, which share no points."""
    corners = points[triangles]  # (m, 3, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=-1, keepdims=True), 1e-30)
    corner_count = 3 * len(triangles)
    return Mesh(
        points=corners.reshape(-1, 3),
        normals=np.repeat(normals, 3, axis=0),
        triangles=np.arange(corner_count).reshape(-1, 3),
    )


def segment_count(radius: float, tolerance: float, min_segments: int = MIN_SEGMENTS) -> int:
    """Return into how many segments, an even number, a circle is cut for a chord to be within a tolerance of it."""
    half_angle = math.acos(max(1.0 - tolerance / radius, 0.0))  # rad, of the longest chord
    segments = min(max(math.pi / half_angle, min_segments), _MAX_SEGMENTS)
    return 2 * math.ceil(segments / 2.0)


def _ball(segments: int, radii: np.ndarray, half_length: float) -> Mesh:
    """Return a ball of three radii, cut at the equator; the halves are moved apart along z by twice a length."""
    rings_in_half = segments // 4 + 1  # pole and equator included
    if half_length:
        upper_angles = np.linspace(0.0, math.pi / 2.0, rings_in_half)
        polar_angles = np.concatenate([upper_angles, math.pi - upper_angles[::-1]])
    else:
        polar_angles = np.linspace(0.0, math.pi, 2 * rings_in_half - 1)
    is_upper = np.arange(len(polar_angles)) < len(polar_angles) / 2.0
    lifts = np.where(is_upper, half_length, -half_length)
    azimuths = np.linspace(0.0, 2.0 * math.pi, segments, endpoint=False)
    sines = np.sin(polar_angles)
    unit_sphere = np.stack(  # (rings, segments, 3)
        [
            np.outer(sines, np.cos(azimuths)),
            np.outer(sines, np.sin(azimuths)),
            np.outer(np.cos(polar_angles), np.ones(segments)),
        ],
        axis=-1,
    )
    points = unit_sphere * radii + lifts[:, None, None] * (0.0, 0.0, 1.0)
    normals = unit_sphere / radii
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    triangles = _ring_triangles(len(polar_angles), segments)
    return _merge_poles(points.reshape(-1, 3), normals.reshape(-1, 3), triangles, segments)


def _merge_poles(points, normals, triangles, segments: int) -> Mesh:
    """Return the mesh with one point for each pole, without the triangles that this flattens.

    Args:
        points: (rings * segments, 3) from the upper pole down.
        normals: normals of the points.
        triangles: (m, 3) between the rings.
        segments: points in a ring.
    """
    merged_indices = np.arange(len(points))
    merged_indices[:segments] = 0
    merged_indices[-segments:] = merged_indices[-1]
    triangles = merged_indices[triangles]
    is_flat = (triangles == np.roll(triangles, 1, axis=1)).any(axis=1)
    point_indices, triangles = np.unique(triangles[~is_flat], return_inverse=True)
    return Mesh(points[point_indices], normals[point_indices], triangles.reshape(-1, 3))


def _ring_triangles(rings: int, segments: int) -> np.ndarray:
    """Return triangles between rings of points, from the top ring down."""
    ring, segment = np.meshgrid(np.arange(rings - 1), np.arange(segments), indexing="ij")
    upper_left = ring * segments + segment
    upper_right = ring * segments + (segment + 1) % segments
    lower_left = upper_left + segments
    lower_right = upper_right + segments
    left_triangles = np.stack([upper_left, lower_left, upper_right], axis=-1)
    right_triangles = np.stack([upper_right, lower_left, lower_right], axis=-1)
    return np.concatenate([left_triangles, right_triangles], axis=-1).reshape(-1, 3)


def _cylinder(radius: float, half_length: float, segments: int) -> Mesh:
    azimuths = np.linspace(0.0, 2.0 * math.pi, segments, endpoint=False)
    circle = np.stack([np.cos(azimuths), np.sin(azimuths), np.zeros(segments)], axis=-1)
    up = np.array((0.0, 0.0, 1.0))
    top_rim = radius * circle + half_length * up
    bottom_rim = radius * circle - half_length * up
    side = Mesh(np.concatenate([top_rim, bottom_rim]), np.concatenate([circle, circle]), _ring_triangles(2, segments))
    # A fan of triangles from the first point of a rim.
    fan = np.stack([np.zeros(segments - 2, int), np.arange(1, segments - 1), np.arange(2, segments)], axis=-1)
    top = Mesh(top_rim, np.tile(up, (segments, 1)), fan)
    bottom = Mesh(bottom_rim, np.tile(-up, (segments, 1)), fan[:, ::-1])
    return join_meshes([side, top, bottom])


def _box(size) -> Mesh:
    faces = []
    for axis in range(3):
        for sign in (1.0, -1.0):
            normal = np.zeros(3)
            normal[axis] = sign
            first_edge = np.roll(np.eye(3), 1, axis=0)[axis]
            second_edge = np.cross(normal, first_edge)
            unit_corners = np.array(
                [
                    normal - first_edge - second_edge,
                    normal + first_edge - second_edge,
                    normal + first_edge + second_edge,
                    normal - first_edge + second_edge,
                ]
            )
            triangles = np.array([[0, 1, 2], [0, 2, 3]])
            faces.append(Mesh(unit_corners * size, np.tile(normal, (4, 1)), triangles))
    return join_meshes(faces)
