"""Rollouts of a policy in a vector environment."""

import math
from collections.abc import Mapping

import numpy as np

from arc_suite.learning.agents import architectures, critic_blocks, learner
from arc_suite.learning.agents import proximal_policy as ppo
from arc_suite.learning.agents.architectures import Architecture
from arc_suite.learning.agents.hyperparameters import ProximalPolicy
from arc_suite.learning.agents.learner import ENVIRONMENT_PREFIX, Diverged, RunContext, generator
from arc_suite.learning.agents.normalizer import Normalizer

# Names of the arrays of a rollout.
ROLLOUT_ARRAYS = ("observations", "actions", "means", "rewards", "terminated", "ended", "next_observations")


def initial_ages(num_envs: int, step_limit: float) -> np.ndarray:
    """Return the control steps (num_envs,) that environments count as taken at the start of learning."""
    return np.arange(num_envs) * (int(step_limit) if math.isfinite(step_limit) else 0) // num_envs


def network_views(architecture: Architecture, observation, privileged, columns):
    """Return observations (..., size) as networks view them, with columns of privileged ones, None for none."""
    if privileged is not None:
        numpy = observation.__array_namespace__()
        observation = numpy.concatenate([observation, privileged[..., columns]], axis=-1)
    return architecture.viewed(observation)


class EnvironmentRollouts:
    """Environments in which a policy acts; they go on from horizon to horizon.

    Attributes:
        environment: the vector environment.
        task: of the environments.
        architecture: of networks for it.
        observation: (num_envs, ...) before the next step, as networks view it.
    """

    def __init__(self, hp: ProximalPolicy, context: RunContext):
        """Begin the first episodes."""
        self._hp, self._seed, self._names = hp, context.seed, hp.critic_blocks
        self.environment = context.environment(hp.num_envs, privileged=bool(self._names))
        self.task = self.environment.task.definition
        self._columns = critic_blocks.privileged_columns(self.task, self._names)
        self.architecture = architectures.of_environment(
            self.environment, hp.network, self._names, hp.symmetry_augmentation
        )
        self.observation = self._seen(*self.environment.reset())
        steps = initial_ages(hp.num_envs, self.task.step_limit)
        self.environment.restore(self.environment.snapshot() | {"steps": steps})

    def roll_out(self, policy, normalize: Normalizer, std: float, iteration: int, step: int) -> dict[str, np.ndarray]:
        """Act in all environments for a horizon.

        Args:
            policy: network of normalized observations to mean actions.
            normalize: what normalizes observations.
            std: standard deviation of actions.
            iteration: number of the horizon, from which the noise follows.
            step: environment steps before it.

        Returns:
            Arrays (horizon, num_envs, ...) by the names of `TRANSITIONS`. A step that begins another command counts as
            `ended`, and the observation before it as the next one; see `VectorEnv.resampled`.

        Raises:
            Diverged: an action is not finite.
        """
        random = generator(self._seed, "noise", iteration)
        rollout = {name: [] for name in ROLLOUT_ARRAYS}
        for _ in range(self._hp.horizon):
            normalized = normalize(self.observation)
            mean = np.asarray(ppo.predict_mean_actions(self.architecture, policy, normalized))
            if not np.isfinite(mean).all():
                raise Diverged("an action is not finite", step)
            action = mean + np.float32(std) * random.standard_normal(mean.shape, np.float32)
            observation, rewards, terminated, truncated, info = self.environment.step(action)
            after = self._seen(observation, info)
            ended, resampled = terminated | truncated, self.environment.resampled()
            next_observation = after.copy()
            next_observation[resampled] = self.observation[resampled]
            for index in np.flatnonzero(ended):
                next_observation[index] = self._seen(info["final_obs"][index], info["final_info"], index)
            ended = ended | resampled
            values = self.observation, action, mean, rewards, terminated, ended, next_observation
            for array, value in zip(rollout.values(), values, strict=True):
                array.append(value)
            self.observation = after
        return {name: np.stack(arrays) for name, arrays in rollout.items()}

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the state of the environments as part of a checkpoint."""
        return learner.environment_arrays(self.environment) | {f"{ENVIRONMENT_PREFIX}seen": self.observation}

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from the arrays of a checkpoint."""
        learner.restore_environment(self.environment, arrays)
        self.observation = arrays[f"{ENVIRONMENT_PREFIX}seen"]

    def _seen(self, observation: np.ndarray, info: Mapping, place: int | slice = slice(None)) -> np.ndarray:
        more = info["privileged"][place] if self._names else None
        return network_views(self.architecture, observation, more, self._columns)
