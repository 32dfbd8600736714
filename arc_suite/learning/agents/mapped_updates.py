"""The updates of several runs of soft actor-critic as one program of JAX's device.

The device holds the transitions of all runs, draws their batches, and makes their updates side by side (`jax.vmap`):
those of an environment step, or all up to a check of a phase, in one call. What it draws depends on the seed of a run
and on the number of an update alone, so a run here has the numbers of a run alone, up to rounding.
"""

import functools
from collections.abc import Hashable, Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.learning.agents import networks, off_policy
from arc_suite.learning.agents import soft_actor_critic as sac
from arc_suite.learning.agents.hyperparameters import SoftActorCritic
from arc_suite.learning.agents.inputs import NetworkInputs
from arc_suite.learning.agents.learner import RunContext
from arc_suite.learning.agents.off_policy_run import OffPolicyRun
from arc_suite.learning.agents.replay import Replay, Transitions, follow_steps

_MAX_MEMORY_SHARE = 0.6  # of the device's memory, that tables of transitions in single precision may take


class Table(NamedTuple):
    """Transitions of several replay buffers, by buffer and slot; see `Replay`.

    Attributes:
        steps: single control steps, arrays (buffers, slots, ...).
        is_last: (buffers, slots) whether they are the last of their episodes.
    """

    steps: Transitions
    is_last: Any


class Place(NamedTuple):
    """Where a run has its transitions in a table; () each.

    Attributes:
        buffer: index of the buffer.
        slots: slots of the buffer.
        total: transitions added since the start.
        length: transitions that can be sampled.
    """

    buffer: Any
    slots: Any
    total: Any
    length: Any


class Draws(NamedTuple):
    """What an update draws, of each run.

    Attributes:
        seed: (runs,) seeds of the runs.
        number: (runs,) numbers of the update.
        index_ranges: (runs, sources, 2) see `OffPolicyRun.index_ranges`.
        orders: (runs, sources, places) transitions by place; None if places are indices of transitions.
    """

    seed: Any
    number: Any
    index_ranges: Any
    orders: Any


def program_of(hp: SoftActorCritic, context: RunContext) -> Hashable:
    """Return a value that is equal for runs that can learn in one program: what is compiled, and steps so far."""
    task = context.training.definition
    inputs = NetworkInputs.of(task, hp.normalize, hp.symmetry_augmentation, hp.network)
    joints = len(task.scene.body.joint_names)
    body = (tuple(task.sizes.items()), joints) if inputs.legs is None and inputs.symmetry is None else context.training
    of_updates = sac.update_hyperparameters(hp)
    batches = (hp.prior, hp.batch, hp.n_step, hp.reward_scale, hp.normalize, hp.symmetry_augmentation)
    rhythm = (hp.num_envs, hp.utd_ratio, hp.phase_every, hp.phase_updates, hp.check_every)
    steps_so_far = 0 if context.checkpoint is None else int(context.checkpoint["count"][0])
    return of_updates, batches, rhythm, body, context.steps, steps_so_far


class MappedUpdates:
    """The updates of runs of one program; see `off_policy.Updates`."""

    def __init__(self, runs: Sequence[OffPolicyRun], states: Sequence[sac.SacState], all_sums: Sequence[dict]):
        """Put states and transitions of the runs on the device."""
        hp = runs[0].hp
        buffers = [run.buffer for run in runs]
        different_priors = list({id(run.prior): run.prior for run in runs if run.prior is not None}.values())
        dtype = _observation_dtype([buffers, different_priors])
        self._runs = runs
        self._update_hp = sac.update_hyperparameters(hp)
        self._states = networks.stack_trees(states)
        self._sums = networks.stack_trees(all_sums)
        self._buffer_table = _make_table(buffers, dtype)
        self._prior_table = None
        self._prior_places = None
        if different_priors:
            self._prior_table = _make_table(different_priors, dtype)
            self._prior_places = jnp.asarray(_places([run.prior for run in runs], different_priors))
        self._orders = None
        update = functools.partial(update_runs, hp, runs[0].inputs)
        self._update = jax.jit(update, static_argnums=0, donate_argnums=(1, 2))

    def act(self, observations: Sequence[np.ndarray], noises: Sequence[np.ndarray]) -> np.ndarray:
        """Return actions (num_envs, *joints) of the policy of each run."""
        return np.asarray(_act(self._update_hp, self._states.policy, np.stack(observations), np.stack(noises)))

    def add(self, transitions: Transitions, is_last: np.ndarray) -> None:
        """Store the transitions (runs, num_envs, ...) of a step."""
        slots = np.stack([run.buffer.next_slots_to_add() for run in self._runs])
        rows = np.arange(len(self._runs))[:, None]
        steps = Transitions(*(np.asarray(array, np.float32) for array in transitions))
        self._buffer_table = _write(self._buffer_table, rows, slots, steps, is_last)

    def update(self, run_indices: Sequence[int], count: int, with_policy: bool) -> None:
        """Make a number of updates of the runs with some indices; the others keep their states."""
        buffers = [run.buffer for run in self._runs]
        all_moments = [run.inputs.moments for run in self._runs]
        moments = jax.tree.map(lambda *arrays: np.stack(arrays).astype(np.float32), *all_moments)
        draws = Draws(
            seed=np.array([run.context.seed for run in self._runs]),
            number=np.array([run.updates for run in self._runs]),
            index_ranges=np.stack([run.index_ranges for run in self._runs]),
            orders=self._orders_of_phases() if any(run.has_orders for run in self._runs) else None,
        )
        self._states, self._sums = self._update(
            with_policy,
            self._states,
            self._sums,
            self._buffer_table,
            self._prior_table,
            _places(buffers, buffers),
            self._prior_places,
            moments,
            np.isin(np.arange(len(self._runs)), run_indices),
            draws,
            count,
        )
        for index in run_indices:
            self._runs[index].count_updates(count, with_policy)

    def begin_phase(self, index: int) -> None:
        """Prepare the phase of a run, by its orders."""
        self._orders = None

    def state_of(self, index: int) -> sac.SacState:
        """Return the state of a run."""
        return networks.select_tree(self._states, index)

    def sums_of(self, index: int) -> dict[str, Any]:
        """Return the sums of metrics of a run."""
        return networks.select_tree(self._sums, index)

    def clear_sums(self, index: int) -> None:
        """Set the sums of metrics of a run to 0."""
        self._sums = jax.tree.map(lambda sums: sums.at[index].set(0.0), self._sums)

    def _orders_of_phases(self):
        """Return the orders of all runs' phases on the device, (runs, sources, places); see `Draws`."""
        if self._orders is None:
            sources = len(self._runs[0].sources)
            most = max(len(source) for run in self._runs for source in run.sources)
            orders = np.tile(np.arange(most, dtype=np.int32), (len(self._runs), sources, 1))
            for run_orders, run in zip(orders, self._runs, strict=True):
                for source_order, order in zip(run_orders, run.phase.orders if run.has_orders else (), strict=False):
                    source_order[: len(order)] = order
            self._orders = jnp.asarray(orders)
        return self._orders


def update_runs(
    hp: SoftActorCritic,
    inputs: NetworkInputs,
    with_policy: bool,
    states: sac.SacState,
    sums: dict,
    buffer_table: Table,
    prior_table: Table | None,
    buffer_places,
    prior_places,
    moments,
    is_active,
    draws: Draws,
    count,
):
    """Make updates of several runs; leading axes of `states`, `sums`, `moments` and `is_active` are (runs,).

    Args:
        hp: hyperparameters, equal in what updates depend on.
        inputs: how networks see observations, without the moments.
        with_policy: whether the policy learns too.
        states: before the updates.
        sums: sums of metrics.
        buffer_table: transitions of the runs.
        prior_table: prior data; None for none.
        buffer_places: (runs, 4) fields of the `Place` of each run in the first table.
        prior_places: the same in the second table; None without one.
        moments: moments of the inputs; None for no normalization.
        is_active: whether a run makes the updates.
        draws: what the first update of each run draws.
        count: number of updates.

    Returns:
        States and sums.
    """
    update_hp = sac.update_hyperparameters(hp)

    def update_run(index, state, run_sums, buffer_place, prior_place, run_moments, active, draw):
        run_inputs = inputs._replace(moments=run_moments)
        indices, noise = off_policy.draw_update(
            update_hp, hp.batch, inputs.joints, with_policy, draw.seed, draw.number + index, draw.index_ranges
        )
        if draw.orders is not None:
            indices = jnp.take_along_axis(draw.orders, indices, axis=1)
        sources = _gather(hp, buffer_table, prior_table, buffer_place, prior_place, indices)
        batches = [off_policy.network_batch(hp, run_inputs, transitions) for transitions in sources]
        batch = Transitions(*off_policy.concatenate_sources(batches))
        new_state, metrics = sac.update(update_hp, state, batch, noise)
        new_sums = {name: run_sums[name] + metrics[name] for name in run_sums} if with_policy else run_sums
        return jax.tree.map(lambda new, old: jnp.where(active, new, old), (new_state, new_sums), (state, run_sums))

    def update_all(index, loop):
        update_runs_once = jax.vmap(functools.partial(update_run, index))
        return update_runs_once(*loop, buffer_places, prior_places, moments, is_active, draws)

    return jax.lax.fori_loop(0, count, update_all, (states, sums))


def _gather(hp: SoftActorCritic, buffer_table, prior_table, buffer_place, prior_place, indices) -> list[Transitions]:
    """Return the transitions of an update from each source; see `off_policy_run`."""
    buffer_place = Place(*buffer_place)
    if prior_table is None:
        return [_take(hp, hp.num_envs, buffer_table, buffer_place, indices[0])]
    prior_place = Place(*prior_place)
    if hp.prior == "symmetric_sampling":
        buffer_part = _take(hp, hp.num_envs, buffer_table, buffer_place, indices[0])
        return [buffer_part, _take(hp, 1, prior_table, prior_place, indices[1])]
    is_prior = indices[0] < prior_place.length  # prior data come first
    prior_part = _take(hp, 1, prior_table, prior_place, jnp.where(is_prior, indices[0], 0))
    buffer_indices = jnp.where(is_prior, 0, indices[0] - prior_place.length)
    buffer_part = _take(hp, hp.num_envs, buffer_table, buffer_place, buffer_indices)

    def choose(prior_array, buffer_array):
        mask = is_prior.reshape(-1, *[1] * (prior_array.ndim - 1))
        return jnp.where(mask, prior_array, buffer_array)

    return [jax.tree.map(choose, prior_part, buffer_part)]


def _take(hp: SoftActorCritic, num_envs: int, table: Table, place: Place, indices) -> Transitions:
    """Return transitions by index, as `Replay.transitions_at` does."""

    def rows_of(array):
        return lambda numbers: array[place.buffer, numbers % place.slots]

    steps = table.steps
    first_numbers = place.total - place.length + indices
    last_numbers, rewards, discounts = follow_steps(
        first_numbers, place.total, num_envs, hp.n_step, hp.discount, rows_of(steps.rewards), rows_of(table.is_last)
    )
    return Transitions(
        observations=rows_of(steps.observations)(first_numbers).astype(jnp.float32),
        actions=rows_of(steps.actions)(first_numbers),
        rewards=rewards,
        goes_on=discounts * rows_of(steps.goes_on)(last_numbers),
        next_observations=rows_of(steps.next_observations)(last_numbers).astype(jnp.float32),
    )


def _places(replays: Sequence[Replay], buffers: Sequence[Replay]) -> np.ndarray:
    """Return the fields of the `Place` of each replay in the table of buffers, (replays, 4)."""
    rows = {id(buffer): row for row, buffer in enumerate(buffers)}
    places = [Place(rows[id(replay)], replay.slots, replay.total, len(replay)) for replay in replays]
    return np.array(places, np.int32)


def _make_table(buffers: Sequence[Replay], dtype) -> Table:
    """Return a table of the transitions of buffers, with observations of a dtype."""
    shape = (len(buffers), max(buffer.slots for buffer in buffers))
    size = buffers[0].size
    steps = Transitions(
        observations=jnp.zeros((*shape, size), dtype),
        actions=jnp.zeros((*shape, buffers[0].joints)),
        rewards=jnp.zeros(shape),
        goes_on=jnp.zeros(shape),
        next_observations=jnp.zeros((*shape, size), dtype),
    )
    table = Table(steps, jnp.zeros(shape, bool))
    for row, buffer in enumerate(buffers):
        for part in buffer.parts():
            table = _write(table, row, *part)
    return table


@functools.partial(jax.jit, donate_argnums=0)
def _write(table: Table, rows, slots, steps: Transitions, is_last) -> Table:
    """Return a table with transitions in some slots of some buffers."""
    return jax.tree.map(
        lambda array, values: array.at[rows, slots].set(values.astype(array.dtype)), table, Table(steps, is_last)
    )


def _observation_dtype(tables: Sequence[Sequence[Replay]]):
    """Return the dtype of observations in tables: float32, or float16 where the device has little memory."""
    memory_stats = jax.local_devices()[0].memory_stats() or {}
    if "bytes_limit" not in memory_stats:
        return jnp.float32
    numbers = 0
    for buffers in tables:
        for buffer in buffers:
            numbers += buffer.slots * 2 * buffer.size
    is_large = np.dtype(np.float32).itemsize * numbers > _MAX_MEMORY_SHARE * memory_stats["bytes_limit"]
    return jnp.float16 if is_large else jnp.float32


@functools.partial(jax.jit, static_argnums=0)
def _act(hp: SoftActorCritic, policies, observations, noises):
    """Return actions (runs, num_envs, *joints) of the policies of runs."""
    return jax.vmap(functools.partial(off_policy.policy_actions, hp))(policies, observations, noises)
