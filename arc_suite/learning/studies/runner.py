"""Makes the runs of a study on this machine, a process for each.

Submitit serves clusters alone, see `cluster`: its local executor starts all jobs at once, and its jobs ignore SIGTERM.
"""

import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from tqdm import tqdm

from arc_suite import checks, data, files
from arc_suite.learning.agents import run_folder
from arc_suite.learning.agents.configuration import OF_DATA
from arc_suite.learning.studies.tables import Run

_PAUSE = 0.2  # s between two looks at the processes


def make(runs: Sequence[Run], folder: Path, jobs: int, progress: Callable = tqdm) -> int:
    """Make the runs that are not finished, print what becomes of each, and return the exit status: 1 if any failed.

    Args:
        runs: of the study.
        folder: of the study, with a folder and a log for each run.
        jobs: runs at a time.
        progress: makes a progress bar as `tqdm` does.

    Raises:
        ValueError, OSError: as `prepare`, or a file cannot be written.
    """
    waiting = prepare(runs, folder, jobs, progress)
    running: dict[str, subprocess.Popen] = {}
    failed = 0
    try:
        while waiting or running:
            while waiting and len(running) < jobs:
                run = waiting.pop(0)
                running[run.name] = _process(run, folder)
                print(f"{run.name}: running", flush=True)
            for name, process in list(running.items()):
                if process.poll() is not None:
                    del running[name]
                    failed += bool(process.returncode)
                    print(f"{name}: {'failed' if process.returncode else 'finished'}", flush=True)
                    if process.returncode:
                        print(_reason(folder / f"{name}.log"), file=sys.stderr)
            time.sleep(_PAUSE)
    finally:
        for end in (subprocess.Popen.terminate, subprocess.Popen.wait):
            for process in running.values():
                end(process)
    print(f"{len(runs) - failed} of {len(runs)} finished" + (f", {failed} failed" if failed else ""))
    return int(failed > 0)


def prepare(runs: Sequence[Run], folder: Path, threads: int, progress: Callable = tqdm) -> list[Run]:
    """Collect the prior data of the runs that are not finished, and return these runs.

    Raises:
        ValueError, OSError: the folder of another run, prior data that do not fit, a full disk.
    """
    files.folder(folder)
    waiting = [run for run in runs if not is_finished(run, folder / run.name)]
    for run in {run.configuration.prior: run for run in waiting if run.prior is not None}.values():
        dataset, episodes = run.configuration.prior, run.prior.episodes
        settings = run.prior.settings(run.configuration.setup)
        data.collect(dataset, settings, episodes, threads=threads, progress=progress, wait=True)  # others may, too
        if (found := len(data.open(dataset))) != episodes:
            what = f"dataset {checks.shown(dataset)} has {found} episodes, and the study takes {episodes}"
            raise ValueError(f"{run.name}: {what}; delete it, to have it collected anew")
    return waiting


def is_finished(run: Run, folder: Path) -> bool:
    """Return whether the run in a folder is finished.

    Raises:
        ValueError: it is another run, or damaged.
    """
    if run_folder.is_begun(folder):
        run_folder.check(folder, run.configuration.record(), left_out=("versions", *OF_DATA))
    return run_folder.progress_of(folder).get("evaluated", 0) >= run.configuration.steps


def _process(run: Run, folder: Path) -> subprocess.Popen:
    output = files.folder(folder / run.name)
    config = output / run_folder.CONFIG
    if not run_folder.is_begun(output):
        with files.writing_json(config) as file:
            file.update(run.configuration.to_dict())
    command = [sys.executable, "-m", "arc_suite", "train", f"--config={config}", f"--output={output}"]
    with (folder / f"{run.name}.log").open("ab") as log:
        return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT)


def _reason(log: Path) -> str:
    """Return why a run failed: its log, and the last line in it."""
    lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    return f"{log}: {lines[-1] if lines else 'says nothing'}"
