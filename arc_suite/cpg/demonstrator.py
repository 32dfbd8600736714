"""Demonstrators: policies that walk by rote, from nothing but their clock and the joints they feel."""

import math

import numpy as np

from arc_suite import names
from arc_suite.cpg.law import Pattern, joint_targets, torques
from arc_suite.cpg.presets import PRESETS, TUNINGS, ByRank, Preset, Tuning
from arc_suite.robots import ROBOTS
from arc_suite.spec import Body

CONTROL_TIMESTEP = 0.05  # s


class Demonstrator:
    """Walks one robot at one preset, in one environment or in a batch of them.

    The policy keeps its own clock, one for each environment, and asks the observation for joint
    angles and velocities alone. A dm_env `TimeStep` that is the first of an episode restarts the
    clock; with flat observations, call `reset`.
    """

    def __init__(self, robot: str, preset: str = "medium"):
        """Prepares a demonstrator.

        Args:
            robot: queen, bastion, tick or leaper.
            preset: slow, medium or fast.

        Raises:
            ValueError: an unknown name; one line that names it and the nearest valid one.
        """
        body = ROBOTS[names.check(robot, ROBOTS, "robot")]
        self._tuning = TUNINGS[robot]
        self._pattern = pattern(body, self._tuning, self._tuning.presets[names.check(preset, PRESETS, "preset")])
        self._joints = len(body.joint_names)
        self._size = 5 + self._joints + 6 + self._joints + 6 * len(body.part_names) + 2
        self.reset()

    def reset(self, rows=None) -> None:
        """Starts the clock again.

        Args:
            rows: indices or mask of the environments of a batch whose clock restarts; None for all.
        """
        if rows is None or self._clock.ndim == 0:
            self._clock = np.array(0)
        else:
            self._clock[rows] = 0

    def __call__(self, observation) -> np.ndarray:
        """The action for a control step.

        Args:
            observation: a dm_env `TimeStep`, its observation (named blocks or flat), or a flat
                observation vector, (..., size); a batch keeps its leading axes from call to call.

        Returns:
            (..., joints) in [-1, 1].

        Raises:
            ValueError: an observation of another size.
        """
        if hasattr(observation, "step_type"):
            if observation.first():
                self.reset()
            observation = observation.observation
        angles, velocities = self._joints_of(observation)
        if self._clock.shape != angles.shape[:-1]:
            self._clock = np.broadcast_to(self._clock, angles.shape[:-1]).copy()
        action = self._act(angles, velocities)
        self._clock = self._clock + 1
        return action

    def _joints_of(self, observation):
        n = self._joints
        if hasattr(observation, "keys"):
            if "posture" in observation:
                return np.asarray(observation["posture"])[..., 5:], np.asarray(observation["velocities"])[..., 6:]
            observation = observation["observations"]
        vector = np.asarray(observation, dtype=float)
        if vector.shape[-1:] != (self._size,):
            raise ValueError(f"observation: expected {self._size} numbers, got shape {vector.shape}")
        return vector[..., 5 : 5 + n], vector[..., 11 + n : 11 + 2 * n]

    def _act(self, angles, velocities):
        tuning = self._tuning
        steps = self._clock[..., None]
        walking = joint_targets(self._pattern, CONTROL_TIMESTEP * self._clock)
        targets = np.where(steps < tuning.settle, self._pattern.centre, walking)
        ramp = (tuning.ramp_start + (1.0 - tuning.ramp_start) * steps / tuning.ramp).clip(max=1.0)
        return torques(targets, angles, velocities, ramp * tuning.stiffness, tuning.damping)


def pattern(body: Body, tuning: Tuning, preset: Preset) -> Pattern:
    """Lays a preset out over a body's joints."""

    def by_rank(angle: ByRank, rank: int) -> float:
        return math.radians(angle[rank] if isinstance(angle, tuple) else angle)

    rows = []
    for leg, rank, offset in zip(body.legs, body.ranks, tuning.phase_offsets, strict=True):
        for joint in leg.joints:
            if joint.name == "hip":
                sweep = math.radians(preset.sweep) * (-1.0 if leg.side == "left" else 1.0)
                rows.append((offset, sweep, 0.0, 0.0, 0.0))
            else:
                bend = preset.bends[joint.name]
                angles = (tuning.centre[joint.name], bend.stance, bend.swing)
                rows.append((offset, 0.0, *(by_rank(angle, rank) for angle in angles)))
    return Pattern(preset.frequency, preset.duty_factor, *np.array(rows).T)
