"""The demonstrator that walks straight ahead by feedback, in tasks that show no command.

It follows a command of its own by the law of `stepping`: the target velocity of the task, and a turn that brings the
torso back to its heading.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.cpg.command_law import CommandLawState
from arc_suite.cpg.gait import gait_of
from arc_suite.cpg.stepping import Stepping, SteppingParameters
from arc_suite.cpg.stride_law import SMOOTHING_CYCLES
from arc_suite.tasks.contract import Task

_MAX_TURN = 1.0  # of the command, in its unit


class StraightParameters(NamedTuple):
    """How a demonstrator walks straight ahead.

    Attributes:
        steps: how its feet step.
        heading: rate of turning per rad of yaw, 1/s.
    """

    steps: SteppingParameters
    heading: float = 1.0


class StraightState(NamedTuple):
    """The state of this law.

    Attributes:
        motion: (environments, 3) smoothed velocity forward and left, and rate of turning, in units of a command.
        steps: state of the law that steps.
    """

    motion: np.ndarray
    steps: CommandLawState


class Straight:
    """Walks along world x at the target velocity of a task."""

    reads: tuple[str, ...] = tuple(name for name in Stepping.reads if name != "command")

    def __init__(self, task: Task, parameters: StraightParameters):
        """Fit the law that steps to a task; see `CommandLaw`."""
        self._heading_gain = parameters.heading
        self._stepping = Stepping(task, parameters.steps)
        self.reads = tuple(name for name in self._stepping.reads if name != "command")
        self._direction = np.sign(gait_of(task).target_velocity)
        self._smoothing = min(1.0, self._stepping.cycles_per_step / SMOOTHING_CYCLES)

    def initial(self, count: int) -> StraightState:
        """Return the state at the start of episodes in a number of environments, with a torso at rest."""
        return StraightState(np.zeros((count, 3)), self._stepping.initial(count))

    def __call__(self, state: StraightState, observation: Mapping) -> tuple:
        """Return the next state and the actions (environments, joints); see `law`."""
        velocities = observation["velocities"]
        xp = velocities.__array_namespace__()
        units = self._stepping.units
        measured = xp.stack([velocities[:, 0], velocities[:, 1], velocities[:, 5]], axis=-1) / units
        motion = state.motion + self._smoothing * (measured - state.motion)

        yaw = rotations.yaw(observation["posture"][:, 1:5])
        turn = (-self._heading_gain * yaw / units[2]).clip(-_MAX_TURN, _MAX_TURN)
        zero = xp.zeros_like(turn)
        command = xp.stack([zero + self._direction, zero, turn], axis=-1)
        blocks = {**observation, "command": xp.concatenate([command, motion], axis=-1)}
        steps, actions = self._stepping(state.steps, blocks)
        return StraightState(motion, steps), actions
