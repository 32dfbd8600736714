"""The last seconds of a walk as arrays: rewards by term, foot contacts and speed."""

import collections
from typing import NamedTuple

import numpy as np

from arc_suite.animation.episodes import Episodes
from arc_suite.tasks.clock import TWO_PI

_STEPS = 120  # control steps that are kept


class Moment(NamedTuple):
    """A control step.

    Attributes:
        terms: weighted terms of the reward by name.
        stance: (feet,) whether the foot is in stance; None in a task without a gait.
        schedule: (feet,) whether the gait wants it there, all feet at a stop; None in a task without a gait.
        place: (2,) of the torso, m.
        desired: m/s that the command asks for; NaN where there is none.
    """

    terms: dict[str, float]
    stance: np.ndarray | None
    schedule: np.ndarray | None
    place: np.ndarray
    desired: float


class History:
    """The last control steps of an episode."""

    def __init__(self, episodes: Episodes):
        """Begin without a step."""
        self._episodes = episodes
        self._moments: collections.deque[Moment] = collections.deque(maxlen=_STEPS)

    def __len__(self) -> int:
        return len(self._moments)

    def observe(self) -> None:
        """Remember the control step that the episodes have just taken; a new episode begins anew."""
        environment, steps = self._episodes.environment, self._episodes.steps
        task, data = environment.task.definition, environment.physics.data
        if steps == 0:
            self._moments.clear()
            return
        weights, run = task.settings.weights, environment.task
        stance = schedule = None
        if (gait := task.leg_phases(run.memory)) is not None:
            phases, duty_factor = gait
            stance = task.read(data).foot_heights < task.parameters.stance_threshold
            schedule = (phases % TWO_PI < TWO_PI * duty_factor) | self._stops()
        terms = {name: weights[name] * float(value) for name, value in run.terms.items()}
        self._moments.append(Moment(terms, stance, schedule, data.qpos[:2].copy(), self._desired()))

    @property
    def times(self) -> np.ndarray:
        """Times (steps,) of the control steps, s, 0 for the latest."""
        return self._episodes.control_timestep * np.arange(1 - len(self._moments), 1)

    def terms(self) -> dict[str, np.ndarray]:
        """Return the weighted terms of the reward by name, (steps,) each."""
        names = self._moments[0].terms if self._moments else ()
        return {name: np.array([moment.terms[name] for moment in self._moments]) for name in names}

    def contacts(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Return which feet are in stance and which the gait wants there, (steps, feet); None without a gait."""
        if not self._moments or self._moments[0].stance is None:
            return None
        return np.array([m.stance for m in self._moments]), np.array([m.schedule for m in self._moments])

    def speeds(self) -> np.ndarray:
        """Return the speeds (steps,) of the torso over the ground, m/s: means over a second, or less at the start."""
        step, places = self._episodes.control_timestep, np.array([moment.place for moment in self._moments])
        count = min(max(1, round(1.0 / step)), len(places) - 1)
        if count < 1:
            return np.zeros(len(places))
        means = np.linalg.norm(places[count:] - places[:-count], axis=1) / (count * step)
        return np.concatenate([np.full(count, means[0]), means])

    def desired(self) -> np.ndarray:
        """Return the speeds (steps,) that the command asks for, m/s; NaN where there is no command."""
        return np.array([moment.desired for moment in self._moments])

    def _stops(self) -> bool:
        """Whether the clock of the gait rests, as at a stop."""
        return not np.any(self._episodes.timestep.observation.get("gait_clock", 1.0))

    def _desired(self) -> float:
        task = self._episodes.environment.task.definition
        command = self._episodes.timestep.observation.get("command")
        if command is not None and task.parameters is not None:
            return float(np.hypot(*command[:2]) * task.parameters.target_velocity)
        return np.nan if task.target_velocity is None else float(task.target_velocity)
