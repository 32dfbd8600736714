"""The leaderboard: a table of all studies and entries, and its page.

studies/leaderboard.csv     rows of studies, by `report.write`, and of entries, by `enter`
studies/entries             the entries
studies/README.md           the page
"""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from arc_suite import files
from arc_suite.evaluation import anchors, provenance
from arc_suite.learning.studies import csv_files
from arc_suite.learning.studies.entries import Entry

PAGE, TABLE, ENTRIES = "README.md", "leaderboard.csv", "entries"
STYLE = ("gait compliance", "heading error, rad", "torso pitch, rad")
HEADS = (
    *("robot, task", "algorithm", "phases, updates", "prior data, episodes", "seeds", "return", "score", "IQM [95 %]"),
    *("metric", *STYLE, "steps", "CPU min", "notes", "study", "command of seed 0", "configuration"),
)
_NAME = re.compile(r"[\w.-]+")
_TEXT = (
    "All committed studies, written by `arc-suite study NAME --report`, and entries, written by `arc-suite enter`. "
    "Return: mean over 100 episodes of the latest policy, unless noted. Score: (return - standing still) / (best "
    "demonstrator - standing still). IQM: interquartile mean with 95 % bootstrap interval over seeds; a single seed "
    "has none. Then the task's own metric, speed in m/s; headings are relative to the x axis, which is not the "
    "direction of a command. Runs of one configuration that several studies have are in one row. Phases: the most "
    "updates of the critics alone; 75,000 are published."
)


def write(studies: Path, study: str, lines: Iterable[dict[str, str]]) -> None:
    """Replace the lines of a study, and write the page.

    Args:
        studies: folder of the leaderboard.
        study: its name.
        lines: cells by `HEADS`.

    Raises:
        ValueError: a damaged table.
        OSError: a file cannot be written.
    """
    _write(studies, [*(line for line in csv_files.read(studies / TABLE, HEADS) if line["study"] != study), *lines])


def _write(studies: Path, lines: Iterable[dict[str, str]]) -> None:
    lines = sorted(lines, key=lambda line: line["study"].partition("/")[0])
    csv_files.write(studies / TABLE, HEADS, lines)
    heads = HEADS[:-1]  # the configuration only tells lines apart
    page = table(heads, [[(line | {"study": link(line)})[head] for head in heads] for line in ranked(lines)])
    files.write(studies / PAGE, f"# Leaderboard\n\n{_TEXT}\n\n{page}\n")


def ranked(lines: Iterable[dict[str, str]]) -> list[dict[str, str]]:
    """Return each configuration once, with the most seeds, by robot and task, and then by return."""
    once: dict[str, dict[str, str]] = {}
    for line in lines:
        known = once.get(line["configuration"])
        if known is None or int(line["seeds"]) > int(known["seeds"]):
            once[line["configuration"]] = line
    return sorted(once.values(), key=lambda line: (line["robot, task"], -float(line["return"])))


def link(line: Mapping[str, str], folder: str = "") -> str:
    """Return the link from a page to the report of a line, or to its entry; `folder` is the way to the studies."""
    study = line["study"]
    return f"[entry]({folder}{study})" if study.startswith(f"{ENTRIES}/") else f"[{study}]({folder}{study}/{PAGE})"


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
    lines: dict[str, dict[str, str]] = {}
    for entry in entries:
        copied = folder / f"{entry.setup.body.name}-{entry.setup.kind.name}-{name}.json"
        files.write(copied, source.read_text(encoding="utf-8"))
        totals = np.array([episode.total for episode in entry.episodes])
        score = float(anchors.anchors(entry.setup).score(totals.mean()))
        figures = {key: np.mean([each.progress[key] for each in entry.episodes]) for key in entry.episodes[0].progress}
        figure = next(iter(figures))
        lines[copied.name] = dict.fromkeys(HEADS, "-") | {
            "robot, task": str(entry.setup),
            "algorithm": name,
            "seeds": "1",
            "return": f"{totals.mean():.1f}",
            "score": f"{score:z.2f}" if np.isfinite(score) else "-",
            "metric": f"{figure} {figures[figure]:.3f}",
            STYLE[0]: f"{figures['gait_compliance']:.3f}" if "gait_compliance" in figures else "-",
            "notes": "-" if entry.training_seeds is not None else provenance.UNKNOWN,
            "study": f"{ENTRIES}/{copied.name}",
            "command of seed 0": _command(entry),
            "configuration": copied.name,
        }
    others = [line for line in csv_files.read(studies / TABLE, HEADS) if line["configuration"] not in lines]
    _write(studies, [*others, *lines.values()])
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
