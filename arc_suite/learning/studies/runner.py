"""Makes the runs of a study on this machine, a process for each, and shows a table of them meanwhile."""

import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np
from tqdm import tqdm

from arc_suite import data, files
from arc_suite.learning.agents import run_folder
from arc_suite.learning.agents.configuration import PRIOR_SHA256
from arc_suite.learning.studies import publication
from arc_suite.learning.studies.tables import Run

_PAUSE = 0.2  # s between two looks at the processes
_EVERY = 2.0  # s between two tables without a change
_WORDS = ("running", "elsewhere", "failed", "waiting", "finished")  # those first that change first


class State(NamedTuple):
    """Progress of a run.

    Attributes:
        run: of the study.
        word: one of `_WORDS`; `elsewhere` is in another process.
        step: environment steps so far.
        result: mean return of the latest evaluation; None before the first.
        wall, cpu: s so far, of wall clock and of the processor.
    """

    run: Run
    word: str
    step: int
    result: float | None
    wall: float
    cpu: float


def make(
    runs: Sequence[Run], folder: Path, published: Path, jobs: int, show: Callable, progress: Callable = tqdm
) -> list[State]:
    """Make and publish the runs that are not finished, and return the states of all; a log has why a run failed.

    Args:
        runs: of the study.
        folder: of the study, with a folder and a log for each run.
        published: folder of the results that are committed.
        jobs: runs at a time.
        show: called with the states of all runs again and again, see `shown`.
        progress: makes a progress bar as `tqdm` does.

    Raises:
        ValueError, OSError: as `prepare`, or a file cannot be written.
    """
    words = prepare(runs, folder, jobs, progress)
    running: dict[str, tuple[Run, subprocess.Popen, IO]] = {}
    known, latest = {}, 0.0
    try:
        while not {"waiting", "elsewhere", "running"}.isdisjoint(words.values()):
            for run in runs:
                if words[run.name] in ("waiting", "elsewhere") and len(running) < jobs:
                    log = claim(folder / f"{run.name}.log")
                    words[run.name] = "running" if log else "elsewhere"
                    if log:
                        running[run.name] = run, _process(run, folder / run.name, log), log
            for run, process, log in list(running.values()):
                if process.poll() is not None:
                    log.close()
                    del running[run.name]
                    words[run.name] = "failed" if process.returncode else "finished"
                    publication.publish(run, folder, published)
            if words != {name: state.word for name, state in known.items()} or time.monotonic() >= latest + _EVERY:
                known, latest = states(runs, folder, words, known), time.monotonic()
                show(list(known.values()))
            time.sleep(_PAUSE)
    finally:
        for end in (subprocess.Popen.terminate, subprocess.Popen.wait):
            for _, process, _ in running.values():
                end(process)
    publication.publish_all(runs, folder, published)  # also runs that were finished before, or elsewhere
    return list(states(runs, folder, words).values())


def make_and_show(
    runs: Sequence[Run], folder: Path, published: Path, jobs: int, progress: Callable = tqdm
) -> list[State]:
    """Make the runs behind a table of their states, print why runs failed, and return the states; see `make`.

    Raises:
        ValueError, OSError: as `make`.
    """
    show = shown(jobs)
    states = make(runs, folder, published, jobs, show, progress)
    show(states, whole=True)
    for line in failures(states, folder):
        print(line, file=sys.stderr)
    return states


def prepare(runs: Sequence[Run], folder: Path, threads: int, progress: Callable = tqdm) -> dict[str, str]:
    """Collect the prior data of the runs that are not finished, and return words of all runs by name.

    Raises:
        ValueError, OSError: the folder of another run, prior data that do not fit, a full disk.
    """
    files.folder(folder)
    words = {run.name: "finished" if is_finished(run, folder / run.name) else "waiting" for run in runs}
    with_prior = [run for run in runs if words[run.name] == "waiting" and run.prior is not None]
    for run in {run.configuration.prior: run for run in with_prior}.values():
        dataset, episodes = run.configuration.prior, run.prior.episodes
        settings = run.prior.settings(run.configuration.setup)
        data.collect(dataset, settings, episodes, threads=threads, progress=progress, wait=True)  # others may, too
        if (found := len(data.open(dataset))) != episodes:
            what = f"dataset {dataset!r} has {found} episodes, and the study takes {episodes}"
            raise ValueError(f"{run.name}: {what}; delete it, to have it collected anew")
    return words


def is_finished(run: Run, folder: Path) -> bool:
    """Return whether the run in a folder is finished.

    Raises:
        ValueError: it is another run, or damaged.
    """
    if run_folder.is_begun(folder):
        run_folder.check(folder, run.configuration.record(), left_out=("versions", PRIOR_SHA256))
    return run_folder.progress_of(folder).get("evaluated", 0) >= run.configuration.steps


def claim(log: Path) -> IO | None:
    """Return the open log of a run, locked; None if another process makes the run."""
    file = log.open("ab")
    return file if files.lock(file) else file.close()


def _process(run: Run, folder: Path, log: IO) -> subprocess.Popen:
    config = files.folder(folder) / run_folder.CONFIG
    if not run_folder.is_begun(folder):
        with files.writing_json(config) as file:
            file.update(run.configuration.to_dict())
    command = [sys.executable, "-m", "arc_suite", "train", f"--config={config}", f"--output={folder}"]
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT)


def states(
    runs: Sequence[Run], folder: Path, words: Mapping[str, str], known: Mapping[str, State] = {}
) -> dict[str, State]:
    """Return the states of runs by name; tables that cannot have grown since the known ones are not read again."""
    found = {}
    for run in runs:
        state, word = known.get(run.name), words[run.name]
        if state is None or state.word != word or word in ("running", "elsewhere"):
            times, evaluations = (run_folder.table(folder / run.name, name) for name in ("times", "evaluations"))
            step, wall, cpu = (times[name][-1] if times else 0.0 for name in ("step", "wall_seconds", "cpu_seconds"))
            result = float(run_folder.latest_returns(evaluations).mean()) if evaluations else None
            state = State(run, word, int(step), result, float(wall), float(cpu))
        found[run.name] = state
    return found


def remaining(states: Sequence[State], jobs: int) -> float | None:
    """Return the estimated s to the end, by the pace of a run, its kind, or all runs; None without any progress."""
    paces: dict[str, list[float]] = {}
    for each in states:
        for name in (each.run.kind, "all") if each.step else ():
            paces.setdefault(name, []).append(each.wall / each.step)
    if not paces:
        return None
    left = [each for each in states if each.word not in ("finished", "failed")]
    usual = {each.run.kind: np.mean(paces.get(each.run.kind, paces["all"])) for each in left}
    pace = [each.wall / each.step if each.step else usual[each.run.kind] for each in left]
    return sum(s * max(each.run.configuration.steps - each.step, 0) for s, each in zip(pace, left, strict=True)) / jobs


def text(states: Sequence[State], jobs: int, most: int | None = None) -> str:
    """Return a table of states, with at most `most` lines of runs, and the estimated time that is left."""
    width = max(len(each.run.name) for each in states)
    lines = [f"{'run':<{width}}  {'state':<9} {'steps':>19} {'return':>8} {'CPU min':>8}"]
    for each in sorted(sorted(states, key=lambda each: _WORDS.index(each.word))[:most], key=states.index):
        steps = f"{each.step:,} / {each.run.configuration.steps:,}"
        result = "-" if each.result is None else f"{each.result:.1f}"
        lines.append(f"{each.run.name:<{width}}  {each.word:<9} {steps:>19} {result:>8} {each.cpu / 60.0:>8.1f}")
    finished, failed = (sum(each.word == word for each in states) for word in ("finished", "failed"))
    left = f", {failed} failed" if failed else ""
    if finished + failed < len(states):
        seconds = remaining(states, jobs)
        left += ", ? to go" if seconds is None else ", {} h {:02} min to go".format(*divmod(round(seconds / 60.0), 60))
    return "\n".join([*lines, f"{finished} of {len(states)} finished{left}"])


def failures(states: Sequence[State], folder: Path) -> list[str]:
    """Return a line for each failed run: its log, and the last line in it."""
    logs = [folder / f"{each.run.name}.log" for each in states if each.word == "failed"]
    return [f"{log}: {_last_line(log)}" for log in logs]


def _last_line(log: Path) -> str:
    return (log.read_text(encoding="utf-8", errors="replace").splitlines() or ["says nothing"])[-1]


def shown(jobs: int) -> Callable[..., None]:
    """Return a function that shows states: a table in its place on a terminal, elsewhere a line for each change."""
    words, height = {}, 0

    def show(states, whole=False):
        nonlocal height
        if sys.stdout.isatty():
            over = f"\x1b[{height}A\x1b[J" if height else ""
            page = text(states, jobs, None if whole else max(shutil.get_terminal_size().lines - 3, 1))
            height = page.count("\n") + 1
            return print(over + page, flush=True)
        for each in states:
            if words.get(each.run.name, "waiting") != each.word:
                print(f"{each.run.name}: {each.word}", flush=True)
            words[each.run.name] = each.word
        if whole:
            print(text(states, jobs))

    return show
