"""What has become of runs, for people: their returns and scores, and when they reached one."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from arc_suite import checks
from arc_suite.evaluation import anchors
from arc_suite.learning.agents import run_folder
from arc_suite.learning.agents.configuration import Configuration


def level(run: Configuration, score: float) -> float:
    """Return the return that has a score in the evaluations of a run.

    Raises:
        ValueError: no number, or no demonstrator to score by.
    """
    checks.number("score", score)
    found = anchors.anchors(run.validation).at(score)
    if not np.isfinite(found):
        what = "expected a task with a demonstrator that earns more than standing still"
        raise ValueError(f"score {score:g}: {what}, got {run.validation}")
    return found


def reached(folder: Path, level: float) -> int | None:
    """Return the step of the first evaluation of a run whose mean return is at least `level`; None without one."""
    table = run_folder.table(folder, "evaluations")
    means = ((step, table["return"][table["step"] == step].mean()) for step in np.unique(table.get("step", ())))
    return next((int(step) for step, mean in means if mean >= level), None)


def when(folder: Path, step: int) -> str:
    """Return the step of an evaluation, and the seconds that the run had taken by then."""
    times = run_folder.table(folder, "times")
    wall, cpu = (times[f"{name}_seconds"][times["step"] == step][-1] for name in ("wall", "cpu"))
    return f"at step {step}, after {wall:.0f} s ({cpu:.0f} s of CPU time)"


def earned(run: Configuration, folder: Path) -> str:
    """Return the return and the score of a run's latest evaluation."""
    table = run_folder.table(folder, "evaluations")
    return _rated(run, run_folder.latest_returns(table)) if table else "no evaluation yet"


def mean(runs: Sequence[Configuration], folder: Path) -> str:
    """Return the mean and the standard deviation over runs of several seeds, by the latest evaluations of each.

    Args:
        runs: of one setup; those without an evaluation are left out.
        folder: that theirs lie in.
    """
    tables = [run_folder.table(folder / run.name, "evaluations") for run in runs]
    means = np.array([run_folder.latest_returns(table).mean() for table in tables if table])
    heading = f"mean of {len(means)} seeds"
    return f"{heading}, {_rated(runs[0], means)}" if means.size else heading


def _rated(run: Configuration, returns: np.ndarray) -> str:
    average, scale = returns.mean(), anchors.anchors(run.validation)
    levels = f"standing still {scale.zero:.1f}"
    if scale.demonstrator is not None:
        levels = f"score {scale.score(average):z.2f} ({levels}, demonstrator {scale.preset} {scale.demonstrator:.1f})"
    return f"return {average:.1f} +- {returns.std():.1f}, {levels}"
