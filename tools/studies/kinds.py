"""Table of a study's scores, with a line for each place and a column for each kind of runs."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from arc_suite.learning.studies import report, results
from arc_suite.learning.studies.results import RunResult
from arc_suite.learning.studies.text_tables import table
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
    for place, results_by_kind in groups.items():
        cells = [_score_text(results_by_kind.get(kind, ()), demonstrators) for kind in kinds]
        lines.append((place, *cells))
    return table(("score", *kinds), lines)


def _score_text(seeds: Sequence[RunResult], demonstrators) -> str:
    """Return the mean score of the latest policies as text, then that of each seed; a dash without runs."""
    if not seeds:
        return "-"
    scores = []
    for result in seeds:
        scale = report.anchors_of(result, result.seeds, demonstrators)
        if scale is None:
            raise ValueError(f"run {result.run.name}: expected a place with anchors, got {result.run.place}")
        scores.append(float(scale.score(result.final)))
    return f"{np.mean(scores):z.2f} ({', '.join(f'{score:z.2f}' for score in scores)})"
