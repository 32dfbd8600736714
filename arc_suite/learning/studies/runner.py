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
    commands = {run.name: functools.partial(_command, run, folder / run.name) for run in waiting}
    failed = len(processes.run(commands, folder, jobs))
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
            what = f"dataset {checks.preview(dataset)} has {found} episodes, and the study takes {episodes}"
            raise ValueError(f"{run.name}: {what}; delete it, to have it collected anew")
    return waiting


def is_finished(run: Run, folder: Path) -> bool:
    """Return whether the run in a folder is finished.

    Raises:
        ValueError: it is another run, or damaged.
    """
    if run_folder.is_begun(folder):
        run_folder.check_same_run(folder, run.configuration.record(), left_out=("versions", *DATA_FIELDS))
    return run_folder.read_progress(folder).get("evaluated", 0) >= run.configuration.steps


def _command(run: Run, output: Path) -> list[str]:
    config = files.folder(output) / run_folder.CONFIG
    if not run_folder.is_begun(output):
        with files.writing_json(config) as file:
            file.update(run.configuration.to_dict())
    modules = ",".join(run.configuration.modules)
    return ["train", f"--config={config}", f"--output={output}", *([f"--modules={modules}"] if modules else [])]
