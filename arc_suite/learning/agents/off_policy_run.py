"""What the host keeps of a run of soft actor-critic: its replay buffer, its counts, what it draws, and its phase."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from arc_suite.learning.agents import networks
from arc_suite.learning.agents import soft_actor_critic as sac
from arc_suite.learning.agents.hyperparameters import SoftActorCritic
from arc_suite.learning.agents.inputs import NetworkInputs
from arc_suite.learning.agents.learner import Diverged, RunContext, Slice, generator
from arc_suite.learning.agents.normalizer import Moments
from arc_suite.learning.agents.replay import CombinedReplay, Replay, Transitions
from arc_suite.learning.agents.stopping import Patience
from arc_suite.tasks import Task

STEPS_PER_SLICE = 1000  # environment steps


class Phase(NamedTuple):
    """A stabilization phase.

    Attributes:
        updates: made so far.
        held_out: transitions of each source in the validation set; 0 for no early stopping.
        patience: state of the early stopping.
        orders: a permutation of each source, whose first `held_out` are the validation set; None for no set.
        next_actions: the policy's distributions at the next observations of each source, which stay, as the policy
            does not change. None if updates do not use them.
    """

    updates: int
    held_out: int
    patience: Patience
    orders: list[np.ndarray] | None
    next_actions: list[list[np.ndarray]] | None = None


class OffPolicyRun:
    """A run, without its environments and networks.

    Attributes:
        hp: hyperparameters.
        context: context of the run.
        inputs: how networks see observations.
        prior: prior data; None for none.
        buffer: the replay buffer.
        sources: sources of transitions; every update has a batch of each.
        steps: environment steps, of all environments together.
        updates: updates.
        phase_updates: updates in the phases since the latest line of metrics.
        summed_updates: updates of the policy since the latest line of metrics.
        episode_returns: (num_envs,) returns so far, of the present episodes.
        latest_return: return of the latest episode that has ended.
        phase: the present phase; None for none.
    """

    def __init__(self, hp: SoftActorCritic, context: RunContext, task: Task, prior: Replay | None):
        """Open the buffer.

        Raises:
            OSError: the disk is too small for the buffer.
        """
        self.hp = hp
        self.context = context
        self._joints = len(task.scene.body.joint_names)
        self.inputs = NetworkInputs.of(task, hp.normalize, hp.symmetry_augmentation, hp.network)
        self.prior = prior
        self.buffer = _open_buffer(hp, context, task.size, self._joints)
        self.sources = _sources(hp, self.buffer, self.prior)
        self.steps = 0
        self.updates = 0
        self.phase_updates = 0
        self.summed_updates = 0
        self.episode_returns = np.zeros(hp.num_envs)
        self.latest_return = 0.0
        self.phase = None

    def restore(self, saved: Mapping[str, np.ndarray]) -> None:
        """Restore what the arrays of a checkpoint hold."""
        self.steps, self.updates, self.phase_updates, self.summed_updates = map(int, saved["count"])
        self.episode_returns = np.array(saved["earned"][:-1])
        self.latest_return = saved["earned"][-1]
        if self.inputs.moments is not None:
            moments = Moments(*(saved[f"moments/{name}"] for name in Moments._fields))
            self.inputs = self.inputs._replace(moments=moments)
        self.buffer.restore(*map(int, saved["replay"]))
        if saved["phase"].size:
            updates, held_out, best_loss, updates_waited = saved["phase"]
            phase = self._draw_phase(int(held_out))
            self.phase = phase._replace(updates=int(updates), patience=Patience(float(best_loss), int(updates_waited)))

    @property
    def acts_at_random(self) -> bool:
        """Whether actions are uniform, as the buffer has few transitions."""
        return bool(self.hp.start_steps) and len(self.sources[0]) <= self.hp.start_steps

    def draw_actions(self) -> np.ndarray:
        """Draw uniform actions (num_envs, joints)."""
        random = generator(self.context.seed, "action", self.steps)
        return random.uniform(-1.0, 1.0, (self.hp.num_envs, self._joints)).astype(np.float32)

    def draw_action_noise(self) -> np.ndarray:
        """Draw the noise (num_envs, *network joints) of the policy's actions."""
        random = generator(self.context.seed, "action", self.steps)
        return random.standard_normal((self.hp.num_envs, *self.inputs.joints), np.float32)

    def check_actions(self, actions: np.ndarray) -> None:
        """Raise Diverged for an action that is not finite."""
        if not np.isfinite(actions).all():
            raise Diverged("an action is not finite", self.steps, self.context.folder)

    def add(self, transitions: Transitions, is_last: np.ndarray) -> None:
        """Count a step of all environments, and add its transitions to the buffer.

        Args:
            transitions: arrays (num_envs, ...); next observations are those after the step, also at the end of an
                episode.
            is_last: (num_envs,) whether they are the last of their episodes.
        """
        for observation, action, reward, goes_on, next_observation, ends in zip(*transitions, is_last, strict=True):
            self.buffer.add(observation, action, reward, not goes_on, next_observation, is_last=bool(ends))
        self.episode_returns += transitions.rewards
        for index in np.flatnonzero(is_last):
            self.latest_return = self.episode_returns[index]
            self.episode_returns[index] = 0.0
        self.steps += self.hp.num_envs

    @property
    def index_ranges(self) -> np.ndarray:
        """Ranges (sources, 2) of what an update draws: indices of transitions, or of places in the phase's orders."""
        first = 0 if self.phase is None else self.phase.held_out
        return np.array([(first, len(source)) for source in self.sources], np.int32)

    @property
    def has_orders(self) -> bool:
        """Whether updates draw places in the orders of a phase."""
        return self.phase is not None and self.phase.orders is not None

    def count_updates(self, count: int, with_policy: bool) -> None:
        """Count updates; `with_policy` says whether the policy learns too."""
        self.updates += count
        self.summed_updates += count * with_policy

    def begin_phase_if_due(self) -> bool:
        """Begin a stabilization phase if it is due, and return whether one begins.

        None begins that lacks transitions for its validation set.
        """
        hp = self.hp
        if not hp.phase_updates or not self._passes_multiple(hp.phase_every):
            return False
        held_out = self._held_out_size()
        if not held_out and hp.early_stop != "none":
            return False
        self.phase = self._draw_phase(held_out)
        return True

    def advance_phase(self, updates: int, loss: float | None) -> None:
        """Count updates of the phase, and end it if it is over.

        Args:
            updates: updates since the last check.
            loss: loss on the validation set; None without early stopping.
        """
        hp = self.hp
        phase = self.phase._replace(updates=self.phase.updates + updates)
        if loss is not None:
            patience = phase.patience.after_check(hp.early_stop, loss, hp.improvement, updates)
            phase = phase._replace(patience=patience)
        is_patience_over = loss is not None and phase.patience.waited >= hp.patience
        self.phase = phase
        if phase.updates == hp.phase_updates or is_patience_over:
            self.phase_updates += phase.updates
            self.phase = None

    @property
    def is_line_due(self) -> bool:
        """Whether the latest step ends with a line of metrics, once its phase is over."""
        return self._passes_multiple(STEPS_PER_SLICE) or self.steps >= self.context.steps

    @property
    def is_slice_due(self) -> bool:
        """Whether a slice follows the latest step: with a line, an evaluation or a phase."""
        evaluation_step = self.context.next_evaluation(self.steps - self.hp.num_envs)
        return self.is_line_due or self.phase is not None or self.steps >= evaluation_step

    def make_slice(self, metrics, sums, state: sac.SacState, environment_arrays: Mapping[str, np.ndarray]) -> Slice:
        """Return the slice of the present state. A step whose phase goes on is not complete yet.

        Args:
            metrics: a line of metrics; None for no line.
            sums: sums of metrics since the latest line.
            state: networks and their optimizers.
            environment_arrays: state of the environments, as part of a checkpoint.
        """
        checkpoint = {
            **networks.flatten_tree("state", state),
            **networks.flatten_tree("sums", sums),
            "count": np.array([self.steps, self.updates, self.phase_updates, self.summed_updates]),
            "earned": np.array([*self.episode_returns, self.latest_return]),
            "replay": np.array([self.buffer.total, self.buffer.ends, self.buffer.checksum]),
            "phase": _phase_numbers(self.phase),
            **networks.flatten_tree("moments", self.inputs.moments),
            **environment_arrays,
        }
        policy = self.inputs.policy_graph(sac.deterministic_layers(state))
        return Slice(metrics, policy, checkpoint, is_complete=self.phase is None)

    def end_line(self, sums: Mapping[str, Any]) -> dict[str, float]:
        """Return a line of metrics, given the sums since the latest line, and begin the next line."""
        means = {name: float(total) / max(self.summed_updates, 1) for name, total in sums.items()}
        counts = {"updates": self.updates, "phase_updates": self.phase_updates}
        self.summed_updates = 0
        self.phase_updates = 0
        return {"episode_return": self.latest_return, **means, **counts}

    def _passes_multiple(self, period: int) -> bool:
        """Return whether the latest steps include a multiple of a period."""
        return self.steps // period > (self.steps - self.hp.num_envs) // period

    def _held_out_size(self) -> int:
        """Return the size of the validation set in each source; 0 for no early stopping, or too few transitions.

        The set has at least a batch, and at least a batch of each source is not in it.
        """
        hp = self.hp
        if hp.early_stop == "none":
            return 0
        desired = max(hp.batch, int(hp.held_out * len(self.buffer)))
        available = min(len(source) for source in self.sources) - hp.batch
        size = min(desired, available)
        return size if size >= hp.batch else 0

    def _draw_phase(self, held_out: int) -> Phase:
        """Return a new phase, whose validation set is drawn."""
        random = generator(self.context.seed, "held out", self.steps)
        orders = None
        if held_out:
            orders = [random.permutation(len(source)).astype(np.int32) for source in self.sources]
        return Phase(updates=0, held_out=held_out, patience=Patience(0.0), orders=orders)


def _open_buffer(hp: SoftActorCritic, context: RunContext, size: int, joints: int) -> Replay:
    """Open the replay buffer of a run, or make it where the run is new."""
    control_steps = -(-context.steps // hp.num_envs)  # of each environment, rounded up
    return Replay(
        context.folder / "replay",
        capacity=min(hp.buffer_size, control_steps * hp.num_envs),
        size=size,
        joints=joints,
        slack=-(-STEPS_PER_SLICE // hp.num_envs) * hp.num_envs,  # what all environments add between two checkpoints
        mode="w+" if context.checkpoint is None else "r+",
        num_envs=hp.num_envs,
    )


def _sources(hp: SoftActorCritic, buffer: Replay, prior: Replay | None) -> Sequence[Replay | CombinedReplay]:
    """Return the sources of transitions; every update has a batch of each."""
    if hp.prior == "protected":
        return [CombinedReplay(prior, buffer)]
    if hp.prior == "symmetric_sampling":
        return [buffer, prior]
    return [buffer]


def _phase_numbers(phase: Phase | None) -> np.ndarray:
    """Return a phase as a checkpoint has it: updates, held out, best loss and updates waited; empty for no phase."""
    if phase is None:
        return np.array((), float)
    return np.array((phase.updates, phase.held_out, phase.patience.best, phase.patience.waited), float)
