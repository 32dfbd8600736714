"""What a learner is given and what it has to be; see `arc_suite.agents`."""

import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from gymnasium.vector import AutoresetMode

from arc_suite.envs.vector import VectorEnv
from arc_suite.policies.network import Layer
from arc_suite.robots.spec import Body

_SEEDS = 100_000  # of the environments of a run; those below are left for judging
MOST_SEEDS = 40_000
ENVIRONMENT = "environment/"  # with which names in `Learner.arrays` begin of what is not learnt, and may be NaN


class Diverged(ValueError):
    """Numbers of a learner are no longer finite."""


class Stage(NamedTuple):
    """What is learned, and where.

    Attributes:
        body: what moves.
        task: name of the task.
        task_kwargs: its settings, as in `arc_suite.load`.
        seed: of the run.
        steps: environment steps of the run.
        folder: of the run.
        prior: id of a dataset of prior data; None for none.
        threads: on which rows are simulated; nothing depends on it but time.
        resumed: whether `Learner.restore` follows, so that nothing need be read of where learning starts.
    """

    body: Body
    task: str
    task_kwargs: Mapping[str, Any]
    seed: int
    steps: int
    folder: Path
    prior: str | None = None
    threads: int = 1
    resumed: bool = False

    def environment(self, rows: int = 1, mode: AutoresetMode = AutoresetMode.SAME_STEP) -> VectorEnv:
        """Return rows to learn in, seeded apart from those of evaluations and of other runs.

        Their `reset()` begins the first episodes.
        """
        settings = {**self.task_kwargs, "random": _SEEDS * (1 + self.seed)}
        return VectorEnv(self.body, self.task, rows, self.threads, mode, task_kwargs=settings)


class Learner(Protocol):
    """What learns, an object that goes from slice to slice.

    Attributes:
        step: environment steps that are done with.
    """

    step: int

    def advance(self, limit: int) -> Mapping[str, float] | None:
        """Learn a slice.

        Args:
            limit: where `step` may stand afterwards at most, or about there for learners of many rows.

        Returns:
            Figures by name, always the same names: a line of training.csv; None where no line is due.

        Raises:
            Diverged: numbers are no longer finite; one line.
        """

    def policy(self) -> Sequence[Layer]:
        """Return the layers of the deterministic policy, from the flat observation to actions in [-1, 1]."""

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all that it goes on from, by name."""

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from what `arrays` has returned.

        Raises:
            KeyError, ValueError: something in it is missing or does not fit.
        """


def generator(seed: int, purpose: str, count: int) -> np.random.Generator:
    """Return the generator of random numbers for one purpose of a run, such as its 1000th update."""
    return np.random.default_rng((seed, zlib.crc32(purpose.encode()), count))


def environment_arrays(environment: VectorEnv) -> dict[str, np.ndarray]:
    """Return the snapshot of an environment, named as part of `Learner.arrays`."""
    return {f"{ENVIRONMENT}{name}": array for name, array in environment.snapshot().items()}


def restore_environment(environment: VectorEnv, arrays: Mapping[str, np.ndarray]) -> np.ndarray:
    """Let an environment go on from `environment_arrays`, and return its observations (rows, size)."""
    snapshot = {name.removeprefix(ENVIRONMENT): array for name, array in arrays.items() if name.startswith(ENVIRONMENT)}
    environment.restore(snapshot)
    return snapshot["observation"]
