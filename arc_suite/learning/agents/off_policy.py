"""Soft actor-critic from a replay buffer: the algorithms of the ARC-RL paper, which differ in hyperparameters alone.

A step of all environments acts, stores the transitions and makes `utd_ratio` updates for each of them. The last
update of an environment step moves the policy too; where updates are rarer than steps, each of them does.
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

_CHUNK = 4096  # observations of one call of the policy

# Sources of transitions, each with a batch in every update, by the use of prior data.
_SOURCES = {
    "none": lambda online, prior: [online],
    "protected": lambda online, prior: [CombinedReplay(prior, online)],
    "symmetric_sampling": lambda online, prior: [online, prior],
}

METRICS = ("policy_loss", "critic_loss", "q", "entropy", "alpha")
CRITIC_METRICS = ("critic_loss", "q")


class Phase(NamedTuple):
    """A stabilization phase.

    Attributes:
        updates: so far.
        held_out: transitions of each source in the validation set; 0 for no early stopping.
        patience: of the early stopping.
        orders: a permutation of each source, whose first `held_out` are the validation set; None for no set.
        next_actions: the policy's distributions at the next observations of each source, as the policy does not
            change; None if updates have other next observations.
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
    priors.check_prior_is_named(context.prior, hp.prior != "none")
    seed, core, environment = context.seed, sac.update_hyperparameters(hp), context.environment(hp.num_envs)
    task, joints = environment.task.definition, environment.single_action_space.shape[0]
    inputs = NetworkInputs.of(task, hp.normalize, hp.symmetry_augmentation, hp.network)
    prior = None if context.prior is None else priors.open_replay(context, task)
    mode = "w+" if context.checkpoint is None else "r+"
    size = min(hp.buffer_size, -(-context.steps // hp.num_envs) * hp.num_envs)
    buffer = Replay(context.folder / "replay", size, task.size, joints, STEPS_PER_SLICE, mode, hp.num_envs)
    sources = _SOURCES[hp.prior](buffer, prior)
    state = sac.begin(hp, generator(seed, "networks", 0), inputs.size, inputs.joints[-1])
    observations = environment.reset()[0]
    steps = updates = phase_updates = 0
    sums, summed = zero_sums(METRICS), 0  # of metrics since the latest line
    earned, latest_return = np.zeros(hp.num_envs), 0.0
    phase = None

    if (saved := context.checkpoint) is not None:
        with learner.restoring():
            state, sums = networks.restore_tree("state", state, saved), networks.restore_tree("sums", sums, saved)
            steps, updates, phase_updates, summed = map(int, saved["count"])
            *earned, latest_return = saved["earned"]
            earned = np.array(earned)
            if inputs.moments is not None:
                inputs = inputs._replace(moments=Moments(*(saved[f"moments/{name}"] for name in Moments._fields)))
            buffer.restore(*map(int, saved["replay"]))
            observations = learner.restore_environment(environment, saved)
            if saved["phase"].size:
                done, held_out, best, waited = saved["phase"]
                phase = _phase(hp, seed, steps, sources, state.policy, inputs, int(held_out))
                phase = phase._replace(updates=int(done), patience=Patience(float(best), int(waited)))

    while True:
        in_phase = phase is not None
        if not in_phase:
            # Act, and store the transitions.
            inputs = inputs.with_observations(observations)
            random = generator(seed, "action", steps)
            if hp.start_steps and len(sources[0]) <= hp.start_steps:
                actions = random.uniform(-1.0, 1.0, (hp.num_envs, joints)).astype(np.float32)
            else:
                noise = random.standard_normal((hp.num_envs, *inputs.joints), np.float32)
                actions = inputs.body_actions(np.asarray(act(core, state.policy, inputs(observations), noise)))
            if not np.isfinite(actions).all():
                raise Diverged("an action is not finite", steps)
            after, rewards, terminated, truncated, info = environment.step(actions)
            ended = terminated | truncated
            for index in range(hp.num_envs):
                is_last = bool(ended[index])
                next_observation = info["final_obs"][index] if is_last else after[index]
                transition = observations[index], actions[index], rewards[index], terminated[index]
                buffer.add(*transition, next_observation, is_last)
            observations = after
            earned += rewards
            for index in np.flatnonzero(ended):
                latest_return, earned[index] = earned[index], 0.0
            steps += hp.num_envs

            # Update the critics, and last the policy too.
            critic_sums, policy_every = zero_sums(CRITIC_METRICS), max(1, round(hp.utd_ratio))
            for index in range(1, hp.updates_of_a_step + 1):
                with_policy = index % policy_every == 0
                drawn = _draw(hp, seed, updates, sources, inputs, with_policy)
                if with_policy:
                    state, sums = update(core, state, sums, *drawn)
                    summed += 1
                else:
                    state, critic_sums = update(core, state, critic_sums, *drawn)
                updates += 1

            # Begin a stabilization phase, unless it lacks transitions for its validation set.
            begins = hp.phase_updates and steps // hp.phase_every > (steps - hp.num_envs) // hp.phase_every
            held_out = _held_out(hp, buffer, sources)
            if begins and (held_out or hp.early_stop == "none"):
                phase = _phase(hp, seed, steps, sources, state.policy, inputs, held_out)
                if held_out:
                    loss = validation_loss(hp, seed, updates, state, sources, inputs, phase)
                    phase = phase._replace(patience=Patience(loss))
        else:
            # Update the critics alone up to the next check of the validation loss.
            critic_sums, count = zero_sums(CRITIC_METRICS), min(hp.check_every, hp.phase_updates - phase.updates)
            for _ in range(count):
                drawn = _draw(hp, seed, updates, sources, inputs, with_policy=False, phase=phase)
                state, critic_sums = update(core, state, critic_sums, *drawn)
                updates += 1
            phase = phase._replace(updates=phase.updates + count)
            if phase.held_out:
                loss = validation_loss(hp, seed, updates, state, sources, inputs, phase)
                phase = phase._replace(patience=phase.patience.after_check(hp.early_stop, loss, hp.improvement, count))
            if phase.updates == hp.phase_updates or (phase.held_out and phase.patience.waited >= hp.patience):
                phase_updates, phase = phase_updates + phase.updates, None

        # Hand over a slice; a step whose phase is under way is not done yet.
        before = steps - hp.num_envs
        is_due = steps // STEPS_PER_SLICE > before // STEPS_PER_SLICE or steps >= context.steps
        if not (is_due or in_phase or phase or steps >= context.next_evaluation(before)):
            continue
        metrics = None
        if is_due and phase is None:
            means = {name: float(total) / max(summed, 1) for name, total in sums.items()}
            metrics = {"episode_return": latest_return, **means, "updates": updates, "phase_updates": phase_updates}
            sums, summed, phase_updates = zero_sums(METRICS), 0, 0
        checkpoint = {
            **networks.flatten_tree("state", state),
            **networks.flatten_tree("sums", sums),
            "count": np.array([steps, updates, phase_updates, summed]),
            "earned": np.array([*earned, latest_return]),
            "replay": np.array([buffer.total, buffer.ends, buffer.checksum]),
            "phase": np.array((phase.updates, phase.held_out, *phase.patience) if phase else (), float),
            **networks.flatten_tree("moments", inputs.moments),
            **learner.environment_arrays(environment),
        }
        yield Slice(
            before if phase else steps, metrics, inputs.policy_graph(sac.deterministic_layers(state)), checkpoint
        )


_distribution = jax.jit(sac.action_distribution, static_argnums=0)
_policy_loss = jax.jit(sac.policy_loss, static_argnums=0)


@functools.partial(jax.jit, static_argnums=0)
def act(hp: SoftActorCritic, policy, observations, noise):
    """Return actions (num_envs, *joints) of the policy for standard normal noise."""
    return sac.sample_actions(*sac.action_distribution(hp, policy, observations), noise)[0]


@functools.partial(jax.jit, static_argnums=0, donate_argnums=(1, 2))
def update(hp: SoftActorCritic, state: sac.SacState, sums: dict, batch: Transitions, noise: sac.Noise, next_actions):
    """Make an update, and return the state and the sums of the metrics with this update's added."""
    state, metrics = sac.update(hp, state, batch, noise, next_actions)
    return state, {name: sums[name] + metric for name, metric in metrics.items()}


def zero_sums(names: Sequence[str]) -> dict[str, jax.Array]:
    """Return sums of metrics before the first update."""
    return {name: jnp.zeros((), jnp.float32) for name in names}


def _draw(hp, seed: int, updates: int, sources, inputs: NetworkInputs, with_policy: bool, phase: Phase | None = None):
    """Draw the batch and the noise of an update, and look up the policy's next actions, None if they are not known."""
    random, held_out = generator(seed, "update", updates), phase.held_out if phase else 0
    batches, next_actions = [], []
    for index, source in enumerate(sources):
        places = random.integers(held_out, len(source), size=hp.batch)
        places = phase.orders[index][places] if held_out else places
        batch = inputs.transform_batch(source.transitions_at(places, hp.n_step, hp.discount))
        batches.append(batch._replace(rewards=np.float32(hp.reward_scale) * batch.rewards))
        if phase and phase.next_actions:
            next_actions.append([array[places] for array in phase.next_actions[index]])
    batch = Transitions(*_joined(batches))
    noise = sac.draw_noise(hp, random, len(batch.rewards), inputs.joints, with_policy)
    return batch, noise, _joined(next_actions) if next_actions else None


def _held_out(hp: SoftActorCritic, buffer: Replay, sources) -> int:
    """Return the size of the validation set in each source: at least a batch, and a batch must be left; else 0."""
    if hp.early_stop == "none":
        return 0
    held_out = min(max(hp.batch, int(hp.held_out * len(buffer))), min(map(len, sources)) - hp.batch)
    return held_out if held_out >= hp.batch else 0


def _phase(hp, seed: int, steps: int, sources, policy, inputs: NetworkInputs, held_out: int) -> Phase:
    """Split off the validation set of a new phase, and cache the policy's distributions at next observations.

    Transitions that are mirrored, or of several steps, have other next observations than those of the sources.
    """
    random = generator(seed, "held out", steps)
    orders = [random.permutation(len(source)).astype(np.int32) for source in sources] if held_out else None
    cached = hp.n_step == 1 and inputs.symmetry is None
    next_actions = (
        [_distributions(sac.update_hyperparameters(hp), policy, source, inputs) for source in sources]
        if cached
        else None
    )
    return Phase(0, held_out, Patience(0.0), orders, next_actions)


def _distributions(core: SoftActorCritic, policy, source, inputs: NetworkInputs) -> list[np.ndarray]:
    """Return the policy's distributions at the next observations of every transition of a source."""
    parts = []
    for first in range(0, len(source), _CHUNK):
        indices = np.arange(first, first + _CHUNK).clip(max=len(source) - 1)  # of one shape, so compiled once
        parts.append(_distribution(core, policy, inputs(source.transitions_at(indices).next_observations)))
    return [np.concatenate(arrays)[: len(source)] for arrays in zip(*parts, strict=True)]


def validation_loss(
    hp: SoftActorCritic, seed: int, updates: int, state: sac.SacState, sources, inputs: NetworkInputs, phase: Phase
) -> float:
    """Return the policy's loss on the validation set of a phase."""
    size = hp.batch * min(phase.held_out // hp.batch, hp.scored_batches)
    pairs = zip(sources, phase.orders, strict=True)
    observations = inputs(np.concatenate([source.transitions_at(order[:size]).observations for source, order in pairs]))
    noise = sac.draw_noise(hp, generator(seed, "look", updates), len(observations), inputs.joints, with_policy=True)
    kept = None if noise.kept is None else noise.kept[2]
    return float(_policy_loss(sac.update_hyperparameters(hp), state.policy, state, observations, noise.action, kept)[0])


def _joined(several: list) -> list[np.ndarray]:
    """Concatenate the arrays of several sources."""
    return several[0] if len(several) == 1 else [np.concatenate(arrays) for arrays in zip(*several, strict=True)]
