"""Publication: the tables of a study from the folders of its runs, with the style of their latest policies."""

import contextlib
import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from gymnasium.vector import AutoresetMode

from arc_suite import evaluation, files, policies, style
from arc_suite.cpg.selection import presets_of
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors
from arc_suite.learning.agents import run_folder
from arc_suite.learning.studies import csv_files, results
from arc_suite.learning.studies.results import RUN_COLUMNS, STYLE, TIMES
from arc_suite.learning.studies.tables import Run
from arc_suite.policies import checkpoints, network

# Metrics of `arc_suite.style` by which the final policies are compared.
METRICS = ("heading_error", "lateral_drift", "torso_pitch", "gait_compliance", "foot_slip", "asymmetry")

# Presets of demonstrators whose returns are published, in `walk`, and in tasks with a command; and the best one.
PRESETS, COMMANDED = ("medium", "refined"), ("steered", "surefooted")

_FURTHER = range(evaluation.CURVE_EPISODES, evaluation.EPISODES)  # seeds that complete the latest evaluation

_EPISODE = ("run", "step", "seed", "return", "length")  # first columns of an episode
_STYLE = tuple(STYLE + name for name in METRICS)


def publish(runs: Sequence[Run], folder: Path, published: Path) -> None:
    """Write the tables of all evaluated runs of a study, and the returns of standing still and of demonstrators.

    Rows of runs that have no folder stay.

    Args:
        runs: of the study.
        folder: of the study, with a folder for each run.
        published: folder of the tables.

    Raises:
        ValueError: a damaged table.
        OSError: a file cannot be written.
    """
    configurations = {row["run"]: row for row in csv_files.read(published / results.RUNS, RUN_COLUMNS)}
    episodes = results.episodes_of(published)
    for run in runs:
        if found := _evaluated(folder / run.name):
            configurations[run.name] = _configuration(run, folder / run.name)
            episodes[run.name] = _judged(run, folder / run.name, _with_style(run, folder / run.name, found))
    names = [run.name for run in runs if run.name in episodes]
    if not names:
        return
    fixed = {*_EPISODE, *TIMES, *_STYLE}
    progress = _merged([name for name in episodes[each][0] if name not in fixed] for each in names)
    rows = [row for name in names for row in episodes[name]]
    csv_files.write(published / results.EVALUATIONS, (*_EPISODE, *progress, *TIMES, *_STYLE), rows)
    csv_files.write(published / results.RUNS, RUN_COLUMNS, [configurations[name] for name in names])
    _publish_demonstrators(runs, published)


def _evaluated(folder: Path) -> list[dict[str, str]]:
    """Return the rows of the whole evaluations in the folder of a run, with their times."""
    rows = run_folder.lines(folder, "evaluations", _EPISODE[1:])
    times = {row.pop("step"): row for row in run_folder.lines(folder, "times", ("step", *TIMES))}
    counts = Counter(row["step"] for row in rows)
    whole = {step for step, count in counts.items() if count == evaluation.CURVE_EPISODES and step in times}
    return [{"run": folder.name, **row, **times[row["step"]]} for row in rows if row["step"] in whole]


def _configuration(run: Run, folder: Path) -> dict[str, str]:
    """Return the row of a run in the table of runs."""
    training = run_folder.lines(folder, "training", ("step",))
    phases = {row["step"]: int(float(row["phase_updates"])) for row in training if float(row.get("phase_updates", 0))}
    fields = {"run": run.name, "kind": run.kind, **run_folder.read_config(folder), "phases": phases or None}
    return {name: cell(value) for name, value in fields.items()}


def cell(value: Any) -> str:
    """Return a field of a configuration as a table holds it: text as it is, nothing for None, else JSON."""
    return "" if value is None else value if isinstance(value, str) else json.dumps(value)


def _merged(orders: Iterable[Sequence[str]]) -> list[str]:
    """Return the names of all sequences, each before those that follow it in its sequence."""
    found: list[str] = []
    for names in orders:
        place = len(found)
        for name in reversed(names):
            if name in found:
                place = found.index(name)
            else:
                found.insert(place, name)
    return found


def _with_style(run: Run, folder: Path, rows: list[dict[str, str]]) -> list[dict[str, str]]:
    """Return rows of episodes, those of the latest evaluation with metrics of style, which the folder keeps."""
    latest = rows[-1]["step"]
    measured = run_folder.lines(folder, "style", ("step", "seed"))
    if not _are_of(measured, latest, range(evaluation.CURVE_EPISODES)):
        measured = _measured(run, folder, latest)
    metrics = {row.pop("seed"): {STYLE + name: row[name] for name in row if name != "step"} for row in measured}
    return [row | metrics[row["seed"]] if row["step"] == latest else row for row in rows]


def _are_of(rows: Sequence[Mapping[str, str]], step: str, seeds: range) -> bool:
    """Return whether rows are those of a step, one for each seed."""
    return [(row["step"], row["seed"]) for row in rows] == [(step, str(seed)) for seed in seeds]


def _measured(run: Run, folder: Path, step: str) -> list[dict[str, str]]:
    """Measure the style of the policy at a step, as a later one may exist already, and write its table; slow."""
    path, setup = folder / checkpoints.FOLDER / step / network.FILE, run.configuration.validation
    lines = []
    with contextlib.closing(setup.load()) as environment:
        policy = policies.policy(path, setup.body, task=environment.task.definition)
        for seed in range(evaluation.CURVE_EPISODES):
            measured = style.measure(style.record(environment, policy, seed))
            metrics = {name: repr(measured[name].value) for name in METRICS if name in measured}
            lines.append({"step": step, "seed": str(seed)} | metrics)
    csv_files.write(folder / "style.csv", list(lines[0]), lines)
    return lines


def _judged(run: Run, folder: Path, rows: list[dict[str, str]]) -> list[dict[str, str]]:
    """Return rows of episodes, and those that complete the latest evaluation, which the folder keeps."""
    latest = rows[-1]
    kept = run_folder.lines(folder, "final", _EPISODE[1:])
    if not _are_of(kept, latest["step"], _FURTHER):
        _judge(run, folder, latest["step"])
        kept = run_folder.lines(folder, "final")
    shared = {name: latest[name] for name in ("run", *TIMES)}
    return [*rows, *(shared | row for row in kept)]


def _judge(run: Run, folder: Path, step: str) -> None:
    """Write a table of the episodes that judge the policy at a step, after those of its curve."""
    setup = run.configuration.validation
    policy = network.load(folder / checkpoints.FOLDER / step)
    environment = setup.make_vec(len(_FURTHER), num_threads=1, autoreset_mode=AutoresetMode.DISABLED)
    with contextlib.closing(environment):
        played = evaluation.episodes_in_batch(environment, policy, _FURTHER)
    lines = [
        {"step": step, "seed": seed, "return": each.total, "length": each.length, **each.progress}
        for seed, each in zip(_FURTHER, played, strict=True)
    ]
    csv_files.write(folder / "final.csv", list(lines[0]), lines)


def _publish_demonstrators(runs: Sequence[Run], published: Path) -> None:
    known = results.demonstrators(published)
    setups = {run.place: run.configuration.validation for run in runs}
    measured = {place: _demonstrated(setup) for place, setup in setups.items() if place not in known}
    if measured:
        with files.writing(published / results.DEMONSTRATORS) as temporary:
            anchors.write(temporary, known | measured)


def _demonstrated(setup: Setup) -> anchors.Returns:
    """Return the returns of the evaluation protocol of standing still and of demonstrators of a body, by policy."""
    found = dict(anchors.committed_returns(setup) or anchors.measure_returns(setup, evaluation.EPISODES))
    usual = COMMANDED if "command" in setup.definition.blocks else PRESETS
    missing = [preset for preset in usual if preset in presets_of(setup.body) and preset not in found]
    return found | {preset: anchors.play_returns(setup, preset, range(evaluation.EPISODES)) for preset in missing}
