"""The table of policies of many bodies in docs/any_body.md, from every episode in studies/bodies.csv."""

import math
from collections.abc import Mapping
from pathlib import Path

from arc_suite.learning import transfer
from arc_suite.learning.studies import csv_files
from arc_suite.learning.studies.bodies import COLUMNS, WHO
from arc_suite.learning.studies.text_tables import table
from arc_suite.learning.transfer import Comparison, Judged


def read(path: Path) -> dict[tuple[str, str], dict[str, list[Comparison]]]:
    """Return the comparisons in a table by policy and task, and by family.

    Raises:
        ValueError: another table.
        OSError: it cannot be read.
    """
    rows = csv_files.read(path, COLUMNS)
    comparisons: dict[tuple[str, str], dict[str, list[Comparison]]] = {}
    for first in range(0, len(rows), len(WHO)):  # a row of each policy that is compared
        rows_of_body = rows[first : first + len(WHO)]
        policy, task, family, body, *_ = rows_of_body[0].values()
        comparison = Comparison(body, *map(_read_row, rows_of_body))
        comparisons.setdefault((policy, task), {}).setdefault(family, []).append(comparison)
    return comparisons


def _read_row(row: Mapping[str, str]) -> Judged:
    return Judged(float(row["return"]), row["walked"] == "1", float(row["speed"]), float(row["tracking"]))


def text(path: Path) -> str:
    """Return the table of all policies in Markdown.

    A cell holds the share of bodies that walk, the score and, in brackets, that of the worst tenth; then the speed as a
    share of the target. In tasks with a command it holds the score and the tracking as a share
    of the demonstrators'.

    Raises:
        ValueError: another table.
        OSError: it cannot be read.
    """
    rows = []
    for (policy, task), families in sorted(read(path).items()):
        results = {family: transfer.result(compared) for family, compared in families.items()}
        rows.append([policy, task, *(_cell(results.get(family)) for family in transfer.FAMILIES)])
    return table(("policy", "task", *transfer.FAMILIES), rows)


def _cell(result: transfer.TransferResult | None) -> str:
    if result is None:
        return "not run"
    if math.isnan(result.tracking):
        return f"{result.walk:.0%}, {result.score:.2f} ({result.worst:.2f}), speed {result.speed:.2f}"
    return f"{result.score:.2f}, tracking {result.tracking:.2f}"
