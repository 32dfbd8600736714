"""Sensors of the joints' angles: each shows its angle with a constant error, its offset."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite.models.sizing import action_reaches
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.draws import Episode
from arc_suite.tasks.modifiers.modifier import Modifier
from arc_suite.tasks.parts import Joints
from arc_suite.tasks.readings import Readings
from arc_suite.tasks.scene import Inputs


class SensorsState(NamedTuple):
    """What an episode draws of sensors.

    Attributes:
        joint_offset: (..., joints) error of each sensor: the angle that it shows minus the true angle, rad.
    """

    joint_offset: np.ndarray


class _SensorsFields(NamedTuple):
    joint_offset: float
    reach: np.ndarray
    are_of_servos: bool


class Sensors(_SensorsFields, Modifier):
    """Sensors of the joints' angles.

    Attributes:
        joint_offset: the greatest error of each joint's sensor, rad. It changes the angles that are observed, and those
            at which position control and servos hold the joints.
        reach: (joints,) distance of the farther limit of each joint's range from the standing pose, rad.
        are_of_servos: whether servos read the sensors; servos hold positions inside the simulation.
    """

    __slots__ = ()

    defaults = {"joint_offset": 0.0}
    bounds = {"joint_offset": (0.0, 1.0)}

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        return cls(cls.check_number("joint_offset", settings), action_reaches(body), bool(body.source))

    @property
    def is_active(self) -> bool:
        """Whether sensors have errors."""
        return self.joint_offset > 0.0

    def draw(self, episode: Episode) -> SensorsState:
        """Return the offsets of the episode."""
        signed_shares = 2.0 * episode.keyed.joint_offsets - 1.0  # in [-1, 1)
        return SensorsState(self.joint_offset * signed_shares)

    def drive(self, state: SensorsState, inputs: Inputs, elapsed) -> Inputs:
        """Return the inputs with positions less the offsets: servos hold positions as their sensors show them."""
        if not self.are_of_servos:
            return inputs
        return inputs._replace(ctrl=inputs.ctrl - state.joint_offset / self.reach)

    def sense(self, state: SensorsState, readings: Readings) -> Readings:
        """Return the readings with the angles that the sensors show."""
        xp = readings.posture.__array_namespace__()
        angles = readings.joint_angles + state.joint_offset
        height_and_quaternion = readings.posture[..., :5]
        posture = xp.concatenate([height_and_quaternion, angles], axis=-1)
        return readings._replace(posture=posture, joint_angles=angles)

    def privileged_blocks(self, body: Body) -> dict[str, Block]:
        """Return the block `joint_offset`."""
        return {"joint_offset": Block((Joints(body, "offset of the sensor of {}", "rad"),))}

    def privileged(self, state: SensorsState, elapsed, heading) -> dict[str, Any]:
        """Return the offsets."""
        return {"joint_offset": state.joint_offset}
