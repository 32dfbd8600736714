"""Table of scores of studies, with a line for each place and a column for each kind of runs."""

import collections
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from arc_suite.learning.studies import results
from arc_suite.learning.studies.results import RunResult
from arc_suite.learning.studies.tables import Study
from arc_suite.learning.studies.text_tables import score_of_seeds, table
from studies import catalog


def text(studies: Path, *names: str) -> str:
    """Return the table of committed studies in Markdown: mean scores, then the score of each seed.

    A column has the name of a kind of runs, or of a study whose kind another study has, too.

    Args:
        studies: folder of the committed studies.
        *names: names of studies. Lines are places that all of them have.

    Raises:
        ValueError: an unknown study, or a damaged table of it.
        OSError: a table cannot be read.
    """
    kinds_of_studies = {
        name: _cells_by_kind(studies / name, catalog.committed_study(name, studies / name)) for name in names
    }
    counts = collections.Counter(kind for kinds in kinds_of_studies.values() for kind in kinds)
    columns = {}
    places_of_studies = []
    for name, kinds in kinds_of_studies.items():
        columns |= {kind if counts[kind] == 1 else name: cells for kind, cells in kinds.items()}
        places_of_studies.append({place: None for cells in kinds.values() for place in cells})
    first_places, *other_places = places_of_studies
    places = [place for place in first_places if all(place in study_places for study_places in other_places)]
    lines = [(place, *(cells.get(place, "-") for cells in columns.values())) for place in places]
    return table(("score", *columns), lines)


def _cells_by_kind(published: Path, study: Study) -> dict[str, dict[str, str]]:
    """Return a cell for each place of a study, by kind of runs."""
    demonstrators = results.read_demonstrators(published)
    cells: dict[str, dict[str, str]] = {}
    for place, results_by_kind in results.group_by_place(results.read_results(study.runs, published)).items():
        for kind, seeds in results_by_kind.items():
            cells.setdefault(kind, {})[place] = _score_cell(seeds, demonstrators)
    return cells


def _score_cell(seeds: Sequence[RunResult], demonstrators) -> str:
    """Return the scores of the latest policies of a kind as text."""
    scores = [results.score_of(result, demonstrators) for result in seeds]
    if np.isnan(scores).any():
        raise ValueError(f"run {seeds[0].run.name}: expected a place with anchors, got {seeds[0].run.place}")
    return score_of_seeds(scores)
