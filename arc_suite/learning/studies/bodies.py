"""Scores of policies of many bodies: episodes in tables, and the table of all policies.

studies/bodies/<policy>-<task>.csv    a line for each episode, by `write`
"""

import csv
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from arc_suite.learning import transfer
from arc_suite.learning.studies.leaderboard import table
from arc_suite.learning.transfer import Comparison, Judged

HEADS = ("family", "body", "who", "return", "walked", "tracking")
WHO = ("policy", "demonstrator", "zero")


def write(path: Path, played: Mapping[str, Sequence[Comparison]]) -> None:
    """Write the episodes of comparisons by family."""
    with path.open("w", encoding="utf-8", newline="") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(HEADS)
        for family, comparisons in played.items():
            for comparison in comparisons:
                for who in WHO:
                    total, walked, tracking = getattr(comparison, who)
                    lines.writerow((family, comparison.body, who, round(total, 3), int(walked), round(tracking, 4)))


def read(path: Path) -> dict[str, list[Comparison]]:
    """Return the comparisons by family that `write` wrote.

    Raises:
        ValueError: another table.
    """
    with path.open(encoding="utf-8", newline="") as file:
        heads, *lines = csv.reader(file)
    if tuple(heads) != HEADS or len(lines) % len(WHO):
        raise ValueError(f"{path}: expected the columns {', '.join(HEADS)}, three lines a body")
    found: dict[str, list[Comparison]] = {}
    for first in range(0, len(lines), len(WHO)):
        family, body = lines[first][:2]
        episodes = [Judged(float(line[3]), bool(int(line[4])), float(line[5])) for line in lines[first : first + 3]]
        found.setdefault(family, []).append(Comparison(body, *episodes))
    return found


def text(folder: Path) -> str:
    """Return the table of all policies in a folder, in Markdown.

    A cell holds the share of bodies that walk, the score and, in brackets, that of the worst tenth. In tasks with a
    command it holds the score and the tracking as a share of the demonstrators'.

    Raises:
        ValueError: no tables of episodes in the folder, or a damaged one.
        OSError: a file cannot be read.
    """
    rows = []
    for path in sorted(folder.glob("*.csv")):
        policy, _, task = path.stem.rpartition("-")
        results = {family: transfer.result(comparisons) for family, comparisons in read(path).items()}
        rows.append([policy, task, *(_cell(results.get(family)) for family in transfer.FAMILIES)])
    if not rows:
        raise ValueError(f"{folder}: holds no tables of episodes; write one by -o, or name their folder by --results")
    return table(("policy", "task", *transfer.FAMILIES), rows)


def _cell(result: transfer.Result | None) -> str:
    if result is None:
        return "not run"
    if math.isnan(result.tracking):
        return f"{result.walk:.0%}, {result.score:.2f} ({result.worst:.2f})"
    return f"{result.score:.2f}, tracking {result.tracking:.2f}"
