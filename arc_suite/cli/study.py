"""Make the runs of a study, or write its report.

A study is a table of runs: robots, tasks, algorithms, seeds, steps. What is finished is skipped, what was broken
off goes on; each run is a process of one thread. The tables of finished runs are copied into a folder that is small
enough to be committed, and the report is made of that folder alone.

  arc-suite study first-steps
  arc-suite study first-steps --report
  arc-suite study paper --jobs 8 --shard 3/16
  arc-suite study paper --submit 16 --hours 24
  arc-suite study my_studies:MINE
"""

import shutil
import sys
from collections.abc import Callable
from pathlib import Path

from absl import flags

from arc_suite.cli.program import progress
from arc_suite.envs.vector import usable_cores
from arc_suite.studies import report, runner, tables, watch
from arc_suite.studies.watch import State

FLAGS = flags.FLAGS
flags.DEFINE_integer("jobs", None, "Runs at a time. [default: as many as cores]", lower_bound=1)
flags.DEFINE_string("shard", "0/1", "Share of the runs, i/n: every nth, from the ith on, which counts from 0.")
flags.DEFINE_integer("submit", None, "Submit so many jobs to a SLURM cluster, each with a share of the runs.", 1)
flags.DEFINE_float("hours", 24.0, "Of a job; it comes back until its share is done.", lower_bound=0.1)
flags.DEFINE_string("partition", None, "Of the cluster. [default: the cluster's]")
flags.DEFINE_bool("report", False, "Write the report in place of making runs.")
flags.DEFINE_string("runs", None, "Folder of the runs. [default: runs/NAME]")
flags.DEFINE_string("results", None, "Folder of the tables and the report. [default: studies/NAME]")

# Of runs, those first whose lines change.
_WORDS = ("running", "elsewhere", "failed", "waiting", "finished")


def main(name: str | None = None) -> int:
    """Make the runs, or write the report; the exit status tells whether all runs are finished."""
    if name is None:
        raise ValueError(f"expected a study: {', '.join(tables.STUDIES)}, or module:attribute; see --help")
    study = tables.study(name)
    part, parts = shard(FLAGS.shard)
    rows = study.rows[part::parts]
    if not rows:
        raise ValueError(f"--shard={FLAGS.shard}: no run, as the study has {len(study.rows)}")
    folder = Path(FLAGS.runs or Path("runs", tables.folder_name(name)))
    results = Path(FLAGS.results or Path("studies", tables.folder_name(name)))
    if FLAGS.report:
        runner.publish_all(rows, folder, results)
        print(report.write(name, study, results))
        return 0
    if FLAGS.jobs is not None and FLAGS.submit is not None:
        raise ValueError("--jobs, --submit: this machine, or a cluster; give one of them")
    if FLAGS.submit is not None:
        if parts > 1:
            raise ValueError(f"--shard={FLAGS.shard}: --submit makes shares of its own; leave one of them out")
        return submit(name, min(FLAGS.submit, len(rows)), folder, results)
    jobs = FLAGS.jobs or usable_cores()
    show = shown(jobs)
    states = runner.run(rows, folder, results, jobs, show, progress)
    show(states, whole=True)
    failed = [each.row.name for each in states if each.word == "failed"]
    for each in failed:
        print(f"{folder / each}.log: {last_line(folder / f'{each}.log')}", file=sys.stderr)
    return 1 if failed else 0


def submit(name: str, jobs: int, folder: Path, results: Path) -> int:
    """Submit the study to a cluster in so many jobs, and print them.

    Raises:
        ValueError: submitit is not installed; one line.
    """
    try:
        from arc_suite.studies import cluster
    except ImportError as error:
        raise ValueError(f"--submit needs submitit: pip install 'arc_suite[cluster]' ({error})") from None
    arguments = ("study", name, f"--runs={folder.absolute()}", f"--results={results.absolute()}")
    parameters = {"slurm_partition": FLAGS.partition} if FLAGS.partition else {}
    for job in cluster.submit(arguments, jobs, FLAGS.hours, folder / "jobs", **parameters):
        print(f"submitted {job.job_id}")
    return 0


def shard(text: str) -> tuple[int, int]:
    """Return i and n of the text i/n.

    Raises:
        ValueError: it is no such text, or i is not below n; one line.
    """
    part, _, parts = text.partition("/")
    if not (part.isdecimal() and parts.isdecimal() and int(part) < int(parts)):
        raise ValueError(f"--shard={text}: expected i/n with i from 0 to n - 1, such as 0/4")
    return int(part), int(parts)


def table(states: list[State], jobs: int, most: int | None = None) -> str:
    """Return as text how the runs stand, and how long they still take.

    Args:
        states: of the runs.
        jobs: runs at a time.
        most: lines of runs, of those first that change; None for all.
    """
    width = max(len(each.row.name) for each in states)
    lines = [f"{'run':<{width}}  {'state':<9} {'steps':>19} {'return':>8} {'CPU min':>8}"]
    chosen = sorted(states, key=lambda each: _WORDS.index(each.word))[:most]
    for each in sorted(chosen, key=states.index):
        steps = f"{each.step:,} / {each.row.steps:,}"
        result = "-" if each.result is None else f"{each.result:.1f}"
        lines.append(f"{each.row.name:<{width}}  {each.word:<9} {steps:>19} {result:>8} {each.cpu / 60.0:>8.1f}")
    finished, failed = (sum(each.word == word for each in states) for word in ("finished", "failed"))
    seconds = watch.remaining(states, jobs)
    left = f", {failed} failed" if failed else ""
    if finished + failed < len(states):
        left += f", {'?' if seconds is None else duration(seconds)} to go"
    return "\n".join([*lines, f"{finished} of {len(states)} finished{left}"])


def duration(seconds: float) -> str:
    """Return a duration as hours and minutes."""
    hours, minutes = divmod(round(seconds / 60.0), 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes} min"


def shown(jobs: int) -> Callable[..., None]:
    """Return what shows states: on a terminal a table in its place, elsewhere a line for each change.

    With `whole`, at the end, it shows the table of all runs; before that, as many as the terminal has lines for.
    """
    words, height = {}, 0

    def on_terminal(states, whole=False):
        nonlocal height
        over = f"\x1b[{height}A\x1b[J" if height else ""
        text = table(states, jobs, None if whole else max(shutil.get_terminal_size().lines - 3, 1))
        print(over + text, flush=True)
        height = text.count("\n") + 1

    def as_lines(states, whole=False):
        for each in states:
            if words.get(each.row.name, "waiting") != each.word:
                print(f"{each.row.name}: {each.word}", flush=True)
            words[each.row.name] = each.word
        if whole:
            print(table(states, jobs))

    return on_terminal if sys.stdout.isatty() else as_lines


def last_line(log: Path) -> str:
    """Return the last line of a log."""
    return (log.read_text(errors="replace").splitlines() or ["says nothing"])[-1]
