"""Publication: the tables of a study from the folders of its runs, with the style of their latest policies."""

import contextlib
import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tqdm import tqdm

from arc_suite import evaluation, files, policies, style, usage
from arc_suite.cpg.selection import presets_of
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, judging
from arc_suite.learning import finals
from arc_suite.learning.agents import run_folder
from arc_suite.learning.studies import csv_files, results
from arc_suite.learning.studies.results import RUN_COLUMNS, STYLE, TIMES
from arc_suite.learning.studies.tables import Run
from arc_suite.policies import checkpoints, network

# Metrics of `arc_suite.style` by which the final policies are compared.
METRICS = ("heading_error", "lateral_drift", "torso_pitch", "gait_compliance", "foot_slip", "asymmetry")

# Presets of demonstrators whose returns are published in `walk` and its like.
PRESETS = ("medium", "refined")
# The same in tasks with a command.
COMMAND_PRESETS = ("steered", "surefooted")

_EPISODE_COLUMNS = ("run", "step", "seed", "return", "length")  # first columns of an episode
_STYLE_COLUMNS = tuple(STYLE + name for name in METRICS)


def publish(runs: Sequence[Run], folder: Path, published: Path, progress: Callable = tqdm) -> None:
    """Write the tables of all evaluated runs of a study, and the returns of standing still and of demonstrators.

    Rows of runs that have no folder stay. Demonstrators play in the places of evaluated runs alone, and in none of the
    benchmark, which has anchors.

    Args:
        runs: runs of the study.
        folder: folder of the study, with a folder for each run.
        published: folder of the tables.
        progress: makes a progress bar as `tqdm` does.

    Raises:
        ValueError: a damaged table.
        OSError: a file cannot be written.
    """
    run_rows = {row["run"]: row for row in csv_files.read(published / results.RUNS, RUN_COLUMNS)}
    episodes = results.read_episodes(published)
    final_rows = results.read_episodes(published, results.FINALS)
    for run in progress(runs, desc=f"{published}: style and returns", unit="run", leave=False):
        output = folder / run.name
        rows = _complete_evaluations(output)
        if rows:
            run_rows[run.name] = _run_row(run, output)
            episodes[run.name] = _add_style(run, output, rows)
            final_rows.pop(run.name, None)  # of an earlier policy
            last_step = int(rows[-1]["step"])
            if last_step >= run.configuration.steps:
                final_lines = finals.play_once(run.configuration, output, last_step)
                final_rows[run.name] = final_lines
    names = [run.name for run in runs if run.name in episodes]
    if not names:
        return
    _write_episodes(published / results.EVALUATIONS, _EPISODE_COLUMNS, episodes, names)
    write_finals(published, {name: final_rows[name] for name in names if name in final_rows})
    csv_files.write(published / results.RUNS, RUN_COLUMNS, [run_rows[name] for name in names])
    evaluated_runs = [run for run in runs if run.name in episodes]
    _publish_demonstrators(evaluated_runs, published, progress)


def write_finals(published: Path, lines_by_run: Mapping[str, Sequence[Mapping[str, str]]]) -> None:
    """Write the table of the episodes that judge policies, if there are any.

    Raises:
        OSError: the file cannot be written.
    """
    episodes = {name: [{"run": name} | dict(row) for row in rows] for name, rows in lines_by_run.items()}
    if episodes:
        _write_episodes(published / results.FINALS, ("run", *finals.COLUMNS), episodes, list(episodes))


def _write_episodes(
    path: Path, first_columns: Sequence[str], episodes: Mapping[str, Sequence[Mapping[str, str]]], names: Sequence[str]
) -> None:
    """Write a table of episodes: the rows of runs in the order of their names.

    Args:
        path: path of the table.
        first_columns: columns that all rows have; the metrics of their tasks follow.
        episodes: rows by name of the run.
        names: names of runs.
    """
    columns_with_cells = {column for name in names for row in episodes[name] for column in row}
    last_columns = [column for column in (*TIMES, *_STYLE_COLUMNS) if column in columns_with_cells]
    metrics_by_run = []
    for name in names:
        first_row = episodes[name][0]
        metrics_by_run.append([column for column in first_row if column not in {*first_columns, *last_columns}])
    columns = (*first_columns, *_merge_orders(metrics_by_run), *last_columns)
    csv_files.write(path, columns, [row for name in names for row in episodes[name]])


def _complete_evaluations(folder: Path) -> list[dict[str, str]]:
    """Return the episodes of the complete evaluations in the folder of a run, with their times."""
    rows = run_folder.lines(folder, "evaluations", _EPISODE_COLUMNS[1:])
    times = {row.pop("step"): row for row in run_folder.lines(folder, "times", ("step", *TIMES))}
    counts = Counter(row["step"] for row in rows)
    complete_steps = {step for step, count in counts.items() if count == evaluation.CURVE_EPISODES and step in times}
    return [{"run": folder.name, **row, **times[row["step"]]} for row in rows if row["step"] in complete_steps]


def _run_row(run: Run, folder: Path) -> dict[str, str]:
    """Return the row of a run in the table of runs."""
    phases = {}
    for row in run_folder.lines(folder, "training", ("step",)):
        updates = int(float(row.get("phase_updates", 0)))
        if updates:
            phases[row["step"]] = updates
    progress = run_folder.read_progress(folder)
    used = {name: progress[name] for name in (*usage.STEP_COUNTS, results.SOURCES) if name in progress}
    fields = {"run": run.name, "kind": run.kind, **run_folder.read_config(folder), "phases": phases or None, **used}
    return {name: cell(value) for name, value in fields.items() if name in RUN_COLUMNS}


def cell(value: Any) -> str:
    """Return the cell of a value in a table: text unchanged, an empty cell for None, else JSON."""
    if value is None:
        return ""
    return value if isinstance(value, str) else json.dumps(value)


def _merge_orders(orders: Iterable[Sequence[str]]) -> list[str]:
    """Return the names of all sequences without repetitions; names keep their order within each sequence."""
    merged_names: list[str] = []
    for names in orders:
        # From the last name to the first: a new name goes before the one that follows it in its sequence.
        position = len(merged_names)
        for name in reversed(names):
            if name in merged_names:
                position = merged_names.index(name)
            else:
                merged_names.insert(position, name)
    return merged_names


def _add_style(run: Run, folder: Path, rows: list[dict[str, str]]) -> list[dict[str, str]]:
    """Return rows of episodes with metrics of style in the latest evaluation.

    The metrics come from the table of style in the folder; they are measured if it has another step.
    """
    latest_step = rows[-1]["step"]
    style_rows = run_folder.lines(folder, "style", ("step", "seed"))
    seeds = [row["seed"] for row in rows if row["step"] == latest_step]
    if [(row["step"], row["seed"]) for row in style_rows] != [(latest_step, seed) for seed in seeds]:
        style_rows = _measure_style(run, folder, latest_step, seeds)
    metrics_by_seed = {}
    for style_row in style_rows:
        metrics = {STYLE + name: text for name, text in style_row.items() if name not in ("step", "seed")}
        metrics_by_seed[style_row["seed"]] = metrics
    return [row | metrics_by_seed[row["seed"]] if row["step"] == latest_step else row for row in rows]


def _measure_style(run: Run, folder: Path, step: str, seeds: Sequence[str]) -> list[dict[str, str]]:
    """Measure the style of the checkpoint of a step, write its table, and return its rows; slow.

    The policy in the folder itself may be a later one.
    """
    path = folder / checkpoints.FOLDER / step / network.FILE
    setup = run.configuration.validation
    rows = []
    with contextlib.closing(setup.load()) as environment:
        policy = policies.policy(path, setup.body, task=environment.task.definition)
        for seed in seeds:
            metrics = style.measure(style.record(environment, policy, int(seed)))
            texts = {name: repr(metrics[name].value) for name in METRICS if name in metrics}
            rows.append({"step": step, "seed": seed} | texts)
    csv_files.write(folder / "style.csv", list(rows[0]), rows)
    return rows


def _publish_demonstrators(runs: Sequence[Run], published: Path, progress: Callable) -> None:
    """Add the returns of standing still and of demonstrators in the places of runs that have no anchors yet.

    Those of the benchmark have some.
    """
    published_returns = results.read_demonstrators(published)
    setups = {}
    for run in runs:
        if run.place not in published_returns and judging.levels(run.configuration.setup) is None:
            setups[run.place] = run.configuration.validation
    if not setups:
        return
    new_returns = {}
    for place, setup in progress(setups.items(), desc=f"{published}: demonstrators", unit="place", leave=False):
        new_returns[place] = _anchor_returns(setup)
    with files.writing(published / results.DEMONSTRATORS) as temporary:
        anchors.write(temporary, published_returns | new_returns)


def _anchor_returns(setup: Setup) -> anchors.Returns:
    """Return the returns of the evaluation protocol of standing still and of demonstrators of a body, by policy."""
    returns = dict(anchors.committed_returns(setup) or anchors.measure_returns(setup, evaluation.EPISODES))
    presets = COMMAND_PRESETS if "command" in setup.definition.blocks else PRESETS
    for preset in presets:
        if preset in presets_of(setup.body) and preset not in returns:
            returns[preset] = anchors.play_returns(setup, preset, range(evaluation.EPISODES))
    return returns
