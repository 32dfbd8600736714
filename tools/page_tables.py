"""Writes the tables of committed studies into docs/benchmark.md, docs/any_body.md and docs/study.md.

A table stands between the lines <!-- table --> and <!-- end --> of its page.

Example:
  python tools/page_tables.py
"""

from collections.abc import Callable
from pathlib import Path

from studies.pages import table_writer

from arc_suite.cli import program
from arc_suite.learning.studies import benchmark, results
from studies import bodies, catalog, claims

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
STUDIES = ROOT / "studies"
STEPS = 100_000  # of a run; returns after them are compared with the paper's
# Studies whose returns are compared; the first one that has a robot and an algorithm counts.
COMPARED_STUDIES = ("exact-tick", "short")


def main() -> None:
    """Write the tables."""
    for name, make_table in TABLES.items():
        page = DOCS / f"{name}.md"
        table_writer(page)(make_table())
        print(f"wrote {page.relative_to(ROOT)}")


def returns_next_to_the_papers() -> str:
    """Return the table of our returns and those of the paper's curves, of all its algorithms and robots."""
    results_of_studies = [results.read_results(catalog.study(name).runs, STUDIES / name) for name in COMPARED_STUDIES]
    return claims.next_to_the_papers(results_of_studies, STEPS)


# By name of a page: a function that makes its table.
TABLES: dict[str, Callable[[], str]] = {
    "benchmark": lambda: benchmark.text(STUDIES),
    "any_body": lambda: bodies.text(STUDIES / "bodies.csv"),
    "study": returns_next_to_the_papers,
}


if __name__ == "__main__":
    program.run(main)
