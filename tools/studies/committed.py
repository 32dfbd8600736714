"""Studies of the benchmark by algorithms of other packages, read from their committed tables.

A report and the leaderboard need neither the algorithm nor its package: the tables hold what they print.
"""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from arc_suite import parsers, usage
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.studies import benchmark, csv_files, results, tables
from arc_suite.learning.studies.divisions import PLACES, SEEDS
from arc_suite.learning.studies.tables import Run, Study


@dataclasses.dataclass(frozen=True)
class CommittedConfiguration(Configuration):
    """Configuration of a committed run, whose algorithm need not be registered. It cannot train.

    Attributes:
        source: what the algorithm learns from, see `Algorithm.source`.
    """

    source: str = usage.UNKNOWN

    @property
    def definition(self) -> algorithms.Algorithm:
        """The algorithm without its function, with these hyperparameters."""

        def refuse_to_learn(_hyperparameters, _context):
            raise ValueError(f"algorithm {self.algorithm}: expected no training, as only its tables are known")

        return algorithms.Algorithm(refuse_to_learn, self.hyperparameters, self.algorithm, source=self.source)

    @property
    def default_hyperparameters(self) -> Mapping[str, Any]:
        """Defaults of the algorithm by name: none are known, so that `command` holds all hyperparameters."""
        return {}


def read(name: str, published: Path) -> Study:
    """Return the study `<division>-<algorithm>` of the benchmark whose tables a folder holds.

    Args:
        name: name of the folder.
        published: the folder.

    Raises:
        ValueError: no table of runs, or a damaged one.
        OSError: a table cannot be read.
    """
    rows = csv_files.read(published / results.RUNS, results.RUN_COLUMNS)
    if not rows:
        what = "holds no runs, and so has no report; python tools/page_tables.py writes the scores of judged policies"
        raise ValueError(f"{published}: {what}")
    division, _, learner = name.partition("-")
    scores = benchmark.read(published.parent).get((division, learner), [])
    source = benchmark.declared_source(division, scores)
    with parsers.guard(f"{published / results.RUNS}: damaged"):
        runs = tuple(_read_run(division, row, source) for row in rows)
        _check_learner(learner, runs)
        title = tables.benchmark_title(division, runs[0].configuration.algorithm)
    all_runs = SEEDS * len(PLACES)
    return Study(title if len(runs) == all_runs else f"{title}, {len(runs)} of {all_runs} runs", runs)


def _check_learner(learner: str, runs: Sequence[Run]) -> None:
    """Raise ValueError for runs of another algorithm than the folder is named after."""
    for run in runs:
        folder_name = tables.folder_name(run.configuration.algorithm)
        if folder_name != learner:
            raise ValueError(f"{run.name}: expected the algorithm {learner} of the folder's name, got {folder_name}")


def _read_run(division: str, row: Mapping[str, str], source: str) -> Run:
    """Return the run of a row in the table of runs.

    Args:
        division: name of the division.
        row: cells by column.
        source: what its algorithm learns from.
    """
    robot = row["robot"]
    task = row["task"]
    hyperparameters = json.loads(row["hyperparameters"])
    fields = [(field, Any) for field in hyperparameters]
    configuration = CommittedConfiguration(
        setup=Setup.of(robot, task, json.loads(row["task_kwargs"])),
        algorithm=row["algorithm"],
        hyperparameters=dataclasses.make_dataclass("Hyperparameters", fields, frozen=True)(**hyperparameters),
        seed=int(row["seed"]),
        steps=int(row["steps"]),
        evaluate_every=int(row["evaluate_every"]),
        prior=row["prior"] or None,
        training_json=row["training"],
        source=source,
    )
    label = "" if row["kind"] == row["algorithm"] else row["kind"]
    return Run(configuration, label, tables.prior_of_division(division, robot, task))
