"""Soft actor-critic from a replay buffer: the algorithms of the ARC-RL paper, which differ in hyperparameters alone.

A step of all environments acts, stores the transitions and makes `utd_ratio` updates for each of them. The last
update of an environment step moves the policy too. Where updates are rarer than steps, each of them does.

Stabilization phases follow every `phase_every`-th step: updates of the critics alone, on the buffer as it stands. With
early stopping a phase holds out a share of the buffer and ends by the loss on it.

Several runs may learn in step, with the updates of all of them in one program of a device: `mapped_updates`.
"""

import functools
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Protocol

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.learning.agents import learner, networks, priors
from arc_suite.learning.agents import soft_actor_critic as sac
from arc_suite.learning.agents.hyperparameters import SoftActorCritic
from arc_suite.learning.agents.learner import RunContext, Slice, generator
from arc_suite.learning.agents.off_policy_run import OffPolicyRun
from arc_suite.learning.agents.replay import Replay, Transitions
from arc_suite.learning.agents.run_environments import RunEnvironments
from arc_suite.learning.agents.stopping import Patience
from arc_suite.tasks import Task

METRICS = ("policy_loss", "critic_loss", "q", "entropy", "alpha")
CRITIC_METRICS = ("critic_loss", "q")

_OBSERVATIONS_PER_CALL = 4096  # of the policy


def learn(hp: SoftActorCritic, context: RunContext) -> Iterator[Slice]:
    """Learn; see `arc_suite.learning.agents`.

    Raises:
        ValueError: prior data are missing, not taken by the algorithm, or do not fit.
        OSError: the disk is too small for the buffer.
        Diverged: an action is not finite.
    """
    all_slices = learn_in_step([hp], [context], HostUpdates)
    for slices in all_slices:
        yield slices[0]


class Updates(Protocol):
    """The networks of runs, and their updates.

    Runs are named by their indices. `HostUpdates` serves a single run, so it needs no indices, and it reads the
    transitions from the run's buffer. `mapped_updates.MappedUpdates` serves several runs.
    """

    def act(self, observations: Sequence[np.ndarray], noises: Sequence[np.ndarray]) -> Iterable[np.ndarray]:
        """Return actions (num_envs, *joints) of the policy of each run."""
        ...

    def add(self, transitions: Transitions, is_last: np.ndarray) -> None:
        """Store the transitions (runs, num_envs, ...) of a step."""
        ...

    def update(self, run_indices: Sequence[int], count: int, with_policy: bool) -> None:
        """Make a number of updates of some runs; `with_policy` says whether the policies learn too."""
        ...

    def begin_phase(self, index: int) -> None:
        """Prepare the updates of a phase that a run begins."""
        ...

    def state_of(self, index: int) -> sac.SacState:
        """Return the state of a run."""
        ...

    def sums_of(self, index: int) -> dict[str, Any]:
        """Return the sums of metrics of a run."""
        ...

    def clear_sums(self, index: int) -> None:
        """Set the sums of metrics of a run to 0."""
        ...


def learn_in_step(
    all_hp: Sequence[SoftActorCritic], contexts: Sequence[RunContext], updates_class: Callable[..., Updates]
) -> Iterator[list[Slice | None]]:
    """Learn in several runs, whose environments step at the same times.

    Args:
        all_hp: hyperparameters of each run.
        contexts: context of each run.
        updates_class: `HostUpdates` for a single run, or `mapped_updates.MappedUpdates`.

    Yields:
        The slices of all runs; None for a run without one.

    Raises:
        ValueError, OSError, Diverged: as `learn`.
    """
    hp = all_hp[0]
    for run_hp, context in zip(all_hp, contexts, strict=True):
        priors.check_prior(context.prior, run_hp.prior != "none")
    environments = RunEnvironments(contexts, hp.num_envs)
    runs, states, all_sums = _begin_runs(all_hp, contexts, environments.tasks)
    observations = environments.begin()
    updates = updates_class(runs, states, all_sums)
    for index, run in enumerate(runs):
        if run.phase is not None:
            updates.begin_phase(index)

    while True:
        indices_in_phase = [index for index, run in enumerate(runs) if run.phase is not None]
        if indices_in_phase:
            due_indices = _advance_phases(runs, updates, indices_in_phase)
        else:
            observations = _step(runs, updates, environments, observations)
            for count, with_policy in hp.update_groups():
                updates.update(range(len(runs)), count, with_policy)
            _begin_due_phases(runs, updates)
            due_indices = [index for index, run in enumerate(runs) if run.is_slice_due]
        if due_indices:
            yield _make_slices(runs, updates, due_indices, environments.arrays())


def _begin_runs(
    all_hp: Sequence[SoftActorCritic], contexts: Sequence[RunContext], tasks: Sequence[Task]
) -> tuple[list[OffPolicyRun], list[sac.SacState], list[dict]]:
    """Return all runs, their states, and their sums of metrics, as new or as their checkpoints have them.

    Runs with the same prior data share them.
    """
    runs = []
    states = []
    all_sums = []
    open_priors: dict[str | None, Replay | None] = {None: None}  # by the id of the dataset
    for hp, context, task in zip(all_hp, contexts, tasks, strict=True):
        if context.prior not in open_priors:
            open_priors[context.prior] = priors.open_replay(context, task)
        run = OffPolicyRun(hp, context, task, open_priors[context.prior])
        random = generator(context.seed, "networks", 0)
        state = sac.begin(hp, random, run.inputs.size, run.inputs.joints[-1])
        sums = zero_sums(METRICS)  # since the latest line of metrics
        if context.checkpoint is not None:
            with learner.restoring():
                state = networks.restore_tree("state", state, context.checkpoint)
                sums = networks.restore_tree("sums", sums, context.checkpoint)
                run.restore(context.checkpoint)
        runs.append(run)
        states.append(state)
        all_sums.append(sums)
    return runs, states, all_sums


def _step(
    runs: Sequence[OffPolicyRun], updates: Updates, environments: RunEnvironments, observations: np.ndarray
) -> np.ndarray:
    """Act in the environments of all runs, store the transitions, and return the next observations.

    Observations are (runs, num_envs, size).
    """
    for run, run_observations in zip(runs, observations, strict=True):
        run.inputs = run.inputs.with_observations(run_observations)
    if all(run.acts_at_random for run in runs):
        actions = [run.draw_actions() for run in runs]
    else:
        network_inputs = [run.inputs(observations[index]) for index, run in enumerate(runs)]
        network_actions = updates.act(network_inputs, [run.draw_action_noise() for run in runs])
        actions = []
        for run, policy_actions in zip(runs, network_actions, strict=True):
            actions.append(run.draw_actions() if run.acts_at_random else run.inputs.body_actions(policy_actions))
    for run, run_actions in zip(runs, actions, strict=True):
        run.check_actions(run_actions)
    step = environments.step(np.stack(actions))
    # A divergence is a fault of the simulator, and no way into the model's default state.
    keeps_observation = step.diverged[..., None]
    transitions = Transitions(
        observations=observations,
        actions=np.stack(actions),
        rewards=step.rewards,
        goes_on=~step.terminated,
        next_observations=np.where(keeps_observation, observations, step.final_observations),
    )
    updates.add(transitions, step.ended)
    for index, run in enumerate(runs):
        run.add(Transitions(*(array[index] for array in transitions)), step.ended[index])
    return step.observations


def _begin_due_phases(runs: Sequence[OffPolicyRun], updates: Updates) -> None:
    """Begin the phases that follow the latest step; early stopping compares with the loss before the phase."""
    for index, run in enumerate(runs):
        if run.begin_phase_if_due():
            updates.begin_phase(index)
            loss = _loss_of_phase(run, updates.state_of(index))
            if loss is not None:
                run.phase = run.phase._replace(patience=Patience(loss))


def _advance_phases(runs: Sequence[OffPolicyRun], updates: Updates, indices_in_phase: Sequence[int]) -> list[int]:
    """Update critics alone up to the next check of the validation loss; return the indices of the runs that did so.

    These are the runs whose phases have come least far.
    """
    hp = runs[0].hp
    fewest_updates = min(runs[index].phase.updates for index in indices_in_phase)
    indices = [index for index in indices_in_phase if runs[index].phase.updates == fewest_updates]
    updates_to_check = min(hp.check_every, hp.phase_updates - fewest_updates)
    updates.update(indices, updates_to_check, with_policy=False)
    for index in indices:
        run = runs[index]
        run.advance_phase(updates_to_check, _loss_of_phase(run, updates.state_of(index)))
    return indices


def _loss_of_phase(run: OffPolicyRun, state: sac.SacState) -> float | None:
    """Return the loss on the validation set of the phase of a run; None without early stopping, which needs none."""
    if run.phase.held_out == 0:
        return None
    return validation_loss(run.hp, run.context.seed, run.updates, state, run.sources, run.inputs, run.phase)


def _make_slices(
    runs: Sequence[OffPolicyRun],
    updates: Updates,
    due_indices: Sequence[int],
    environment_arrays: Sequence[Mapping[str, np.ndarray]],
) -> list[Slice | None]:
    """Return the slices of all runs; None where none is due.

    A line of metrics that is due waits for the end of the phase.
    """
    slices: list[Slice | None] = [None] * len(runs)
    for index in due_indices:
        run = runs[index]
        metrics = None
        if run.is_line_due and run.phase is None:
            metrics = run.end_line(updates.sums_of(index))
            updates.clear_sums(index)
        sums = updates.sums_of(index)
        slices[index] = run.make_slice(metrics, sums, updates.state_of(index), environment_arrays[index])
    return slices


class HostUpdates:
    """The updates of a single run, whose batches are gathered on the host; see `Updates`."""

    def __init__(self, runs: Sequence[OffPolicyRun], states: Sequence[sac.SacState], all_sums: Sequence[dict]):
        """Begin with the state and the sums of metrics of the run."""
        (self._run,) = runs
        (self._state,) = states
        (self._sums,) = all_sums
        self._update_hp = sac.update_hyperparameters(self._run.hp)

    def act(self, observations: Sequence[np.ndarray], noises: Sequence[np.ndarray]) -> list[np.ndarray]:
        """Return actions (num_envs, *joints) of the policy, as those of the only run."""
        return [np.asarray(policy_actions(self._update_hp, self._state.policy, observations[0], noises[0]))]

    def add(self, transitions: Transitions, is_last: np.ndarray) -> None:
        """Do nothing: the run has the transitions in its buffer."""

    def update(self, run_indices: Sequence[int], count: int, with_policy: bool) -> None:
        """Make a number of updates."""
        run = self._run
        # Lines of metrics are means over updates of the policy: sums of updates without it are dropped.
        sums = self._sums if with_policy else zero_sums(CRITIC_METRICS)
        for _ in range(count):
            indices, noise = _draw_update(
                self._update_hp,
                run.hp.batch,
                run.inputs.joints,
                with_policy,
                run.context.seed,
                run.updates,
                run.index_ranges,
            )
            batch, next_actions = gather_update(run, np.asarray(indices))
            self._state, sums = make_update(self._update_hp, self._state, sums, batch, noise, next_actions)
            run.count_updates(1, with_policy)
        if with_policy:
            self._sums = sums

    def begin_phase(self, index: int) -> None:
        """Cache the policy's distributions at next observations, for the updates of a phase.

        There is no cache where transitions are mirrored or of several steps: their next observations are not those of
        the sources.
        """
        run = self._run
        if run.hp.n_step == 1 and run.inputs.symmetry is None:
            distributions = [
                _next_distributions(self._update_hp, self._state.policy, source, run.inputs) for source in run.sources
            ]
            run.phase = run.phase._replace(next_actions=distributions)

    def state_of(self, index: int) -> sac.SacState:
        """Return the state."""
        return self._state

    def sums_of(self, index: int) -> dict[str, Any]:
        """Return the sums of metrics."""
        return self._sums

    def clear_sums(self, index: int) -> None:
        """Set the sums of metrics to 0."""
        self._sums = zero_sums(METRICS)


@functools.partial(jax.jit, static_argnums=0)
def policy_actions(hp: SoftActorCritic, policy, observations, noise):
    """Return actions (num_envs, *joints) of the policy for standard normal noise."""
    mean, log_std = sac.action_distribution(hp, policy, observations)
    actions, _ = sac.sample_actions(mean, log_std, noise)
    return actions


@functools.partial(jax.jit, static_argnums=0, donate_argnums=(1, 2))
def make_update(
    hp: SoftActorCritic, state: sac.SacState, sums: dict, batch: Transitions, noise: sac.Noise, next_actions
):
    """Make an update, and return the state and the sums of the metrics with this update's added."""
    state, metrics = sac.update(hp, state, batch, noise, next_actions)
    return state, {name: sums[name] + metric for name, metric in metrics.items()}


def zero_sums(names: Sequence[str]) -> dict[str, jax.Array]:
    """Return sums of metrics before the first update."""
    return {name: jnp.zeros((), jnp.float32) for name in names}


def draw_update(
    hp: SoftActorCritic, batch: int, joints: tuple[int, ...], with_policy: bool, seed, number, index_ranges
):
    """Draw the random inputs of an update; a pure function of its arguments.

    Args:
        hp: hyperparameters.
        batch: transitions of each source.
        joints: shape of an action of the network.
        with_policy: whether the policy learns too.
        seed: seed of the run.
        number: number of the update.
        index_ranges: (sources, 2) ranges of the indices.

    Returns:
        Indices (sources, batch), and the noise.
    """
    index_key, noise_key = jax.random.split(make_key(seed, "update", number))
    sources = len(index_ranges)
    indices = jax.random.randint(index_key, (sources, batch), index_ranges[:, :1], index_ranges[:, 1:])
    return indices, sac.draw_noise(hp, noise_key, sources * batch, joints, with_policy)


_draw_update = jax.jit(draw_update, static_argnums=(0, 1, 2, 3))


def make_key(seed, purpose: str, count):
    """Return the key of JAX for one purpose of a run, such as its 1000th update; see `learner.generator`."""
    purpose_key = jax.random.fold_in(jax.random.key(seed), zlib.crc32(purpose.encode()))
    return jax.random.fold_in(purpose_key, count)


def gather_update(run: OffPolicyRun, all_indices: np.ndarray):
    """Return the inputs of an update.

    Args:
        run: the run.
        all_indices: (sources, batch) as `draw_update` returns them.

    Returns:
        The batch, and the policy's distributions at the next observations, None if they are not known.
    """
    hp = run.hp
    batches = []
    next_actions = []
    for index, source in enumerate(run.sources):
        indices = run.phase.orders[index][all_indices[index]] if run.has_orders else all_indices[index]
        batches.append(network_batch(hp, run.inputs, source.transitions_at(indices, hp.n_step, hp.discount)))
        if run.phase is not None and run.phase.next_actions:
            next_actions.append([array[indices] for array in run.phase.next_actions[index]])
    batch = Transitions(*concatenate_sources(batches))
    return batch, concatenate_sources(next_actions) if next_actions else None


def network_batch(hp: SoftActorCritic, inputs, transitions: Transitions) -> Transitions:
    """Return transitions as networks learn from them, with arrays of NumPy or JAX."""
    batch = inputs.transform_batch(transitions)
    return batch._replace(rewards=np.float32(hp.reward_scale) * batch.rewards)


def concatenate_sources(arrays_of_sources: Sequence[Sequence]) -> list:
    """Return the arrays of all sources, each concatenated over the sources."""
    if len(arrays_of_sources) == 1:
        return list(arrays_of_sources[0])
    xp = arrays_of_sources[0][0].__array_namespace__()
    return [xp.concatenate(arrays) for arrays in zip(*arrays_of_sources, strict=True)]


_distribution = jax.jit(sac.action_distribution, static_argnums=0)


def _next_distributions(hp: SoftActorCritic, policy, source, inputs) -> list[np.ndarray]:
    """Return the policy's distributions at the next observations of every transition of a source."""
    parts = []
    for first in range(0, len(source), _OBSERVATIONS_PER_CALL):
        # The last call repeats a transition: calls of one shape are compiled once.
        indices = np.arange(first, first + _OBSERVATIONS_PER_CALL).clip(max=len(source) - 1)
        parts.append(_distribution(hp, policy, inputs(source.transitions_at(indices).next_observations)))
    return [np.concatenate(arrays)[: len(source)] for arrays in zip(*parts, strict=True)]


@functools.partial(jax.jit, static_argnums=(0, 1, 2))
def _draw_validation_noise(hp: SoftActorCritic, size: int, joints: tuple[int, ...], seed, updates):
    """Draw noise and dropout masks of the policy's loss on a validation set; None for no masks."""
    noise_key, mask_key = jax.random.split(make_key(seed, "look", updates))  # the text is part of the seed
    noise = jax.random.normal(noise_key, (size, *joints))
    if not hp.dropout:
        return noise, None
    return noise, sac.draw_dropout_masks(mask_key, (sac.CRITICS, sac.HIDDEN_LAYERS, size, hp.hidden), hp.dropout)


_policy_loss = jax.jit(sac.policy_loss, static_argnums=0)


def validation_loss(hp: SoftActorCritic, seed: int, updates: int, state: sac.SacState, sources, inputs, phase) -> float:
    """Return the policy's loss on the validation set of a phase."""
    size = hp.batch * min(phase.held_out // hp.batch, hp.scored_batches)
    parts = [
        source.transitions_at(order[:size]).observations for source, order in zip(sources, phase.orders, strict=True)
    ]
    observations = inputs(np.concatenate(parts))
    action_noise, policy_masks = _draw_validation_noise(hp, len(observations), inputs.joints, seed, updates)
    update_hp = sac.update_hyperparameters(hp)
    loss, _ = _policy_loss(update_hp, state.policy, state, observations, action_noise, policy_masks)
    return float(loss)
