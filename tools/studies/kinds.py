"""Table of a study's scores, with a line for each place and a column for each kind of runs."""

import itertools
from pathlib import Path

from arc_suite.learning.studies import benchmark, results
from arc_suite.learning.studies.text_tables import table
from studies import catalog


def text(studies: Path, name: str) -> str:
    """Return the table of a committed study in Markdown: mean scores, then the score of each seed.

    Raises:
        ValueError: an unknown study, or a damaged table of it.
        OSError: a table cannot be read.
    """
    run_results = results.read_results(catalog.study(name).runs, studies / name)
    results_by_cell: dict[tuple[str, str], list[results.RunResult]] = {}
    for result in run_results:
        results_by_cell.setdefault((result.run.place, result.run.kind), []).append(result)
    places, kinds = (dict.fromkeys(names) for names in zip(*results_by_cell, strict=True))
    cells = {
        (place, kind): benchmark.place_text(benchmark.score_results(results_by_cell.get((place, kind), [])))
        for place, kind in itertools.product(places, kinds)
    }
    return table(("score", *kinds), [(place, *(cells[place, kind] for kind in kinds)) for place in places])
