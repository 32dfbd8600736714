"""Rows of numbers of what learns. Nothing here needs JAX."""

import dataclasses
from collections.abc import Mapping

from arc_suite import checks


@dataclasses.dataclass(frozen=True)
class SoftActorCritic:
    """The numbers of a soft actor-critic (Haarnoja et al., "Soft actor-critic algorithms and applications", 2018).

    Defaults are what the published code of the ARC-RL paper has for SAC.

    Attributes:
        hidden: units of each of the two hidden layers, of policy and critics.
        learning_rate: of Adam, for policy, critics and temperature.
        discount: of a control step.
        averaging: share of a critic that its target takes over in each update.
        batch: transitions of an update from each source of data.
        capacity: latest online transitions that are kept.
        dropout: share of units that the critics drop.
        prior: what prior data are: "none"; "fenced", in one buffer with online data, never overwritten; or
            "beside", a batch of their own in every update.
        updates_per_step: of an environment step; all but the last are of the critics alone.
        random_steps: the policy acts once the buffer has more transitions than this; before, actions are uniform.
        phase_every: environment steps between stabilisation phases.
        phase_updates: the most updates of critics alone in a phase; 0 for no phases.
        early_stop: what ends a phase before: "none", "published" or "sign_safe"; see `stopping`.
        held_out: share of the online transitions by which phases are judged.
        scored_batches: the most batches from each source by which they are judged at a time.
        check_every: updates between two looks at them.
        patience: updates without improvement after which a phase ends.
        improvement: relative improvement that counts.
    """

    hidden: int = 256
    learning_rate: float = 3e-4
    discount: float = 0.99
    averaging: float = 0.005
    batch: int = 256
    capacity: int = 1_000_000
    dropout: float = 0.0
    prior: str = "none"
    updates_per_step: int = 1
    random_steps: int = 5000
    phase_every: int = 10_000
    phase_updates: int = 0
    early_stop: str = "none"
    held_out: float = 0.1
    scored_batches: int = 16
    check_every: int = 1000
    patience: int = 10_000
    improvement: float = 0.001

    def __post_init__(self):
        """Check the numbers.

        Raises:
            ValueError: one that does not fit; one line.
        """
        least = {"hidden": 1, "batch": 1, "capacity": 1, "updates_per_step": 1, "random_steps": 0, "phase_every": 1}
        _check(self, least | {"phase_updates": 0, "scored_batches": 1, "check_every": 1, "patience": 1})
        _check_shares(self, "learning_rate", "discount", "averaging", "held_out", "improvement")
        checks.number("dropout", self.dropout, 0.0, 0.9)
        checks.name(self.prior, ("none", "fenced", "beside"), "prior")
        checks.name(self.early_stop, ("none", "published", "sign_safe"), "early_stop")
        if self.capacity <= self.random_steps and self.prior != "fenced":  # prior data in the same buffer count too
            raise ValueError(
                f"capacity: expected more than random_steps, {self.random_steps}, after which the policy acts, "
                f"got {self.capacity}"
            )


@dataclasses.dataclass(frozen=True)
class Imitation:
    """The numbers of imitation of a demonstrator.

    Attributes:
        preset: of the demonstrator; "" for that which suits the task.
        rows: that act side by side, half of them by the demonstrator.
        noise: standard deviation of what is added to actions.
        left_out: first control steps of an episode that are not learned from, as the demonstrator sets out by a
            clock that the network does not see.
        round: control steps between fits.
        updates: of a fit.
        last_updates: of the last one, over which the rate falls to 0.
        batch: labels of an update.
        hidden: units of each of the two hidden layers.
        learning_rate: of Adam.
    """

    preset: str = ""
    rows: int = 64
    noise: float = 0.1
    left_out: int = 25
    round: int = 50
    updates: int = 100
    last_updates: int = 800
    batch: int = 1024
    hidden: int = 256
    learning_rate: float = 1e-3

    def __post_init__(self):
        """Check the numbers.

        Raises:
            ValueError: one that does not fit; one line.
        """
        least = {"rows": 2, "left_out": 0, "round": 1, "updates": 1, "last_updates": 1, "batch": 1, "hidden": 1}
        _check(self, least)
        checks.number("noise", self.noise, 0.0, 10.0)
        _check_shares(self, "learning_rate")


@dataclasses.dataclass(frozen=True)
class Cloning:
    """The numbers of behaviour cloning.

    Attributes:
        batch: transitions of an update.
        hidden: units of each of the two hidden layers.
        learning_rate: of Adam, at first; it falls to 0.
    """

    batch: int = 256
    hidden: int = 256
    learning_rate: float = 1e-3

    def __post_init__(self):
        """Check the numbers.

        Raises:
            ValueError: one that does not fit; one line.
        """
        _check(self, {"batch": 1, "hidden": 1})
        _check_shares(self, "learning_rate")


@dataclasses.dataclass(frozen=True)
class ProximalPolicy:
    """The numbers of proximal policy optimisation (Schulman et al., 2017).

    Attributes:
        start: folder of a run, or a policy file, whose policy is where learning starts; "" for none.
        rows: that act side by side.
        horizon: control steps between updates.
        mirrored: whether every step counts for its mirror image too, where the body has one.
        epochs: passes over what was seen since the last updates.
        minibatch: steps of an update, mirror images counted.
        discount: of a control step.
        trace: decay of the generalised advantage estimate, lambda.
        clip: by how much the ratio of probabilities counts at most.
        first_std: standard deviation of actions at the start.
        last_std: the same at the end; between them it falls geometrically.
        first_divergence: Kullback-Leibler divergence of an update from the policy before, wanted at the start.
        last_divergence: the same at the end.
        policy_rate: of Adam for the policy, at the start; it follows the divergence.
        value_rate: of Adam for the values.
        gradient_norm: the largest that an update follows.
        normalising: share of the run in which the observations' moments are updated; of a policy that learning
            starts from they stay.
        warm_up: control steps of each row in which values alone learn; 0 unless learning starts from a policy.
        hidden: units of each of the two hidden layers.
    """

    start: str = ""
    rows: int = 64
    horizon: int = 32
    mirrored: bool = True
    epochs: int = 5
    minibatch: int = 1024
    discount: float = 0.97
    trace: float = 0.95
    clip: float = 0.2
    first_std: float = 0.37
    last_std: float = 0.07
    first_divergence: float = 0.03
    last_divergence: float = 0.01
    policy_rate: float = 3e-4
    value_rate: float = 5e-4
    gradient_norm: float = 1.0
    normalising: float = 0.7
    warm_up: int = 0
    hidden: int = 256

    def __post_init__(self):
        """Check the numbers.

        Raises:
            ValueError: one that does not fit; one line.
        """
        _check(self, {"rows": 1, "horizon": 1, "epochs": 1, "minibatch": 1, "hidden": 1, "warm_up": 0})
        _check_shares(self, "discount", "trace", "clip", "normalising", "policy_rate", "value_rate")
        for name in ("first_std", "last_std", "first_divergence", "last_divergence", "gradient_norm"):
            checks.number(name, getattr(self, name), 1e-6, 1e3)
        if self.minibatch > self.rows * self.horizon * (2 if self.mirrored else 1):
            raise ValueError(f"minibatch: expected at most the steps between updates, got {self.minibatch}")


def _check(row, least: Mapping[str, int]) -> None:
    for name, low in least.items():
        checks.integer(name, getattr(row, name), low)


def _check_shares(row, *names: str) -> None:
    for name in names:
        checks.number(name, getattr(row, name), 0.0, 1.0)
