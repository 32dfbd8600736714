"""Submits studies to a SLURM cluster with submitit, one job for each share of the runs."""

import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import submitit


class Share(NamedTuple):
    """A job: makes a share of a study; after a timeout or preemption it is queued again and resumes.

    Attributes:
        command: command that makes it.
    """

    command: tuple[str, ...]

    def __call__(self) -> None:
        """Make the runs.

        Raises:
            subprocess.CalledProcessError: a run has failed.
        """
        subprocess.run(self.command, check=True)

    def checkpoint(self) -> submitit.helpers.DelayedSubmission:
        """Return the job that is queued in place of an interrupted one: the same, as it resumes from its folders."""
        return submitit.helpers.DelayedSubmission(self)


def submit(
    command: Sequence[str], shares: int, hours: float, logs: Path, cluster: str = "slurm", **parameters
) -> list[submitit.Job]:
    """Submit an array of jobs.

    Args:
        command: command that makes the study; each job adds its share.
        shares: number of jobs, of one core each.
        hours: time limit of a job, which is queued again.
        logs: folder of the jobs' output.
        cluster: submitit's name of what runs the jobs; "debug" and "local" run them on this machine.
        **parameters: others of submitit, such as `slurm_partition`.
    """
    executor = submitit.AutoExecutor(logs, cluster=cluster)
    executor.update_parameters(timeout_min=round(60 * hours), cpus_per_task=1, name="arc-suite", **parameters)
    with executor.batch():
        jobs = [executor.submit(Share((*command, f"--shard={i}/{shares}", "--jobs=1"))) for i in range(shares)]
    return jobs
