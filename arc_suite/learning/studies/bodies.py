"""Scores of policies of many bodies: every episode in a table, and the table of all policies."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from arc_suite.learning import transfer
from arc_suite.learning.studies import csv_files
from arc_suite.learning.studies.leaderboard import table
from arc_suite.learning.transfer import Comparison, Judged

COLUMNS = ("policy", "task", "family", "body", "who", "return", "walked", "speed", "tracking")
WHO = ("policy", "demonstrator", "zero")


def write(path: Path, policy: str, task: str, played: Mapping[str, Sequence[Comparison]]) -> None:
    """Replace the episodes of a policy in a task, given by family.

    Raises:
        ValueError: another table.
        OSError: it cannot be written.
    """
    owner = {"policy": policy, "task": task}
    rows = [row for row in csv_files.read(path, COLUMNS) if not owner.items() <= row.items()]
    for family, compared in played.items():
        for each in compared:
            for who in WHO:
                total, walked, speed, tracking = getattr(each, who)
                numbers = {"return": round(total, 3), "walked": int(walked)}
                numbers |= {"speed": round(speed, 4), "tracking": round(tracking, 4)}
                rows.append(owner | {"family": family, "body": each.body, "who": who} | numbers)
    csv_files.write(path, COLUMNS, rows)


def read(path: Path) -> dict[tuple[str, str], dict[str, list[Comparison]]]:
    """Return the comparisons in a table by policy and task, and by family.

    Raises:
        ValueError: another table.
        OSError: it cannot be read.
    """
    rows = csv_files.read(path, COLUMNS)
    found: dict[tuple[str, str], dict[str, list[Comparison]]] = {}
    for three in zip(*[iter(rows)] * len(WHO), strict=True):
        policy, task, family, body, *_ = three[0].values()
        judged = map(_judged, three)
        found.setdefault((policy, task), {}).setdefault(family, []).append(Comparison(body, *judged))
    return found


def _judged(row: Mapping[str, str]) -> Judged:
    return Judged(float(row["return"]), row["walked"] == "1", float(row["speed"]), float(row["tracking"]))


def text(path: Path) -> str:
    """Return the table of all policies in Markdown.

    A cell holds the share of bodies that walk, the score and, in brackets, that of the worst tenth; then the speed as a
    share of the target. In tasks with a command it holds the score and the tracking as a share
    of the demonstrators'.

    Raises:
        ValueError: no table of episodes, or a damaged one.
        OSError: it cannot be read.
    """
    rows = []
    for (policy, task), families in sorted(read(path).items()):
        results = {family: transfer.result(compared) for family, compared in families.items()}
        rows.append([policy, task, *(_cell(results.get(family)) for family in transfer.FAMILIES)])
    if not rows:
        raise ValueError(f"{path}: holds no episodes; add some by -o, or name another table by --results")
    return table(("policy", "task", *transfer.FAMILIES), rows)


def _cell(result: transfer.TransferResult | None) -> str:
    if result is None:
        return "not run"
    if math.isnan(result.tracking):
        return f"{result.walk:.0%}, {result.score:.2f} ({result.worst:.2f}), speed {result.speed:.2f}"
    return f"{result.score:.2f}, tracking {result.tracking:.2f}"
