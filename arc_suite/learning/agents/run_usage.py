"""The usage of a run, which its checkpoints hold: it begins with what the run has used before."""

from collections.abc import Sequence

from arc_suite import seed_ranges
from arc_suite.learning.agents import run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.run_folder import RunFolder
from arc_suite.usage import STEP_COUNTS, Usage


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
