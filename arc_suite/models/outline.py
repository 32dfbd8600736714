"""Outline of a standing body, which scales cameras and visuals."""

import itertools
from collections.abc import Iterator

import mujoco
import numpy as np

from arc_suite.robots.spec import Body, Leg, Solid

# Corners (8, 3) of a box with half-extents of 1.
CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


def solid_corners(solid: Solid) -> np.ndarray:
    """Return the corners of a box around a solid, turned with it, in the torso's frame: (8, 3)."""
    half_extents = np.add(*_split(solid))  # in the solid's frame
    return solid.position + (CORNERS * half_extents) @ _rotation(solid).T


def level_extents(solid: Solid) -> np.ndarray:
    """Return the half-extents (3,) of a solid along the torso's axes, m."""
    ellipsoid, box = _split(solid)
    rotation = _rotation(solid)
    return np.sqrt(rotation**2 @ np.square(ellipsoid)) + abs(rotation) @ box


def _split(solid: Solid) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return half-extents of an ellipsoid and of a box, m, whose sums of extents are those of a solid in any turn."""
    radius = solid.size[0]
    half_length = solid.size[-1]  # without the ends of a capsule
    nothing = (0.0, 0.0, 0.0)
    rod = (0.0, 0.0, half_length)
    return {
        "sphere": ((radius, radius, radius), nothing),
        "capsule": ((radius, radius, radius), rod),
        "cylinder": ((radius, radius, 0.0), rod),
        "ellipsoid": (solid.size, nothing),
        "box": (nothing, solid.size),
    }[solid.shape]


def _rotation(solid: Solid) -> np.ndarray:
    """Return the rotation matrix (3, 3) of a solid in the torso's frame."""
    quaternion = np.empty(4)
    mujoco.mju_euler2Quat(quaternion, np.radians(solid.euler_deg), "xyz")
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, quaternion)
    return rotation.reshape(3, 3)


def geom_corners(model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
    """Return the corners (geoms, 8, 3) of the boxes around geoms, turned with them, in the world, m."""
    boxes = model.geom_aabb[:, None]  # centers and half-extents, in the frames of the geoms
    corners = boxes[..., :3] + CORNERS * boxes[..., 3:]
    geom_rotations = data.geom_xmat.reshape(-1, 3, 3)
    return corners @ geom_rotations.swapaxes(-1, -2) + data.geom_xpos[:, None]


def leg_points(leg: Leg) -> Iterator[tuple[np.ndarray, float]]:
    """Yield both ends of every link (3,) and its foot, in the torso's frame, and the radius there."""
    points = np.array(leg.points)
    for link, ends in zip(leg.links, itertools.pairwise(points), strict=True):
        for end in ends:
            yield end, link.radius
    yield points[-1], leg.foot.radius


def torso_box(body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest coordinates (3,) of the torso's solids, in its frame, m."""
    corners = np.concatenate([solid_corners(solid) for solid in body.torso.solids])
    return corners.min(axis=0), corners.max(axis=0)


def outline(body: Body) -> np.ndarray:
    """Return points in the torso's frame whose convex hull holds the standing body: (n, 3)."""
    solids = [solid_corners(solid) for solid in (*body.torso.solids, *body.ballast)]
    legs = [point + radius * CORNERS for leg in body.legs for point, radius in leg_points(leg)]
    return np.concatenate(solids + legs)
