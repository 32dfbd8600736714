"""Runs studies: each run is a process of `arc-suite train`, which goes on with whatever its folder holds.

The lock of a run is that of its log, which its process inherits: what a killed study has left behind goes on by
itself, and no other study starts it a second time. Finished runs are published: their tables, a few kilobytes,
the style of their policies, and a strip of frames go into a folder that is committed and that reports are made of.
"""

import contextlib
import csv
import json
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO

import numpy as np
from gymnasium.vector import AutoresetMode
from tqdm import tqdm

from arc_suite import data, evaluation, files, policies, style
from arc_suite.agents import run_folder
from arc_suite.agents.training import PRIOR_SHA256
from arc_suite.cpg.demonstrator import presets_of, suited_preset
from arc_suite.envs.dm import Environment, load
from arc_suite.envs.vector import VectorEnv
from arc_suite.policies import Policy, checkpoints, network
from arc_suite.simulation.opengl import RenderingUnavailable
from arc_suite.studies import results
from arc_suite.studies.tables import Row
from arc_suite.studies.watch import State, states, table, watched
from arc_suite.style import strips

PUBLISHED = (run_folder.CONFIG, "evaluations.csv", "times.csv")

# Metrics of `arc_suite.style` by which the final policies are compared.
METRICS = ("heading_error", "lateral_drift", "torso_pitch", "gait_compliance", "foot_slip", "asymmetry")

# Of demonstrators whose returns are published beside those of runs: in `walk`, and where there is a command. That which
# suits the task stands with them.
PRESETS, COMMANDED = ("medium", "refined"), ("steered", "surefooted")

_PAUSE = 0.2  # s between two looks at the processes


def is_finished(row: Row, folder: Path) -> bool:
    """Return whether the run in a folder is at its end.

    Raises:
        ValueError: it is another run than the row's, or damaged; one line.
    """
    if run_folder.progress_of(folder).get("evaluated", 0) < row.steps:
        return False
    run_folder.check(folder, json.loads(json.dumps(row.run().config())), left_out=("versions", PRIOR_SHA256))
    return True


def run(
    rows: Sequence[Row],
    folder: Path,
    published: Path,
    jobs: int,
    shown: Callable[[list[State]], None],
    progress: Callable = tqdm,
) -> list[State]:
    """Make the runs that are not finished, and publish them.

    Args:
        rows: of the study.
        folder: of the study, in which each run has one of its own.
        published: folder for what is to be committed.
        jobs: runs at a time.
        shown: called with the states of all runs, again and again.
        progress: makes progress bars as `tqdm` does, of prior data that are collected first.

    Returns:
        The states of all runs at the end; a failed run has said why in its log, beside its folder.

    Raises:
        ValueError: a row that does not fit, or the folder of another run; one line.
        OSError: something cannot be written; one line.
    """
    words = prepared(rows, folder, jobs, progress)
    look = watched(rows, folder, words, shown)
    running: dict[str, tuple[Row, subprocess.Popen, IO]] = {}
    try:
        while not {"waiting", "elsewhere", "running"}.isdisjoint(words.values()):
            for row in rows:
                if words[row.name] in ("waiting", "elsewhere") and len(running) < jobs:
                    log = claimed(folder / f"{row.name}.log")
                    words[row.name] = "running" if log else "elsewhere"
                    if log:
                        running[row.name] = row, _started(row, folder / row.name, log), log
            for row, process, log in list(running.values()):
                if process.poll() is not None:
                    log.close()
                    del running[row.name]
                    words[row.name] = "failed" if process.returncode else "finished"
                    publish(row, folder, published)
            look()
            time.sleep(_PAUSE)
    finally:
        for _, process, _ in running.values():
            process.terminate()
        for _, process, _ in running.values():
            process.wait()
    publish_all(rows, folder, published)  # those too that were finished before, or made elsewhere
    return states(rows, folder, words)


def prepared(rows: Sequence[Row], folder: Path, threads: int, progress: Callable = tqdm) -> dict[str, str]:
    """Collect the prior data of the runs that are not finished, and return words of all by name, as in `State`.

    Raises:
        ValueError: a row that does not fit, or the folder of another run; one line.
        OSError: something cannot be written; one line.
    """
    for row in rows:
        _ = row.body  # before any run is made: it names files
    files.folder(folder)
    words = {row.name: "finished" if is_finished(row, folder / row.name) else "waiting" for row in rows}
    waiting = [row for row in rows if words[row.name] == "waiting"]
    for row in {row.prior_id: row for row in waiting if row.prior is not None}.values():
        # Other shares of the study begin at the same time, and want the same data.
        wanted = row.prior_id, row.prior_settings, row.prior.episodes
        data.collect(*wanted, threads=threads, progress=progress, wait=True)
        found = len(data.open(row.prior_id))
        if found != row.prior.episodes:
            what = f"dataset {row.prior_id!r} has {found} episodes, and the study takes {row.prior.episodes}"
            raise ValueError(f"{row.name}: {what}; delete it, to have it collected anew")
    return words


def claimed(log: Path) -> IO | None:
    """Return the open log of a run, locked; None where another process goes on with the run."""
    file = log.open("ab")
    if files.lock(file):
        return file
    file.close()
    return None


def publish(row: Row, folder: Path, published: Path) -> None:
    """Copy the tables of a run that has been evaluated, and measure and draw the style of its latest policy.

    What is there already of the same policy stays, and where there is no OpenGL, no strip is drawn.

    Args:
        row: of the run.
        folder: of the study, in which the run has one.
        published: folder in which the copies get one.

    Raises:
        OSError: something cannot be written; one line.
    """
    source, target = folder / row.name, published / row.name
    steps = results.evaluated(table(source, "evaluations"))
    if not len(steps):
        return
    files.folder(target)
    config = target / run_folder.CONFIG
    if config.exists() and config.read_text() != (source / run_folder.CONFIG).read_text():
        (target / "style.csv").unlink(missing_ok=True)  # it was measured of another run
    for name in PUBLISHED:
        with files.writing(target / name) as temporary:
            temporary.write_text((source / name).read_text())
    training = table(source, "training")
    if np.any(training.get("phase_updates", 0)):
        with files.writing(target / "phases.csv") as temporary:
            temporary.write_text(_phases(training))
    step = int(steps[-1])
    measured, drawn = table(target, "style"), target / results.STRIP
    up_to_date = bool(measured) and measured["step"][-1] == step
    if not up_to_date:
        drawn.unlink(missing_ok=True)  # before the style is new: where it is, the strip is of the same policy
    if not drawn.exists():
        with contextlib.suppress(RenderingUnavailable), _played(row, source, step) as (environment, policy):
            if (picture := strips.strip(environment, policy)) is not None:
                with files.writing(drawn) as temporary:
                    strips.write(temporary, picture)
    if not up_to_date:
        text = _style(row, source, step)  # long work, in which a kill is to leave no temporary file
        with files.writing(target / "style.csv") as temporary:
            temporary.write_text(text)


def _phases(training: Mapping[str, np.ndarray]) -> str:
    """Return a table of the updates of stabilisation phases, by the environment step that they follow."""
    pairs = zip(training["step"].astype(int), training["phase_updates"].astype(int), strict=True)
    return "\n".join(["step,updates", *(f"{step},{updates}" for step, updates in pairs if updates)]) + "\n"


def publish_all(rows: Sequence[Row], folder: Path, published: Path) -> None:
    """Publish all runs of a study that have been evaluated, and what demonstrators earn in their places.

    Raises:
        OSError: something cannot be written; one line.
    """
    for row in rows:
        publish(row, folder, published)
    known = results.demonstrators(published)
    places = {row.place: row for row in rows}
    if places.keys() <= known.keys() or not published.exists():
        return
    with files.writing(published / results.DEMONSTRATORS) as temporary, temporary.open("w", newline="") as file:
        lines = csv.writer(file, lineterminator="\n")
        lines.writerow(("place", "preset", "seed", "return"))
        for place, presets in known.items():
            for preset, totals in presets.items():
                lines.writerows((place, preset, seed, repr(float(total))) for seed, total in enumerate(totals))
        for place, row in places.items():
            if place not in known:
                for preset, episodes in _demonstrated(row).items():
                    lines.writerows((place, preset, seed, repr(each.total)) for seed, each in enumerate(episodes))


def _demonstrated(row: Row) -> dict[str, list[evaluation.Episode]]:
    """Return the episodes of the evaluation protocol by the demonstrators of a run's body, by preset."""
    body, found = row.body, {}
    rows = VectorEnv(body, row.task, evaluation.EPISODES, 1, AutoresetMode.DISABLED, task_kwargs=dict(row.task_kwargs))
    with contextlib.closing(rows):
        usual = COMMANDED if "command" in rows.task.blocks else PRESETS
        for preset in dict.fromkeys((*usual, suited_preset(rows.task))):
            if preset in presets_of(body):
                policy = policies.policy("cpg", body, preset, evaluation.EPISODES, task=rows.task)
                found[preset] = evaluation.episodes_in_rows(rows, policy)
    return found


@contextlib.contextmanager
def _played(row: Row, folder: Path, step: int) -> Iterator[tuple[Environment, Policy]]:
    """Open the environment of a run, and its policy at a step; a later one may be there already."""
    path = folder / checkpoints.FOLDER / str(step) / network.FILE
    with contextlib.closing(load(row.body, row.task, row.task_kwargs)) as environment:
        yield environment, policies.policy(path, row.body, task=environment.task.definition)


def _style(row: Row, folder: Path, step: int) -> str:
    """Return a table of the metrics of the episodes of the evaluation protocol."""
    lines = []
    with _played(row, folder, step) as (environment, policy):
        for seed in range(evaluation.EPISODES):
            measured = style.measure(style.record(environment, policy, seed))
            figures = {name: measured[name].value for name in METRICS if name in measured}
            lines.append(",".join(map(repr, (step, seed, *figures.values()))))
    return "\n".join([",".join(("step", "seed", *figures)), *lines]) + "\n"


def _started(row: Row, folder: Path, log: IO) -> subprocess.Popen:
    command = [sys.executable, "-m", "arc_suite", *row.arguments(folder)]
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT)
