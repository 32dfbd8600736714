"""What laws that follow a command share: gait and units of a task, feedback on the command, control of the joints."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite.cpg.drives import drive
from arc_suite.cpg.gait import gait_of
from arc_suite.cpg.law import proprioception
from arc_suite.models.sizing import size_body
from arc_suite.models.standing import pose_mechanics
from arc_suite.tasks.contract import Task
from arc_suite.tasks.fitting import velocity_units

_SMOOTHING = 0.25  # cycles over which a new command takes hold
_ONSET = 1.0  # cycles over which the gait grows to its full size


class CommandLawState(NamedTuple):
    """The state of a law that follows a command.

    Attributes:
        command: (environments, 3) smoothed, in units of the command.
        integral: (environments, 3) of the error of the motion, in the same units.
        motion: (environments, 3) requested of the feet, in the same units; held while the command rests.
        size: (environments, 1) of the gait, from 0 to 1.
        phase: (environments,) of the gait in the next control step, cycles; held while the command rests.
        paths: a law's own, an array or a NamedTuple of arrays.
    """

    command: np.ndarray
    integral: np.ndarray
    motion: np.ndarray
    size: np.ndarray
    phase: np.ndarray
    paths: Any


class Request(NamedTuple):
    """What feet are to do in a control step.

    Attributes:
        motion: (environments, 3) command, corrected by feedback, in units of the command.
        size: (environments, 1) of the gait, from 0 to 1.
        phase: (environments,) of the gait, cycles.
        advance: (environments,) of the phase in a control step, cycles; 0 while the command rests.
    """

    motion: np.ndarray
    size: np.ndarray
    phase: np.ndarray
    advance: np.ndarray


class CommandLaw(ABC):
    """A law that follows the block `command` in the gait of a task, whose phase the block `gait_clock` shows.

    Attributes:
        parameters: of the law; a NamedTuple with fields `gain`, `integral` and `lead`, at least.
        body: with motors and armatures.
        pose: in which it stands.
        step: s between two actions.
        cycles: of the gait in a control step.
        smoothing: share of a new command that takes hold in a control step.
        onset: share of its full size by which the gait grows in a control step.
        duty_factor: of the gait.
        stance: that it lasts, s.
        offsets: (legs,) over the task's clock, cycles.
        units: (3,) of the command, m/s and rad/s.
        drive: of the joints.
    """

    reads: tuple[str, ...] = ("posture", "velocities", "command", "gait_clock")

    def __init__(self, task: Task, parameters, angles: tuple[float, ...] | None = None):
        """Fit the law to a task.

        Args:
            task: whose body is to walk, and whose gait it walks in.
            parameters: of the law.
            angles: (joints,) of the pose about which joints are controlled, rad; None for the standing pose.

        Raises:
            ValueError: a gait without a cycle, or without stance or swing.
        """
        gait, self.parameters, self.body = gait_of(task), parameters, size_body(task.scene.body)
        self.pose, self.control_timestep = pose_mechanics(self.body, angles), task.scene.control_timestep
        self.cycles_per_step, self.duty_factor = gait.frequency * self.control_timestep, gait.duty_factor
        self.smoothing, self.onset = min(1.0, self.cycles_per_step / _SMOOTHING), self.cycles_per_step / _ONSET
        self.stance_duration, self.offsets = gait.duty_factor / gait.frequency, gait.offsets + parameters.lead
        self.units = velocity_units(self.body, gait.target_velocity)
        self.drive = drive(self.body, self.pose.inertias)

    def initial(self, count: int) -> CommandLawState:
        """Return the state at the start of episodes in a number of environments."""
        zeros = np.zeros((count, 3))
        return CommandLawState(zeros, zeros, zeros, zeros[:, :1], zeros[:, 0], self.initial_paths(count))

    def __call__(self, state: CommandLawState, observation: Mapping) -> tuple:
        """Return the next state and the actions (environments, joints); see `law`."""
        _, angles, velocities = proprioception(observation)
        state, targets, speeds = self.targets(state, observation)
        return state, self.drive.actions(targets, speeds, angles, velocities)

    def targets(self, state: CommandLawState, observation: Mapping) -> tuple:
        """Return the next state, and the joints' target angles, rad, and velocities, rad/s, (environments, joints)."""
        state, request = self._requested(state, observation["command"], observation["gait_clock"])
        paths, targets, change = self.planned(state.paths, request, observation)
        return state._replace(paths=paths), targets, change / self.control_timestep

    def _requested(self, state: CommandLawState, command, clock) -> tuple[CommandLawState, Request]:
        """The next state, and what feet are to do, by proportional and integral feedback on the command."""
        numpy, wanted, motion = clock.__array_namespace__(), command[:, :3], command[:, 3:]
        going = clock.any(axis=-1, keepdims=True)
        smooth = state.command + self.smoothing * (wanted - state.command)
        integral = state.integral + self.parameters.integral * self.cycles_per_step * (wanted - motion)
        integral = integral.clip(-1.0, 1.0) * going
        size = (state.size + numpy.where(going, 1.0, -1.0) * self.onset).clip(0.0, 1.0)
        # At rest the clock reads (0, 0), which is no phase.
        phase = numpy.where(going[:, 0], numpy.arctan2(clock[:, 0], clock[:, 1]) / (2.0 * np.pi), state.phase)
        advance = self.cycles_per_step * going[:, 0]
        requested = smooth + integral + np.array(self.parameters.gain) * (smooth - motion)
        requested = numpy.where(going, requested, state.motion)
        state = CommandLawState(smooth, integral, requested, size, phase + advance, state.paths)
        return state, Request(requested, size, phase, advance)

    @abstractmethod
    def initial_paths(self, count: int) -> Any:
        """Return the law's own state at the start of episodes in a number of environments."""

    @abstractmethod
    def planned(self, paths, request: Request, observation: Mapping) -> tuple:
        """Return the law's own next state, target angles (environments, joints), rad, and their change in a step."""
