"""Rollouts of a policy in a vector environment."""

import math
from collections.abc import Mapping

import numpy as np
from gymnasium.vector import AutoresetMode

from arc_suite.learning.agents import architectures, critic_blocks, learner, motion_style, networks
from arc_suite.learning.agents import proximal_policy as ppo
from arc_suite.learning.agents.architectures import Architecture
from arc_suite.learning.agents.hyperparameters import ProximalPolicy
from arc_suite.learning.agents.learner import ENVIRONMENT_PREFIX, Diverged, RunContext, generator
from arc_suite.learning.agents.motion_style import MotionStyle, StyleState, pair_poses
from arc_suite.learning.agents.normalizer import Normalizer

# Names of the arrays of a rollout.
ROLLOUT_ARRAYS = ("observations", "actions", "means", "rewards", "terminated", "ended", "next_observations")


class EnvironmentRollouts:
    """Environments in which a policy acts; episodes go on from horizon to horizon.

    Attributes:
        environment: the vector environment.
        task: task of the environments.
        architecture: architecture of the networks.
        observation: (num_envs, ...) before the next step, as networks view it.
        style: the motion whose style the policy learns; None for none.
        style_state: what it has learned; None for none.
    """

    def __init__(self, hp: ProximalPolicy, context: RunContext):
        """Begin the first episodes."""
        self._hp = hp
        self._seed = context.seed
        self._folder = context.folder
        self._has_privileged = bool(hp.critic_blocks)
        self.environment = context.environment(
            hp.num_envs, privileged=self._has_privileged, autoreset_mode=AutoresetMode.DISABLED
        )
        self.task = self.environment.task.definition
        self._columns = critic_blocks.privileged_columns(self.task, hp.critic_blocks)
        self.architecture = architectures.of_environment(
            self.environment, hp.network, hp.critic_blocks, hp.symmetry_augmentation
        )
        self.style: MotionStyle | None = None
        self.style_state: StyleState | None = None
        if hp.style:
            self.style = MotionStyle.of(self.task, hp.style, hp.style_share, both_sides=hp.symmetry_augmentation)
            self.style_state = self.style.begin(generator(context.seed, "discriminator", 0))
        observation, info = self.environment.reset()
        self._poses = self._read_poses(observation)
        self.observation = self._view(observation, info)
        ages = initial_ages(hp.num_envs, self.task.step_limit)
        self.environment.restore(self.environment.snapshot() | {"steps": ages})

    def roll_out(self, policy, normalize: Normalizer, std: float, iteration: int, step: int) -> dict[str, np.ndarray]:
        """Act in all environments for a horizon.

        Args:
            policy: network of normalized observations to mean actions.
            normalize: normalizer of observations.
            std: standard deviation of actions.
            iteration: number of the horizon, which seeds the noise.
            step: environment steps before it.

        Returns:
            Arrays (horizon, num_envs, ...) by the names of `ROLLOUT_ARRAYS`. A step that begins another command counts
            as `ended`, and the observation before it as the next one; see `VectorEnv.resampled`. The latter holds for
            a step that diverges, too, after which the body is in the model's default state. With a style also
            `poses`, the poses before and after each step.

        Raises:
            Diverged: an action is not finite.
        """
        random = generator(self._seed, "noise", iteration)
        names = ROLLOUT_ARRAYS if self.style is None else (*ROLLOUT_ARRAYS, "poses")
        rollout: dict[str, list] = {name: [] for name in names}
        for _ in range(self._hp.horizon):
            means = np.asarray(ppo.predict_mean_actions(self.architecture, policy, normalize(self.observation)))
            if not np.isfinite(means).all():
                raise Diverged("an action is not finite", step, self._folder)
            actions = means + np.float32(std) * random.standard_normal(means.shape, np.float32)
            observation, rewards, terminated, truncated, info = self.environment.step(actions)
            view = self._view(observation, info)
            has_ended = terminated | truncated
            has_new_command = self.environment.resampled()
            keeps_view = has_new_command | info.get("diverged", False)
            next_view = view.copy()
            next_view[keeps_view] = self.observation[keeps_view]
            poses = self._read_poses(observation)
            if self.style is not None:
                rollout["poses"].append(pair_poses(self._poses, poses))

            rollout["observations"].append(self.observation)
            rollout["actions"].append(actions)
            rollout["means"].append(means)
            rollout["rewards"].append(rewards)
            rollout["terminated"].append(terminated)
            rollout["ended"].append(has_ended | has_new_command)
            rollout["next_observations"].append(next_view)
            self.observation = view
            self._poses = poses
            if has_ended.any():
                self._begin_episodes(has_ended)
        return {name: np.stack(arrays) for name, arrays in rollout.items()}

    def _begin_episodes(self, ended: np.ndarray) -> None:
        """Begin episodes in the environments (num_envs,) whose episodes have ended."""
        observation, info = self.environment.reset(options={"reset_mask": ended})
        self.observation[ended] = self._view(observation, info)[ended]
        self._poses = self._read_poses(observation)

    def reward_style(self, rollout: dict[str, np.ndarray], iteration: int) -> dict[str, float]:
        """Add the share of the style to the rewards of a rollout, learn from its poses, and return metrics.

        Args:
            rollout: as `roll_out` returns it; `poses` are taken out.
            iteration: number of the horizon, which seeds the draws.

        Returns:
            `reward`, the mean reward of the task, and with a style also `style`, its mean.
        """
        metrics = {"reward": float(rollout["rewards"].mean())}
        if self.style is not None and self.style_state is not None:
            poses = rollout.pop("poses")
            rollout["rewards"], metrics["style"] = self.style.add_reward(self.style_state, rollout["rewards"], poses)
            random = generator(self._seed, "pairs", iteration)
            self.style_state = self.style.learn(self.style_state, poses, random)
        return metrics

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the state of the environments and of the style as part of a checkpoint."""
        arrays = learner.environment_arrays(self.environment)
        arrays[f"{ENVIRONMENT_PREFIX}seen"] = self.observation
        if self.style is not None:
            arrays[f"{ENVIRONMENT_PREFIX}poses"] = self._poses
            arrays |= motion_style.arrays(self.style_state)
        return arrays

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Restore the state of the environments from the arrays of a checkpoint."""
        learner.restore_environment(self.environment, arrays)
        self.observation = arrays[f"{ENVIRONMENT_PREFIX}seen"]
        if self.style is not None:
            self._poses = arrays[f"{ENVIRONMENT_PREFIX}poses"]
            self.style_state = networks.restore_tree("style", self.style_state, arrays)

    def _read_poses(self, observation: np.ndarray) -> np.ndarray:
        """Return the poses (..., numbers) of observations (..., size) as a style sees them; (0,) without a style."""
        return np.zeros(0) if self.style is None else self.style.poses(self.task, observation)

    def _view(self, observation: np.ndarray, info: Mapping) -> np.ndarray:
        """Return observations (num_envs, ...) as networks view them."""
        privileged = info["privileged"] if self._has_privileged else None
        return network_views(self.architecture, observation, privileged, self._columns)


def initial_ages(num_envs: int, step_limit: float) -> np.ndarray:
    """Return the steps (num_envs,) that environments count as made when learning starts.

    They differ, so time limits fall on different steps. Without a time limit they are 0.
    """
    steps = int(step_limit) if math.isfinite(step_limit) else 0
    return np.arange(num_envs) * steps // num_envs


def network_views(architecture: Architecture, observation, privileged, columns):
    """Return observations as networks view them.

    Args:
        architecture: architecture of the networks.
        observation: (..., size)
        privileged: (..., privileged size) privileged observation; None for none.
        columns: indices of the privileged numbers that networks see.
    """
    if privileged is not None:
        xp = observation.__array_namespace__()
        observation = xp.concatenate([observation, privileged[..., columns]], axis=-1)
    return architecture.view(observation)
