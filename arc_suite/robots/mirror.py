"""Left-right symmetry of bodies across the x-z plane: legs, joints and parts, and their counterparts."""

from typing import NamedTuple

import numpy as np

from arc_suite.robots.spec import Body, Joint, Leg, Link, Solid

# Relative differences up to which two numbers count as equal; of lengths, relative to the standing height.
_TOLERANCE = 1e-9
_TOLERANCE_OF_IMPORTED_BODIES = 1e-3  # their files have few digits

_POINT_REFLECTION = np.array((1.0, -1.0, 1.0))  # factors on a point
_AXIS_REFLECTION = -_POINT_REFLECTION  # factors on the axis of a rotation


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
    tolerance = _Tolerance(body)
    for kind, solids in (("solid", body.torso.solids), ("ballast", body.ballast)):
        for solid in solids:
            if not any(_solids_match(solid, candidate, tolerance) for candidate in solids):
                raise ValueError(f"{body.name} is not left-right symmetric: no {kind} is across from {solid.name}")

    leg_indices = []
    signs = []
    for leg in body.legs:
        counterpart_index, joint_signs = _find_counterpart(leg, body, tolerance)
        leg_indices.append(counterpart_index)
        signs += joint_signs

    joint_index = {name: index for index, name in enumerate(body.joint_names)}
    part_index = {name: index for index, name in enumerate(body.part_names)}
    joint_indices = []
    part_indices = [0]  # the torso is its own counterpart
    for counterpart_index in leg_indices:
        counterpart = body.legs[counterpart_index]
        joint_indices += [joint_index[counterpart.full_name(joint)] for joint in counterpart.joints]
        part_indices += [part_index[counterpart.full_name(part)] for part in counterpart.parts]
    return Image(
        legs=np.array(leg_indices),
        joints=np.array(joint_indices),
        signs=np.array(signs),
        parts=np.array(part_indices),
    )


def has_image(body: Body) -> bool:
    """Return whether a body has a left-right symmetry."""
    try:
        image(body)
    except ValueError:
        return False
    return True


class _Tolerance:
    """Comparisons of numbers up to rounding."""

    def __init__(self, body: Body):
        self.relative = _TOLERANCE_OF_IMPORTED_BODIES if body.source else _TOLERANCE
        self.length = self.relative * body.torso.standing_height  # m

    def numbers_match(self, first: float | None, second: float | None) -> bool:
        """Return whether two numbers are equal, or both are None."""
        if first is None or second is None:
            return first is second
        return bool(np.isclose(first, second, self.relative, 0.0))

    def points_match(self, first, second) -> bool:
        """Return whether two arrays of points are the same."""
        return bool(np.allclose(first, second, rtol=0.0, atol=self.length))

    def are_parallel(self, cosines) -> bool:
        """Return whether directions with angles of these cosines between them are all parallel or antiparallel."""
        return bool((abs(cosines) > 1.0 - self.relative).all())


def _find_counterpart(leg: Leg, body: Body, tolerance: _Tolerance) -> tuple[int, list[int]]:
    """Return the index of the leg on the other side, and the signs of the joints; see `Image`.

    Raises:
        ValueError: there is none.
    """
    for index, candidate in enumerate(body.legs):
        signs = _match_legs(leg, candidate, tolerance)
        if signs is not None:
            return index, signs
    raise ValueError(f"{body.name} is not left-right symmetric: no leg is across from {leg.name}")


def are_images(body: Body, leg: Leg, candidate: Leg) -> bool:
    """Return whether two legs of a body are reflections of each other; a leg on the midline is one of itself."""
    return _match_legs(leg, candidate, _Tolerance(body)) is not None


def _match_legs(leg: Leg, candidate: Leg, tolerance: _Tolerance) -> list[int] | None:
    """Return the signs of the joints of two legs that are reflections of each other, else None."""
    if len(leg.links) != len(candidate.links):
        return None
    if not tolerance.numbers_match(leg.foot.radius, candidate.foot.radius):
        return None
    if not tolerance.points_match(np.array(leg.points) * _POINT_REFLECTION, candidate.points):
        return None

    signs = []
    for link, other_link in zip(leg.links, candidate.links, strict=True):
        if not tolerance.numbers_match(link.radius, other_link.radius):
            return None
        if (link.joint is None) != (other_link.joint is None):
            return None
        if link.joint is None:
            continue
        cosine = (_joint_axis(leg, link) * _AXIS_REFLECTION) @ _joint_axis(candidate, other_link)
        sign = 1 if cosine > 0.0 else -1
        if not (tolerance.are_parallel(cosine) and _joints_match(link.joint, other_link.joint, sign, tolerance)):
            return None
        signs.append(sign)
    return signs


def _joints_match(joint: Joint, candidate: Joint, sign: int, tolerance: _Tolerance) -> bool:
    """Return whether range and drive of a joint are those of another, whose angles have a sign, 1 or -1, to it."""
    reflected_range = sorted(sign * limit for limit in joint.range_deg)
    numbers = [*reflected_range, *_drive_numbers(joint)]
    other_numbers = [*candidate.range_deg, *_drive_numbers(candidate)]
    pairs = zip(numbers, other_numbers, strict=True)
    return all(tolerance.numbers_match(number, other_number) for number, other_number in pairs)


def _joint_axis(leg: Leg, link: Link) -> np.ndarray:
    """Return the unit direction (3,) of a link's joint in the torso's frame."""
    yaw = np.radians(leg.yaw_deg)
    axis = np.array(link.joint.axis)
    x = np.cos(yaw) * axis[0] - np.sin(yaw) * axis[1]
    y = np.sin(yaw) * axis[0] + np.cos(yaw) * axis[1]
    return np.array((x, y, axis[2])) / np.linalg.norm(axis)


def _drive_numbers(joint: Joint) -> list[float | None]:
    """Return the numbers of a joint's drive: resistances, torque, its line, loss and delay, and two of a servo."""
    numbers = [joint.armature, joint.damping, joint.friction_loss, joint.torque]
    numbers += [getattr(joint.drive, name, None) for name in ("no_load_speed", "stall", "winding_loss", "delay")]
    numbers += [getattr(joint.servo, name, None) for name in ("stiffness", "damping")]
    return numbers


def _solids_match(solid: Solid, candidate: Solid, tolerance: _Tolerance) -> bool:
    """Return whether a shape is the reflection of another."""
    if solid.shape != candidate.shape or not all(map(tolerance.numbers_match, solid.size, candidate.size)):
        return False
    if not tolerance.numbers_match(getattr(solid, "mass", None), getattr(candidate, "mass", None)):
        return False
    if not tolerance.points_match(np.array(solid.position) * _POINT_REFLECTION, candidate.position):
        return False
    if solid.shape == "sphere":
        compared_axes = []  # it looks the same in every orientation
    elif solid.shape in ("capsule", "cylinder"):
        compared_axes = [2]  # they look the same after any turn about their z axis
    else:
        compared_axes = [0, 1, 2]
    reflected_axes = _POINT_REFLECTION[:, None] * _shape_axes(solid)
    cosines = (reflected_axes * _shape_axes(candidate)).sum(axis=0)
    return tolerance.are_parallel(cosines[compared_axes])


def _shape_axes(solid: Solid) -> np.ndarray:
    """Return the axes (3, 3) of a shape, in columns, in the torso's frame."""
    axes = np.eye(3)
    for i, angle in enumerate(np.radians(solid.euler_deg)):
        j = (i + 1) % 3
        k = (i + 2) % 3
        turn = np.eye(3)
        turn[j, j] = np.cos(angle)
        turn[k, k] = np.cos(angle)
        turn[k, j] = np.sin(angle)
        turn[j, k] = -np.sin(angle)
        axes = axes @ turn
    return axes
