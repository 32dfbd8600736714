"""The table of packaged policies in docs/results.md, from arc_suite/policies/packaged/policies.json."""

from pathlib import Path

from arc_suite import files
from arc_suite.learning.studies.text_tables import table
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS


def text(path: Path) -> str:
    """Return the table of returns in Markdown: a line for each robot, a column for a task.

    Args:
        path: the list of packaged policies, with names such as `tick-walk`.

    Raises:
        ValueError: another file.
        OSError: it cannot be read.
    """
    returns = {tuple(name.split("-")): policy["return"] for name, policy in files.read_json(path).items()}
    tasks = [task for task in TASKS if any((robot, task) in returns for robot in ROBOTS)]
    lines = [[robot, *(_cell(returns.get((robot, task))) for task in tasks)] for robot in ROBOTS]
    return table(("robot", *tasks), lines)


def _cell(mean_return: float | None) -> str:
    return "-" if mean_return is None else f"{mean_return:.0f}"
