"""Outcomes of runs as text: returns and scores, and when a run reached a score."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from arc_suite import checks
from arc_suite.evaluation import anchors
from arc_suite.learning.agents import run_folder
from arc_suite.learning.agents.configuration import Configuration


def return_of_score(run: Configuration, score: float) -> float:
    """Return the mean return that has a score in the evaluations of a run.

    Raises:
        ValueError: a score that is no number, or returns without scores; see `anchors.Anchors.flaw`.
    """
    checks.number("score", score)
    scale = anchors.anchors(run.validation)
    if scale.flaw:
        raise ValueError(f"score {score:g}: {run.validation} has no scores: {scale.flaw}")
    return scale.at(score)


def first_step_above(folder: Path, threshold: float) -> int | None:
    """Return the step of the first evaluation of a run with a mean return of at least `threshold`; None without one."""
    table = run_folder.table(folder, "evaluations")
    for step in np.unique(table.get("step", ())):
        if table["return"][table["step"] == step].mean() >= threshold:
            return int(step)
    return None


def when(folder: Path, step: int) -> str:
    """Return the step of an evaluation and the time that the run had taken before it, as text."""
    times = run_folder.table(folder, "times")
    is_at_step = times["step"] == step
    wall = times["wall_seconds"][is_at_step][-1]
    cpu = times["cpu_seconds"][is_at_step][-1]
    return f"at step {step}, after {wall:.0f} s ({cpu:.0f} s of CPU time)"


def latest_result(run: Configuration, folder: Path) -> str:
    """Return the step, the return and the score of a run's latest evaluation as text."""
    table = run_folder.table(folder, "evaluations")
    if not table:
        return "no evaluation yet"
    return _describe_returns(run, run_folder.latest_returns(table), f" at step {int(table['step'][-1])}")


def best_run(runs: Sequence[Configuration], folder: Path) -> Configuration | None:
    """Return the run whose latest evaluation has the largest mean return; None without an evaluation.

    Args:
        runs: runs of one setup.
        folder: folder that holds the folders of the runs.
    """

    def latest_return(run: Configuration) -> float:
        table = run_folder.table(folder / run.name, "evaluations")
        return run_folder.latest_returns(table).mean() if table else -math.inf

    best = max(runs, key=latest_return, default=None)
    return None if best is None or latest_return(best) == -math.inf else best


def mean(runs: Sequence[Configuration], folder: Path) -> str:
    """Return the mean and the standard deviation of the latest returns of several seeds as text.

    Args:
        runs: runs of one setup; those without an evaluation are left out.
        folder: folder that holds the folders of the runs.
    """
    tables = [run_folder.table(folder / run.name, "evaluations") for run in runs]
    means = np.array([run_folder.latest_returns(table).mean() for table in tables if table])
    heading = f"mean of {len(means)} seeds"
    return f"{heading}, {_describe_returns(runs[0], means)}" if means.size else heading


def _describe_returns(run: Configuration, returns: np.ndarray, where: str = "") -> str:
    """Return mean, standard deviation and score of returns as text, with the anchors of the score.

    Args:
        run: configuration of a run.
        returns: the returns.
        where: what stands after the mean, such as " at step 100".
    """
    mean_return = returns.mean()
    scale = anchors.anchors(run.validation)
    levels = f"standing still {scale.zero:.1f}"
    if scale.blind is not None:
        levels += f", blind walker {scale.blind:.1f}"
    if scale.flaw:
        levels += f", no score: {scale.flaw}"
    else:
        score = f"score {scale.score(mean_return):z.2f}"
        levels += f", demonstrator {scale.preset} {scale.demonstrator:.1f}"
        if scale.errors:
            levels += ", standard errors {:.1f} and {:.1f}".format(*scale.errors)
        levels = f"{score} ({levels}, over other seeds)"
    return f"return {mean_return:.1f}{where}, deviation {returns.std():.1f}, {levels}"
