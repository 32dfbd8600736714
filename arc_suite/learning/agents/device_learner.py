"""Proximal policy optimization that stays on JAX's device.

A chunk of iterations is one compiled function: rollouts, advantages, updates and the normalizer. Between chunks the
host takes the metrics and a copy of what a checkpoint holds. While it handles them, the device computes the next chunk.
The text of an iteration is that of `on_policy`.
"""

import functools
import math
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.learning.agents import architectures, learner, networks, on_policy
from arc_suite.learning.agents import proximal_policy as ppo
from arc_suite.learning.agents.hyperparameters import ProximalPolicy
from arc_suite.learning.agents.learner import Diverged, RunContext, Slice
from arc_suite.learning.agents.normalizer import Normalizer
from arc_suite.learning.agents.on_policy import LearnerState, Schedules
from arc_suite.learning.agents.world_rollouts import WorldRollouts, WorldsState
from arc_suite.tasks.mirrors import Symmetry

CHUNK = 10  # iterations of a chunk, at most

# How the metrics of a chunk follow from those of its iterations.
_SUMMARIES = {
    "reward": np.mean,
    "falls": np.sum,
    "std": lambda column: column[-1],
    "kl": np.mean,
    "policy_rate": lambda column: column[-1],
    "value_loss": np.mean,
}
_IS_FINITE = "is_finite"  # name of the column that tells whether all actions of an iteration were finite


class TrainerState(NamedTuple):
    """What a chunk changes.

    Attributes:
        worlds: state of the worlds.
        learner_state: networks and normalizer.
    """

    worlds: WorldsState
    learner_state: LearnerState


class Chunk(NamedTuple):
    """Successive iterations.

    Attributes:
        first: number of the first one.
        end: number of the one after the last.
    """

    first: int
    end: int


def learn(hp: ProximalPolicy, context: RunContext) -> Iterator[Slice]:
    """Learn; see `on_policy.learn`.

    Arrays of checkpoints are on the device.
    """
    on_policy.check(hp, context)
    rollouts = WorldRollouts(hp, context)
    task = rollouts.task
    architecture = rollouts.architecture
    symmetry = on_policy.mirror_maps(hp, task, architecture)
    learner_state = jax.tree.map(jnp.asarray, on_policy.begin(hp, context, task, architecture))
    iterations = 0
    saved = context.checkpoint
    if saved is None:
        worlds = rollouts.begin()
    else:
        with learner.restoring():
            learner_state = _restore_state(learner_state, saved)
            iterations = int(saved["iterations"])
            worlds = rollouts.restore(saved)
    trainer_state = _copy(TrainerState(worlds, learner_state))  # donated arrays must not be those of others
    run_chunk = _compile_chunks(hp, rollouts, symmetry, context.seed)

    def start_chunk(trainer_state):
        columns, learns_policy = _schedule_columns(hp, context, chunk)
        return thread.submit(run_chunk, trainer_state, chunk.first, columns, learns_policy)

    with ThreadPoolExecutor(1) as thread:
        chunk = next_chunk(hp, context, iterations)
        running_chunk = start_chunk(trainer_state)
        while True:
            trainer_state, table = running_chunk.result()
            finished_chunk = chunk
            step = chunk.end * hp.num_envs * hp.horizon
            checkpoint = _copy({**trainer_state.learner_state.arrays(), **rollouts.arrays(trainer_state.worlds)})
            normalize, policy = _copy((trainer_state.learner_state.normalize, trainer_state.learner_state.state.policy))
            chunk = next_chunk(hp, context, finished_chunk.end)
            if step < context.steps:
                running_chunk = start_chunk(trainer_state)
            metrics = _summarize(hp, finished_chunk, table)
            graph = architectures.policy_graph(architecture, *jax.tree.map(np.asarray, (normalize, policy)))
            yield Slice(step, metrics, graph, {**checkpoint, "iterations": np.array(finished_chunk.end)})
            if step >= context.steps:
                return


def _compile_chunks(hp: ProximalPolicy, rollouts: WorldRollouts, symmetry: Symmetry | None, seed: int) -> Callable:
    """Return `run_iterations` as a compiled function of the state, the first iteration, and what follows them."""
    run_chunk = functools.partial(run_iterations, hp, rollouts, symmetry, jax.random.key(seed))
    return jax.jit(run_chunk, static_argnums=3, donate_argnums=0)


def next_chunk(hp: ProximalPolicy, context: RunContext, first: int) -> Chunk:
    """Return the chunk that begins with an iteration.

    It ends where an evaluation is due, and where the policy begins to learn, so that chunks of a run that resumes are
    those of the run that was never stopped.
    """
    steps_of_iteration = hp.num_envs * hp.horizon
    evaluation_step = context.next_evaluation(first * steps_of_iteration)
    warm_up_end = math.ceil(hp.value_warm_up / hp.horizon)
    end = min(first + CHUNK, math.ceil(evaluation_step / steps_of_iteration))
    if first < warm_up_end:
        end = min(end, warm_up_end)
    return Chunk(first, end)


def run_iterations(
    hp: ProximalPolicy,
    rollouts: WorldRollouts,
    symmetry: Symmetry | None,
    key,
    trainer_state: TrainerState,
    first,
    columns: Mapping[str, Any],
    learns_policy: bool,
) -> tuple[TrainerState, dict[str, Any]]:
    """Run the iterations of a chunk.

    The number of iterations is no constant of the compiled function: chunks of any length have the same results.

    Args:
        hp: hyperparameters.
        rollouts: worlds in which the policy acts.
        symmetry: mirror maps; see `on_policy.batch_of`.
        key: key of JAX of the run.
        trainer_state: before the chunk.
        first: number of the first iteration.
        columns: schedules by name, arrays (CHUNK,) with a value for each iteration, and their number as `count`.
        learns_policy: whether the policy learns.

    Returns:
        The state after the chunk, and metrics by name, arrays (CHUNK,).
    """

    def iterate(index, loop):
        trainer_state, table = loop
        schedules = {name: column[index] for name, column in columns.items() if name != "count"}
        iteration_key = jax.random.fold_in(key, first + index)
        trainer_state, metrics = run_iteration(
            hp, rollouts, symmetry, iteration_key, trainer_state, schedules, learns_policy
        )
        return trainer_state, {name: column.at[index].set(metrics[name]) for name, column in table.items()}

    table = {name: jnp.zeros(CHUNK) for name in (*_SUMMARIES, _IS_FINITE)}
    return jax.lax.fori_loop(0, columns["count"], iterate, (trainer_state, table))


def run_iteration(
    hp: ProximalPolicy,
    rollouts: WorldRollouts,
    symmetry: Symmetry | None,
    key,
    trainer_state: TrainerState,
    schedules: Mapping[str, Any],
    learns_policy: bool,
) -> tuple[TrainerState, dict[str, Any]]:
    """Act for a horizon and learn from it; return the state and metrics by name. See `run_iterations`."""
    architecture = rollouts.architecture
    state, moments, normalize = trainer_state.learner_state
    action_key, order_key = jax.random.split(key)
    std = schedules["std"]

    worlds, rollout = rollouts.roll_out(trainer_state.worlds, state.policy, normalize, std, action_key)

    batch = on_policy.batch_of(hp, architecture, rollout, state.values, normalize, symmetry)
    orders = _draw_orders(hp, order_key, len(batch.returns))
    numbers = (std, schedules["desired_kl"])
    state, kl, value_loss = ppo.update(hp, architecture, state, batch, orders, numbers, learns_policy)

    if not hp.start:
        new_moments = on_policy.update_moments(architecture, symmetry, moments, rollout["observations"])
        moments = jax.tree.map(
            lambda new, old: jnp.where(schedules["updates_normalizer"], new, old), new_moments, moments
        )
        normalize = architecture.normalize(moments)

    metrics = {
        "reward": rollout["rewards"].mean(),
        "falls": rollout["terminated"].sum(),
        "std": std,
        "kl": kl,
        "policy_rate": state.rate,
        "value_loss": value_loss,
        _IS_FINITE: jnp.isfinite(rollout["means"]).all(),
    }
    return TrainerState(worlds, LearnerState(state, moments, normalize)), metrics


def _draw_orders(hp: ProximalPolicy, key, count: int):
    """Draw the indices (updates, minibatch) of transitions, as `on_policy` does, by a key of JAX."""
    keys = jax.random.split(key, hp.epochs)
    permutations = jax.vmap(lambda epoch_key: jax.random.permutation(epoch_key, count))(keys)
    transitions_of_epoch = count // hp.minibatch * hp.minibatch  # in complete minibatches
    return permutations[:, :transitions_of_epoch].reshape(-1, hp.minibatch)


def _schedule_columns(hp: ProximalPolicy, context: RunContext, chunk: Chunk) -> tuple[dict[str, np.ndarray], bool]:
    """Return the schedules of a chunk's iterations, see `run_iterations`, and whether the policy learns in it."""
    schedules = [Schedules.of(hp, context.steps, iteration) for iteration in range(chunk.first, chunk.first + CHUNK)]
    columns = {
        "std": np.array([schedule.std for schedule in schedules], np.float32),
        "desired_kl": np.array([schedule.desired_kl for schedule in schedules], np.float32),
        "updates_normalizer": np.array([schedule.updates_normalizer for schedule in schedules]),
        "count": np.int32(chunk.end - chunk.first),
    }
    return columns, schedules[0].learns_policy


def _summarize(hp: ProximalPolicy, chunk: Chunk, table: Mapping[str, Any]) -> dict[str, float]:
    """Return the metrics of a chunk.

    Raises:
        Diverged: an action was not finite.
    """
    count = chunk.end - chunk.first
    columns = {name: np.asarray(column)[:count] for name, column in table.items()}
    bad_iterations = chunk.first + np.flatnonzero(columns[_IS_FINITE] == 0.0)
    if bad_iterations.size:
        raise Diverged("an action is not finite", int(bad_iterations[0]) * hp.num_envs * hp.horizon)
    return {name: float(summarize(columns[name])) for name, summarize in _SUMMARIES.items()}


def _restore_state(learner_state: LearnerState, saved: Mapping[str, np.ndarray]) -> LearnerState:
    """Return the state of a checkpoint, whose form is that of `learner_state`."""
    return LearnerState(
        networks.restore_tree("state", learner_state.state, saved),
        networks.restore_tree("moments", learner_state.moments, saved),
        Normalizer(*networks.restore_tree("normalizer", tuple(learner_state.normalize), saved)),
    )


def _copy(tree):
    """Return a pytree whose arrays are copies on the device."""
    return jax.tree.map(lambda array: jnp.array(array, copy=True), tree)
