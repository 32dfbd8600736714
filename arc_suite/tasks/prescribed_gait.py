"""The gait that the parameters of a task prescribe, for tasks that command neither gaits nor poses."""

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.clock import Clock
from arc_suite.tasks.context import Context
from arc_suite.tasks.parameters import Parameters


@dataclasses.dataclass(frozen=True, eq=False)
class PrescribedGait:
    """A gait that never changes, with the methods of `gait_and_pose.GaitAndPose`.

    It has no memory, no commands, no blocks and no bonuses of its own. Its phase follows from the tick of the clock.

    Attributes:
        parameters: parameters of the gait.
        clock: clock of the gait.
        needs_feet: whether `after` takes the positions of the feet from the readings.
    """

    parameters: Parameters
    clock: Clock

    needs_feet: ClassVar[bool] = False

    def blocks(self, body: Body) -> dict[str, Block]:
        """Return no blocks."""
        return {}

    def live(self, body: Body) -> dict[str, int]:
        """Return no commands."""
        return {}

    def limits(self, body: Body, step: float) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Return no bounds of commands."""
        return {}

    def named_command(self, body: Body, name: str, value: str) -> None:
        """Return None, as no command has names."""

    def reference(self, scene, parameters: Parameters) -> None:
        """Return None, as no poses are measured."""

    def start(self, context: Context, random: np.random.RandomState) -> None:
        """Return no memory; nothing is drawn."""

    def advance(self, context: Context, memory: None, steps, is_going) -> None:
        """Return no memory."""

    def after(self, context: Context, memory: None, readings, schedule_errors) -> None:
        """Return no memory."""

    def with_command(self, memory: None, name: str, value) -> None:
        """Return no memory, as there are no commands."""

    def resampled(self, memory: None, steps) -> bool:
        """Return False, as no gait is drawn."""
        return False

    def phase(self, tick, memory: None):
        """Return the phase (...) of the gait, rad."""
        return self.clock.entries(self.clock.phases, tick)

    def circle(self, tick, memory: None):
        """Return sine and cosine (..., 2) of the phase."""
        return self.clock.entries(self.clock.circle, tick)

    def stance(self, tick, memory: None):
        """Return which feet (..., legs) the gait has on the ground."""
        return self.clock.entries(self.clock.stance, tick)

    def leg_phases(self, tick, memory: None) -> tuple[Any, Any]:
        """Return the phase (..., legs) of each leg, rad, and the duty factor."""
        return self.phase(tick, memory)[..., None] + self.parameters.phase_offsets, self.parameters.duty_factor

    def height_share(self, memory: None) -> float:
        """Return 1, as the torso is to keep its height."""
        return 1.0

    def default_angles(self, context: Context, memory: None, default_angles):
        """Return the default angles (joints,) of the task, rad."""
        return default_angles

    def terms(self, memory: None, bonuses: dict, step_tracking) -> dict:
        """Return the bonuses of the command of the velocity."""
        return bonuses

    def observe(self, context: Context, memory: None) -> Mapping[str, Any]:
        """Return no blocks."""
        return {}

    def progress(self, memory: None, judged_steps) -> dict:
        """Return no metrics."""
        return {}
