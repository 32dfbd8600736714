"""Rollouts in the worlds of `learning.worlds.mjx`: simulation, policy and transitions stay on JAX's device."""

from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.learning.agents import architectures, critic_blocks, networks
from arc_suite.learning.agents import proximal_policy as ppo
from arc_suite.learning.agents.collecting import initial_ages, network_views
from arc_suite.learning.agents.hyperparameters import ProximalPolicy
from arc_suite.learning.agents.learner import ENVIRONMENT_PREFIX, Diverged, RunContext
from arc_suite.learning.agents.normalizer import Normalizer
from arc_suite.learning.worlds import mjx

_IMPLEMENTATIONS = {"mjx": "jax", "warp": "warp"}  # by the hyperparameter `simulation`


class WorldRollouts:
    """Worlds that step together, in which a policy acts as in `collecting.EnvironmentRollouts`.

    A world whose episode has ended starts another one of the table of starts in the same step.
    """

    def __init__(self, hp: ProximalPolicy, context: RunContext):
        """Begin the first episodes."""
        self._hp = hp
        setup = context.training
        self.env = mjx.load(
            setup.body,
            setup.task,
            setup.task_kwargs,
            impl=_IMPLEMENTATIONS[hp.simulation],
            first_seed=context.first_seed,
            num_envs=hp.num_envs,
            privileged=bool(hp.critic_blocks),
        )
        self.task = self.env.task
        self.architecture = architectures.of(self.task, hp.network, hp.critic_blocks, hp.symmetry_augmentation)
        self._columns = critic_blocks.privileged_columns(self.task, hp.critic_blocks)
        self._key = jax.random.key(context.seed)
        seeds = np.uint32(context.first_seed) + np.arange(hp.num_envs, dtype=np.uint32)
        self._state = jax.jit(jax.vmap(self.env.start))(seeds)
        self._steps = jnp.asarray(initial_ages(hp.num_envs, self.task.step_limit), int)
        self._act = jax.jit(self._scan_steps)

    def roll_out(self, policy, normalize: Normalizer, std: float, iteration: int, step: int) -> dict[str, jax.Array]:
        """Act in all worlds for a horizon; see `collecting.EnvironmentRollouts.roll_out`."""
        keys = jax.random.split(jax.random.fold_in(self._key, iteration), self._hp.horizon)
        worlds = (self._state, self._steps)
        (self._state, self._steps), rollout = self._act(worlds, policy, normalize, np.float32(std), keys)
        if not jnp.isfinite(rollout["means"]).all():
            raise Diverged("an action is not finite", step)
        return rollout

    def _scan_steps(self, worlds, policy, normalize: Normalizer, std, keys):
        """Step all worlds once for each key."""

        def step_worlds(worlds, key):
            return self._step(policy, normalize, std, worlds, key)

        return jax.lax.scan(step_worlds, worlds, keys)

    def _step(self, policy, normalize: Normalizer, std, worlds, key):
        """Step all worlds.

        Args:
            policy: network of normalized observations to mean actions.
            normalize: normalizer of observations.
            std: standard deviation of actions.
            worlds: their state, and the steps (num_envs,) of their episodes.
            key: key of JAX.

        Returns:
            The worlds after the step, in another episode where one has ended, and the transitions.
        """
        state, steps = worlds
        action_key, restart_key = jax.random.split(key)
        view = self._view(state)
        means = ppo.predict_mean_actions(self.architecture, policy, normalize(view))
        actions = means + std * jax.random.normal(action_key, means.shape)
        state_after = jax.vmap(self.env.step)(state, actions)
        steps = steps + 1
        time_is_up = steps >= self.task.step_limit
        terminated = (state_after.done > 0.0) & (state_after.info["truncation"] == 0.0)
        has_ended = (state_after.done > 0.0) | time_is_up
        has_new_command = self.task.resampled(state_after.info["memory"]) & ~has_ended
        transitions = {
            "observations": view,
            "actions": actions,
            "means": means,
            "rewards": state_after.reward,
            "terminated": terminated,
            "ended": has_ended | has_new_command,
            "next_observations": jnp.where(has_new_command[:, None], view, self._view(state_after)),
        }
        first_state = jax.vmap(self.env.reset)(jax.random.split(restart_key, self._hp.num_envs))
        next_state = jax.vmap(mjx.restart_at_ends)(state_after, first_state, has_ended)
        next_steps = jnp.where(has_ended, 0, steps)
        return (next_state, next_steps), transitions

    def _view(self, state: mjx.WorldState):
        """Return observations (num_envs, ...) as networks view them."""
        return network_views(self.architecture, state.obs, state.info.get("privileged"), self._columns)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the state of the worlds as part of a checkpoint."""
        return networks.flatten_tree(ENVIRONMENT_PREFIX.rstrip("/"), self._saved_tree())

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Restore the state of the worlds from the arrays of a checkpoint."""
        tree = networks.restore_tree(ENVIRONMENT_PREFIX.rstrip("/"), self._saved_tree(), arrays)
        simulation, state_fields, self._steps = tree
        self._state = self._state.replace(data=self._state.data.replace(**simulation), **state_fields)

    def _saved_tree(self):
        """Return what a checkpoint holds: fields of the simulation, fields of the state, and steps of the episodes."""
        simulation = {name: getattr(self._state.data, name) for name in mjx.START_FIELDS}
        state_fields = {"obs": self._state.obs, "info": self._state.info}
        return simulation, state_fields, self._steps
