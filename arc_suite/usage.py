"""What runs of training use of the suite: environment steps, seeds of episodes, and sources.

A run records its usage while it learns. All environments that are open add their steps, and the seeds of
their episodes. Demonstrators, policies and datasets add what they are. Nothing is recorded outside of runs,
and nothing while policies are judged.

An episode without a seed gets one of the run. Seeds are checked when a stream of episodes begins, when a snapshot is
restored, and in each step, as an environment may be older than the run.

Other processes and other simulators are not seen. `RunContext.count_steps` adds their steps.
"""

import contextlib
import contextvars
import os
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

# Sources: what an algorithm may learn from in addition to its own steps.
NOTHING = "nothing"
PRIOR_DATA = "prior data"
DEMONSTRATOR = "a demonstrator"
POLICY = "a policy"
UNKNOWN = "unknown"
SOURCES = (NOTHING, PRIOR_DATA, DEMONSTRATOR, POLICY, UNKNOWN)

UNKNOWN_SEED = -1  # Gymnasium's sign for a stream of unknown seed

STEP_COUNTS = ("environment_steps", "steps_by_learner")  # attributes of `Usage`, and their names in checkpoints


class Usage:
    """What a run has used so far.

    Attributes:
        environment_steps: steps of environments of the suite.
        steps_by_learner: steps that the learner has counted, of other simulators, or updates.
        sources: those of `SOURCES` that the learner has used.
    """

    def __init__(
        self,
        name: str,
        source: str = UNKNOWN,
        seeds: Sequence[range] = (),
        runs: int = 1,
        environment_steps: int = 0,
        steps_by_learner: int = 0,
        sources: Iterable[str] = (),
    ):
        """Begin with what an interrupted run has used.

        Args:
            name: name of the algorithm, for errors.
            source: what the algorithm may use, one of `SOURCES`; all of them if that is unknown.
            seeds: ranges of seeds of the episodes that the run may play; empty for all seeds.
            runs: runs that learn side by side in the same environments, each with an equal share.
            environment_steps: steps before.
            steps_by_learner: steps before.
            sources: sources before.
        """
        self.environment_steps = environment_steps
        self.steps_by_learner = steps_by_learner
        self.sources = set(sources)
        self._name = name
        self._source = source
        self._seeds = seeds
        self._runs = runs
        self._known_seeds: set[int] = set()  # that have passed the check
        self._drawn_seeds = 0
        self._process = os.getpid()

    @property
    def steps(self) -> int:
        """All steps."""
        return self.environment_steps + self.steps_by_learner

    def to_dict(self) -> dict[str, Any]:
        """Return the attributes by name, as plain values."""
        counts = {name: getattr(self, name) for name in STEP_COUNTS}
        return {**counts, "sources": sorted(self.sources)}

    def count_steps(self, steps: int) -> None:
        """Add steps of environments."""
        self.environment_steps += steps // self._runs

    def check_seeds(self, seeds: Iterable[int]) -> None:
        """Raise ValueError for the seed of an episode that the run may not play, and for an unknown one."""
        if not self._seeds:
            return
        for seed in sorted(set(seeds) - self._known_seeds):
            if not any(seed in allowed_seeds for allowed_seeds in self._seeds):
                ranges = ", ".join(f"{allowed.start} to {allowed.stop - 1}" for allowed in self._seeds)
                fault = f"seed {seed} is of an episode of others"
                if seed == UNKNOWN_SEED:
                    fault = "an episode has no known seed, so give reset one"
                raise ValueError(f"algorithm {self._name}: {fault}; this run learns in those of seeds {ranges}")
            self._known_seeds.add(seed)

    def draw_seeds(self, count: int) -> list[int]:
        """Return seeds of the run for streams of episodes without a seed; none if the run may play all episodes.

        They count down from the last seed, as learners count up from the first. A run that resumes draws the same.

        Raises:
            ValueError: another process draws, whose seeds the run does not know.
        """
        if not self._seeds:
            return []
        allowed_seeds = self._seeds[0]
        if os.getpid() != self._process:
            raise ValueError(
                f"algorithm {self._name}: an environment of another process begins without a seed; give reset "
                f"a seed from {allowed_seeds.start} to {allowed_seeds.stop - 1}"
            )
        numbers = range(self._drawn_seeds, self._drawn_seeds + count)
        self._drawn_seeds += count
        return [allowed_seeds[-1 - number % len(allowed_seeds)] for number in numbers]

    def add_source(self, source: str) -> None:
        """Add a source.

        Raises:
            ValueError: the algorithm does not declare it.
        """
        if self._source not in (source, UNKNOWN):
            raise ValueError(
                f"algorithm {self._name}: uses {source} and declares source={self._source!r}; declare source={source!r}"
            )
        self.sources.add(source)


recording: list[Usage] = []  # of the runs that learn in this process; empty outside of runs
_learners: list[str] = []  # names of algorithms whose code runs now
_is_paused = contextvars.ContextVar("is_paused", default=False)  # in this thread


@contextlib.contextmanager
def record(usage: Usage) -> Iterator[Usage]:
    """Record the usage of a run within the context, in all threads."""
    recording.append(usage)
    try:
        yield usage
    finally:
        recording.remove(usage)


@contextlib.contextmanager
def run_learner(algorithm: str) -> Iterator[None]:
    """Refuse pauses within the context, in all threads: the code of a learner runs."""
    _learners.append(algorithm)
    try:
        yield
    finally:
        _learners.remove(algorithm)


@contextlib.contextmanager
def pause() -> Iterator[None]:
    """Record nothing within the context, in this thread: a policy is judged.

    Raises:
        ValueError: a learner pauses, whose usage is to be recorded.
    """
    if _learners:
        raise ValueError(f"algorithm {_learners[-1]}: pauses the record of its usage; only judges do, between slices")
    token = _is_paused.set(True)
    try:
        yield
    finally:
        _is_paused.reset(token)


def count_steps(steps: int) -> None:
    """Add steps of environments to the usage of the runs that learn."""
    for usage in _active_usages():
        usage.count_steps(steps)


def count_steps_by_learner(steps: int) -> None:
    """Add steps that a learner counts to the usage of the runs that learn."""
    for usage in _active_usages():
        usage.steps_by_learner += steps


def check_seeds(seeds: Iterable[int]) -> None:
    """Check the seeds of streams of episodes.

    Raises:
        ValueError: a run learns, and may not play the episodes of a seed, or the seed is unknown.
    """
    for usage in _active_usages():
        usage.check_seeds(seeds)


def draw_seeds(count: int) -> list[int]:
    """Return seeds of the run that learns for streams of episodes without a seed; none without such a run.

    Raises:
        ValueError: another process than that of the run draws.
    """
    for usage in _active_usages():
        seeds = usage.draw_seeds(count)
        if seeds:
            return seeds
    return []


def add_source(source: str) -> None:
    """Add a source to the usage of the runs that learn.

    Raises:
        ValueError: a run learns whose algorithm does not declare it.
    """
    for usage in _active_usages():
        usage.add_source(source)


def _active_usages() -> Sequence[Usage]:
    return () if _is_paused.get() else recording
