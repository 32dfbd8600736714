"""The environments of several runs of one algorithm: one vector environment for all runs of a setup."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from arc_suite.envs import snapshots
from arc_suite.learning.agents import learner
from arc_suite.learning.agents.learner import RunContext


class EnvironmentStep(NamedTuple):
    """A step of all environments; leading axes (runs, num_envs).

    Attributes:
        observations: (..., size) after the step, of the next episode where one has ended.
        final_observations: (..., size) after the step, of the same episode.
        rewards: (...)
        terminated: (...) whether the return after the step is 0.
        ended: (...) whether the episode has ended.
        diverged: (...) whether the physics has diverged in the step: `final_observations` is of the default state.
    """

    observations: np.ndarray
    final_observations: np.ndarray
    rewards: np.ndarray
    terminated: np.ndarray
    ended: np.ndarray
    diverged: np.ndarray


class RunEnvironments:
    """Environments of runs whose observations and actions have the same sizes.

    Attributes:
        tasks: task of each run.
    """

    def __init__(self, contexts: Sequence[RunContext], num_envs: int):
        """Load the tasks.

        Args:
            contexts: context of each run.
            num_envs: environments of each run.
        """
        self._contexts = contexts
        self._num_envs = num_envs
        runs_of_setup: dict = {}
        for index, context in enumerate(contexts):
            runs_of_setup.setdefault(context.training, []).append(index)
        self._groups = []  # indices of runs, and their vector environment
        self.tasks = [None] * len(contexts)
        for indices in runs_of_setup.values():
            environment = contexts[indices[0]].environment(len(indices) * num_envs)
            self._groups.append((indices, environment))
            for index in indices:
                self.tasks[index] = environment.task.definition

    def begin(self) -> np.ndarray:
        """Begin the first episodes, or restore the checkpoints; return the observations (runs, num_envs, size)."""
        observations = [None] * len(self._contexts)
        for indices, environment in self._groups:
            first_seeds = [self._contexts[index].first_seed for index in indices]
            seeds = [first + number for first in first_seeds for number in range(self._num_envs)]
            group_observations, _ = environment.reset(seed=seeds)
            checkpoints = [self._contexts[index].checkpoint for index in indices]
            if checkpoints[0] is not None:
                with learner.restoring():
                    group_snapshots = [learner.environment_snapshot(checkpoint) for checkpoint in checkpoints]
                    snapshot = snapshots.join_environments(group_snapshots)
                    environment.restore(snapshot)
                    group_observations = snapshot["observation"]
            for index, run_observations in zip(indices, self._split(group_observations), strict=True):
                observations[index] = run_observations
        return np.stack(observations)

    def step(self, actions: np.ndarray) -> EnvironmentStep:
        """Step all environments with actions (runs, num_envs, joints)."""
        steps: list = [None] * len(self._contexts)
        for indices, environment in self._groups:
            group_actions = np.concatenate([actions[index] for index in indices])
            observations, rewards, terminated, truncated, info = environment.step(group_actions)
            ended = terminated | truncated
            final_observations = observations.copy()
            for row in np.flatnonzero(ended):
                final_observations[row] = info["final_obs"][row]
            diverged = info.get("final_info", {}).get("diverged", np.zeros_like(ended))
            group_step = (observations, final_observations, rewards, terminated, ended, diverged)
            for index, *arrays in zip(indices, *map(self._split, group_step), strict=True):
                steps[index] = arrays
        return EnvironmentStep(*(np.stack(arrays) for arrays in zip(*steps, strict=True)))

    def arrays(self) -> list[dict[str, np.ndarray]]:
        """Return the state of each run's environments as part of a checkpoint."""
        all_arrays: list = [None] * len(self._contexts)
        for indices, environment in self._groups:
            snapshot = environment.snapshot()
            for place, index in enumerate(indices):
                rows = range(place * self._num_envs, (place + 1) * self._num_envs)
                all_arrays[index] = learner.name_environment_arrays(snapshots.select_environments(snapshot, rows))
        return all_arrays

    def _split(self, array: np.ndarray) -> np.ndarray:
        """Return an array of all environments of a group with leading axes (runs of the group, num_envs)."""
        return array.reshape(-1, self._num_envs, *array.shape[1:])
