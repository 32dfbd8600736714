"""Makes the runs of a study on this machine, a process for each."""

import functools
from collections.abc import Callable, Sequence
from pathlib import Path

from tqdm import tqdm

from arc_suite import checks, data, files
from arc_suite.learning import processes
from arc_suite.learning.agents import run_folder
from arc_suite.learning.agents.configuration import DATA_FIELDS
from arc_suite.learning.studies.tables import Run


def make(runs: Sequence[Run], folder: Path, jobs: int, progress: Callable = tqdm) -> int:
    """Make the runs that are not finished, print the outcome of each, and return the exit status: 1 if any failed.

    Args:
        runs: runs of the study.
        folder: folder of the study, with a folder and a log for each run.
        jobs: number of runs at a time.
        progress: makes a progress bar as `tqdm` does.

    Raises:
        ValueError, OSError: as `prepare`, or a file cannot be written.
    """
    unfinished = prepare(runs, folder, jobs, progress)
    commands = {run.name: functools.partial(_command, run, folder / run.name) for run in unfinished}
    failures = len(processes.run(commands, folder, jobs))
    line = f"{len(runs) - failures} of {len(runs)} finished"
    print(f"{line}, {failures} failed" if failures else line)
    return int(failures > 0)


def prepare(runs: Sequence[Run], folder: Path, threads: int, progress: Callable = tqdm) -> list[Run]:
    """Collect the prior data of the runs that are not finished, and return these runs.

    Raises:
        ValueError, OSError: the folder of another run, prior data that do not fit, a full disk.
    """
    files.folder(folder)
    unfinished = [run for run in runs if not is_finished(run, folder / run.name)]
    run_by_dataset = {run.configuration.prior: run for run in unfinished if run.prior is not None}
    for dataset, run in run_by_dataset.items():
        episodes = run.prior.episodes
        settings = run.prior.settings(run.configuration.setup)
        # Waits, as another process may collect the same dataset.
        data.collect(dataset, settings, episodes, threads=threads, progress=progress, wait=True)
        stored_episodes = len(data.open(dataset))
        if stored_episodes != episodes:
            what = f"dataset {checks.preview(dataset)} has {stored_episodes} episodes, and the study takes {episodes}"
            raise ValueError(f"{run.name}: {what}; delete it, to have it collected anew")
    return unfinished


def is_finished(run: Run, folder: Path) -> bool:
    """Return whether the run in a folder is finished.

    Raises:
        ValueError: it is another run, or damaged.
    """
    if run_folder.is_begun(folder):
        run_folder.check_same_run(folder, run.configuration.record(), left_out=("versions", *DATA_FIELDS))
    return run_folder.read_progress(folder).get("evaluated", 0) >= run.configuration.steps


def _command(run: Run, output: Path) -> list[str]:
    """Return the arguments of `arc-suite` that make a run, and write the configuration of one that has not begun."""
    config = files.folder(output) / run_folder.CONFIG
    if not run_folder.is_begun(output):
        with files.writing_json(config) as file:
            file.update(run.configuration.to_dict())
    command = ["train", f"--config={config}", f"--output={output}"]
    modules = ",".join(run.configuration.modules)
    if modules:
        command.append(f"--modules={modules}")
    return command
