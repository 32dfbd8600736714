"""A table of every episode of policies of many bodies, as `arc-suite transfer` writes it."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from arc_suite.learning.studies import csv_files
from arc_suite.learning.transfer import Comparison

COLUMNS = ("policy", "task", "family", "body", "who", "return", "walked", "speed", "tracking")
WHO = ("policy", "demonstrator", "zero")  # fields of a comparison with an episode


def write(path: Path, policy: str, task: str, comparisons: Mapping[str, Sequence[Comparison]]) -> None:
    """Replace the episodes of a policy in a task.

    Args:
        path: path of the table.
        policy: name of the policy.
        task: name of the task, with its settings if there are any.
        comparisons: episodes of each body by family.

    Raises:
        ValueError: the file holds another table.
        OSError: the file cannot be written.
    """
    policy_and_task = {"policy": policy, "task": task}
    rows = [row for row in csv_files.read(path, COLUMNS) if not policy_and_task.items() <= row.items()]
    for family, family_comparisons in comparisons.items():
        for comparison in family_comparisons:
            for who in WHO:
                episode = getattr(comparison, who)
                row = {
                    "family": family,
                    "body": comparison.body,
                    "who": who,
                    "return": round(episode.total, 3),
                    "walked": int(episode.walked),
                    "speed": round(episode.speed, 4),
                    "tracking": round(episode.tracking, 4),
                }
                rows.append(policy_and_task | row)
    csv_files.write(path, COLUMNS, rows)
