"""The usage of a run, which its checkpoints hold: it begins with what the run has used before."""

from collections.abc import Sequence

from arc_suite import seed_ranges
from arc_suite.learning.agents import run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.run_folder import RunFolder
from arc_suite.usage import STEP_COUNTS, Usage

# Complete slices without a new step after which a run ends. A slice takes seconds, and none is complete without having
# learned from a new step, so that no learner that counts its steps comes near.
MAX_STALLED_SLICES = 1000


def begin(configuration: Configuration, run_files: RunFolder, run_seeds: Sequence[int]) -> Usage:
    """Return what a run has used until its checkpoint.

    Args:
        configuration: configuration of the run.
        run_files: the open folder of the run.
        run_seeds: seeds of the runs that learn in the same environments.
    """
    algorithm = configuration.definition
    counts = {name: run_files.progress[name] for name in STEP_COUNTS if name in run_files.progress}
    if run_files.arrays is not None and not counts:  # of an earlier version
        counts = {"environment_steps" if algorithm.acts else "steps_by_learner": _latest_step(run_files)}
    return Usage(
        name=configuration.algorithm,
        source=algorithm.source,
        seeds=[seed_ranges.of_run(seed) for seed in run_seeds],
        runs=len(run_seeds),
        sources=run_files.progress.get("sources", ()),
        **counts,
    )


def _latest_step(run_files: RunFolder) -> int:
    """Return the latest step in the tables of a run, or that of its latest evaluation."""
    lines = [*run_folder.lines(run_files.path, "training"), *run_folder.lines(run_files.path, "times")]
    return max((int(line["step"]) for line in lines), default=run_files.progress.get("evaluated", 0))


def check_steps(usage: Usage, configuration: Configuration) -> None:
    """Raise ValueError if an algorithm that does not act has made environment steps."""
    if usage.environment_steps and not configuration.definition.acts:
        raise ValueError(
            f"algorithm {configuration.algorithm}: declares acts=False, and has made {usage.environment_steps} "
            "environment steps; declare acts=True, so that these are the run's steps"
        )


class StepWatch:
    """Notices a learner that counts no steps, whose run would never end."""

    def __init__(self, algorithm: str):
        """Begin before the first slice; the name of the algorithm is for errors."""
        self._algorithm = algorithm
        self._step = -1  # of the latest complete slice
        self._slices = 0  # complete ones since then without a new step

    def check(self, step: int) -> None:
        """Raise ValueError at a complete slice of a learner that has stayed at a step for too many slices."""
        self._slices = self._slices + 1 if step == self._step else 0
        self._step = step
        if self._slices >= MAX_STALLED_SLICES:
            raise ValueError(
                f"algorithm {self._algorithm}: {self._slices} slices have counted no step after step {step}; "
                "count what the suite does not see by context.count_steps, or yield is_complete=False before a step"
            )
