"""Soft actor-critic from a replay buffer: the algorithms of the ARC-RL paper, which differ in hyperparameters alone.

An environment step acts, stores the transition and makes `utd_ratio` updates; the last one moves the policy
too. Stabilisation phases follow every `phase_every`-th step: updates of the critics alone, on the buffer as it
stands. With early stopping a phase holds out a share of the buffer and ends by the loss on it.
"""

import functools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.agents import learner, networks, priors
from arc_suite.agents import soft_actor_critic as sac
from arc_suite.agents.hyperparameters import SoftActorCritic
from arc_suite.agents.learner import Diverged, RunContext, Slice, generator
from arc_suite.agents.replay import Protected, Replay, Transitions
from arc_suite.agents.stopping import Patience

SLICE = 1000  # environment steps

_CHUNK = 4096  # observations of one call of the policy

# Sources of transitions, each with a batch in every update, by the use of prior data.
_SOURCES = {
    "none": lambda online, prior: [online],
    "protected": lambda online, prior: [Protected(prior, online)],
    "symmetric_sampling": lambda online, prior: [online, prior],
}

METRICS = ("policy_loss", "critic_loss", "q", "entropy", "alpha")
METRICS_OF_CRITICS = ("critic_loss", "q")


class Phase(NamedTuple):
    """A stabilisation phase.

    Attributes:
        updates: so far.
        held_out: transitions of each source in the validation set; 0 for no early stopping.
        patience: of the early stopping.
        orders: a permutation of each source, whose first `held_out` are the validation set; None for no set.
        next_actions: the policy's distributions at the next observations of each source; the policy does not change.
    """

    updates: int
    held_out: int
    patience: Patience
    orders: list[np.ndarray] | None
    next_actions: list[list[np.ndarray]]


def learn(hp: SoftActorCritic, context: RunContext) -> Iterator[Slice]:
    """Learn; see `arc_suite.agents`.

    Raises:
        ValueError: prior data are missing, not taken by the algorithm, or do not fit.
        OSError: the disk is too small for the buffer.
        Diverged: an action is not finite.
    """
    if (context.prior is None) != (hp.prior == "none"):
        expected = "no prior data" if hp.prior == "none" else "prior data, the id of a dataset"
        raise ValueError(f"prior: the algorithm takes {expected}, got {context.prior!r}")
    seed, core, environment = context.seed, sac.core(hp), context.environment()
    size, joints = environment.task.definition.size, environment.single_action_space.shape[0]
    prior = None if context.prior is None else priors.mapped(context, environment.task.definition)
    mode = "w+" if context.checkpoint is None else "r+"
    buffer = Replay(context.folder / "replay", min(hp.buffer_size, context.steps), size, joints, SLICE, mode)
    sources = _SOURCES[hp.prior](buffer, prior)
    state = sac.begin(hp, generator(seed, "networks", 0), size, joints)
    observation = environment.reset()[0][0]
    steps = updates = phase_updates = 0
    sums, summed = zeros(METRICS), 0  # of metrics since the latest line
    episode_return = latest_return = 0.0
    phase = None

    if (saved := context.checkpoint) is not None:
        with learner.restoring():
            state, sums = networks.restored("state", state, saved), networks.restored("sums", sums, saved)
            steps, updates, phase_updates, summed = map(int, saved["count"])
            episode_return, latest_return = map(float, saved["earned"])
            buffer.restore(*map(int, saved["replay"]))
            observation = learner.restore_environment(environment, saved)[0]
            if saved["phase"].size:
                done, held_out, best, waited = saved["phase"]
                phase = _phase(seed, steps, sources, state.policy, int(held_out))
                phase = phase._replace(updates=int(done), patience=Patience(float(best), int(waited)))

    while True:
        in_phase = phase is not None
        if not in_phase:
            # Act, and store the transition.
            random = generator(seed, "action", steps)
            if len(sources[0]) <= hp.start_steps:
                action = random.uniform(-1.0, 1.0, joints).astype(np.float32)
            else:
                action = np.asarray(act(state.policy, observation, random.standard_normal(joints, np.float32)))
            if not np.isfinite(action).all():
                raise Diverged("an action is not finite", steps)
            observations, rewards, terminated, truncated, info = environment.step(action[None])
            is_last = bool(terminated[0] or truncated[0])
            next_observation = info["final_obs"][0] if is_last else observations[0]
            buffer.add(observation, action, rewards[0], terminated[0], next_observation, is_last)
            observation = observations[0]
            episode_return += float(rewards[0])
            if is_last:
                latest_return, episode_return = episode_return, 0.0
            steps += 1

            # Update the critics, and last the policy too.
            critic_sums = zeros(METRICS_OF_CRITICS)
            for _ in range(hp.utd_ratio - 1):
                drawn = _draw(hp, seed, updates, sources, joints, with_policy=False)
                state, critic_sums = update(core, state, critic_sums, *drawn)
                updates += 1
            state, sums = update(core, state, sums, *_draw(hp, seed, updates, sources, joints))
            updates, summed = updates + 1, summed + 1

            # Begin a stabilisation phase.
            if hp.phase_updates and steps % hp.phase_every == 0:
                phase = _phase(seed, steps, sources, state.policy, _held_out(hp, buffer, sources))
                if phase.held_out:
                    loss = validation_loss(hp, seed, updates, state, sources, phase)
                    phase = phase._replace(patience=Patience(loss))
        else:
            # Update the critics alone up to the next check of the validation loss.
            critic_sums, count = zeros(METRICS_OF_CRITICS), min(hp.check_every, hp.phase_updates - phase.updates)
            for _ in range(count):
                drawn = _draw(hp, seed, updates, sources, joints, with_policy=False, phase=phase)
                state, critic_sums = update(core, state, critic_sums, *drawn)
                updates += 1
            phase = phase._replace(updates=phase.updates + count)
            if phase.held_out:
                loss = validation_loss(hp, seed, updates, state, sources, phase)
                phase = phase._replace(patience=phase.patience.checked(hp.early_stop, loss, hp.improvement, count))
            if phase.updates == hp.phase_updates or (phase.held_out and phase.patience.waited >= hp.patience):
                phase_updates, phase = phase_updates + phase.updates, None

        # Hand over a slice; a step whose phase is under way is not done yet.
        is_due = steps % SLICE == 0 or steps == context.steps
        if not (is_due or in_phase or phase or steps == context.next_evaluation(steps - 1)):
            continue
        metrics = None
        if is_due and phase is None:
            means = {name: float(total) / max(summed, 1) for name, total in sums.items()}
            metrics = {"episode_return": latest_return, **means, "updates": updates, "phase_updates": phase_updates}
            sums, summed, phase_updates = zeros(METRICS), 0, 0
        checkpoint = {
            **networks.named("state", state),
            **networks.named("sums", sums),
            "count": np.array([steps, updates, phase_updates, summed]),
            "earned": np.array([episode_return, latest_return]),
            "replay": np.array([buffer.total, buffer.ends, buffer.checksum]),
            "phase": np.array((phase.updates, phase.held_out, *phase.patience) if phase else (), float),
            **learner.environment_arrays(environment),
        }
        yield Slice(steps - (phase is not None), metrics, sac.exported(state), checkpoint)


act = jax.jit(lambda policy, observation, noise: sac.sample(*sac.distribution(policy, observation), noise)[0])
_distribution = jax.jit(sac.distribution)
_held_out_loss = jax.jit(sac.held_out_loss, static_argnums=0)


@functools.partial(jax.jit, static_argnums=0, donate_argnums=(1, 2))
def update(hp: SoftActorCritic, state: sac.State, sums: dict, batch: Transitions, noise: sac.Noise, next_actions):
    """Make an update, and return the state and the sums of the metrics with this update's added."""
    state, metrics = sac.update(hp, state, batch, noise, next_actions)
    return state, {name: sums[name] + metric for name, metric in metrics.items()}


def zeros(names: Sequence[str]) -> dict[str, jax.Array]:
    """Return sums of metrics before the first update."""
    return {name: jnp.zeros((), jnp.float32) for name in names}


def _draw(hp, seed: int, updates: int, sources, joints: int, with_policy: bool = True, phase: Phase | None = None):
    """Draw the batch and the noise of an update; in a phase also look up the policy's next actions, else None."""
    random, held_out = generator(seed, "update", updates), phase.held_out if phase else 0
    batches, next_actions = [], []
    for index, source in enumerate(sources):
        places = random.integers(held_out, len(source), size=hp.batch)
        places = phase.orders[index][places] if held_out else places
        batches.append(source.at(places))
        if phase:
            next_actions.append([array[places] for array in phase.next_actions[index]])
    batch = Transitions(*_joined(batches))
    noise = sac.noise(hp, random, len(batch.rewards), joints, with_policy)
    return batch, noise, _joined(next_actions) if phase else None


def _held_out(hp: SoftActorCritic, buffer: Replay, sources) -> int:
    """Return the size of the validation set in each source: at least a batch, and a batch must be left."""
    if hp.early_stop == "none":
        return 0
    held_out = min(max(hp.batch, int(hp.held_out * len(buffer))), min(map(len, sources)) - hp.batch)
    return held_out if held_out >= hp.batch else 0


def _phase(seed: int, steps: int, sources, policy, held_out: int) -> Phase:
    """Split off the validation set of a new phase, and cache the policy's distributions at next observations."""
    random = generator(seed, "held out", steps)
    orders = [random.permutation(len(source)).astype(np.int32) for source in sources] if held_out else None
    return Phase(0, held_out, Patience(0.0), orders, [_distributions(policy, source) for source in sources])


def _distributions(policy, source) -> list[np.ndarray]:
    """Return the policy's distributions at the next observations of every transition of a source."""
    parts = []
    for first in range(0, len(source), _CHUNK):
        indices = np.arange(first, first + _CHUNK).clip(max=len(source) - 1)  # of one shape, so compiled once
        parts.append(_distribution(policy, source.at(indices).next_observations))
    return [np.concatenate(arrays)[: len(source)] for arrays in zip(*parts, strict=True)]


def validation_loss(hp: SoftActorCritic, seed: int, updates: int, state: sac.State, sources, phase: Phase) -> float:
    """Return the policy's loss on the validation set of a phase."""
    size = hp.batch * min(phase.held_out // hp.batch, hp.scored_batches)
    pairs = zip(sources, phase.orders, strict=True)
    observations = np.concatenate([source.at(order[:size]).observations for source, order in pairs])
    joints = phase.next_actions[0][0].shape[-1]
    noise = sac.noise(hp, generator(seed, "look", updates), len(observations), joints, with_policy=True)
    kept = None if noise.kept is None else noise.kept[2]
    return float(_held_out_loss(sac.core(hp), state, observations, noise.action, kept))


def _joined(several: list) -> list[np.ndarray]:
    """Concatenate the arrays of several sources."""
    return several[0] if len(several) == 1 else [np.concatenate(arrays) for arrays in zip(*several, strict=True)]
