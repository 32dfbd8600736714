"""Proximal policy optimization that stays on JAX's device.

A chunk of iterations is one compiled function: rollouts, advantages, updates and the normalizer. Between chunks the
host takes the metrics and a copy of what a checkpoint holds. While it handles them, the device computes the next chunk.
The text of an iteration is that of `on_policy`.

Runs of several seeds are mapped: each has worlds, networks and random numbers of its own, and all step together.
"""

import functools
import math
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh, NamedSharding, PartitionSpec

from arc_suite import usage
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
    for slices in learn_in_step(hp, [context]):
        yield slices[0]


def learn_in_step(hp: ProximalPolicy, contexts: Sequence[RunContext]) -> Iterator[list[Slice]]:
    """Learn in runs that differ in their seeds, as far as each has come; yield the slices of all runs.

    Arrays of checkpoints are on the device.

    Raises:
        ValueError, OSError, Diverged: as `on_policy.learn`.
    """
    first_context = contexts[0]
    for context in contexts:
        on_policy.check(hp, context)
    rollouts = WorldRollouts(hp, contexts)
    task = rollouts.task
    architecture = rollouts.architecture
    symmetry = on_policy.mirror_maps(hp, task, architecture)
    learner_states = []
    for context in contexts:
        learner_state = jax.tree.map(jnp.asarray, on_policy.begin(hp, context, task, architecture))
        if context.checkpoint is not None:
            with learner.restoring():
                learner_state = _restore_state(learner_state, context.checkpoint)
        learner_states.append(learner_state)
    iterations = 0
    if first_context.checkpoint is None:
        worlds = rollouts.begin()
    else:
        with learner.restoring():
            iterations = int(first_context.checkpoint["iterations"])
            worlds = rollouts.restore([context.checkpoint for context in contexts])
    # Donated arrays must not be those of others.
    trainer_state = _spread(hp, _copy(TrainerState(worlds, networks.stack_trees(learner_states))))
    run_chunk = _compile_chunks(hp, rollouts, symmetry, [context.seed for context in contexts])

    def start_chunk(trainer_state):
        columns, learns_policy = _schedule_columns(hp, first_context, chunk)
        return thread.submit(run_chunk, trainer_state, chunk.first, columns, learns_policy)

    with ThreadPoolExecutor(1) as thread:
        chunk = next_chunk(hp, first_context, iterations)
        running_chunk = start_chunk(trainer_state)
        while True:
            trainer_state, table = running_chunk.result()
            finished_chunk = chunk
            usage.count_steps(len(contexts) * (chunk.end - chunk.first) * hp.num_envs * hp.horizon)
            step = chunk.end * hp.num_envs * hp.horizon
            parts = _split_runs(len(contexts), rollouts, trainer_state)
            chunk = next_chunk(hp, first_context, finished_chunk.end)
            if step < first_context.steps:
                running_chunk = start_chunk(trainer_state)
            slices = []
            for index, (checkpoint, normalize, policy) in enumerate(parts):
                columns = {name: np.asarray(column)[:, index] for name, column in table.items()}
                metrics = _summarize(hp, contexts[index], finished_chunk, columns)
                graph = architectures.policy_graph(architecture, *jax.tree.map(np.asarray, (normalize, policy)))
                arrays = {**checkpoint, "iterations": np.array(finished_chunk.end)}
                slices.append(Slice(metrics, graph, arrays))
            yield slices
            if step >= first_context.steps:
                return


def program_of(hp: ProximalPolicy, context: RunContext) -> Hashable:
    """Return a value that is equal for runs that can learn in step: all of a run except its seed."""
    iterations = 0 if context.checkpoint is None else int(context.checkpoint["iterations"])
    return hp, context.setup, context.training, context.steps, context.evaluate_every, iterations


def _compile_chunks(
    hp: ProximalPolicy, rollouts: WorldRollouts, symmetry: Symmetry | None, seeds: list[int]
) -> Callable:
    """Return `run_iterations` as a compiled function of the state, the first iteration, and what follows them."""
    keys = jax.vmap(jax.random.key)(jnp.array(seeds))
    run_chunk = functools.partial(run_iterations, hp, rollouts, symmetry, keys)
    return jax.jit(run_chunk, static_argnums=3, donate_argnums=0)


def _split_runs(count: int, rollouts: WorldRollouts, trainer_state: TrainerState) -> list[tuple]:
    """Return the arrays of a checkpoint, the normalizer and the policy of each run, as copies on the device."""
    learner_state = trainer_state.learner_state
    checkpoint = {**learner_state.arrays(), **rollouts.arrays(trainer_state.worlds)}
    tree = (checkpoint, learner_state.normalize, learner_state.state.policy)
    return [networks.select_tree(tree, index) for index in range(count)]


def _spread(hp: ProximalPolicy, trainer_state: TrainerState) -> TrainerState:
    """Return the state with the worlds of each run divided over all devices, and all else on each of them.

    It stays as it is where Warp simulates, which knows one device, and where the devices do not divide the worlds.
    """
    devices = jax.devices()
    if len(devices) == 1 or hp.simulation == "warp" or hp.num_envs % len(devices):
        return trainer_state
    mesh = Mesh(np.array(devices), ("worlds",))
    worlds = jax.device_put(trainer_state.worlds, NamedSharding(mesh, PartitionSpec(None, "worlds")))
    learner_state = jax.device_put(trainer_state.learner_state, NamedSharding(mesh, PartitionSpec()))
    return TrainerState(worlds, learner_state)


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
    keys,
    trainer_state: TrainerState,
    first,
    columns: Mapping[str, Any],
    learns_policy: bool,
) -> tuple[TrainerState, dict[str, Any]]:
    """Run the iterations of a chunk, of several runs.

    The number of iterations is no constant of the compiled function: chunks of any length have the same results.

    Args:
        hp: hyperparameters.
        rollouts: worlds in which the policy acts.
        symmetry: mirror maps; see `on_policy.batch_of`.
        keys: (runs,) keys of JAX.
        trainer_state: before the chunk, with a leading axis for the runs.
        first: number of the first iteration.
        columns: schedules by name, arrays (CHUNK,) with a value for each iteration, and their number as `count`.
        learns_policy: whether the policy learns.

    Returns:
        The state after the chunk, and metrics by name, arrays (CHUNK, runs).
    """

    def iterate(index, loop):
        trainer_state, table = loop
        schedules = {name: column[index] for name, column in columns.items() if name != "count"}

        def iterate_run(key, trainer_state, starts):
            run_rollouts = rollouts.with_starts(starts)
            iteration_key = jax.random.fold_in(key, first + index)
            return run_iteration(hp, run_rollouts, symmetry, iteration_key, trainer_state, schedules, learns_policy)

        trainer_state, metrics = jax.vmap(iterate_run)(keys, trainer_state, rollouts.starts)
        return trainer_state, {name: column.at[index].set(metrics[name]) for name, column in table.items()}

    table = {name: jnp.zeros((CHUNK, len(keys))) for name in (*_SUMMARIES, _IS_FINITE)}
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


def _summarize(
    hp: ProximalPolicy, context: RunContext, chunk: Chunk, table: Mapping[str, np.ndarray]
) -> dict[str, float]:
    """Return the metrics of a chunk of a run.

    Raises:
        Diverged: an action was not finite.
    """
    count = chunk.end - chunk.first
    columns = {name: column[:count] for name, column in table.items()}
    bad_iterations = chunk.first + np.flatnonzero(columns[_IS_FINITE] == 0.0)
    if bad_iterations.size:
        step = int(bad_iterations[0]) * hp.num_envs * hp.horizon
        raise Diverged("an action is not finite", step, context.folder)
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
