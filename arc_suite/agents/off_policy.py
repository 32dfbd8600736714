"""Learns by soft actor-critic from a buffer: the algorithms of the ARC-RL paper, which differ in their rows alone.

A step acts, stores the transition and makes an update, or several, of which the last moves the policy too. Where
the row has stabilisation phases, one follows the update of every `phase_every`-th step: updates of the critics
alone, on the buffer as it stands. With early stopping, a share of the buffer is held out of the phase and tells when
to stop.
"""

import functools
from collections.abc import Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.agents import networks, priors
from arc_suite.agents import soft_actor_critic as sac
from arc_suite.agents.hyperparameters import SoftActorCritic
from arc_suite.agents.learner import Diverged, Stage, environment_arrays, generator, restore_environment
from arc_suite.agents.replay import Fenced, Replay, Transitions
from arc_suite.agents.stopping import Patience

SLICE = 1000  # environment steps

_ROWS = 4096  # observations that the policy sees at a time


class Phase(NamedTuple):
    """A stabilisation phase that is under way.

    Attributes:
        updates: of it so far.
        held_out: transitions of each source that judge it; 0 where nothing stops it early.
        patience: how it stands with early stopping.
    """

    updates: int
    held_out: int
    patience: Patience


def begin(row: SoftActorCritic, stage: Stage) -> "OffPolicy":
    """Return the learner; see `arc_suite.agents`.

    Raises:
        ValueError: prior data are missing, not taken by the algorithm, or do not fit; one line.
    """
    if (stage.prior is None) != (row.prior == "none"):
        wanted = "no prior data" if row.prior == "none" else "prior data, the id of a dataset"
        raise ValueError(f"prior: the algorithm takes {wanted}, got {stage.prior!r}")
    return OffPolicy(row, stage)


@functools.partial(jax.jit, static_argnums=0, donate_argnums=(1, 2))
def _update(row: SoftActorCritic, state: sac.State, sums: dict, batch: Transitions, noise: sac.Noise, following):
    state, figures = sac.update(row, state, batch, noise, following)
    return state, {name: sums[name] + figure for name, figure in figures.items()}


_act = jax.jit(lambda policy, observation, noise: sac.sample(*sac.distribution(policy, observation), noise)[0])
_distribution = jax.jit(sac.distribution)
_look = jax.jit(sac.held_out_loss, static_argnums=0)

# What an update takes a batch of each from, by what prior data are.
_SOURCES = {
    "none": lambda online, prior: [online],
    "fenced": lambda online, prior: [Fenced(prior, online)],
    "beside": lambda online, prior: [online, prior],
}

_FIGURES = ("policy_loss", "critic_loss", "q", "entropy", "alpha")
_OF_CRITICS = ("critic_loss", "q")


def _zeros(names) -> dict:
    return {name: jnp.zeros((), jnp.float32) for name in names}


class OffPolicy:
    """A learner that acts in one environment."""

    def __init__(self, row: SoftActorCritic, stage: Stage):
        """Draw the networks and begin the first episode.

        Raises:
            ValueError: prior data that do not fit; one line.
            OSError: the disk is too small for the buffer; one line.
        """
        self._row, self._seed, self._steps_of_run = row, stage.seed, stage.steps
        # What updates depend on: rows that differ in the rest share compiled programs.
        self._core = SoftActorCritic(**{name: getattr(row, name) for name in sac.NUMBERS})
        self._environment = stage.environment()
        size, self._joints = self._environment.task.size, self._environment.single_action_space.shape[0]
        self._prior = None if stage.prior is None else priors.mapped(stage, self._environment.task)
        capacity = min(row.capacity, stage.steps)
        self._replay = Replay(stage.folder / "replay", capacity, size, self._joints, slack=SLICE)
        self._sources = _SOURCES[row.prior](self._replay, self._prior)
        self._state = sac.begin(row, generator(stage.seed, "networks", 0), size, self._joints)
        self._observation = self._environment.reset()[0][0]
        self._sums = _zeros(_FIGURES)
        self._count = {"steps": 0, "updates": 0, "phase_updates": 0, "summed": 0}
        self._earned = {"present": 0.0, "latest": 0.0}  # return of the present episode, and of the one before
        self._phase: Phase | None = None
        self._orders: list[np.ndarray] | None = None  # of each source's transitions; the first are held out
        self._following: list | None = None  # the policy's distributions after each source's transitions in a phase

    @property
    def step(self) -> int:
        """Environment steps that are done with, and so are their phases."""
        return self._count["steps"] - (self._phase is not None)

    def advance(self, limit: int) -> Mapping[str, float] | None:
        """Learn for up to `SLICE` environment steps, or up to the next look in a phase; see `Learner`."""
        count = self._count
        if self._phase is not None:
            self._advance_phase()
        else:
            until = min(limit, (count["steps"] // SLICE + 1) * SLICE)
            while count["steps"] < until and self._phase is None:
                self._step()
        is_due = count["steps"] % SLICE == 0 or count["steps"] == self._steps_of_run
        return self._figures() if is_due and self._phase is None else None

    def policy(self):
        """Return the layers of the deterministic policy."""
        return sac.exported(self._state)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all that it goes on from, beside the files of the buffer."""
        phase = None if self._phase is None else (self._phase.updates, self._phase.held_out, *self._phase.patience)
        return {
            **networks.named("state", self._state),
            **networks.named("sums", self._sums),
            "count": np.array(list(self._count.values())),
            "earned": np.array(list(self._earned.values())),
            "replay": np.array([self._replay.total, self._replay.ends]),
            "phase": np.array(phase or (), float),
            **environment_arrays(self._environment),
        }

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from what `arrays` returned."""
        self._state = networks.restored("state", self._state, arrays)
        self._sums = networks.restored("sums", self._sums, arrays)
        self._count = dict(zip(self._count, map(int, arrays["count"]), strict=True))
        self._earned = dict(zip(self._earned, map(float, arrays["earned"]), strict=True))
        self._replay.restore(*map(int, arrays["replay"]))
        if arrays["phase"].size:
            updates, held_out, best, waited = arrays["phase"]
            self._phase = Phase(int(updates), int(held_out), Patience(float(best), int(waited)))
            self._prepare_phase()
        self._observation = restore_environment(self._environment, arrays)[0]

    def _step(self) -> None:
        """Act, store the transition, update, and begin a phase if it is time."""
        row, count = self._row, self._count
        action = self._action()
        observations, rewards, terminated, truncated, info = self._environment.step(action[None])
        is_last = bool(terminated[0] or truncated[0])
        following = info["final_obs"][0] if is_last else observations[0]
        self._replay.add(self._observation, action, rewards[0], terminated[0], following, is_last)
        self._observation = observations[0]
        self._earned["present"] += float(rewards[0])
        if is_last:
            self._earned = {"present": 0.0, "latest": self._earned["present"]}
        count["steps"] += 1
        spent = _zeros(_OF_CRITICS)
        for _ in range(row.updates_per_step - 1):
            spent = self._update(spent, with_policy=False)
        self._sums = self._update(self._sums, with_policy=True)
        count["summed"] += 1
        if row.phase_updates and count["steps"] % row.phase_every == 0:
            self._begin_phase()

    def _action(self) -> np.ndarray:
        random = generator(self._seed, "action", self._count["steps"])
        if len(self._sources[0]) <= self._row.random_steps:
            return random.uniform(-1.0, 1.0, self._joints).astype(np.float32)
        noise = random.standard_normal(self._joints, np.float32)
        action = np.asarray(_act(self._state.policy, self._observation, noise))
        if not np.isfinite(action).all():
            raise Diverged(f"the learner diverged: its action is not finite at step {self.step}")
        return action

    def _update(self, sums: dict, with_policy: bool) -> dict:
        """Make an update, and return the sums of its figures and those before."""
        self._state, sums = _update(self._core, self._state, sums, *self._drawn(with_policy))
        self._count["updates"] += 1
        return sums

    def _drawn(self, with_policy: bool):
        """Draw the batch and the noise of the next update; in a phase also return what the policy does next."""
        row, random = self._row, generator(self._seed, "update", self._count["updates"])
        batches, following = [], []
        for place, source in enumerate(self._sources):
            held_out = 0 if self._phase is None else self._phase.held_out
            indices = random.integers(held_out, len(source), size=row.batch)
            indices = self._orders[place][indices] if held_out else indices
            batches.append(source.at(indices))
            if self._phase is not None:
                following.append([numbers[indices] for numbers in self._following[place]])
        batch = Transitions(*_joined(batches))
        noise = sac.noise(row, random, len(batch.rewards), self._joints, with_policy)
        return batch, noise, _joined(following) if following else None

    def _begin_phase(self) -> None:
        row = self._row
        wanted = 0 if row.early_stop == "none" else max(row.batch, int(row.held_out * len(self._replay)))
        most = min(map(len, self._sources)) - row.batch
        held_out = min(wanted, most)
        self._phase = Phase(0, held_out if held_out >= row.batch else 0, Patience(0.0))
        self._prepare_phase()
        if self._phase.held_out:
            self._phase = self._phase._replace(patience=Patience(self._look()))

    def _prepare_phase(self) -> None:
        """Draw what is held out of the present phase, and let the policy, which rests, say what it does next.

        The same again after a restore.
        """
        if self._phase.held_out:
            random = generator(self._seed, "held out", self._count["steps"])
            self._orders = [random.permutation(len(source)).astype(np.int32) for source in self._sources]
        self._following = [self._distributions(source) for source in self._sources]

    def _distributions(self, source) -> list[np.ndarray]:
        """Return the policy's distribution of the next observation of every transition."""
        results = [np.empty((len(source), self._joints), np.float32) for _ in range(2)]
        for first in range(0, len(source), _ROWS):
            indices = np.arange(first, first + _ROWS).clip(max=len(source) - 1)  # of one shape, so compiled once
            part = _distribution(self._state.policy, source.at(indices).next_observations)
            for result, numbers in zip(results, part, strict=True):
                result[first : first + _ROWS] = numbers[: len(source) - first]
        return results

    def _advance_phase(self) -> None:
        """Make updates of the critics up to the next look, take it, and end the phase if it is time."""
        row, count, phase, sums = self._row, self._count, self._phase, _zeros(_OF_CRITICS)
        updates = min(row.check_every, row.phase_updates - phase.updates)
        for _ in range(updates):
            sums = self._update(sums, with_policy=False)
        self._phase = phase = phase._replace(updates=phase.updates + updates)
        if phase.held_out:
            patience = phase.patience.looked(row.early_stop, self._look(), row.improvement, updates)
            self._phase = phase = phase._replace(patience=patience)
        if phase.updates == row.phase_updates or (phase.held_out and phase.patience.waited >= row.patience):
            count["phase_updates"] += phase.updates
            self._phase = self._orders = self._following = None

    def _look(self) -> float:
        """Return the policy's loss on what is held out."""
        row, phase = self._row, self._phase
        size = row.batch * min(phase.held_out // row.batch, row.scored_batches)
        pairs = zip(self._sources, self._orders, strict=True)
        observations = np.concatenate([source.at(order[:size]).observations for source, order in pairs])
        random = generator(self._seed, "look", self._count["updates"])
        noise = sac.noise(row, random, len(observations), self._joints, with_policy=True)
        kept = None if noise.kept is None else noise.kept[2]
        return float(_look(self._core, self._state, observations, noise.action, kept))

    def _figures(self) -> dict[str, float]:
        count = self._count
        means = {name: float(total) / max(count["summed"], 1) for name, total in self._sums.items()}
        figures = {
            "episode_return": self._earned["latest"],
            **means,
            "updates": count["updates"],
            "phase_updates": count["phase_updates"],
        }
        self._sums = _zeros(_FIGURES)
        count["summed"] = count["phase_updates"] = 0
        return figures


def _joined(several: list) -> list[np.ndarray]:
    """Arrays of several sources, one after the other."""
    return several[0] if len(several) == 1 else [np.concatenate(arrays) for arrays in zip(*several, strict=True)]
