"""Rollouts in the worlds of `learning.worlds.mjx`: simulation, policy and transitions stay on JAX's device."""

import copy
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.learning.agents import architectures, critic_blocks, networks
from arc_suite.learning.agents import proximal_policy as ppo
from arc_suite.learning.agents.collecting import initial_ages, network_views
from arc_suite.learning.agents.hyperparameters import ProximalPolicy
from arc_suite.learning.agents.learner import ENVIRONMENT_PREFIX, RunContext
from arc_suite.learning.agents.normalizer import Normalizer
from arc_suite.learning.worlds import mjx
from arc_suite.learning.worlds.starts import Starts

_IMPLEMENTATIONS = {"mjx": "jax", "warp": "warp"}  # by the hyperparameter `simulation`


class WorldsState(NamedTuple):
    """The state of all worlds of a run, or with a leading axis of several runs.

    Attributes:
        state: state of the worlds, with a leading axis (num_envs,).
        steps: (num_envs,) control steps of their episodes.
    """

    state: mjx.WorldState
    steps: Any


class WorldRollouts:
    """Worlds that step together, in which a policy acts as in `collecting.EnvironmentRollouts`.

    A world whose episode has ended starts another one of the table of starts in the same step. Methods are pure: the
    state of the worlds is a value.

    Attributes:
        env: the task as functions of JAX.
        starts: tables of starts of the runs, with a leading axis.
        task: the task.
        architecture: architecture of the networks.
    """

    def __init__(self, hp: ProximalPolicy, contexts: Sequence[RunContext]):
        """Load the task of runs that differ in their seeds."""
        self._hp = hp
        setup = contexts[0].training
        self.env = mjx.load(
            setup.body,
            setup.task,
            setup.task_kwargs,
            impl=_IMPLEMENTATIONS[hp.simulation],
            first_seed=contexts[0].first_seed,
            num_envs=hp.num_envs * len(contexts),
            privileged=bool(hp.critic_blocks),
        )
        self.starts = networks.stack_trees([self.env.draw_starts(context.first_seed) for context in contexts])
        self.task = self.env.task
        self.architecture = architectures.of(self.task, hp.network, hp.critic_blocks, hp.symmetry_augmentation)
        self._columns = critic_blocks.privileged_columns(self.task, hp.critic_blocks)

    def with_starts(self, starts: Starts) -> Self:
        """Return the worlds of a run, whose episodes start from its table."""
        rollouts = copy.copy(self)
        rollouts.env = self.env.with_starts(starts)
        return rollouts

    def begin(self) -> WorldsState:
        """Return the worlds of all runs at the start of their first episodes."""
        ages = jnp.asarray(initial_ages(self._hp.num_envs, self.task.step_limit), int)

        def begin_run(starts):
            state = jax.vmap(self.env.with_starts(starts).start_of)(jnp.arange(self._hp.num_envs))
            return WorldsState(state, ages)

        return jax.jit(jax.vmap(begin_run))(self.starts)

    def roll_out(
        self, worlds: WorldsState, policy, normalize: Normalizer, std, key
    ) -> tuple[WorldsState, dict[str, jax.Array]]:
        """Act in all worlds of a run for a horizon.

        Args:
            worlds: before the horizon.
            policy: network of normalized observations to mean actions.
            normalize: normalizer of observations.
            std: standard deviation of actions.
            key: key of JAX, for noise and for the starts of episodes.

        Returns:
            The worlds after the horizon, and arrays as of `collecting.EnvironmentRollouts.roll_out`.
        """

        def step_worlds(worlds, key):
            return self._step(policy, normalize, std, worlds, key)

        return jax.lax.scan(step_worlds, worlds, jax.random.split(key, self._hp.horizon))

    def _step(self, policy, normalize: Normalizer, std, worlds: WorldsState, key):
        """Step all worlds, and return them, in another episode where one has ended, and the transitions."""
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
        # The observation after a step that diverges is 0.
        keeps_view = has_new_command | (state_after.metrics["diverged"] > 0.0)
        transitions = {
            "observations": view,
            "actions": actions,
            "means": means,
            "rewards": state_after.reward,
            "terminated": terminated,
            "ended": has_ended | has_new_command,
            "next_observations": jnp.where(keeps_view[:, None], view, self._view(state_after)),
        }
        first_state = jax.vmap(self.env.reset)(jax.random.split(restart_key, self._hp.num_envs))
        next_state = jax.vmap(mjx.restart_at_ends)(state_after, first_state, has_ended)
        next_steps = jnp.where(has_ended, 0, steps)
        return WorldsState(next_state, next_steps), transitions

    def _view(self, state: mjx.WorldState):
        """Return observations (num_envs, ...) as networks view them."""
        return network_views(self.architecture, state.obs, state.info.get("privileged"), self._columns)

    def arrays(self, worlds: WorldsState) -> dict[str, jax.Array]:
        """Return the state of worlds as part of a checkpoint."""
        return networks.name_leaves({ENVIRONMENT_PREFIX.rstrip("/"): _saved_tree(worlds)})

    def restore(self, checkpoints: Sequence[Mapping[str, np.ndarray]]) -> WorldsState:
        """Return the worlds of all runs whose states the arrays of checkpoints hold."""
        worlds = self.begin()
        saved_tree = _saved_tree(worlds)
        trees = []
        for index, arrays in enumerate(checkpoints):
            template = networks.select_tree(saved_tree, index)
            trees.append(networks.restore_tree(ENVIRONMENT_PREFIX.rstrip("/"), template, arrays))
        simulation, state_fields, steps = networks.stack_trees(trees)
        data = worlds.state.data.replace(**simulation)
        return WorldsState(worlds.state.replace(data=data, **state_fields), steps)


def _saved_tree(worlds: WorldsState):
    """Return what a checkpoint holds: fields of the simulation, fields of the state, and steps of the episodes."""
    simulation = {name: getattr(worlds.state.data, name) for name in mjx.START_FIELDS}
    state_fields = {"obs": worlds.state.obs, "info": worlds.state.info}
    return simulation, state_fields, worlds.steps
