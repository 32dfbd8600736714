"""Make the runs of a study, or write its report.

A study is a table of runs: robots, tasks, algorithms, seeds, steps. Each run is a process of one thread; with
--device, runs of equal sizes are one program on a GPU. Finished runs are skipped, and the others resume.
Configurations, episodes, times and style of all runs become two tables, which are small enough to be committed, and the
report is made from these tables alone. A name is module:attribute, a Study on Python's path or in the current folder,
or <division>-<algorithm> of the benchmark.

  arc-suite study my_studies:MINE
  arc-suite study my_studies:MINE --report
  arc-suite study my_studies:MINE --jobs 8 --shard 3/16
  arc-suite study my_studies:MINE --submit 16 --hours 24
  arc-suite study top-ppo
  arc-suite study samples-sac --device --minutes 30
"""

import shutil
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from absl import flags

from arc_suite import checks, files, versions
from arc_suite.cli import outputs
from arc_suite.cli.flags import refuse_flags
from arc_suite.cli.program import progress, resumable
from arc_suite.learning.studies import publication, report, runner, tables
from arc_suite.simulation.cores import prepare_jax, usable_cores

FLAGS = flags.FLAGS
flags.DEFINE_integer("jobs", None, "Runs at a time. [default: as many as cores]", lower_bound=1)
flags.DEFINE_bool("device", False, "Learn on JAX's device, such as a GPU: runs of equal sizes in one program.")
flags.DEFINE_float("minutes", None, "With --device: stop after so many minutes; the same command goes on.", 0.0)
flags.DEFINE_string("shard", "0/1", "Share of the runs, i/n: every nth from the ith on; i counts from 0.")
flags.DEFINE_integer("submit", None, "Submit so many jobs to a SLURM cluster, each with a share of the runs.", 1)
flags.DEFINE_float(
    "hours", 24.0, "Time limit of a job; it is queued again until its share is finished.", lower_bound=0.1
)
flags.DEFINE_string("partition", None, "Of the cluster. [default: the cluster's]")
flags.DEFINE_bool("report", False, "Write the report in place of making runs.")
flags.DEFINE_string("runs", None, "Folder of the runs. [default: runs/NAME]")
flags.DEFINE_string("results", None, "Folder of the tables and the report. [default: studies/NAME]")


_FLAGS_OF_RUNS = (
    "jobs",
    "device",
    "minutes",
    "shard",
    "submit",
    "hours",
    "partition",
)  # flags without effect on a report


def main(name: str | None = None) -> int:
    """Make the runs, or write the report; the exit status is 0 if all runs are finished."""
    if name is None:
        raise ValueError("expected a study: module:attribute, or <division>-<algorithm>; see --help")
    command = (sys.executable, "-m", "arc_suite", "study", name)
    return make_or_report(name, tables.study(name), command, report.write)


def make_or_report(
    name: str,
    study: tables.Study,
    command: Sequence[str],
    write_report: Callable[[str, tables.Study, Path], Path],
) -> int:
    """Make the runs of a study or write its report, as the flags say, and return the exit status.

    Args:
        name: name of the study.
        study: study.
        command: command that does the same on a machine of a cluster.
        write_report: function of the name, the study and the folder of its tables that returns the report's path.

    Raises:
        ValueError: flags that do not fit each other or the study.
    """
    if FLAGS.report:
        refuse_flags(_FLAGS_OF_RUNS, "goes without --report, which makes no runs")
    if FLAGS.submit is None:
        refuse_flags(("hours", "partition"), "goes with --submit")
    if FLAGS.device:
        refuse_flags(("jobs", "submit"), "goes without --device, on which runs learn in this process")
    else:
        refuse_flags(["minutes"], "goes with --device")
    outputs.check_folders("runs", "results")
    part, parts = shard(FLAGS.shard)
    runs = study.runs[part::parts]
    if not runs:
        raise ValueError(f"--shard={FLAGS.shard}: no run, as the study has {len(study.runs)}")
    folder = Path(FLAGS.runs or Path(files.RUNS_FOLDER, tables.folder_name(name)))
    results = results_folder(name)
    if FLAGS.report:
        publication.publish(study.runs, folder, results, progress)
        print(write_report(name, study, results))
        return 0
    if FLAGS.jobs is not None and FLAGS.submit is not None:
        raise ValueError("--jobs, --submit: this machine, or a cluster; give one of them")
    if FLAGS.submit is not None:
        if parts > 1:
            raise ValueError(f"--shard={FLAGS.shard}: --submit makes shares of its own; leave one of them out")
        return submit(command, min(FLAGS.submit, len(runs)), folder, results)
    files.check_folder(results)
    with resumable(folder):
        if FLAGS.device:
            prepare_jax()
            status = runner.make_on_device(runs, folder, FLAGS.minutes, progress)
        else:
            status = runner.make(runs, folder, FLAGS.jobs or usable_cores(), progress)
    publication.publish(study.runs, folder, results, progress)
    return status


def results_folder(name: str) -> Path:
    """Return the folder of a study's tables, as the flags say."""
    return Path(FLAGS.results or Path("studies", tables.folder_name(name)))


def submit(command: Sequence[str], jobs: int, folder: Path, results: Path) -> int:
    """Submit a command that makes a study to a cluster, split into a number of jobs, and print them.

    Raises:
        ValueError: the machine has no SLURM, or submitit is not installed.
    """
    if shutil.which("sbatch") is None:
        raise ValueError("--submit: SLURM's sbatch is not here; --jobs runs processes on this machine")
    with versions.require_extra("--submit needs submitit", "learn"):
        from arc_suite.learning.studies import cluster
    command = (*command, f"--runs={folder.absolute()}", f"--results={results.absolute()}")
    parameters = {"slurm_partition": FLAGS.partition} if FLAGS.partition else {}
    for job in cluster.submit(command, jobs, FLAGS.hours, folder / "jobs", **parameters):
        print(f"submitted {job.job_id}")
    return 0


def shard(text: str) -> tuple[int, int]:
    """Return i and n of the text i/n.

    Raises:
        ValueError: it is no such text, or i is not below n.
    """
    part_text, _, parts_text = text.partition("/")
    part = checks.digits(part_text)
    parts = checks.digits(parts_text)
    if part is None or parts is None or part >= parts:
        raise ValueError(f"--shard={checks.quote(text)}: expected i/n with i from 0 to n - 1, such as 0/4")
    return part, parts
