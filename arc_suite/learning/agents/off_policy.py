"""Soft actor-critic from a replay buffer: the algorithms of the ARC-RL paper, which differ in hyperparameters alone.

A step of all environments acts, stores the transitions and makes `utd_ratio` updates for each of them. The last
update of an environment step moves the policy too. Where updates are rarer than steps, each of them does.

Stabilization phases follow every `phase_every`-th step: updates of the critics alone, on the buffer as it stands. With
early stopping a phase holds out a share of the buffer and ends by the loss on it.
"""

import functools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.learning.agents import learner, networks, priors
from arc_suite.learning.agents import soft_actor_critic as sac
from arc_suite.learning.agents.hyperparameters import SoftActorCritic
from arc_suite.learning.agents.inputs import NetworkInputs
from arc_suite.learning.agents.learner import Diverged, RunContext, Slice, generator
from arc_suite.learning.agents.normalizer import Moments
from arc_suite.learning.agents.replay import CombinedReplay, Replay, Transitions
from arc_suite.learning.agents.stopping import Patience

STEPS_PER_SLICE = 1000  # environment steps

_OBSERVATIONS_PER_CALL = 4096  # of the policy

METRICS = ("policy_loss", "critic_loss", "q", "entropy", "alpha")
CRITIC_METRICS = ("critic_loss", "q")


class Phase(NamedTuple):
    """A stabilization phase.

    Attributes:
        updates: made so far.
        held_out: transitions of each source in the validation set; 0 for no early stopping.
        patience: state of the early stopping.
        orders: a permutation of each source, whose first `held_out` are the validation set; None for no set.
        next_actions: the policy's distributions at the next observations of each source, which stay, as the policy
            does not change. None if updates have other next observations.
    """

    updates: int
    held_out: int
    patience: Patience
    orders: list[np.ndarray] | None
    next_actions: list[list[np.ndarray]] | None


def learn(hp: SoftActorCritic, context: RunContext) -> Iterator[Slice]:
    """Learn; see `arc_suite.learning.agents`.

    Raises:
        ValueError: prior data are missing, not taken by the algorithm, or do not fit.
        OSError: the disk is too small for the buffer.
        Diverged: an action is not finite.
    """
    priors.check_prior(context.prior, hp.prior != "none")
    seed = context.seed
    update_hp = sac.update_hyperparameters(hp)
    environment = context.environment(hp.num_envs)
    task = environment.task.definition
    joints = environment.single_action_space.shape[0]
    inputs = NetworkInputs.of(task, hp.normalize, hp.symmetry_augmentation, hp.network)
    prior = None if context.prior is None else priors.open_replay(context, task)
    buffer = _open_buffer(hp, context, task.size, joints)
    sources = _sources(hp, buffer, prior)
    state = sac.begin(hp, generator(seed, "networks", 0), inputs.size, inputs.joints[-1])
    observations, _ = environment.reset()
    steps = 0  # of all environments together
    updates = 0
    phase_updates = 0  # in the phases since the latest line of metrics
    sums = zero_sums(METRICS)  # since the latest line of metrics
    summed_updates = 0  # those of the policy, which are in the sums
    episode_returns = np.zeros(hp.num_envs)  # so far, of the present episodes
    latest_return = 0.0  # of the latest episode that has ended
    phase = None

    saved = context.checkpoint
    if saved is not None:
        with learner.restoring():
            state = networks.restore_tree("state", state, saved)
            sums = networks.restore_tree("sums", sums, saved)
            steps, updates, phase_updates, summed_updates = map(int, saved["count"])
            episode_returns = np.array(saved["earned"][:-1])
            latest_return = saved["earned"][-1]
            if inputs.moments is not None:
                inputs = inputs._replace(moments=Moments(*(saved[f"moments/{name}"] for name in Moments._fields)))
            buffer.restore(*map(int, saved["replay"]))
            observations = learner.restore_environment(environment, saved)
            if saved["phase"].size:
                phase_updates_made, held_out, best_loss, updates_waited = saved["phase"]
                phase = _begin_phase(hp, seed, steps, sources, state.policy, inputs, int(held_out))
                patience = Patience(float(best_loss), int(updates_waited))
                phase = phase._replace(updates=int(phase_updates_made), patience=patience)

    while True:
        was_in_phase = phase is not None
        if not was_in_phase:
            # Act, and store the transitions.
            inputs = inputs.with_observations(observations)
            random = generator(seed, "action", steps)
            if hp.start_steps and len(sources[0]) <= hp.start_steps:
                actions = random.uniform(-1.0, 1.0, (hp.num_envs, joints)).astype(np.float32)
            else:
                action_noise = random.standard_normal((hp.num_envs, *inputs.joints), np.float32)
                network_actions = act(update_hp, state.policy, inputs(observations), action_noise)
                actions = inputs.body_actions(np.asarray(network_actions))
            if not np.isfinite(actions).all():
                raise Diverged("an action is not finite", steps)
            next_observations, rewards, terminated, truncated, info = environment.step(actions)
            has_ended = terminated | truncated
            for index in range(hp.num_envs):
                is_last = bool(has_ended[index])
                buffer.add(
                    observations[index],
                    actions[index],
                    rewards[index],
                    terminated[index],
                    next_observation=info["final_obs"][index] if is_last else next_observations[index],
                    is_last=is_last,
                )
            observations = next_observations
            episode_returns += rewards
            for index in np.flatnonzero(has_ended):
                latest_return = episode_returns[index]
                episode_returns[index] = 0.0
            steps += hp.num_envs

            # Update the critics, and last the policy too.
            critic_sums = zero_sums(CRITIC_METRICS)  # which no line of metrics has
            policy_every = max(1, round(hp.utd_ratio))
            for update_of_step in range(1, hp.updates_of_a_step + 1):
                with_policy = update_of_step % policy_every == 0
                batch, noise, next_actions = _draw_update(hp, seed, updates, sources, inputs, with_policy)
                if with_policy:
                    state, sums = update(update_hp, state, sums, batch, noise, next_actions)
                    summed_updates += 1
                else:
                    state, critic_sums = update(update_hp, state, critic_sums, batch, noise, next_actions)
                updates += 1

            # Begin a stabilization phase, unless it lacks transitions for its validation set.
            is_phase_due = hp.phase_updates and _passes_multiple(steps, hp.num_envs, hp.phase_every)
            held_out = _held_out_size(hp, buffer, sources)
            if is_phase_due and (held_out or hp.early_stop == "none"):
                phase = _begin_phase(hp, seed, steps, sources, state.policy, inputs, held_out)
                if held_out:
                    loss = validation_loss(hp, seed, updates, state, sources, inputs, phase)
                    phase = phase._replace(patience=Patience(loss))
        else:
            # Update the critics alone up to the next check of the validation loss.
            critic_sums = zero_sums(CRITIC_METRICS)
            updates_to_check = min(hp.check_every, hp.phase_updates - phase.updates)
            for _ in range(updates_to_check):
                batch, noise, next_actions = _draw_update(
                    hp, seed, updates, sources, inputs, with_policy=False, phase=phase
                )
                state, critic_sums = update(update_hp, state, critic_sums, batch, noise, next_actions)
                updates += 1
            phase = phase._replace(updates=phase.updates + updates_to_check)
            if phase.held_out:
                loss = validation_loss(hp, seed, updates, state, sources, inputs, phase)
                patience = phase.patience.after_check(hp.early_stop, loss, hp.improvement, updates_to_check)
                phase = phase._replace(patience=patience)
            is_patience_over = phase.held_out and phase.patience.waited >= hp.patience
            if phase.updates == hp.phase_updates or is_patience_over:
                phase_updates += phase.updates
                phase = None

        # Yield a slice where one is due, and around phases. A step whose phase goes on is not complete yet.
        steps_before = steps - hp.num_envs
        is_line_due = _passes_multiple(steps, hp.num_envs, STEPS_PER_SLICE) or steps >= context.steps
        is_evaluation_due = steps >= context.next_evaluation(steps_before)
        if not (is_line_due or was_in_phase or phase is not None or is_evaluation_due):
            continue
        metrics = None
        if is_line_due and phase is None:
            means = {name: float(total) / max(summed_updates, 1) for name, total in sums.items()}
            metrics = {"episode_return": latest_return, **means, "updates": updates, "phase_updates": phase_updates}
            sums = zero_sums(METRICS)
            summed_updates = 0
            phase_updates = 0
        checkpoint = {
            **networks.flatten_tree("state", state),
            **networks.flatten_tree("sums", sums),
            "count": np.array([steps, updates, phase_updates, summed_updates]),
            "earned": np.array([*episode_returns, latest_return]),
            "replay": np.array([buffer.total, buffer.ends, buffer.checksum]),
            "phase": _phase_numbers(phase),
            **networks.flatten_tree("moments", inputs.moments),
            **learner.environment_arrays(environment),
        }
        complete_steps = steps if phase is None else steps_before
        yield Slice(complete_steps, metrics, inputs.policy_graph(sac.deterministic_layers(state)), checkpoint)


def _open_buffer(hp: SoftActorCritic, context: RunContext, size: int, joints: int) -> Replay:
    """Open the replay buffer of a run, or make it where the run is new."""
    control_steps = -(-context.steps // hp.num_envs)  # of each environment, rounded up
    return Replay(
        context.folder / "replay",
        capacity=min(hp.buffer_size, control_steps * hp.num_envs),
        size=size,
        joints=joints,
        slack=STEPS_PER_SLICE,
        mode="w+" if context.checkpoint is None else "r+",
        num_envs=hp.num_envs,
    )


def _sources(hp: SoftActorCritic, buffer: Replay, prior: Replay | None) -> list[Replay | CombinedReplay]:
    """Return the sources of transitions; every update has a batch of each."""
    if hp.prior == "protected":
        return [CombinedReplay(prior, buffer)]
    if hp.prior == "symmetric_sampling":
        return [buffer, prior]
    return [buffer]


def _passes_multiple(steps: int, last_steps: int, period: int) -> bool:
    """Return whether the last steps up to `steps` include a multiple of a period."""
    return steps // period > (steps - last_steps) // period


@functools.partial(jax.jit, static_argnums=0)
def act(hp: SoftActorCritic, policy, observations, noise):
    """Return actions (num_envs, *joints) of the policy for standard normal noise."""
    mean, log_std = sac.action_distribution(hp, policy, observations)
    actions, _ = sac.sample_actions(mean, log_std, noise)
    return actions


@functools.partial(jax.jit, static_argnums=0, donate_argnums=(1, 2))
def update(hp: SoftActorCritic, state: sac.SacState, sums: dict, batch: Transitions, noise: sac.Noise, next_actions):
    """Make an update, and return the state and the sums of the metrics with this update's added."""
    state, metrics = sac.update(hp, state, batch, noise, next_actions)
    return state, {name: sums[name] + metric for name, metric in metrics.items()}


def zero_sums(names: Sequence[str]) -> dict[str, jax.Array]:
    """Return sums of metrics before the first update."""
    return {name: jnp.zeros((), jnp.float32) for name in names}


def _draw_update(
    hp: SoftActorCritic,
    seed: int,
    updates: int,
    sources,
    inputs: NetworkInputs,
    with_policy: bool,
    phase: Phase | None = None,
):
    """Draw the inputs of an update.

    Args:
        hp: hyperparameters.
        seed: seed of the run.
        updates: made so far.
        sources: sources of transitions.
        inputs: how networks see observations.
        with_policy: whether the policy learns too.
        phase: phase that the update belongs to; None for none.

    Returns:
        The batch, the noise, and the policy's distributions at the next observations, None if they are not known.
    """
    random = generator(seed, "update", updates)
    batches = []
    next_actions = []
    for index, source in enumerate(sources):
        if phase is not None and phase.held_out:
            indices = phase.orders[index][random.integers(phase.held_out, len(source), size=hp.batch)]
        else:
            indices = random.integers(0, len(source), size=hp.batch)
        batch = inputs.transform_batch(source.transitions_at(indices, hp.n_step, hp.discount))
        batches.append(batch._replace(rewards=np.float32(hp.reward_scale) * batch.rewards))
        if phase is not None and phase.next_actions:
            next_actions.append([array[indices] for array in phase.next_actions[index]])
    joint_batch = Transitions(*_concatenate_sources(batches))
    noise = sac.draw_noise(hp, random, len(joint_batch.rewards), inputs.joints, with_policy)
    return joint_batch, noise, _concatenate_sources(next_actions) if next_actions else None


def _concatenate_sources(arrays_of_sources: Sequence[Sequence[np.ndarray]]) -> list[np.ndarray]:
    """Return the arrays of all sources, each concatenated over the sources."""
    if len(arrays_of_sources) == 1:
        return list(arrays_of_sources[0])
    return [np.concatenate(arrays) for arrays in zip(*arrays_of_sources, strict=True)]


def _held_out_size(hp: SoftActorCritic, buffer: Replay, sources) -> int:
    """Return the size of the validation set in each source; 0 for no early stopping, or too few transitions.

    The set has at least a batch, and at least a batch of each source is not in it.
    """
    if hp.early_stop == "none":
        return 0
    desired = max(hp.batch, int(hp.held_out * len(buffer)))
    available = min(len(source) for source in sources) - hp.batch
    size = min(desired, available)
    return size if size >= hp.batch else 0


def _begin_phase(
    hp: SoftActorCritic, seed: int, steps: int, sources, policy, inputs: NetworkInputs, held_out: int
) -> Phase:
    """Draw the validation set of a new phase, and cache the policy's distributions at next observations.

    There is no cache where transitions are mirrored or of several steps: their next observations are not those of the
    sources.
    """
    random = generator(seed, "held out", steps)
    orders = None
    if held_out:
        orders = [random.permutation(len(source)).astype(np.int32) for source in sources]
    next_actions = None
    if hp.n_step == 1 and inputs.symmetry is None:
        update_hp = sac.update_hyperparameters(hp)
        next_actions = [_next_distributions(update_hp, policy, source, inputs) for source in sources]
    return Phase(updates=0, held_out=held_out, patience=Patience(0.0), orders=orders, next_actions=next_actions)


def _phase_numbers(phase: Phase | None) -> np.ndarray:
    """Return a phase as a checkpoint has it: updates, held out, best loss and updates waited; empty for no phase."""
    if phase is None:
        return np.array((), float)
    return np.array((phase.updates, phase.held_out, phase.patience.best, phase.patience.waited), float)


_distribution = jax.jit(sac.action_distribution, static_argnums=0)


def _next_distributions(hp: SoftActorCritic, policy, source, inputs: NetworkInputs) -> list[np.ndarray]:
    """Return the policy's distributions at the next observations of every transition of a source."""
    parts = []
    for first in range(0, len(source), _OBSERVATIONS_PER_CALL):
        # The last call repeats a transition: calls of one shape are compiled once.
        indices = np.arange(first, first + _OBSERVATIONS_PER_CALL).clip(max=len(source) - 1)
        parts.append(_distribution(hp, policy, inputs(source.transitions_at(indices).next_observations)))
    return [np.concatenate(arrays)[: len(source)] for arrays in zip(*parts, strict=True)]


_policy_loss = jax.jit(sac.policy_loss, static_argnums=0)


def validation_loss(
    hp: SoftActorCritic, seed: int, updates: int, state: sac.SacState, sources, inputs: NetworkInputs, phase: Phase
) -> float:
    """Return the policy's loss on the validation set of a phase."""
    size = hp.batch * min(phase.held_out // hp.batch, hp.scored_batches)
    parts = [
        source.transitions_at(order[:size]).observations for source, order in zip(sources, phase.orders, strict=True)
    ]
    observations = inputs(np.concatenate(parts))
    noise = sac.draw_noise(hp, generator(seed, "look", updates), len(observations), inputs.joints, with_policy=True)
    policy_masks = None if noise.dropout_masks is None else noise.dropout_masks[2]
    update_hp = sac.update_hyperparameters(hp)
    loss, _ = _policy_loss(update_hp, state.policy, state, observations, noise.action, policy_masks)
    return float(loss)
