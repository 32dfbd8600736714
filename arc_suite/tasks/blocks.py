"""Blocks of an observation: the size, the mirror image and the noise of each, declared once."""

import functools
import itertools
import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.models.standing import GRAVITY
from arc_suite.robots.mirror import Image
from arc_suite.robots.spec import Body
from arc_suite.tasks import mirrors
from arc_suite.tasks.mirrors import AXIAL, POLAR, QUATERNION, SAME, Mirror

# Half-widths of noise at level 1, about those of legged_gym (joints 0.01 rad and 1.5 rad/s, velocity 0.1 m/s and
# 0.2 rad/s, gravity 0.05, heights 0.1 m) for a robot that stands half a meter high.
HEIGHT = 0.02  # h
ORIENTATION = 0.02  # of the quaternion's components
JOINT_ANGLE = 0.01  # rad
LINEAR_VELOCITY = 0.05  # sqrt(g h)
ANGULAR_VELOCITY = 0.05  # sqrt(g / h)
JOINT_VELOCITY = 0.3  # sqrt(g / h)
CONTACT_FORCE = 0.02  # of the range to which forces are clipped


class Block(NamedTuple):
    """A block of the observation.

    Attributes:
        size: how many numbers it has.
        mirror: its left-right map, or a function that returns the map for the `Image` of the body and raises a
            ValueError where there is none; None for a block that declares none.
        noise: half-widths (size,) of its noise at level 1, or one for all numbers; None for what is known exactly.
    """

    size: int
    mirror: Mirror | Callable[[Image], Mirror] | None = None
    noise: np.ndarray | float | None = None

    def map(self, image: Image) -> Mirror:
        """Return the left-right map of a block that declares one.

        Raises:
            ValueError: there is none for this body.
        """
        return self.mirror if isinstance(self.mirror, Mirror) else self.mirror(image)

    @property
    def widths(self) -> np.ndarray:
        """The half-widths (size,) of the noise at level 1 of a block that declares it."""
        return np.broadcast_to(self.noise, self.size)


def places(sizes: Mapping[str, int]) -> dict[str, slice]:
    """Return where each block lies in a vector of all, by name, given their sizes in the order of the vector."""
    ends = itertools.accumulate(sizes.values())
    return {name: slice(end - size, end) for (name, size), end in zip(sizes.items(), ends, strict=True)}


def posture(body: Body) -> Block:
    """Return the block of the torso's height and quaternion, and the joint angles: (5 + joints)."""
    joints = len(body.joint_names)
    widths = HEIGHT * body.torso.standing_height, ORIENTATION, JOINT_ANGLE
    return Block(5 + joints, _mirrored_posture, np.repeat(widths, (1, 4, joints)))


def velocities(body: Body) -> Block:
    """Return the block of the torso's linear and angular velocity, and the joint velocities: (6 + joints)."""
    joints, height = len(body.joint_names), body.torso.standing_height
    unit, rate = math.sqrt(GRAVITY * height), math.sqrt(GRAVITY / height)
    widths = LINEAR_VELOCITY * unit, ANGULAR_VELOCITY * rate, JOINT_VELOCITY * rate
    return Block(6 + joints, _mirrored_velocities, np.repeat(widths, (3, 3, joints)))


def contact_forces(body: Body) -> Block:
    """Return the block of torque and force on each part: (6 * parts)."""
    return Block(6 * len(body.part_names), _mirrored_forces, CONTACT_FORCE)


def gait_clock(phase_offsets: np.ndarray, default_angles: np.ndarray) -> Block:
    """Return the block of sine and cosine of the phase of a gait: (2)."""
    return Block(2, functools.partial(_mirrored_clock, phase_offsets, default_angles))


def of_gait(body: Body, phase_offsets: np.ndarray, default_angles: np.ndarray) -> dict[str, Block]:
    """Return the blocks of the paper's observation (Section 3), for a body in a gait; see `parameters.Parameters`."""
    return {
        "posture": posture(body),
        "velocities": velocities(body),
        "contact_forces": contact_forces(body),
        "gait_clock": gait_clock(phase_offsets, default_angles),
    }


def _mirrored_posture(image: Image) -> Mirror:
    return mirrors.joined([SAME, QUATERNION, mirrors.joints(image)])


def _mirrored_velocities(image: Image) -> Mirror:
    return mirrors.joined([POLAR, AXIAL, mirrors.joints(image)])


def _mirrored_forces(image: Image) -> Mirror:
    return mirrors.of_each(image.parts, mirrors.joined([AXIAL, POLAR]))


def _mirrored_clock(offsets: np.ndarray, default: np.ndarray, image: Image) -> Mirror:
    """Where left and right legs take turns, the clock is half a cycle later: its sine and cosine change sign."""
    if not np.allclose(mirrors.joints(image)(default), default):
        raise ValueError("default_angles: expected mirrored poses left and right")
    for sign in (1, -1):  # of the clock's sine and cosine, whose leads over the legs across are 0 or half a cycle
        if np.allclose(np.exp(1j * offsets[image.legs]), sign * np.exp(1j * offsets)):
            return Mirror.signed(sign, sign)
    raise ValueError("phase_offsets: expected legs across from each other to move together, or half a cycle apart")
