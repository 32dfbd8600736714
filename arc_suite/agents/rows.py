"""Rows of numbers of imitation, of behaviour cloning and of proximal policy optimisation. Nothing here needs JAX."""

import dataclasses

from arc_suite import checks


@dataclasses.dataclass(frozen=True)
class Imitation:
    """The numbers of imitation of a demonstrator.

    Attributes:
        preset: of the demonstrator; "" for one that follows the task's command, or else earns most.
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
        for name, low in (("rows", 2), ("left_out", 0), ("round", 1), ("updates", 1), ("last_updates", 1)):
            checks.integer(name, getattr(self, name), low)
        for name in ("batch", "hidden"):
            checks.integer(name, getattr(self, name), 1)
        checks.number("noise", self.noise, 0.0, 10.0)
        checks.number("learning_rate", self.learning_rate, 0.0, 1.0)


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
        for name in ("batch", "hidden"):
            checks.integer(name, getattr(self, name), 1)
        checks.number("learning_rate", self.learning_rate, 0.0, 1.0)


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
    first_divergence: float = 0.012
    last_divergence: float = 0.004
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
        for name in ("rows", "horizon", "epochs", "minibatch", "hidden"):
            checks.integer(name, getattr(self, name), 1)
        checks.integer("warm_up", self.warm_up, 0)
        for name in ("discount", "trace", "clip", "normalising", "policy_rate", "value_rate"):
            checks.number(name, getattr(self, name), 0.0, 1.0)
        for name in ("first_std", "last_std", "first_divergence", "last_divergence", "gradient_norm"):
            checks.number(name, getattr(self, name), 1e-6, 1e3)
        if self.minibatch > self.rows * self.horizon * (2 if self.mirrored else 1):
            raise ValueError(f"minibatch: expected at most the steps between updates, got {self.minibatch}")
