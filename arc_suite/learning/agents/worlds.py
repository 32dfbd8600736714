"""Rollouts in the worlds of `arc_suite.envs.worlds.mjx`: simulation, policy and transitions stay on JAX's device."""

import functools
from collections.abc import Mapping

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.envs.worlds import mjx
from arc_suite.learning.agents import networks
from arc_suite.learning.agents import proximal_policy as ppo
from arc_suite.learning.agents.architectures import Perceptron
from arc_suite.learning.agents.collecting import TRANSITIONS, ages
from arc_suite.learning.agents.hyperparameters import ProximalPolicy
from arc_suite.learning.agents.learner import ENVIRONMENT, Diverged, RunContext
from arc_suite.learning.agents.normaliser import Normalizer

_IMPLEMENTATIONS = {"mjx": "jax", "warp": "warp"}


class Worlds:
    """Worlds that step together, in which a policy acts as in `collecting.Environments`.

    A world whose episode has ended starts another one in the same step, one of the table of starts.
    """

    def __init__(self, hp: ProximalPolicy, context: RunContext):
        """Begin the first episodes."""
        setup, self._hp = context.setup, hp
        impl = _IMPLEMENTATIONS[hp.simulation]
        first = context.first_seed
        self.env = mjx.load(setup.body, setup.task, setup.task_kwargs, impl, first_seed=first, num_envs=hp.num_envs)
        self.task, self.architecture = self.env.task, Perceptron.of(self.env.task)
        self._key = jax.random.key(context.seed)
        self._state = jax.jit(jax.vmap(self.env.start))(np.uint32(first) + np.arange(hp.num_envs, dtype=np.uint32))
        self._steps = jnp.asarray(ages(hp.num_envs, self.task.step_limit), int)
        self._act = jax.jit(self._acted)

    def roll_out(self, policy, normalise: Normalizer, std: float, iteration: int, step: int) -> dict[str, jax.Array]:
        """Act in all worlds for a horizon."""
        keys = jax.random.split(jax.random.fold_in(self._key, iteration), self._hp.horizon)
        carry = self._state, self._steps
        (self._state, self._steps), rollout = self._act(carry, policy, normalise, np.float32(std), keys)
        if not jnp.isfinite(rollout["means"]).all():
            raise Diverged("an action is not finite", step)
        return rollout

    def _acted(self, carry, policy, normalise, std, keys):
        return jax.lax.scan(functools.partial(self._step, policy, normalise, std), carry, keys)

    def _step(self, policy, normalise: Normalizer, std, carry, key):
        """Step all worlds; return what the next step goes on from, and the transitions."""
        state, steps = carry
        noise, restart = jax.random.split(key)
        mean = ppo.mean_action(self.architecture, policy, normalise(state.obs))
        action = mean + std * jax.random.normal(noise, mean.shape)
        after = jax.vmap(self.env.step)(state, action)
        steps = steps + 1
        time_is_up = steps >= self.task.step_limit
        terminated = (after.done > 0.0) & (after.info["truncation"] == 0.0) & ~time_is_up
        ended = (after.done > 0.0) | time_is_up
        resampled = self.task.resampled(after.info["memory"]) & ~ended
        next_obs = jnp.where(resampled[:, None], state.obs, after.obs)
        values = state.obs, action, mean, after.reward, terminated, ended | resampled, next_obs
        fresh = jax.vmap(self.env.reset)(jax.random.split(restart, self._hp.num_envs))
        carry = jax.vmap(mjx.restarted)(after, fresh, ended), jnp.where(ended, 0, steps)
        return carry, dict(zip(TRANSITIONS, values, strict=True))

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the state of the worlds, from which simulation goes on."""
        return networks.named(ENVIRONMENT.rstrip("/"), self._kept())

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from the arrays of a checkpoint."""
        simulation, others, self._steps = networks.restored(ENVIRONMENT.rstrip("/"), self._kept(), arrays)
        self._state = self._state.replace(data=self._state.data.replace(**simulation), **others)

    def _kept(self):
        state = self._state
        simulation = {name: getattr(state.data, name) for name in mjx.WRITTEN}
        return simulation, {name: getattr(state, name) for name in ("obs", "info")}, self._steps
