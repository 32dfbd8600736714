"""Results of studies: the published tables of their runs, and statistics over them."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import checks, evaluation
from arc_suite.evaluation import anchors, provenance
from arc_suite.evaluation.published import CURVES
from arc_suite.learning.agents.configuration import CONFIGURATION_FIELDS, PROVENANCE_FIELDS, TRAINING_SEEDS
from arc_suite.learning.studies import csv_files
from arc_suite.learning.studies.tables import Run
from arc_suite.seed_ranges import EVALUATION, Ranges, common_seeds, from_json

RUNS, EVALUATIONS, DEMONSTRATORS = "runs.csv", "evaluations.csv", "demonstrators.csv"

# Columns of the table of runs: the configuration, then the updates of stabilization phases by environment step.
RUN_COLUMNS = ("run", "kind", *CONFIGURATION_FIELDS, *PROVENANCE_FIELDS, "phases")
TIMES = ("wall_seconds", "cpu_seconds")  # until the end of an evaluation
SHARED, TEN = "data share seeds with evaluation", "ten episodes"
_FEW = evaluation.CURVE_EPISODES
STYLE = "style_"  # prefix of the columns with metrics of style, which the latest evaluation has
_OTHERS = ("run", "step", "seed", "return", "length", *TIMES)  # columns of an episode that are not the task's metrics


class RunResult(NamedTuple):
    """Result of a run.

    Attributes:
        run: of the study.
        steps: (evaluations,) environment steps.
        returns: (evaluations, episodes) of the curve.
        finals: (episodes,) returns of the latest policy.
        progress: the task's progress in the latest evaluation by name, each (episodes,).
        cpu: (evaluations,) s of the processor until then.
        style: metrics of style of the latest policy by name, each (episodes,).
        phases: (phases,) updates of each stabilization phase; empty if they are not published.
        training_seeds: of the episodes that it learned from; None if they are unknown.
    """

    run: Run
    steps: np.ndarray
    returns: np.ndarray
    finals: np.ndarray
    progress: dict[str, np.ndarray]
    cpu: np.ndarray
    style: dict[str, np.ndarray]
    phases: np.ndarray
    training_seeds: Ranges | None = ()

    @property
    def final(self) -> float:
        """Mean return of the latest policy."""
        return float(self.finals.mean())

    @property
    def notes(self) -> tuple[str, ...]:
        """What its final return must not be compared with others for."""
        few = few_episodes(self.finals)
        if self.training_seeds is None:
            return (*few, provenance.UNKNOWN)
        return few + (SHARED,) * bool(common_seeds(self.training_seeds, EVALUATION))


Groups = Mapping[str, Mapping[str, Sequence[RunResult]]]  # results by place and kind


def results(runs: Sequence[Run], published: Path) -> list[RunResult]:
    """Return the results of those runs of a study that are published.

    Raises:
        ValueError: a damaged table.
        OSError: a table cannot be read.
    """
    episodes = episodes_of(published)
    rows = {row["run"]: row for row in csv_files.read(published / RUNS, RUN_COLUMNS)}
    try:
        return [_result(run, episodes[run.name], rows[run.name]) for run in runs if run.name in episodes]
    except (KeyError, ValueError) as error:
        raise ValueError(f"{published / EVALUATIONS}: damaged: {checks.quote(error)}") from None


def episodes_of(published: Path) -> dict[str, list[dict[str, str]]]:
    """Return the rows of the table of episodes by run, without the columns that a row leaves empty."""
    found: dict[str, list[dict[str, str]]] = {}
    for row in csv_files.read(published / EVALUATIONS):
        found.setdefault(row["run"], []).append({name: text for name, text in row.items() if text})
    return found


def _result(run: Run, rows: Sequence[Mapping[str, str]], known: Mapping[str, str]) -> RunResult:
    by_step: dict[str, list[Mapping[str, str]]] = {}
    for row in rows:
        by_step.setdefault(row["step"], []).append(row)
    *_, latest = by_step.values()
    counts = [len(each) for each in by_step.values()]
    if set(counts[:-1]) - {_FEW} or counts[-1] not in (_FEW, evaluation.EPISODES):
        raise ValueError(f"{run.name}: expected {_FEW} episodes of a step, got {counts}")

    def curve(name):
        return np.array([[row[name] for row in each[:_FEW]] for each in by_step.values()], float)

    metrics = {n: np.array([row[n] for row in latest if n in row], float) for n in latest[0] if n not in _OTHERS}
    return RunResult(
        run=run,
        steps=curve("step")[:, 0].astype(int),
        returns=curve("return"),
        finals=np.array([row["return"] for row in latest], float),
        progress={name: values for name, values in metrics.items() if not name.startswith(STYLE)},
        cpu=curve("cpu_seconds")[:, 0],
        style={name.removeprefix(STYLE): values for name, values in metrics.items() if name.startswith(STYLE)},
        phases=np.array(list(json.loads(known["phases"] or "{}").values())),
        training_seeds=from_json(json.loads(known[TRAINING_SEEDS] or "null")),
    )


def demonstrators(published: Path) -> dict[str, dict[str, np.ndarray]]:
    """Return the returns of standing still and of demonstrators, (episodes,), by place (`Run.place`) and policy."""
    path = published / DEMONSTRATORS
    return anchors.read(path) if path.exists() else {}


def grouped(found: Sequence[RunResult]) -> Groups:
    """Return results by place and kind, each with all its seeds."""
    groups: dict[str, dict[str, list[RunResult]]] = {}
    for each in found:
        groups.setdefault(each.run.place, {}).setdefault(each.run.kind, []).append(each)
    return groups


def is_in_paper(result: RunResult) -> bool:
    """Return whether the paper's curves have a run."""
    setup, algorithm = result.run.configuration.setup, result.run.configuration.algorithm
    plain = setup.kind.name == "walk" and not setup.task_kwargs and not result.run.label
    return plain and algorithm in CURVES.get(setup.body.name, {})


def few_episodes(returns: np.ndarray) -> tuple[str, ...]:
    """Return the note of returns (episodes,) that are fewer than those of a final policy; none otherwise."""
    return (TEN,) * (len(returns) < evaluation.EPISODES)


def notes(seeds: Iterable[RunResult]) -> str:
    """Return the notes of all results, each once; a dash without any."""
    return "; ".join(dict.fromkeys(note for each in seeds for note in each.notes)) or "-"


def scores(seeds: Sequence[RunResult]) -> np.ndarray:
    """Return the mean return of each seed, (seeds,)."""
    return np.array([each.final for each in seeds])


def curve(seeds: Sequence[RunResult]) -> tuple[np.ndarray, np.ndarray]:
    """Return the steps (points,) of the evaluations that all seeds have, and the mean returns (seeds, points)."""
    count = min(len(each.steps) for each in seeds)
    return seeds[0].steps[:count], np.array([each.returns.mean(axis=1)[:count] for each in seeds])


def size(values: np.ndarray) -> float:
    """Return the mean size of the values that are finite; NaN where none are."""
    sizes = np.abs(values[np.isfinite(values)])
    return float(sizes.mean()) if sizes.size else np.nan


def until(seeds: Sequence[RunResult], threshold: float) -> tuple[float, float]:
    """Return environment steps and s of the processor up to a mean return of `threshold`.

    Returns:
        Means over the seeds; infinite if a seed has not reached it.
    """
    found = []
    for each in seeds:
        enough = np.flatnonzero(each.returns.mean(axis=1) >= threshold)
        found.append((each.steps[enough[0]], each.cpu[enough[0]]) if enough.size else (np.inf, np.inf))
    steps, seconds = np.mean(found, axis=0)
    return float(steps), float(seconds)
