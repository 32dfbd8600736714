"""Submits studies to a SLURM cluster with submitit, one job for each share of the runs."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import submitit


class Share(NamedTuple):
    """A job: makes a share of a study, and comes back in the queue after a timeout or preemption to go on with it.

    Attributes:
        arguments: of `arc-suite`.
    """

    arguments: tuple[str, ...]

    def __call__(self) -> None:
        """Make the runs.

        Raises:
            subprocess.CalledProcessError: a run has failed.
        """
        subprocess.run([sys.executable, "-m", "arc_suite", *self.arguments], check=True)

    def checkpoint(self) -> submitit.helpers.DelayedSubmission:
        """Return what is submitted in place of a job that was broken off: the same, as its folders hold the rest."""
        return submitit.helpers.DelayedSubmission(self)


def submit(
    arguments: Sequence[str], shares: int, hours: float, logs: Path, cluster: str | None = None, **parameters
) -> list[submitit.Job]:
    """Submit an array of jobs.

    Args:
        arguments: of `arc-suite` that make the study, to which each job adds its share.
        shares: number of jobs, of one core each.
        hours: after which a job is broken off and comes back.
        logs: folder for what jobs print.
        cluster: submitit's name of one; None for the one that is there.
        **parameters: others of submitit, such as `slurm_partition`.
    """
    executor = submitit.AutoExecutor(logs, cluster=cluster)
    executor.update_parameters(timeout_min=round(60 * hours), cpus_per_task=1, name="arc-suite", **parameters)
    with executor.batch():
        jobs = [executor.submit(Share((*arguments, f"--shard={i}/{shares}", "--jobs=1"))) for i in range(shares)]
    return jobs
