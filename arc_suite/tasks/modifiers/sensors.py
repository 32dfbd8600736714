"""Sensors of joints, whose zeros are displaced."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite.models.sizing import reaches
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
        joint_offset: (..., joints) of the angles that they show, rad.
    """

    joint_offset: np.ndarray


class _SensorsFields(NamedTuple):
    joint_offset: float
    reach: np.ndarray
    are_of_servos: bool


class Sensors(_SensorsFields, Modifier):
    """Sensors of the joints' angles.

    Attributes:
        joint_offset: the greatest error of the zero of each joint's sensor, rad: of the angles that are observed, and
            of those that position control and servos hold.
        reach: (joints,) the farther limit of each joint's range, from the standing pose, rad.
        are_of_servos: whether servos, in place of this suite, hold positions by them.
    """

    __slots__ = ()

    defaults = {"joint_offset": 0.0}
    bounds = {"joint_offset": (0.0, 1.0)}

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        return cls(cls.check_number("joint_offset", settings), reaches(body), bool(body.source))

    @property
    def is_active(self) -> bool:
        """Whether zeros are displaced."""
        return self.joint_offset > 0.0

    def draw(self, episode: Episode) -> SensorsState:
        """Return the offsets of the episode."""
        return SensorsState(self.joint_offset * (2.0 * episode.keyed.offsets - 1.0))

    def drive(self, state: SensorsState, inputs: Inputs, elapsed) -> Inputs:
        """Return the positions that servos hold: displaced as their sensors are."""
        return inputs._replace(ctrl=inputs.ctrl - state.joint_offset / self.reach) if self.are_of_servos else inputs

    def sense(self, state: SensorsState, readings: Readings) -> Readings:
        """Return the readings with displaced angles."""
        xp = readings.posture.__array_namespace__()
        angles = readings.joint_angles + state.joint_offset
        posture = xp.concatenate([readings.posture[..., :5], angles], axis=-1)
        return readings._replace(posture=posture, joint_angles=angles)

    def privileged_blocks(self, body: Body) -> dict[str, Block]:
        """Return the block `joint_offset`."""
        return {"joint_offset": Block((Joints(body, "offset of the sensor of {}", "rad"),))}

    def privileged(self, state: SensorsState, elapsed, heading) -> dict[str, Any]:
        """Return the offsets."""
        return {"joint_offset": state.joint_offset}
