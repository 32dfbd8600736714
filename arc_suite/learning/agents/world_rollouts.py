"""Rollouts in the worlds of `learning.worlds.mjx`: simulation, policy and transitions stay on JAX's device."""

import functools
from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.learning.agents import architectures, critic_blocks, networks
from arc_suite.learning.agents import proximal_policy as ppo
from arc_suite.learning.agents.collecting import ROLLOUT_ARRAYS, initial_ages, network_views
from arc_suite.learning.agents.hyperparameters import ProximalPolicy
from arc_suite.learning.agents.learner import ENVIRONMENT_PREFIX, Diverged, RunContext
from arc_suite.learning.agents.normalizer import Normalizer
from arc_suite.learning.worlds import mjx

_IMPLEMENTATIONS = {"mjx": "jax", "warp": "warp"}


class WorldRollouts:
    """Worlds that step together, in which a policy acts as in `collecting.EnvironmentRollouts`.

    A world whose episode has ended starts another one in the same step, one of the table of starts.
    """

    def __init__(self, hp: ProximalPolicy, context: RunContext):
        """Begin the first episodes."""
        setup, self._hp = context.training, hp
        impl = _IMPLEMENTATIONS[hp.simulation]
        first = context.first_seed
        options = {"first_seed": first, "num_envs": hp.num_envs, "privileged": bool(hp.critic_blocks)}
        self.env = mjx.load(setup.body, setup.task, setup.task_kwargs, impl, **options)
        self.task = self.env.task
        self.architecture = architectures.of(self.task, hp.network, hp.critic_blocks, hp.symmetry_augmentation)
        self._columns = critic_blocks.privileged_columns(self.task, hp.critic_blocks)
        self._key = jax.random.key(context.seed)
        self._state = jax.jit(jax.vmap(self.env.start))(np.uint32(first) + np.arange(hp.num_envs, dtype=np.uint32))
        self._steps = jnp.asarray(initial_ages(hp.num_envs, self.task.step_limit), int)
        self._act = jax.jit(self._acted)

    def roll_out(self, policy, normalize: Normalizer, std: float, iteration: int, step: int) -> dict[str, jax.Array]:
        """Act in all worlds for a horizon."""
        keys = jax.random.split(jax.random.fold_in(self._key, iteration), self._hp.horizon)
        before = self._state, self._steps
        (self._state, self._steps), rollout = self._act(before, policy, normalize, np.float32(std), keys)
        if not jnp.isfinite(rollout["means"]).all():
            raise Diverged("an action is not finite", step)
        return rollout

    def _acted(self, carry, policy, normalize, std, keys):
        return jax.lax.scan(functools.partial(self._step, policy, normalize, std), carry, keys)

    def _step(self, policy, normalize: Normalizer, std, carry, key):
        """Step all worlds; return what the next step goes on from, and the transitions."""
        state, steps = carry
        drawn, restart = jax.random.split(key)
        seen = self._seen(state)
        mean = ppo.predict_mean_actions(self.architecture, policy, normalize(seen))
        action = mean + std * jax.random.normal(drawn, mean.shape)
        after = jax.vmap(self.env.step)(state, action)
        steps = steps + 1
        time_is_up = steps >= self.task.step_limit
        terminated = (after.done > 0.0) & (after.info["truncation"] == 0.0) & ~time_is_up
        ended = (after.done > 0.0) | time_is_up
        resampled = self.task.resampled(after.info["memory"]) & ~ended
        next_obs = jnp.where(resampled[:, None], seen, self._seen(after))
        values = seen, action, mean, after.reward, terminated, ended | resampled, next_obs
        fresh = jax.vmap(self.env.reset)(jax.random.split(restart, self._hp.num_envs))
        carry = jax.vmap(mjx.restart_where_ended)(after, fresh, ended), jnp.where(ended, 0, steps)
        return carry, dict(zip(ROLLOUT_ARRAYS, values, strict=True))

    def _seen(self, state):
        return network_views(self.architecture, state.obs, state.info.get("privileged"), self._columns)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the state of the worlds, from which simulation goes on."""
        return networks.flatten_tree(ENVIRONMENT_PREFIX.rstrip("/"), self._kept())

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from the arrays of a checkpoint."""
        simulation, others, self._steps = networks.restore_tree(ENVIRONMENT_PREFIX.rstrip("/"), self._kept(), arrays)
        self._state = self._state.replace(data=self._state.data.replace(**simulation), **others)

    def _kept(self):
        state = self._state
        simulation = {name: getattr(state.data, name) for name in mjx.START_FIELDS}
        return simulation, {name: getattr(state, name) for name in ("obs", "info")}, self._steps
