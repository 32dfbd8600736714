"""A table of every episode of policies of many bodies, as `arc-suite transfer` writes it."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from arc_suite.learning.studies import csv_files
from arc_suite.learning.transfer import Comparison

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
