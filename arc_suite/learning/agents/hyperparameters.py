"""Hyperparameters of the learners. Nothing here needs JAX."""

import dataclasses
import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from arc_suite import checks, registry
from arc_suite.envs.base_vector import MAX_ENVS
from arc_suite.motions import motion_text

_POSITIVE_RANGE = (1e-6, 1e3)  # of numbers that must not be 0
_MAX_STEPS = 1 << 16  # control steps of an environment, or passes, between which a run neither saves nor stops
_MAX_BATCH = 1 << 24
_RANGES_OF_ALL = {  # of all algorithms
    "num_envs": (1, MAX_ENVS),
    "hidden": (1, 1 << 16),
    "horizon": (1, _MAX_STEPS),
    "round": (1, _MAX_STEPS),
    "n_step": (1, _MAX_STEPS),
    "epochs": (1, _MAX_STEPS),
    "batch": (1, _MAX_BATCH),
    "minibatch": (1, _MAX_BATCH),
}
# Blocks that networks do not see by default. Contact forces are 114 to 150 numbers; learners that act are better
# without them: docs/algorithms.md.
BLOCKS_LEFT_OUT = ("contact_forces",)
# Functions that make an architecture for a task, see `architectures.of`; as `module:name`, since they need JAX.
NETWORKS = {
    "perceptron": "arc_suite.learning.agents.architectures:Perceptron.of",
    "legs": "arc_suite.learning.agents.leg_networks:Legs.of",
}


class DeviceDefaults(NamedTuple):
    """What a run has by default, in place of its algorithm's, where its simulation fills a GPU.

    Attributes:
        hyperparameters: hyperparameters by name.
        num_envs_of_seeds: environments of each of several seeds in one program.
        steps: environment steps of a run.
        long_steps: environment steps of a run with commands, or in any arena except the flat one.
        evaluations: evaluations of a run.
    """

    hyperparameters: Mapping[str, int]
    num_envs_of_seeds: int
    steps: int
    long_steps: int
    evaluations: int


# By the hyperparameter `simulation`. Fewer worlds cost as much time, more ones learn less from a step: docs/gpu.md.
DEVICE_DEFAULTS = {
    "warp": DeviceDefaults(
        {"num_envs": 4096, "horizon": 16, "minibatch": 4096},
        num_envs_of_seeds=1024,
        steps=6_500_000,
        long_steps=18_000_000,
        evaluations=10,
    )
}


@dataclasses.dataclass(frozen=True)
class SoftActorCritic:
    """Hyperparameters of soft actor-critic (Haarnoja et al., "Soft actor-critic algorithms and applications", 2018).

    Defaults are those of SAC in the published code of the ARC-RL paper.

    Attributes:
        hidden: units of each of the two hidden layers, of policy and critics.
        learning_rate: learning rate of Adam, for policy, critics and temperature.
        discount: discount of a control step.
        n_step: control steps of the rewards in a target, before the critics' value.
        tau: step of the target networks towards the critics in each update.
        batch: transitions of an update from each source of data.
        buffer_size: number of the latest online transitions, from which batches are drawn.
        dropout: share of units that the critics drop.
        critics: "squared": they learn values, by squared errors. "categorical": they learn distributions over returns,
            by cross-entropy, with batch norm and weights on the unit sphere; see `categorical`.
        network: network of policy and critics. "perceptron": it sees the complete observation. "legs": all legs share
            it, and half of its first units are means over legs; see `leg_networks.Legs`.
        prior: use of prior data. "none"; "protected": in one buffer with online data, never overwritten; or
            "symmetric_sampling": a second batch in every update.
        num_envs: environments, which step together.
        utd_ratio: updates of an environment step; a share where several environments step together. Of several
            updates of a step, the last one moves the policy too; all others move the critics alone.
        start_steps: actions are uniform while the buffer has at most this many transitions; 0 for never. Updates do
            not wait.
        reward_scale: factor of rewards.
        initial_std: standard deviation of actions at the start, before the tanh.
        last_gain: factor of the initial weights of the policy's last layers.
        initial_temperature: weight of the entropy at the start.
        target_entropy: entropy of a joint's action, which the temperature is adapted to.
        symmetry_augmentation: whether every other transition of a batch is mirrored, for symmetric bodies.
        normalize: whether running moments normalize observations.
        exclude_blocks: names of blocks of the observation that networks do not see, where a task has them.
        phase_every: environment steps between stabilization phases.
        phase_updates: largest number of updates of the critics alone in a phase; 0 for no phases.
        early_stop: rule that ends a phase early: "none", "published" or "sign_safe"; see `stopping`.
        held_out: share of the online transitions in the validation set of a phase.
        scored_batches: largest number of batches of each source in a validation loss.
        check_every: updates between two validation losses.
        patience: updates without improvement that end a phase.
        improvement: relative improvement of the validation loss that counts as one.
    """

    hidden: int = 256
    learning_rate: float = 3e-4
    discount: float = 0.99
    n_step: int = 1
    tau: float = 0.005
    batch: int = 256
    buffer_size: int = 1_000_000
    dropout: float = 0.0
    critics: str = "squared"
    network: str = "perceptron"
    prior: str = "none"
    num_envs: int = 1
    utd_ratio: float = 1.0
    start_steps: int = 5000
    reward_scale: float = 1.0
    initial_std: float = 1.0
    last_gain: float = 1.0
    initial_temperature: float = 1.0
    target_entropy: float = -1.0
    symmetry_augmentation: bool = False
    normalize: bool = False
    exclude_blocks: tuple[str, ...] = ()
    phase_every: int = 10_000
    phase_updates: int = 0
    early_stop: str = "none"
    held_out: float = 0.1
    scored_batches: int = 16
    check_every: int = 1000
    patience: int = 10_000
    improvement: float = 0.001

    def __post_init__(self):
        """Raise ValueError for a value out of its range."""
        ranges = {
            "start_steps": (0,),
            "phase_updates": (0,),
            "tau": (1e-6, 1.0),
            "dropout": (0.0, 0.9),
            "last_gain": (0.0, 1e3),
            "target_entropy": (-100.0, 100.0),
            "utd_ratio": (0.0, 1e3),
            "reward_scale": _POSITIVE_RANGE,
            "initial_std": _POSITIVE_RANGE,
            "initial_temperature": _POSITIVE_RANGE,
        }
        _check_numbers(self, ranges)
        updates = self.utd_ratio if self.utd_ratio > 1.0 else self.num_envs * self.utd_ratio
        if not updates or not math.isclose(updates, round(updates)):  # rounding makes 100 * 0.07 another number than 7
            raise ValueError(
                f"utd_ratio: expected a whole number of updates when {self.num_envs} environments step, of each if "
                f"it is above 1, got {checks.preview(self.utd_ratio)}"
            )
        checks.name(self.critics, ("squared", "categorical"), "critics")
        checks.name(self.network, NETWORKS, "network of soft actor-critic")
        if self.dropout and (self.critics == "categorical" or self.network == "legs"):
            reason = "categorical critics" if self.critics == "categorical" else "a network of legs"
            raise ValueError(f"dropout: expected 0 with {reason}, got {self.dropout}")
        checks.name(self.prior, ("none", "protected", "symmetric_sampling"), "prior")
        checks.name(self.early_stop, ("none", "published", "sign_safe"), "early_stop")
        if self.early_stop != "none" and not self.phase_updates:
            raise ValueError(f"early_stop: expected none without phases, phase_updates=0, got {self.early_stop}")
        # Prior data in the same buffer count towards the start steps.
        if self.buffer_size <= self.start_steps and self.prior != "protected":
            raise ValueError(
                f"buffer_size: expected more than start_steps, {self.start_steps}, after which the policy acts, "
                f"got {self.buffer_size}"
            )

    @property
    def updates_of_a_step(self) -> int:
        """Number of updates after all environments have stepped once."""
        return round(self.num_envs * self.utd_ratio)

    def update_groups(self) -> Iterator[tuple[int, bool]]:
        """Yield the updates after all environments have stepped once: their number, and whether the policy learns."""
        updates_of_policy = self.updates_of_a_step // self.policy_every
        if self.policy_every == 1:
            yield updates_of_policy, True
            return
        for _ in range(updates_of_policy):
            yield self.policy_every - 1, False
            yield 1, True

    @property
    def policy_every(self) -> int:
        """Number of updates of which the last one moves the policy too."""
        return max(1, round(self.utd_ratio))


@dataclasses.dataclass(frozen=True)
class DAgger:
    """Hyperparameters of DAgger, imitation of a demonstrator.

    Attributes:
        preset: preset of the demonstrator; "" for the preset that suits the task.
        num_envs: environments; the demonstrator acts in half of them.
        noise: standard deviation of the noise on actions.
        left_out: number of the first control steps of an episode that are not learned from, as the demonstrator
            starts by a clock that the network does not see.
        round: control steps of each environment between fits.
        updates: updates of a fit.
        last_updates: updates of the last fit, over which the learning rate falls to 0.
        batch: labels of an update.
        hidden: units of each of the two hidden layers.
        learning_rate: learning rate of Adam.
        exclude_blocks: names of blocks of the observation that the network does not see, where a task has them.
    """

    preset: str = ""
    num_envs: int = 64
    noise: float = 0.1
    left_out: int = 25
    round: int = 50
    updates: int = 100
    last_updates: int = 800
    batch: int = 1024
    hidden: int = 256
    learning_rate: float = 1e-3
    exclude_blocks: tuple[str, ...] = BLOCKS_LEFT_OUT

    def __post_init__(self):
        """Raise ValueError for a value out of its range."""
        _check_numbers(self, {"num_envs": (2, MAX_ENVS), "left_out": (0,), "noise": (0.0, 10.0)})


@dataclasses.dataclass(frozen=True)
class BehaviorCloning:
    """Hyperparameters of behavior cloning.

    Attributes:
        batch: transitions of an update.
        hidden: units of each of the two hidden layers.
        learning_rate: learning rate of Adam at the start; it falls to 0.
        exclude_blocks: names of blocks of the observation that the network does not see, where a task has them.
    """

    batch: int = 256
    hidden: int = 256
    learning_rate: float = 1e-3
    exclude_blocks: tuple[str, ...] = ()

    def __post_init__(self):
        """Raise ValueError for a value out of its range."""
        _check_numbers(self, {})


@dataclasses.dataclass(frozen=True)
class ProximalPolicy:
    """Hyperparameters of proximal policy optimization (Schulman et al., 2017).

    Attributes:
        start: folder of a run, or a policy file, whose policy learning starts from; "" for none.
        simulation: simulator of the environments. "mujoco": on a processor. "mjx" or "warp": the implementations of
            `arc_suite.learning.worlds.mjx`, with which all of learning stays on JAX's device.
        num_envs: environments.
        horizon: control steps of each environment between updates.
        network: network of policy and values. "perceptron": two layers that see the complete observation. "legs": all
            legs share it, see `leg_networks`. `module:name`: that of another package.
        symmetry_augmentation: whether left and right are alike, for symmetric bodies. A perceptron learns from a
            mirrored copy of each transition; left and right legs share one network.
        epochs: passes over the transitions of a horizon.
        minibatch: transitions of an update, mirrored ones counted.
        discount: discount of a control step.
        gae_lambda: decay of the generalized advantage estimate.
        clip: range of the probability ratio around 1.
        initial_std: standard deviation of actions at the start.
        final_std: the same at the end of the schedule; it falls geometrically.
        initial_desired_kl: desired Kullback-Leibler divergence of an iteration's policy from the last, at the start.
        final_desired_kl: the same at the end of the schedule.
        schedule_steps: fewest environment steps of the schedule. That of a longer run spans the run; a shorter run
            stops within it, as noise that falls faster keeps it from learning.
        policy_rate: learning rate of the policy at the start; it follows the divergence.
        value_rate: learning rate of the value function.
        gradient_norm: the largest norm of a gradient; longer ones are scaled down.
        normalize_until: share of the schedule during which the observation normalizer is updated; never if learning
            starts from a policy.
        value_warm_up: control steps of each environment during which only the value function learns; 0 unless
            learning starts from a policy.
        hidden: units of each of the two hidden layers.
        exclude_blocks: names of blocks of the observation that networks do not see, where a task has them.
        critic_blocks: names of blocks of the privileged observation that the value function sees too; see
            `arc_suite.tasks.privileged`.
        style: file of a motion (.npz) that the policy is to resemble, see `motion_style`; "" for none.
        style_share: share of the style in the reward.
    """

    start: str = ""
    simulation: str = "mujoco"
    num_envs: int = 64
    horizon: int = 32
    network: str = "perceptron"
    symmetry_augmentation: bool = True
    epochs: int = 5
    minibatch: int = 1024
    discount: float = 0.97
    gae_lambda: float = 0.95
    clip: float = 0.2
    initial_std: float = 0.37
    final_std: float = 0.07
    initial_desired_kl: float = 0.03
    final_desired_kl: float = 0.01
    schedule_steps: int = 1
    policy_rate: float = 3e-4
    value_rate: float = 5e-4
    gradient_norm: float = 1.0
    normalize_until: float = 0.7
    value_warm_up: int = 0
    hidden: int = 256
    exclude_blocks: tuple[str, ...] = BLOCKS_LEFT_OUT
    critic_blocks: tuple[str, ...] = ()
    style: str = ""
    style_share: float = 0.5

    def __post_init__(self):
        """Put the motion of a file in place of its path. Raise ValueError for a value out of its range."""
        ranges = {
            "value_warm_up": (0,),
            "gae_lambda": (0.0, 1.0),
            "normalize_until": (0.0, 1.0),
            "initial_std": _POSITIVE_RANGE,
            "final_std": _POSITIVE_RANGE,
            "initial_desired_kl": _POSITIVE_RANGE,
            "final_desired_kl": _POSITIVE_RANGE,
            "gradient_norm": _POSITIVE_RANGE,
        }
        _check_numbers(self, ranges)
        checks.name(self.simulation, ("mujoco", "mjx", "warp"), "simulation")
        object.__setattr__(self, "style", motion_text.embed(self.style))  # a run holds its motion, as settings do
        if not self.style and self.style_share != ProximalPolicy.style_share:
            raise ValueError(
                f"style_share: expected a motion as style, of which it is the share, got {self.style_share}"
            )
        registry.find_entry("network", self.network, NETWORKS)
        self.check_minibatch(has_copies=self.symmetry_augmentation and self.network != "legs")

    def check_minibatch(self, has_copies: bool) -> None:
        """Check that the transitions of a horizon fill a minibatch.

        Args:
            has_copies: whether each transition has a mirrored copy. It has none of an asymmetric body, or if the
                network treats left and right alike.

        Raises:
            ValueError: they are too few.
        """
        transitions = (1 + has_copies) * self.num_envs * self.horizon
        if self.minibatch > transitions:
            copies = ", mirrored copies counted" if has_copies else ""
            expected = f"at most the {transitions} transitions of a horizon{copies}"
            raise ValueError(f"minibatch: expected {expected}, got {self.minibatch}")


def _check_numbers(hp, ranges: Mapping[str, tuple]) -> None:
    """Check the values of hyperparameters.

    Args:
        hp: a dataclass of hyperparameters.
        ranges: the lowest, and maybe the highest, allowed number by name. Integers without a range are at least 1, and
            other numbers without a range are shares between 0 and 1.

    Raises:
        ValueError: a number out of its range, or a tuple of anything but names.
    """
    for field in dataclasses.fields(hp):
        name = field.name
        value = getattr(hp, name)
        if field.type is int:
            checks.integer(name, value, *ranges.get(name, _RANGES_OF_ALL.get(name, (1,))))
        elif field.type is float:
            checks.number(name, value, *ranges.get(name, ()))
            if name not in ranges and not 0.0 < value < 1.0:
                raise ValueError(f"{name}: expected a number between 0 and 1, got {checks.preview(value)}")
        elif isinstance(value, tuple) and not all(isinstance(block, str) for block in value):
            raise ValueError(f"{name}: expected names of blocks, got {checks.preview(value)}")
