"""How much room a body takes as it stands: what cameras and looks are scaled by."""

import math
from collections.abc import Iterator

import mujoco
import numpy as np

from arc_suite.robots.spec import Body, Leg, Solid

_CORNERS = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])


def solid_corners(solid: Solid) -> np.ndarray:
    """The corners of a box around a solid, turned with it, in the torso's frame: (8, 3)."""
    rotation, quaternion = np.empty(9), np.empty(4)
    mujoco.mju_euler2Quat(quaternion, np.radians(solid.euler_deg), "xyz")
    mujoco.mju_quat2Mat(rotation, quaternion)
    return solid.position + (_CORNERS * _half_extents(solid)) @ rotation.reshape(3, 3).T


def _half_extents(solid: Solid) -> tuple[float, ...]:
    radius, length = solid.size[0], solid.size[-1]
    return {
        "sphere": (radius, radius, radius),
        "capsule": (radius, radius, length + radius),
        "cylinder": (radius, radius, length),
    }.get(solid.shape, solid.size)


def leg_points(leg: Leg) -> Iterator[tuple[np.ndarray, float]]:
    """Both ends of every link, from the mount to the foot, in the torso's frame, and the radius there."""
    cos, sin = math.cos(math.radians(leg.yaw_deg)), math.sin(math.radians(leg.yaw_deg))
    point = np.array(leg.mount)
    for link in leg.links:
        yield point, link.radius
        x, y, z = link.end
        point = point + (cos * x - sin * y, sin * x + cos * y, z)
        yield point, link.radius
    yield point, leg.foot.radius


def outline(body: Body) -> np.ndarray:
    """Points in the torso's frame whose convex hull holds the standing body: (n, 3)."""
    solids = [solid_corners(solid) for solid in (*body.torso.solids, *body.ballast)]
    legs = [point + radius * _CORNERS for leg in body.legs for point, radius in leg_points(leg)]
    return np.concatenate(solids + legs)
