"""The interface of learners: what `learn` takes and what it yields; see `arc_suite.learning.agents`."""

import contextlib
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode

from arc_suite import checks, parsers, seed_ranges, usage
from arc_suite.bodies import BodiesEnv
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.learning import teachers
from arc_suite.policies.graph import Graph

MAX_RUN_SEED = 40_000
ENVIRONMENT_PREFIX = "environment/"  # prefix of the names in a checkpoint
# Prefixes of what is not learned: commands of tasks may be NaN, and ground that nobody has seen is at -inf.
UNLEARNED_PREFIXES = (ENVIRONMENT_PREFIX, teachers.PREFIX)


class Diverged(ValueError):
    """A value of the learner is not finite.

    Attributes:
        folder: folder of the run.
    """

    def __init__(self, what: str, step: int, folder: Path):
        """Make the message.

        Args:
            what: the value in words, such as "an action is not finite".
            step: environment step.
            folder: folder of the run.
        """
        super().__init__(f"the learner diverged: {what} at step {step}; the checkpoint before stays")
        self.folder = folder


class Damaged(ValueError):
    """The checkpoint lacks something, or does not fit."""


class RunContext(NamedTuple):
    """The run that a learner learns in.

    Attributes:
        setup: body, or bodies, task and settings in which the policy is evaluated.
        training: body, or bodies, task and settings in which the policy learns; it sees the same blocks.
        seed: seed of the run.
        steps: environment steps of the run.
        evaluate_every: environment steps between evaluations.
        folder: folder of the run.
        prior: id of a dataset of prior data; None for none.
        threads: threads of the simulation; results do not depend on it.
        checkpoint: arrays of the latest `Slice` to resume from; None for a new run.
    """

    setup: Setup
    training: Setup
    seed: int
    steps: int
    evaluate_every: int
    folder: Path
    prior: str | None = None
    threads: int = 1
    checkpoint: Mapping[str, np.ndarray] | None = None

    @property
    def first_seed(self) -> int:
        """The first seed of the environments to learn in; no evaluation and no other run has it."""
        return seed_ranges.of_run(self.seed).start

    def environment(self, num_envs: int = 1, **options: Any) -> VectorEnv | BodiesEnv:
        """Return environments to learn in, whose seeds no evaluation and no other run has.

        Their `reset()` begins the first episodes. For the options see `VectorEnv`.
        """
        defaults = {"num_threads": self.threads, "autoreset_mode": AutoresetMode.SAME_STEP}
        return self.training.make_vec(num_envs, seed=self.first_seed, **(defaults | options))

    def count_steps(self, steps: int) -> None:
        """Count steps of a simulator that is not the suite's, or updates of an algorithm that does not act.

        Environments of the suite count their steps themselves. The record of the run has both numbers.

        Raises:
            ValueError: no integer, or a negative one.
        """
        usage.count_steps_by_learner(checks.integer("steps", steps, 0))

    def next_evaluation(self, step: int) -> int:
        """Return the environment step of the first evaluation after `step`."""
        next_multiple = (step // self.evaluate_every + 1) * self.evaluate_every
        return min(next_multiple, self.steps)


class Slice(NamedTuple):
    """A slice of learning, which takes seconds.

    Attributes:
        metrics: a line of training.csv, metrics by name; all lines have the same names. None for no line.
        policy: graph of the deterministic policy, from the flat observation to actions in [-1, 1].
        checkpoint: everything that learning resumes from, arrays by name.
        is_complete: whether learning from the latest environment step is complete; before, no policy is evaluated.
    """

    metrics: Mapping[str, float] | None
    policy: Graph
    checkpoint: dict[str, np.ndarray]
    is_complete: bool = True


@contextlib.contextmanager
def restoring() -> Iterator[None]:
    """Raise `Damaged` in place of the errors of a checkpoint that lacks something or does not fit."""
    try:
        yield
    except Exception as error:
        raise Damaged(parsers.describe(error)) from None


def generator(seed: int, purpose: str, count: int) -> np.random.Generator:
    """Return the random generator of one purpose of a run, such as its 1000th update."""
    return np.random.default_rng((seed, zlib.crc32(purpose.encode()), count))


def environment_arrays(environment: VectorEnv | BodiesEnv) -> dict[str, np.ndarray]:
    """Return the snapshot of an environment as part of a checkpoint."""
    return name_environment_arrays(environment.snapshot())


def name_environment_arrays(snapshot: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the snapshot of an environment with the names that its arrays have in a checkpoint."""
    return {f"{ENVIRONMENT_PREFIX}{name}": array for name, array in snapshot.items()}


def restore_environment(environment: VectorEnv | BodiesEnv, arrays: Mapping[str, np.ndarray]) -> np.ndarray:
    """Restore an environment from `environment_arrays`, and return its observations (num_envs, size)."""
    snapshot = environment_snapshot(arrays)
    environment.restore(snapshot)
    return snapshot["observation"]


def environment_snapshot(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the snapshot of an environment that is part of a checkpoint."""
    return {
        name.removeprefix(ENVIRONMENT_PREFIX): array
        for name, array in arrays.items()
        if name.startswith(ENVIRONMENT_PREFIX)
    }
