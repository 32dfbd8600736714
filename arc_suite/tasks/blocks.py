"""Blocks of an observation: the parts of each block, and its noise."""

import itertools
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.models.standing import rate_unit, speed_unit
from arc_suite.robots.mirror import Image
from arc_suite.robots.spec import Body
from arc_suite.tasks import mirrors
from arc_suite.tasks.mirrors import Mirror
from arc_suite.tasks.parts import HEADED, ROTATIONS, WORLD, Joints, Part, Phase, Quaternion, RigidParts, Scalar, Vector

# Half-widths of noise at level 1, about those of legged_gym (joints 0.01 rad and 1.5 rad/s, velocity 0.1 m/s and
# 0.2 rad/s, gravity 0.05, heights 0.1 m) for a robot that stands half a meter high.
HEIGHT_NOISE = 0.02  # h
ORIENTATION_NOISE = 0.02  # components of the quaternion
JOINT_ANGLE_NOISE = 0.01  # rad
LINEAR_VELOCITY_NOISE = 0.05  # sqrt(g h)
ANGULAR_VELOCITY_NOISE = 0.05  # sqrt(g / h)
JOINT_VELOCITY_NOISE = 0.3  # sqrt(g / h)
CONTACT_FORCE_NOISE = 0.02  # share of the range to which forces are clipped

# Blocks that the JavaScript of a playable page computes, so that a policy of them can act there.
PAGE_BLOCKS = ("posture", "velocities", "contact_forces", "gait_clock", "command")


class Block(NamedTuple):
    """A block of the observation.

    Attributes:
        parts: its parts, in order.
        noise: half-widths of the noise of each part at level 1, in its unit, or one number for all; None without noise.
        sensed: whether the sensors of a robot measure each part, or one value for all; see `modifiers.SensorsOnly`.
    """

    parts: tuple[Part, ...]
    noise: tuple[float, ...] | float | None = None
    sensed: tuple[bool, ...] | bool = True

    @property
    def size(self) -> int:
        """The number of its numbers."""
        return sum(part.size for part in self.parts)

    @property
    def kinds(self) -> tuple[type[Part], ...]:
        """The classes of its parts."""
        return tuple(map(type, self.parts))

    @property
    def slices(self) -> list[slice]:
        """The slice of each of its parts."""
        ends = itertools.accumulate(part.size for part in self.parts)
        return [slice(end - part.size, end) for part, end in zip(self.parts, ends, strict=True)]

    @property
    def has_frame(self) -> bool:
        """Whether all of its parts have a frame, so that they can be mirrored and turned."""
        return all(part.has_frame for part in self.parts)

    @property
    def measures_joints(self) -> bool:
        """Whether it holds numbers of joints; a history keeps such blocks."""
        return any(isinstance(part, Joints) for part in self.parts)

    @property
    def widths(self) -> np.ndarray:
        """The half-widths (size,) of the noise at level 1 of a block that declares it."""
        return self._repeat_by_size(self.noise)

    @property
    def are_sensed(self) -> np.ndarray:
        """Whether (size,) the sensors of a robot measure each number."""
        return self._repeat_by_size(self.sensed)

    def _repeat_by_size(self, values) -> np.ndarray:
        """Return the values (size,) of all numbers, given that of each part, or one value for all."""
        sizes = [part.size for part in self.parts]
        return np.repeat(np.broadcast_to(values, len(self.parts)), sizes)

    def mirror(self, image: Image) -> Mirror:
        """Return the left-right map.

        Raises:
            ValueError: there is none for this body.
        """
        return mirrors.join([part.mirror(image) for part in self.parts])

    def entries(self) -> list[tuple[str, str]]:
        """Return the name and the unit of every number."""
        return [entry for part in self.parts for entry in part.entries()]


def slices(sizes: Mapping[str, int]) -> dict[str, slice]:
    """Return the slice of each block in a vector of all, by name, given their sizes in the order of the vector."""
    ends = itertools.accumulate(sizes.values())
    return {name: slice(end - size, end) for (name, size), end in zip(sizes.items(), ends, strict=True)}


def posture(body: Body) -> Block:
    """Return the block of the torso's height and quaternion, and the joint angles: (5 + joints)."""
    parts = Scalar("torso height", "m"), Quaternion("torso quaternion"), Joints(body, "angle of {}", "rad")
    noise = (HEIGHT_NOISE * body.torso.standing_height, ORIENTATION_NOISE, JOINT_ANGLE_NOISE)
    return Block(parts, noise, sensed=(False, True, True))


def velocities(body: Body, headed: bool = False) -> Block:
    """Return the block of the torso's linear and angular velocity, and the joint velocities: (6 + joints).

    Args:
        body: the body.
        headed: whether the linear velocity is relative to the heading; else it is in the world's frame.
    """
    height = body.torso.standing_height
    parts = (
        Vector("torso velocity", "m/s", HEADED if headed else WORLD),
        Vector("torso angular velocity", "rad/s", ROTATIONS, axial=True),
        Joints(body, "velocity of {}", "rad/s"),
    )
    noise = (
        LINEAR_VELOCITY_NOISE * speed_unit(height),
        ANGULAR_VELOCITY_NOISE * rate_unit(height),
        JOINT_VELOCITY_NOISE * rate_unit(height),
    )
    return Block(parts, noise, sensed=(False, True, True))


def contact_forces(body: Body, headed: bool = False) -> Block:
    """Return the block of torque and force on each rigid part: (6 * parts).

    Args:
        body: the body.
        headed: whether they are relative to the heading and in the body's weight; else in the world's frame and in N.
    """
    axes = HEADED if headed else ("x", "y", "z")
    torque_unit, force_unit = ("weight x h", "weight") if headed else ("N m", "N")
    torque = Vector("torque on {}", torque_unit, axes, axial=True)
    force = Vector("force on {}", force_unit, axes)
    return Block((RigidParts(body, (torque, force)),), CONTACT_FORCE_NOISE, sensed=False)


def gait_clock(phase_offsets: np.ndarray | None = None, default_angles: np.ndarray | None = None) -> Block:
    """Return the block of sine and cosine of the phase of a gait: (2).

    Args:
        phase_offsets: (legs,) phase offsets of the gait, rad; None where they change.
        default_angles: (joints,) angles of the pose around which the gait moves, rad; None where it changes.
    """
    return Block((Phase("the phase", phase_offsets, default_angles),))


def of_gait(
    body: Body, phase_offsets: np.ndarray, default_angles: np.ndarray, headed: bool = False
) -> dict[str, Block]:
    """Return the blocks of the paper's observation (Section 3), for a body in a gait.

    Args:
        body: the body.
        phase_offsets: see `parameters.Parameters`.
        default_angles: see `parameters.Parameters`.
        headed: whether vectors are relative to the heading; see `velocities` and `contact_forces`.
    """
    return {
        "posture": posture(body),
        "velocities": velocities(body, headed),
        "contact_forces": contact_forces(body, headed),
        "gait_clock": gait_clock(phase_offsets, default_angles),
    }
