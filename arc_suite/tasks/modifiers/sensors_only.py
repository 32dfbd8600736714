"""Observations from what a robot's sensors give: encoders of the joints, an IMU, a clock and the command."""

from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite import checks
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.modifier import Modifier


class _SensorsOnlyFields(NamedTuple):
    sensors_only: bool
    are_sensed: Mapping[str, np.ndarray]


class SensorsOnly(_SensorsOnlyFields, Modifier):
    """Observations without what no sensor gives.

    Attributes:
        sensors_only: whether numbers that a robot's sensors do not give are 0: height and velocity of the torso,
            contact forces, and the measured motion of the block `command`. Joint angles and speeds, orientation and
            turning rates, clock and desired command stay.
        are_sensed: by name of a block with such numbers, whether sensors give each number (size,).
    """

    __slots__ = ()

    defaults = {"sensors_only": False}

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        are_sensed = {name: block.are_sensed for name, block in blocks.items()}
        incomplete = {name: mask for name, mask in are_sensed.items() if not mask.all()}
        return cls(checks.boolean("sensors_only", settings["sensors_only"]), incomplete)

    @property
    def is_active(self) -> bool:
        """Whether numbers are left out."""
        return self.sensors_only

    @property
    def structure(self) -> Hashable:
        """The names of the blocks that lack numbers."""
        return tuple(self.are_sensed)

    def observe(self, state, observed: dict, elapsed) -> dict[str, Any]:
        """Return the blocks with 0 in place of what no sensor gives."""
        blocks = dict(observed)
        for name, mask in self.are_sensed.items():
            if name in blocks:
                xp = blocks[name].__array_namespace__()
                blocks[name] = xp.where(mask, blocks[name], 0.0)
        return blocks
