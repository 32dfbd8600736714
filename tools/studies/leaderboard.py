"""The leaderboard: a table of all committed studies, and its page.

studies/leaderboard.csv     rows of all studies
studies/README.md           the page
"""

import hashlib
import json
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from arc_suite import files
from arc_suite.learning.studies import csv_files, report, results
from arc_suite.learning.studies.tables import Run
from arc_suite.learning.studies.text_tables import table
from studies import catalog

PAGE = "README.md"
TABLE = "leaderboard.csv"
STYLE_METRICS = {  # by the heading of their column
    "gait compliance": "gait_compliance",
    "heading error, rad": "heading_error",
    "torso pitch, rad": "torso_pitch",
}
HEADS = (
    *("robot, task", "algorithm", "phases, updates", "prior data, episodes"),
    *("seeds", "return", "95 %", "of each seed", "score", "metric"),
    *(*STYLE_METRICS, "steps", "CPU min", "notes", "study", "command of seed 0", "configuration"),
)
_TEXT = (
    "All committed studies, written by `python tools/study.py NAME --report`. "
    "Return: mean over 100 episodes of the latest policy, unless noted; over three seeds or more with a 95 % interval "
    "(Student's t). Score: (return - standing still) / (best demonstrator - standing still), over the same "
    "episodes or as the [benchmark](../docs/benchmark.md#how-we-judge) judges. Then the task's own metric, speed in "
    "m/s; headings are relative to the x axis, which is not the direction of a command. Runs of one configuration "
    "that several studies have are in one row. Phases: the most updates of the critics alone; 75,000 are published. "
    "Earlier model: the body or the ground has changed since the run, so that the command gives another return. Judged "
    "on seeds from 0 on: a run of an earlier version, whose command gives another return now."
)


def write(studies: Path) -> None:
    """Write the table and the page of the studies in a folder.

    Args:
        studies: folder with the tables of each study in a folder of its name.

    Raises:
        ValueError: a folder with the name of no study, or a damaged table.
        OSError: a file cannot be read or written.
    """
    names = sorted(path.parent.name for path in studies.glob(f"*/{results.RUNS}"))
    rows = [row for name in names for row in study_rows(name, studies / name)]
    csv_files.write(studies / TABLE, HEADS, rows)
    heads = HEADS[:-1]  # the configuration says which rows of studies are the same
    lines = []
    for row in rank_configurations(rows):
        linked_row = row | {"study": link(row)}
        lines.append([linked_row[head] for head in heads])
    files.write(studies / PAGE, f"# Leaderboard\n\n{_TEXT}\n\n{table(heads, lines)}\n")


def study_rows(name: str, published: Path) -> list[dict[str, str]]:
    """Return the rows of a study, one for each kind of run in a place: cells by `HEADS`.

    Args:
        name: name of the study.
        published: folder of its tables.

    Raises:
        ValueError: an unknown study, or a damaged table.
        OSError: a table cannot be read.
    """
    groups = results.group_by_place(results.read_results(catalog.committed_study(name, published).runs, published))
    demonstrators = results.read_demonstrators(published)
    rows = []
    for _, _, seeds in report.by_kind(groups):
        run = seeds[0].run
        returns = results.final_returns(seeds)
        phase_updates = getattr(run.configuration.hyperparameters, "phase_updates", 0)
        metric = next(iter(seeds[0].progress))
        cells = {
            "robot, task": run.place,
            "algorithm": run.kind,
            "phases, updates": f"{phase_updates:,}" if phase_updates else "-",
            "prior data, episodes": f"{run.prior.preset}, {run.prior.episodes:,}" if run.prior else "-",
            "seeds": str(len(seeds)),
            "return": f"{returns.mean():.1f}",
            "95 %": report.interval_text(returns),
            "of each seed": report.list_text(returns),
            "score": report.score_text(seeds, demonstrators),
            "metric": f"{metric} {np.mean([np.mean(result.progress[metric]) for result in seeds]):.3f}",
            **{head: report.style_text(name, seeds) for head, name in STYLE_METRICS.items()},
            "steps": f"{min(result.steps[-1] for result in seeds):,} of {run.configuration.steps:,}",
            "CPU min": f"{np.mean([result.cpu[-1] for result in seeds]) / 60.0:.1f}",
            "notes": results.join_notes(seeds),
            "study": name,
            "command of seed 0": f"`{run.configuration.command}`",
            "configuration": _hash_without_seed(run),
        }
        rows.append(cells)
    return rows


def _hash_without_seed(run: Run) -> str:
    """Return a hash of a run's configuration without its seed: runs that differ in nothing else have the same."""
    fields = {name: value for name, value in run.configuration.to_dict().items() if name != "seed"}
    return hashlib.sha256(json.dumps(fields, sort_keys=True).encode()).hexdigest()[:12]


def rank_configurations(rows: Iterable[dict[str, str]]) -> list[dict[str, str]]:
    """Return the row with the most seeds of each configuration, sorted by robot and task, and then by return."""
    row_of_configuration: dict[str, dict[str, str]] = {}
    for row in rows:
        earlier_row = row_of_configuration.get(row["configuration"])
        if earlier_row is None or int(row["seeds"]) > int(earlier_row["seeds"]):
            row_of_configuration[row["configuration"]] = row
    return sorted(row_of_configuration.values(), key=lambda row: (row["robot, task"], -float(row["return"])))


def link(row: Mapping[str, str], studies: str = "") -> str:
    """Return the link from a page to the report of a row; `studies` is the way to the folder of all studies."""
    return f"[{row['study']}]({studies}{row['study']}/{report.REPORT})"
