"""Measures how fast control steps are, against plain MuJoCo and Gymnasium's ordinary environments.

Prints tables and writes all measurements and a plot. Takes minutes; on a busy machine the figures
are worth nothing.

Example:
  python tools/bench.py --plot docs/performance.png --document studies/performance.md
  python tools/bench.py --tasks --robots queen
  python tools/bench.py --collect 128 --robots queen --rounds 3
"""

import functools
import json
import os

from absl import flags
from benchmark import contestants, measurement, report, tasks

from arc_suite import checks, files
from arc_suite.cli import program
from arc_suite.robots import ROBOTS

FLAGS = flags.FLAGS
flags.DEFINE_list("robots", list(ROBOTS), "Whose walks.")
flags.DEFINE_list("num_envs", ["1", "16", "64", "256", "1024"], "Numbers of environments of the vector environment.")
flags.DEFINE_list("workers", None, "Numbers of processes of AsyncVectorEnv; 1, 2 and 4 for each thread by default.")
flags.DEFINE_integer("rounds", 9, "How often everything is measured in turn.", lower_bound=1)
flags.DEFINE_integer(
    "steps", 60, "Control steps of one turn; a third of it where there are many environments.", lower_bound=1
)
flags.DEFINE_string("json", "out/bench.json", "Where to write all measurements.")
flags.DEFINE_string("plot", "out/bench.png", "Where to write the plot.")
flags.DEFINE_string("document", None, "A Markdown file between whose <!-- benchmark --> marks to put the tables.")
flags.DEFINE_bool("tasks", False, "Measure a step of every task against one of walk instead.")
flags.DEFINE_integer("collect", None, "Measure the collecting of so many episodes instead.", lower_bound=1)


def numbers(flag: str) -> list[int]:
    """A flag's list of positive integers."""
    try:
        values = [int(value) for value in FLAGS[flag].value]
    except ValueError:
        values = []
    if not values or min(values) < 1:
        raise ValueError(
            f"--{flag}: expected positive integers with commas between, got {','.join(FLAGS[flag].value)!r}"
        )
    return values


def main():
    """Measures, prints and writes."""
    robots = [checks.name(robot, ROBOTS, "robot") for robot in FLAGS.robots]
    if FLAGS.collect is not None:
        try:
            from benchmark import collecting
        except ImportError as error:
            raise ValueError(str(error)) from None
        print(collecting.measure(robots, FLAGS.collect, FLAGS.rounds))
        return
    threads = contestants.all_threads()
    if FLAGS.tasks:
        for robot in robots:
            print(tasks.measure(robot, max(threads), FLAGS.rounds), end="\n\n")
        return
    workers = numbers("workers") if FLAGS.workers else [factor * max(threads) for factor in (1, 2, 4)]
    rows = numbers("num_envs")
    document = FLAGS.document and report.document(FLAGS.document)
    for path in (FLAGS.json, FLAGS.plot):
        os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    with files.writing(FLAGS.json) as json_path, files.writing(FLAGS.plot) as plot_path:
        progress = functools.partial(program.progress, unit="round")
        results = measurement.measure(robots, rows, threads, workers, FLAGS.rounds, FLAGS.steps, progress)
        json_path.write_text(json.dumps(results, indent=1), encoding="utf-8")
        report.plot(results, plot_path)
    tables = report.tables(results)
    print(tables)
    if document:
        report.into_document(document, tables)


if __name__ == "__main__":
    program.run(main)
