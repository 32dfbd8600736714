"""The last seconds of a walk as arrays: rewards by term, foot contacts and speed."""

import collections
from typing import NamedTuple

import numpy as np

from arc_suite.animation.episodes import Episodes
from arc_suite.tasks import readings
from arc_suite.tasks.clock import TWO_PI

_MAX_STEPS = 120  # control steps of the history
_SPEED_WINDOW = 1.0  # s, over which a speed is a mean


class Moment(NamedTuple):
    """The values of one control step.

    Attributes:
        terms: weighted terms of the reward by name.
        stance: (feet,) whether the foot is in stance; None in a task without a gait.
        schedule: (feet,) whether the gait schedules a stance, at a stop for all feet; None in a task without a gait.
        position: (2,) position of the torso over the ground, m.
        desired_speed: by command, m/s; NaN without a command.
    """

    terms: dict[str, float]
    stance: np.ndarray | None
    schedule: np.ndarray | None
    position: np.ndarray
    desired_speed: float


class History:
    """The last control steps of an episode."""

    def __init__(self, episodes: Episodes):
        """Begin without a step."""
        self._episodes = episodes
        self._moments: collections.deque[Moment] = collections.deque(maxlen=_MAX_STEPS)

    def __len__(self) -> int:
        return len(self._moments)

    def observe(self) -> None:
        """Add the control step that the episodes have just taken; at the start of an episode, forget all steps."""
        if self._episodes.steps == 0:
            self._moments.clear()
            return
        environment = self._episodes.environment
        data = environment.physics.data
        running_task = environment.task
        task = running_task.definition
        weights = task.settings.weights
        stance = None
        schedule = None
        gait = task.leg_phases(running_task.memory)
        if gait is not None:
            phases, duty_factor = gait  # rad, and the share of a cycle that a foot stands
            stance = task.read(data).foot_heights < task.parameters.stance_threshold
            schedule = phases % TWO_PI < TWO_PI * duty_factor
            if self._is_at_stop():
                schedule = np.ones_like(schedule)
        moment = Moment(
            terms={name: weights[name] * float(value) for name, value in running_task.terms.items()},
            stance=stance,
            schedule=schedule,
            position=readings.torso_qpos(data.qpos, task.scene.layout)[:2].copy(),
            desired_speed=self._desired_speed(),
        )
        self._moments.append(moment)

    @property
    def times(self) -> np.ndarray:
        """Return the times (steps,) of the control steps, s; the latest is at 0."""
        return self._episodes.control_timestep * np.arange(1 - len(self._moments), 1)

    def terms(self) -> dict[str, np.ndarray]:
        """Return the weighted terms of the reward by name, (steps,) each."""
        if not self._moments:
            return {}
        return {name: np.array([moment.terms[name] for moment in self._moments]) for name in self._moments[0].terms}

    def contacts(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return which feet are in stance and which the gait schedules so, (steps, feet); None without a gait."""
        if not self._moments or self._moments[0].stance is None:
            return None
        stance = np.array([moment.stance for moment in self._moments])
        schedule = np.array([moment.schedule for moment in self._moments])
        return stance, schedule

    def speeds(self) -> np.ndarray:
        """Return the speeds (steps,) of the torso over the ground, m/s: means over a second, or less at the start."""
        control_timestep = self._episodes.control_timestep
        positions = np.array([moment.position for moment in self._moments])
        window = max(1, round(_SPEED_WINDOW / control_timestep))
        window = min(window, len(positions) - 1)  # control steps
        if window < 1:
            return np.zeros(len(positions))
        distances = np.linalg.norm(positions[window:] - positions[:-window], axis=1)
        means = distances / (window * control_timestep)
        return np.concatenate([np.full(window, means[0]), means])

    def desired_speeds(self) -> np.ndarray:
        """Return the speeds (steps,) by command, m/s; NaN where there is no command."""
        return np.array([moment.desired_speed for moment in self._moments])

    def _is_at_stop(self) -> bool:
        """Return whether the clock of the gait, as it is observed, rests."""
        return not np.any(self._episodes.timestep.observation.get("gait_clock", 1.0))

    def _desired_speed(self) -> float:
        task = self._episodes.environment.task.definition
        command = self._episodes.timestep.observation.get("command")  # velocity in multiples of the target velocity
        if command is not None and task.parameters is not None:
            return float(np.hypot(*command[:2]) * task.parameters.target_velocity)
        if task.target_velocity is None:
            return np.nan
        return float(task.target_velocity)
