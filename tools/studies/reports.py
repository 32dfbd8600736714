"""Reports of the project's own studies: with the paper's claims, and with the leaderboard."""

from pathlib import Path

from arc_suite.learning.studies import benchmark, report, results
from arc_suite.learning.studies.tables import Study
from studies import claims, leaderboard


def write(name: str, study: Study, published: Path) -> Path:
    """Write the report of a study into the folder of its tables, and the leaderboard one folder above.

    Args:
        name: name of the study.
        study: its title and runs.
        published: folder of its tables.

    Returns:
        The file of the report.

    Raises:
        ValueError: nothing is published, a table is damaged, or a folder next to it has the name of no study.
        OSError: a file cannot be read or written.
    """
    benchmark.check_tables(published.parent)
    path = report.write(name, study, published, claims.sections(results.read_results(study.runs, published)))
    leaderboard.write(published.parent)
    return path
