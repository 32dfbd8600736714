"""A pose in pictures: markers in place of the torso and the links of a body that is not in the simulation."""

import numpy as np

from arc_suite import rotations
from arc_suite.markers import Marker
from arc_suite.models.kinematics import Legs
from arc_suite.models.outline import torso_box
from arc_suite.robots.spec import Body

_COLOR = (0.35, 0.75, 1.0, 0.45)


def draw_pose(body: Body, position: np.ndarray, quaternion: np.ndarray, angles: np.ndarray) -> list[Marker]:
    """Return cylinders in place of the torso and of every link of a body in a pose.

    Args:
        body: the body.
        position: (3,) of the torso in the world, m.
        quaternion: (4,) of the torso, w first.
        angles: (joints,) from the standing pose, rad.
    """
    rotation = rotations.matrix(quaternion)
    low, high = torso_box(body)
    middle = 0.5 * (low + high)
    half_height = np.array((0.0, 0.0, 0.5 * (high - low)[2]))
    radius = 0.25 * float((high - low)[:2].sum())  # a mean of both half-widths
    bottom = position + rotation @ (middle - half_height)
    top = position + rotation @ (middle + half_height)
    markers = [Marker("cylinder", bottom, top, radius, _COLOR)]
    legs = Legs.of(body)
    joints, _ = legs.places(legs.by_leg(angles))
    for leg, leg_joints in zip(body.legs, joints, strict=True):
        points = position + leg_joints @ rotation.T
        for link, start, end in zip(leg.links, points[:-1], points[1:], strict=False):  # shorter legs repeat their foot
            markers.append(Marker("cylinder", start, end, link.radius, _COLOR))
    return markers
