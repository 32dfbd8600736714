"""Environments of different bodies with one vector of observation and one of actions, for plain learners."""

from collections.abc import Mapping
from typing import NamedTuple

import gymnasium
import numpy as np
from gymnasium.vector.utils import batch_space

from arc_suite.envs.bodies import BodiesEnv
from arc_suite.tasks import tokens


class FlatTask(NamedTuple):
    """What learners know of the task of different bodies.

    Attributes:
        name: of the task.
        step_limit: control steps after which an episode is over, may be infinite.
        blocks: sizes of the blocks of the observation vector by name, in order.
    """

    name: str
    step_limit: float
    blocks: Mapping[str, int] = tokens.FLAT

    @property
    def definition(self) -> "FlatTask":
        """Itself, where an environment of one body has a view of its task."""
        return self

    @property
    def size(self) -> int:
        """Of an observation vector."""
        return sum(self.blocks.values())

    @property
    def symmetry(self):
        """No mirror maps.

        Raises:
            ValueError: always; bodies need not be symmetric.
        """
        raise ValueError(f"task {self.name}: different bodies have no common mirror image")

    def split(self, observation: np.ndarray) -> dict[str, np.ndarray]:
        """Return an observation vector (..., size) as named blocks, views of it."""
        return tokens.split(observation)


class FlatBodies(gymnasium.vector.VectorWrapper):
    """Environments of different bodies with one vector of observation and one of actions, for plain learners.

    Observations are (num_envs, 664): legs, torso and command of the step, then legs and torso of the description.
    Actions are (num_envs, 48).
    """

    unwrapped: BodiesEnv  # of Gymnasium, for which it is any environment

    def __init__(self, env: BodiesEnv):
        """Wrap environments of different bodies."""
        super().__init__(env)
        description = self.unwrapped.description
        self._description = description.legs, description.torso
        self.task = FlatTask(self.unwrapped.tasks[0].name, self.unwrapped.tasks[0].step_limit)
        self.single_observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (self.task.size,), np.float32)
        self.single_action_space = gymnasium.spaces.Box(-1.0, 1.0, (tokens.LEGS * tokens.JOINTS,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

    def reset(self, *, seed=None, options=None):
        """Start episodes; see `BodiesEnv.reset`."""
        observation, info = self.env.reset(seed=seed, options=options)
        return self._vectors(observation), info

    def step(self, actions):
        """Advance by one control step; see `BodiesEnv.step`."""
        actions = np.asarray(actions)
        if actions.shape == self.action_space.shape:
            actions = actions.reshape(self.env.action_space.shape)
        observation, reward, terminated, truncated, info = self.env.step(actions)
        for index in np.flatnonzero(info.get("_final_obs", ())):
            last = {name: array[None] for name, array in info["final_obs"][index].items()}
            info["final_obs"][index] = self._vectors(last, [index])[0]
        return self._vectors(observation), reward, terminated, truncated, info

    @property
    def step_limit(self) -> float:
        """Control steps after which every episode is over, may be infinite."""
        return self.unwrapped.step_limit

    def rest(self, mask) -> None:
        """Let environments stand still; see `BodiesEnv.rest`."""
        self.unwrapped.rest(mask)

    def resampled(self) -> np.ndarray:
        """Return in which environments the latest step began another command; see `BodiesEnv.resampled`."""
        return self.unwrapped.resampled()

    def snapshot(self) -> dict[str, np.ndarray]:
        """Return the state of all environments; see `BodiesEnv.snapshot`.

        With `observation` (num_envs, 664), and `steps` (num_envs,), control steps of the episodes.
        """
        steps = np.array(self.unwrapped._of_each(lambda group: group._steps))
        own = {"observation": self._vectors(self.unwrapped._observed()), "steps": steps}
        return self.unwrapped.snapshot() | own

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on, bit-exact, from a snapshot, whose `steps` may have been changed; see `BodiesEnv.restore`."""
        places, steps = self.unwrapped._places, arrays["steps"]
        own = {f"{number}/steps": steps[place.indices] for number, place in enumerate(places)}
        self.unwrapped.restore({**arrays, **own})

    def _vectors(self, observation: Mapping[str, np.ndarray], indices=slice(None)) -> np.ndarray:
        return tokens.flat(observation, *(part[indices] for part in self._description))
