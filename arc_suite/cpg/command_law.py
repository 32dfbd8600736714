"""What laws that follow a command share: gait and units of a task, feedback on the command, control of the joints."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.cpg.drives import drive
from arc_suite.cpg.gait import gait_of
from arc_suite.cpg.law import proprioception
from arc_suite.models.sizing import size_body
from arc_suite.models.standing import pose_mechanics
from arc_suite.tasks.contract import Task
from arc_suite.tasks.fitting import velocity_units

_SMOOTHING_CYCLES = 0.25  # cycles over which a new command takes hold
_ONSET_CYCLES = 1.0  # cycles over which the gait grows to its full size


class CommandLawState(NamedTuple):
    """The state of a law that follows a command.

    Attributes:
        command: (environments, 3) smoothed, in units of the command.
        integral: (environments, 3) integral of the error of the motion, in the same units.
        motion: (environments, 3) requested of the feet, in the same units; held while the command rests.
        size: (environments, 1) size of the gait, from 0 to 1.
        phase: (environments,) phase of the gait in the next control step, cycles; held while the command rests.
        paths: state of a law derived from this one, an array or a NamedTuple of arrays.
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
        size: (environments, 1) size of the gait, from 0 to 1.
        phase: (environments,) phase of the gait, cycles.
        advance: (environments,) advance of the phase in a control step, cycles; 0 while the command rests.
    """

    motion: np.ndarray
    size: np.ndarray
    phase: np.ndarray
    advance: np.ndarray


def read_vertical(observation: Mapping):
    """Return the world's vertical (environments, 3) in the torso's frame, given the blocks of the observation."""
    return rotations.matrix(observation["posture"][:, 1:5])[:, 2]


class CommandLaw(ABC):
    """A law that follows the block `command` in the gait of a task, whose phase the block `gait_clock` shows.

    Attributes:
        parameters: parameters of the law; a NamedTuple with fields `gain`, `integral` and `lead`, at least.
        body: with motors and armatures.
        mechanics: mechanics of the pose about which joints are controlled.
        control_timestep: s between two actions.
        cycles_per_step: cycles of the gait in a control step.
        smoothing: share of a new command that takes hold in a control step.
        onset: share of its full size by which the gait grows in a control step.
        duty_factor: share of a cycle that a foot stands.
        stance_duration: s.
        phase_offsets: (legs,) over the task's clock, cycles.
        units: (3,) units of the command, m/s and rad/s.
        drive: moves the joints to their targets.
    """

    reads: tuple[str, ...] = ("posture", "velocities", "command", "gait_clock")

    def __init__(self, task: Task, parameters, angles: tuple[float, ...] | None = None):
        """Fit the law to a task.

        Args:
            task: task whose body is to walk, and whose gait it walks in.
            parameters: parameters of the law.
            angles: (joints,) angles of the pose about which joints are controlled, rad; None for the standing pose.

        Raises:
            ValueError: a gait without a cycle, or without stance or swing.
        """
        gait = gait_of(task)
        self.parameters = parameters
        self.body = size_body(task.scene.body)
        self.mechanics = pose_mechanics(self.body, angles)
        self.control_timestep = task.scene.control_timestep
        self.cycles_per_step = gait.frequency * self.control_timestep
        self.smoothing = min(1.0, self.cycles_per_step / _SMOOTHING_CYCLES)
        self.onset = self.cycles_per_step / _ONSET_CYCLES
        self.duty_factor = gait.duty_factor
        self.stance_duration = gait.duty_factor / gait.frequency
        self.phase_offsets = gait.offsets + parameters.lead
        self.units = velocity_units(self.body, gait.target_velocity)
        self.drive = drive(self.body, self.mechanics.inertias)

    def initial(self, count: int) -> CommandLawState:
        """Return the state at the start of episodes in a number of environments."""
        zeros = np.zeros((count, 3))
        return CommandLawState(
            command=zeros,
            integral=zeros,
            motion=zeros,
            size=zeros[:, :1],
            phase=zeros[:, 0],
            paths=self.initial_paths(count),
        )

    def __call__(self, state: CommandLawState, observation: Mapping) -> tuple:
        """Return the next state and the actions (environments, joints); see `law`."""
        _, joint_angles, joint_velocities = proprioception(observation)
        next_state, target_angles, target_velocities = self.targets(state, observation)
        actions = self.drive.actions(target_angles, target_velocities, joint_angles, joint_velocities)
        return next_state, actions

    def targets(self, state: CommandLawState, observation: Mapping) -> tuple:
        """Return the next state, and target angles, rad, and velocities, rad/s, of joints: (environments, joints)."""
        next_state, request = self._make_request(state, observation["command"], observation["gait_clock"])
        paths, target_angles, angle_changes = self.follow_request(state.paths, request, observation)
        return next_state._replace(paths=paths), target_angles, angle_changes / self.control_timestep

    def _make_request(self, state: CommandLawState, command, clock) -> tuple[CommandLawState, Request]:
        """Return the next state, and what feet are to do, by proportional and integral feedback on the command.

        Args:
            state: before the control step.
            command: (environments, 6) desired and measured motion, in units of the command.
            clock: (environments, 2) sine and cosine of the gait's phase; (0, 0) while the command rests.
        """
        xp = clock.__array_namespace__()
        desired = command[:, :3]
        measured = command[:, 3:]
        is_walking = clock.any(axis=-1, keepdims=True)  # (environments, 1)

        smooth = state.command + self.smoothing * (desired - state.command)
        error = smooth - measured
        # While the gait grows the body cannot follow yet, and the integral would make it run later.
        is_grown = state.size >= 1.0
        integral = state.integral + self.parameters.integral * self.cycles_per_step * error * is_grown
        integral = integral.clip(-1.0, 1.0) * is_walking
        feedback = np.array(self.parameters.gain) * error
        motion = xp.where(is_walking, smooth + integral + feedback, state.motion)

        size_change = xp.where(is_walking, 1.0, -1.0) * self.onset
        size = (state.size + size_change).clip(0.0, 1.0)
        clock_phase = xp.arctan2(clock[:, 0], clock[:, 1]) / (2.0 * np.pi)
        phase = xp.where(is_walking[:, 0], clock_phase, state.phase)  # a clock at rest has no phase
        advance = self.cycles_per_step * is_walking[:, 0]
        next_state = CommandLawState(smooth, integral, motion, size, phase + advance, state.paths)
        return next_state, Request(motion, size, phase, advance)

    @abstractmethod
    def initial_paths(self, count: int) -> Any:
        """Return the state of a derived law at the start of episodes in a number of environments."""

    @abstractmethod
    def follow_request(self, state, request: Request, observation: Mapping) -> tuple:
        """Return a derived law's next state, target angles (environments, joints), rad, and their change in a step.

        Args:
            state: state of the derived law, before the control step.
            request: what feet are to do.
            observation: blocks by name, (environments, size) each.
        """
