"""Judges many presets of a robot at once, on the vector environment."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from arc_suite.cpg.demonstrator import Prescribed
from arc_suite.cpg.presets import Preset
from arc_suite.spec import Body
from arc_suite.vector import VectorEnv

STYLE = ("posture", "smoothness")  # the terms by which presets may not be worse than another


class Score(NamedTuple):
    """How presets walk: arrays (presets, episodes).

    Attributes:
        rewards: mean over the steps of an episode; a robot that has fallen earns nothing any more.
        falls: booleans.
        terms: of the reward, unweighted, means until the fall, by name.
    """

    rewards: np.ndarray
    falls: np.ndarray
    terms: Mapping[str, np.ndarray]

    def style(self) -> np.ndarray:
        """The terms of style, means over episodes, (presets, terms)."""
        return np.stack([self.terms[name].mean(axis=-1) for name in STYLE], axis=-1)


class Judge:
    """Plays seeded episodes of presets, each in a row of one vector environment."""

    def __init__(self, body: Body, presets: int, episodes: int, steps: int):
        """Allocates the rows.

        Args:
            body: of the robot.
            presets: how many are judged at once.
            episodes: of each.
            steps: control steps of an episode.
        """
        self._body, self._shape, self._steps = body, (presets, episodes), steps
        self._environment = VectorEnv(body, "walk", presets * episodes)

    def __call__(self, presets: Sequence[Preset], seed: int = 0) -> Score:
        """Plays the episodes of the seeds from `seed` on, which are the same for all presets."""
        count, episodes = self._shape
        joints = len(self._body.joint_names)
        controls = [Prescribed.fit(self._body, preset) for preset in presets]
        control = Prescribed.stacked([control for control in controls for _ in range(episodes)])
        observations, _ = self._environment.reset(seed=[seed + k for _ in range(count) for k in range(episodes)])
        upright = np.ones(count * episodes, bool)
        totals, lengths, sums = np.zeros(upright.size), np.zeros(upright.size), {}
        for step in range(self._steps):
            clock, felt = np.full(upright.size, step), observations.astype(float)
            angles, velocities = felt[:, 5 : 5 + joints], felt[:, 11 + joints : 11 + 2 * joints]
            observations, rewards, fallen, _, info = self._environment.step(
                control(clock, felt[:, 1:5], angles, velocities)
            )
            totals += rewards * upright
            lengths += upright
            for name, term in _terms(info):
                sums[name] = sums.get(name, 0.0) + term * upright
            upright &= ~fallen
        return Score(
            rewards=(totals / self._steps).reshape(self._shape),
            falls=~upright.reshape(self._shape),
            terms={name: (total / lengths).reshape(self._shape) for name, total in sums.items()},
        )

    def close(self) -> None:
        """Frees the rows."""
        self._environment.close()


def _terms(info: Mapping[str, Any]) -> Iterator[tuple[str, np.ndarray]]:
    return ((name, term) for name, term in info.get("reward_terms", {}).items() if not name.startswith("_"))
