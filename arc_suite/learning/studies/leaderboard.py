"""The leaderboard: rows of studies and of entries, each in a table of its own folder, and one page of all.

studies/<study>/leaderboard.csv     rows of a study, by `report.write`
studies/entries/leaderboard.csv     rows of entries, by `enter`; next to it the entries themselves
studies/README.md                   the page
"""

import csv
import json
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from arc_suite import files
from arc_suite.evaluation import anchors
from arc_suite.learning.studies.entries import Entry

PAGE, TABLE, ENTRIES = "README.md", "leaderboard.csv", "entries"
STYLE = ("gait compliance", "heading error, rad", "torso pitch, rad")
HEADS = (
    *("robot, task", "algorithm", "phases, updates", "prior data, episodes", "seeds", "return", "score", "IQM [95 %]"),
    *("metric", *STYLE, "steps", "CPU min", "study", "command of seed 0", "configuration"),
)
_NAME = re.compile(r"[\w.-]+")
_TEXT = (
    "All committed studies, written by `arc-suite study NAME --report`, and entries, written by `arc-suite enter`. "
    "Return: mean of the latest evaluation. Score: (return - standing still) / (best demonstrator - standing still). "
    "IQM: interquartile mean with 95 % bootstrap interval over seeds; a single seed has none. Then the task's own "
    "metric, speed in m/s; headings are relative to the x axis, which is not the direction of a command. Runs of one "
    "configuration that several studies have are in one row. Phases: the most updates of the critics alone; 75,000 are "
    "published."
)


def write(folder: Path, lines: Sequence[Sequence[str]]) -> None:
    """Write the rows of a folder, and the page of all rows one folder above.

    Args:
        folder: of a study, or of entries.
        lines: cells by `HEADS`.

    Raises:
        ValueError: a damaged table of rows.
        OSError: a file cannot be written.
    """
    with files.writing(folder / TABLE) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([HEADS, *lines])
    every = [row for path in sorted(folder.parent.glob(f"*/{TABLE}")) for row in _rows(path)]
    once: dict[str, dict[str, str]] = {}
    for row in (dict(zip(HEADS, cells, strict=True)) for cells in every):
        known = once.get(row["configuration"])
        if known is None or int(row["seeds"]) > int(known["seeds"]):
            once[row["configuration"]] = row
    shown = sorted(once.values(), key=lambda row: (row["robot, task"], -float(row["return"])))
    heads = HEADS[:-1]  # the configuration is for this choice alone
    page = table(heads, [[row[head] for head in heads] for row in shown])
    with files.writing(folder.parent / PAGE) as temporary:
        temporary.write_text(f"# Leaderboard\n\n{_TEXT}\n\n{page}\n", encoding="utf-8")


def enter(source: Path, name: str, entries: Sequence[Entry], studies: Path) -> Path:
    """Add checked entries to the leaderboard; entries of the same name, robot and task are replaced.

    Args:
        source: file of the entries, which is copied.
        name: of the algorithm.
        entries: of the file.
        studies: folder of the leaderboard.

    Returns:
        The page.

    Raises:
        ValueError: a name of other characters than letters, digits, `_`, `-` and `.`.
    """
    checked_name(name)
    folder = files.folder(studies / ENTRIES)
    rows = {(row[0], row[1]): row for row in (_rows(folder / TABLE) if (folder / TABLE).exists() else ())}
    for entry in entries:
        place = str(entry.setup)
        copied = folder / f"{entry.setup.body.name}-{entry.setup.kind.name}-{name}.json"
        with files.writing(copied) as temporary:
            temporary.write_text(source.read_text(encoding="utf-8"), encoding="utf-8")
        totals = np.array([episode.total for episode in entry.episodes])
        score = float(anchors.anchors(entry.setup).score(totals.mean()))
        figures = {key: np.mean([each.progress[key] for each in entry.episodes]) for key in entry.episodes[0].progress}
        figure = next(iter(figures))
        compliance = f"{figures['gait_compliance']:.3f}" if "gait_compliance" in figures else "-"
        cells = dict.fromkeys(HEADS, "-") | {
            "robot, task": place,
            "algorithm": name,
            "seeds": "1",
            "return": f"{totals.mean():.1f}",
            "score": f"{score:z.2f}" if np.isfinite(score) else "-",
            "metric": f"{figure} {figures[figure]:.3f}",
            STYLE[0]: compliance,
            "study": f"[entry]({ENTRIES}/{copied.name})",
            "command of seed 0": _command(entry),
            "configuration": copied.name,
        }
        rows[place, name] = list(cells.values())
    write(folder, list(rows.values()))
    return studies / PAGE


def checked_name(name: str) -> str:
    """Return the name of a learner.

    Raises:
        ValueError: it has other characters than letters, digits, `_`, `-` and `.`.
    """
    if not _NAME.fullmatch(name):
        raise ValueError(f"--name={name}: expected letters, digits, _, - and .")
    return name


def table(heads: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    return "\n".join(f"| {' | '.join(cells)} |" for cells in (heads, ["---"] * len(heads), *lines))


def _command(entry: Entry) -> str:
    setup = entry.setup
    settings = [f"--set={name}={json.dumps(value)}" for name, value in setup.task_kwargs.items()]
    words = ["arc-suite evaluate", f"--robot={setup.body.name}", f"--task={setup.task}", f"--policy={entry.policy}"]
    settings += [f"--preset={entry.preset}"] * (entry.preset is not None)
    return f"`{' '.join([*words, *settings])}`"


def _rows(path: Path) -> list[list[str]]:
    with path.open(newline="", encoding="utf-8") as file:
        heads, *rows = csv.reader(file)
    if tuple(heads) != HEADS or any(len(row) != len(HEADS) for row in rows):
        raise ValueError(f"{path}: expected rows of {', '.join(HEADS)}")
    return rows
