"""Evaluates many presets of a robot at once, on the vector environment."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import checks, rotations
from arc_suite.cpg.law import Clocked, proprioception, read_blocks
from arc_suite.cpg.prescribed import Prescribed, Preset
from arc_suite.envs.setup import Setup

TERMS = ("posture", "smoothness")  # of the reward, unweighted
STYLE = (*TERMS, "tilt")  # costs by which presets may not be worse than another


class PresetScore(NamedTuple):
    """How presets walk: arrays (presets, episodes).

    Attributes:
        rewards: mean over the steps of an episode; steps after a fall have none.
        falls: whether the robot fell.
        style: means until the fall, by name: the reward's terms `posture` and `smoothness`, and
            `tilt`, the squared sine of the angle between the torso's axis and the vertical.
        tipping: the largest deviation of the torso from upright: 0 is upright, 1 is a fall or upside down.
    """

    rewards: np.ndarray
    falls: np.ndarray
    style: Mapping[str, np.ndarray]
    tipping: np.ndarray


class Evaluator:
    """Plays seeded episodes of presets, all in one vector environment."""

    def __init__(self, setup: Setup, presets: int, episodes: int, steps: int, skipped: int = 0):
        """Open the environment.

        Args:
            setup: body and task, whose reward has the terms of `TERMS`.
            presets: how many are evaluated at once.
            episodes: episodes of each.
            steps: control steps of an episode.
            skipped: first steps that count for neither rewards nor style.

        Raises:
            ValueError: a task whose reward has other terms, or no steps that count.
        """
        checks.integer("steps", steps, skipped + 1)
        self._body = setup.body
        self._shape = (presets, episodes)
        self._steps = steps
        self._skipped = skipped
        self._environment = setup.make_vec(presets * episodes)
        weights = self._environment.task.settings.weights
        if not set(TERMS) <= weights.keys():
            self.close()
            terms = " and ".join(TERMS)
            raise ValueError(f"task {setup.kind.name}: expected a reward with terms {terms}, got {', '.join(weights)}")

    def __call__(self, presets: Sequence[Preset], seeds: Sequence[int]) -> PresetScore:
        """Play the episodes of these seeds, which are the same for all presets."""
        num_presets, episodes = self._shape
        num_envs = num_presets * episodes
        split = self._environment.task.split
        joints = len(self._body.joint_names)
        controls = [Prescribed.fit(self._body, preset) for preset in presets]
        control = Prescribed.stack([control for control in controls for _ in range(episodes)])
        observations, _ = self._environment.reset(seed=[*seeds] * num_presets)
        sensed = proprioception(read_blocks(split(observations), Clocked.reads, joints))
        is_upright = np.ones(num_envs, bool)
        totals = np.zeros(num_envs)
        lengths = np.zeros(num_envs)  # steps that count
        tipping = np.zeros(num_envs)
        style = dict.fromkeys(STYLE, 0.0)
        for step in range(self._steps):
            actions = control(np.full(num_envs, step), *sensed)
            observations, rewards, fallen, _, info = self._environment.step(actions)
            counts = is_upright & (step >= self._skipped)
            totals += rewards * counts
            lengths += counts
            sensed = proprioception(read_blocks(split(observations), Clocked.reads, joints))
            uprightness = rotations.upright(sensed[0])
            costs = {name: info.get(f"reward_{name}", 0.0) for name in TERMS}  # missing if all environments were reset
            costs["tilt"] = 1.0 - uprightness**2
            for name, cost in costs.items():
                style[name] += cost * counts
            tipping_now = np.where(fallen, 1.0, 0.5 - 0.5 * uprightness)
            tipping = np.where(is_upright, np.maximum(tipping, tipping_now), tipping)
            is_upright &= ~fallen
        return PresetScore(
            rewards=(totals / (self._steps - self._skipped)).reshape(self._shape),
            falls=~is_upright.reshape(self._shape),
            style={name: (total / lengths.clip(1)).reshape(self._shape) for name, total in style.items()},
            tipping=tipping.reshape(self._shape),
        )

    def close(self) -> None:
        """Close the environment."""
        self._environment.close()
