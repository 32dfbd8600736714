"""Left-right symmetry of bodies across the x-z plane: legs, joints and parts, and their counterparts."""

from typing import NamedTuple

import numpy as np

from arc_suite.robots.spec import Body, Joint, Leg, Solid

_ROUNDING = 1e-9  # of the standing height for lengths, and of a number for numbers
_ROUNDING_OF_FILES = 1e-3  # the same of imported bodies, whose files have few digits

_REFLECTION = np.array((1.0, -1.0, 1.0))  # of a point, and of a velocity
_TURNED = -_REFLECTION  # of the axis of a rotation


class _Rounding:
    """Comparisons of numbers up to rounding."""

    def __init__(self, body: Body):
        self.share = _ROUNDING_OF_FILES if body.source else _ROUNDING
        self.length = self.share * body.torso.standing_height

    def equal(self, number: float | None, other: float | None) -> bool:
        """Return whether two numbers are equal, or neither is there."""
        return number == other if None in (number, other) else bool(np.isclose(number, other, self.share, 0.0))

    def near(self, points, others) -> bool:
        """Return whether points are the same."""
        return bool(np.allclose(points, others, rtol=0.0, atol=self.length))

    def along(self, cosine) -> bool:
        """Return whether directions with these cosines of their angles are parallel."""
        return bool((abs(cosine) > 1.0 - self.share).all())


class Image(NamedTuple):
    """Left-right permutation of the legs, joints and parts of a symmetric body.

    Attributes:
        legs: (legs,) index of the leg on the other side; of a leg on the midline, its own.
        joints: (joints,) index of the joint on the other side, in the order of the actions.
        signs: (joints,) 1 where equal angles give symmetric poses, -1 where opposite angles do.
        parts: (parts,) index of the rigid part on the other side, in the order of the contact forces.
    """

    legs: np.ndarray
    joints: np.ndarray
    signs: np.ndarray
    parts: np.ndarray


def image(body: Body) -> Image:
    """Return the left-right permutation of a symmetric body.

    It depends on geometry, joints and motors, not on names and order of the legs.

    Raises:
        ValueError: the body has no left-right symmetry; the message names a part without a counterpart.
    """
    rounding = _Rounding(body)
    for kind, solids in (("solid", body.torso.solids), ("ballast", body.ballast)):
        for solid in solids:
            if not any(_solids_match(solid, other, rounding) for other in solids):
                raise ValueError(f"{body.name} is not left-right symmetric: no {kind} is across from {solid.name}")
    legs, signs = [], []
    for leg in body.legs:
        matches = [(across, found) for across, other in enumerate(body.legs) if (found := _signs(leg, other, rounding))]
        if not matches:
            raise ValueError(f"{body.name} is not left-right symmetric: no leg is across from {leg.name}")
        across, found = matches[0]
        legs.append(across)
        signs += found
    joints, parts = {name: i for i, name in enumerate(body.joint_names)}, {n: i for i, n in enumerate(body.part_names)}
    across = [(leg, body.legs[other]) for leg, other in zip(body.legs, legs, strict=True)]
    return Image(
        legs=np.array(legs),
        joints=np.array([joints[other.full_name(joint)] for _, other in across for joint in other.joints]),
        signs=np.array(signs),
        parts=np.array([0, *(parts[other.full_name(p)] for _, other in across for p in other.parts)]),
    )


def _signs(leg: Leg, other: Leg, rounding: _Rounding) -> list[int] | None:
    """Return the signs of the joints of two legs that are reflections of each other, else None."""
    if len(leg.links) != len(other.links) or not rounding.equal(leg.foot.radius, other.foot.radius):
        return None
    if not rounding.near(np.array(leg.points) * _REFLECTION, other.points):
        return None
    signs = []
    for link, across in zip(leg.links, other.links, strict=True):
        if not rounding.equal(link.radius, across.radius) or (link.joint is None) != (across.joint is None):
            return None
        if link.joint is None:
            continue
        cosine = (_axis(leg, link) * _TURNED) @ _axis(other, across)
        sign = 1 if cosine > 0.0 else -1
        bounds = tuple(sorted(sign * bound for bound in link.joint.range_deg))
        pairs = zip([*bounds, *_drive(link.joint)], [*across.joint.range_deg, *_drive(across.joint)], strict=True)
        if not (rounding.along(cosine) and all(rounding.equal(a, b) for a, b in pairs)):
            return None
        signs.append(sign)
    return signs


def _axis(leg: Leg, link) -> np.ndarray:
    """Return the direction of a link's joint in the torso's frame."""
    yaw, axis = np.radians(leg.yaw_deg), np.array(link.joint.axis)
    x = np.cos(yaw) * axis[0] - np.sin(yaw) * axis[1]
    y = np.sin(yaw) * axis[0] + np.cos(yaw) * axis[1]
    return np.array((x, y, axis[2])) / np.linalg.norm(axis)


def _drive(joint: Joint) -> tuple[float | None, ...]:
    """Return the numbers by which a joint is driven."""
    servo = joint.servo
    return (joint.armature, joint.damping, joint.torque, *((servo.stiffness, servo.damping) if servo else ()))


def _solids_match(solid: Solid, other: Solid, rounding: _Rounding) -> bool:
    """Return whether a shape is the reflection of another."""
    if solid.shape != other.shape or not all(map(rounding.equal, solid.size, other.size)):
        return False
    if not rounding.equal(getattr(solid, "mass", None), getattr(other, "mass", None)):
        return False
    if not rounding.near(np.array(solid.position) * _REFLECTION, other.position):
        return False
    # Shapes are symmetric about their own axes: a sphere about any, a round one about any across its z.
    axes = {"sphere": [], "capsule": [2], "cylinder": [2]}.get(solid.shape, [0, 1, 2])
    cosines = ((_REFLECTION[:, None] * _turned(solid)) * _turned(other)).sum(axis=0)
    return rounding.along(cosines[axes])


def _turned(solid: Solid) -> np.ndarray:
    """Return the axes (3, 3) of a shape, in columns, in the torso's frame."""
    axes = np.eye(3)
    for i, angle in enumerate(np.radians(solid.euler_deg)):
        turn, (j, k) = np.eye(3), ((i + 1) % 3, (i + 2) % 3)
        turn[j, j] = turn[k, k] = np.cos(angle)
        turn[k, j], turn[j, k] = np.sin(angle), -np.sin(angle)
        axes = axes @ turn
    return axes
