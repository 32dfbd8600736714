"""Table of a study's scores, with a line for each place and a column for each kind of runs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from arc_suite.learning.studies import report, results
from arc_suite.learning.studies.results import RunResult
from arc_suite.learning.studies.text_tables import score_of_seeds, table
from studies import catalog


def text(studies: Path, name: str) -> str:
    """Return the table of a committed study in Markdown: mean scores, then the score of each seed.

    Raises:
        ValueError: an unknown study, or a damaged table of it.
        OSError: a table cannot be read.
    """
    published = studies / name
    demonstrators = results.read_demonstrators(published)
    groups = results.group_by_place(results.read_results(catalog.study(name).runs, published))
    kinds = dict.fromkeys(kind for results_by_kind in groups.values() for kind in results_by_kind)
    lines = []
    for robot_and_task, results_by_kind in groups.items():
        cells = [_score_cell(results_by_kind.get(kind, ()), demonstrators) for kind in kinds]
        lines.append((robot_and_task, *cells))
    return table(("score", *kinds), lines)


def _score_cell(seeds: Sequence[RunResult], demonstrators) -> str:
    """Return the scores of the latest policies of a kind as text; a dash without runs."""
    if not seeds:
        return "-"
    scores = report.scores_of(seeds, demonstrators)
    if np.isnan(scores).any():
        raise ValueError(f"run {seeds[0].run.name}: expected a place with anchors, got {seeds[0].run.place}")
    return score_of_seeds(scores)
