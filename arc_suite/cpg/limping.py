"""The demonstrator that limps: it steps along paths of feet, as `stepping` does, and unloads a leg that fails.

Joints whose motors fail do not follow their targets. A leg fails in so far as the angles of its joints err by more than
those of any other leg; a kick or rough ground disturbs several legs. The torso moves over the middle of the other feet,
and these stand longer. It also moves against the rate and the sum of its tilt.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.cpg.command_law import Request, read_vertical
from arc_suite.cpg.stepping import GaitTiming, Stepping, SteppingParameters, SteppingState
from arc_suite.tasks.contract import Task

_MEMORY_CYCLES = 0.1  # cycles over which the squares of errors are averaged
_LEAD_CYCLES = 0.08  # cycles ahead for which errors are predicted
_SMALL_ERROR = 0.1  # rad, that joints of a sound leg err at least
_SOUND_ERROR = 1.0  # multiple of the largest error of other legs up to which a leg is sound
_FAILED_ERROR = 1.5  # the same multiple, from which on it has failed


class LimpingParameters(NamedTuple):
    """How a demonstrator that limps walks. Where a task commands the pose, `steps` alone have an effect.

    Attributes:
        steps: how its feet step.
        unload: how far the torso moves from the middle of all feet to that of the sound legs, as a share of the way.
        linger: share of their swing by which sound legs stand longer.
        tilt_rate: shift of the torso, as a share of the distance by which its rate of tilt moves its weight within the
            time constant of an inverted pendulum.
        tilt_sum: shift of the torso, as a share of the distance by which the tilt's sum over cycles moves its weight.
    """

    steps: SteppingParameters
    unload: float = 1.0
    linger: float = 0.4
    tilt_rate: float = 0.15
    tilt_sum: float = 0.25


class LimpingState(NamedTuple):
    """What this law adds to the state of a `CommandLaw`.

    Attributes:
        joint_angles: (environments, legs, links) planned, rad.
        tilt_sum: (environments, 2) sum of the tilt, forward and left, rad cycles.
        squared_errors: (environments, legs) mean squares of the errors of joints, rad^2.
    """

    joint_angles: np.ndarray
    tilt_sum: np.ndarray
    squared_errors: np.ndarray


class Limping(Stepping):
    """Steps, and limps where a leg fails.

    Attributes:
        limping: parameters of this law; `parameters` are those of its steps.
        ways_from_legs: (legs, 2) from the middle of all soles to that of the soles of the other legs, m.
    """

    def __init__(self, task: Task, parameters: LimpingParameters):
        """Fit the law to a task; see `CommandLaw`.

        Raises:
            ValueError: a body of one leg, which no other one can relieve.
        """
        super().__init__(task, parameters.steps)
        if len(self.rest_soles) == 1:
            raise ValueError(f"preset: {task.scene.body.name} has one leg, and limping is for two or more; see braced")
        self.limping = parameters
        middle = self.rest_soles[:, :2].mean(axis=0)
        self.ways_from_legs = (middle - self.rest_soles[:, :2]) / (len(self.rest_soles) - 1)
        self._error_memory = min(1.0, self.cycles_per_step / _MEMORY_CYCLES)
        self._lead_steps = _LEAD_CYCLES / self.cycles_per_step

    def initial_paths(self, count: int) -> LimpingState | SteppingState:
        """Return the angles at rest, without tilt and errors, for a number of environments."""
        stepping_state = super().initial_paths(count)
        if self.directed:
            return stepping_state
        return LimpingState(stepping_state.joint_angles, np.zeros((count, 2)), np.zeros((count, len(self.rest_soles))))

    def follow_request(self, state, request: Request, observation: Mapping) -> tuple:
        """Return the next state, target angles (environments, joints), rad, and their change; see `CommandLaw`."""
        if self.directed:
            return super().follow_request(state, request, observation)
        vertical = read_vertical(observation)
        failure = find_failure(state.squared_errors)
        timing = self._linger(self.gait_timing(request, observation), failure)

        velocity, foothold_shift = self.balance(request.motion, vertical, observation)
        soles = self.next_feet(timing, velocity, foothold_shift, request.size)
        tilt_sum = self.add_tilt(state.tilt_sum, vertical[:, :2], request.size)
        feet_shift = self.tilt_shift(
            self.limping.tilt_sum * tilt_sum, self.limping.tilt_rate, observation["velocities"][:, 3:5]
        )
        # Feet move against the way of the torso.
        feet_shift = feet_shift - self.limping.unload * (failure[..., None] * self.ways_from_legs).sum(axis=-2)
        soles = shift_feet(soles, feet_shift)

        joint_angles, target_angles, angle_changes = self.move_feet(state.joint_angles, soles, velocity)
        squares = self._square_errors(state.joint_angles, joint_angles, observation)
        squared_errors = state.squared_errors + self._error_memory * (squares - state.squared_errors)
        return LimpingState(joint_angles, tilt_sum, squared_errors), target_angles, angle_changes

    def _linger(self, timing: GaitTiming, failure) -> GaitTiming:
        """Return the timing with longer stances of the legs other than the one that fails; see `find_failure`."""
        swing_share = 1.0 - timing.duty_factor
        duty_factor = timing.duty_factor + self.limping.linger * swing_share * _sum_of_others(failure)
        stance_duration = timing.stance_duration * (duty_factor / timing.duty_factor)[..., None]
        return timing._replace(duty_factor=duty_factor, stance_duration=stance_duration)

    def _square_errors(self, planned_angles, next_angles, observation: Mapping):
        """Return the squares (environments, legs) of the errors of each leg's joints, rad^2, a little ahead of time.

        Args:
            planned_angles: (environments, legs, links) in this control step, rad.
            next_angles: (environments, legs, links) in the next one, rad.
            observation: blocks by name.
        """
        measured_angles = self.legs.by_leg(observation["posture"][:, 5:])
        measured_changes = self.legs.by_leg(observation["velocities"][:, 6:]) * self.control_timestep
        error = measured_angles - planned_angles
        error_change = measured_changes - (next_angles - planned_angles)
        predicted_error = (error + self._lead_steps * error_change) * self.legs.has_joint
        return (predicted_error**2).sum(axis=-1)


def find_failure(squared_errors):
    """Return how far each leg fails, (environments, legs) from 0 to 1; at most one leg has more than 0.

    Args:
        squared_errors: (environments, legs) mean squares of the errors of joints, rad^2.
    """
    xp = squared_errors.__array_namespace__()
    errors = xp.sqrt(squared_errors)
    sorted_errors = xp.sort(errors, axis=-1)
    largest = sorted_errors[:, -1:]
    second = sorted_errors[:, -2:-1]
    largest_of_others = xp.where(errors < largest, largest, second)
    multiple = errors / (largest_of_others + _SMALL_ERROR)
    return ((multiple - _SOUND_ERROR) / (_FAILED_ERROR - _SOUND_ERROR)).clip(0.0, 1.0)


def shift_feet(soles, shift):
    """Return soles (environments, legs, 3), m, all of which a shift (environments, 2) has moved forward and left, m."""
    xp = soles.__array_namespace__()
    return xp.concatenate([soles[..., :2] + shift[:, None], soles[..., 2:]], axis=-1)


def _sum_of_others(values):
    """Return the sum of the values (environments, legs) of the other legs, for each leg."""
    return values.sum(axis=-1, keepdims=True) - values
