"""Writes tables of committed studies, and of the metrics of tasks, into pages of docs/.

A table stands between a line with its name, such as <!-- table -->, and the line <!-- end --> of its page. The table
`coverage` says how often intervals hold the expected score: it is simulated. First the scores of the benchmark, in
studies/scores.csv, are made anew from the tables of its studies.

Example:
  python tools/page_tables.py
"""

from collections.abc import Callable
from pathlib import Path

from studies.pages import table_writer
from website.tasks import metrics_of_all_tasks

from arc_suite.cli import program
from arc_suite.learning.studies import benchmark, entries, results
from arc_suite.learning.studies.divisions import DIVISIONS
from arc_suite.policies.network import PACKAGED
from studies import bodies, catalog, claims, coverage, kinds, packaged, peers

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
STUDIES = ROOT / "studies"
STEPS = 100_000  # of a run; returns after them are compared with the paper's
# Studies whose returns are compared; the first one that has a robot and an algorithm counts.
COMPARED_STUDIES = ("exact-tick", "short")


def main() -> None:
    """Write the scores and the tables."""
    write_scores()
    for (page_name, table_name), make_table in TABLES.items():
        page = DOCS / f"{page_name}.md"
        table_writer(page, table_name)(make_table())
        print(f"wrote {page.relative_to(ROOT)}: {table_name}")


def write_scores() -> None:
    """Write the scores of the committed studies of the benchmark, and of judged policies of other libraries."""
    for path in sorted(STUDIES.glob(f"*/{results.RUNS}")):
        name = path.parent.name
        division, _, learner = name.partition("-")
        if division in DIVISIONS:
            run_results = results.read_results(catalog.committed_study(name, path.parent).runs, path.parent)
            benchmark.write(STUDIES, division, learner, benchmark.score_results(run_results))
    for (division, learner), scores in benchmark.read(STUDIES).items():
        published = STUDIES / f"{division}-{learner}"
        if not (published / results.RUNS).exists():
            benchmark.write(STUDIES, division, learner, entries.score_anew(scores, published))


def returns_next_to_the_papers() -> str:
    """Return the table of our returns and those of the paper's curves, of all its algorithms and robots."""
    results_of_studies = [results.read_results(catalog.study(name).runs, STUDIES / name) for name in COMPARED_STUDIES]
    return claims.next_to_the_papers(results_of_studies, STEPS)


# By names of a page and of its table: a function that makes the table.
TABLES: dict[tuple[str, str], Callable[[], str]] = {
    ("benchmark", "coverage"): coverage.text,
    ("benchmark", "table"): lambda: benchmark.text(STUDIES),
    ("benchmark", "peers"): lambda: peers.text(STUDIES),
    ("any_body", "table"): lambda: bodies.text(STUDIES / "bodies.csv"),
    ("results", "packaged"): lambda: packaged.text(PACKAGED / "policies.json"),
    ("tasks", "metrics"): metrics_of_all_tasks,
    ("study", "table"): returns_next_to_the_papers,
    ("algorithms", "parallel-parts"): lambda: kinds.text(STUDIES, "parallel-parts"),
    ("algorithms", "legs"): lambda: kinds.text(STUDIES, "legs"),
    ("algorithms", "parallel"): lambda: kinds.text(STUDIES, "parallel"),
    ("algorithms", "few-steps"): lambda: kinds.text(STUDIES, "samples-xqc", "samples-sac_parallel", "samples-ppo"),
    ("algorithms", "schedules"): lambda: kinds.text(STUDIES, "samples-ppo", "schedules", "top-ppo"),
}


if __name__ == "__main__":
    program.run(main)
