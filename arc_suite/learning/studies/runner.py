"""Makes the runs of a study on this machine: a process for each, or many in one program of a device."""

import functools
import math
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from tqdm import tqdm

from arc_suite import checks, data, files
from arc_suite.learning import processes
from arc_suite.learning.agents import run_folder, training
from arc_suite.learning.agents.configuration import DATA_FIELDS
from arc_suite.learning.agents.hyperparameters import SoftActorCritic
from arc_suite.learning.agents.learner import Diverged
from arc_suite.learning.studies.tables import Run
from arc_suite.simulation.cores import usable_cores


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


def make_on_device(runs: Sequence[Run], folder: Path, minutes: float | None, progress: Callable = tqdm) -> int:
    """Make the runs that are not finished in this process, and return the exit status: 1 if any failed.

    Runs that can learn in one program of JAX's device do so together. The programs with the fewest updates come first.
    A run that diverges leaves its program, which goes on from the checkpoints of the others.

    Args:
        runs: runs of the study.
        folder: folder of the study, with a folder for each run.
        minutes: time after which all stop; the same command goes on. None to make all runs.
        progress: makes a progress bar as `tqdm` does.

    Raises:
        ValueError: a run that cannot learn on a device, or as `prepare`.
        OSError: as `prepare`, or a file cannot be written.
    """
    end_time = math.inf if minutes is None else time.monotonic() + 60.0 * minutes
    waiting = prepare(runs, folder, usable_cores(), progress)
    failures = 0
    while waiting and time.monotonic() < end_time:
        program_runs = _group_by_program(waiting, folder)[0]
        try:
            training.train_in_one_program(
                [run.configuration for run in program_runs],
                [folder / run.name for run in program_runs],
                progress,
                stop=lambda: time.monotonic() >= end_time,
            )
        except Diverged as error:
            tqdm.write(f"{error.folder}: {error}", file=sys.stderr)
            program_runs = [run for run in program_runs if folder / run.name == error.folder]
            failures += 1
        waiting = [run for run in waiting if run not in program_runs]
    finished = sum(is_finished(run, folder / run.name) for run in runs)
    line = f"{finished} of {len(runs)} finished"
    print(f"{line}, {failures} failed" if failures else line)
    return int(failures > 0)


def _group_by_program(runs: Sequence[Run], folder: Path) -> list[list[Run]]:
    """Return runs in groups that can learn in one program, those with the fewest updates first."""
    folders = [folder / run.name for run in runs]
    groups = training.group_by_program([run.configuration for run in runs], folders)
    return sorted(([runs[index] for index in group] for group in groups), key=lambda group: _count_updates(group[0]))


def _count_updates(run: Run) -> int:
    """Return how many updates a run makes at most."""
    hp = run.configuration.hyperparameters
    steps = run.configuration.steps
    if not isinstance(hp, SoftActorCritic):
        return steps * hp.epochs // hp.minibatch
    return steps // hp.num_envs * hp.updates_of_a_step + steps // hp.phase_every * hp.phase_updates


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
