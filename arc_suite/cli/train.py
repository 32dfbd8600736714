"""Train a policy: an algorithm, a body and a task, from nothing to a folder that every program takes.

Killed at any moment, the same command goes on, to the same bits. The folder holds tables of returns
and losses, a checkpoint and the policy; `--policy FOLDER` has it walk in every program.

  arc-suite train --robot tick --algorithm sac --steps 200000
  arc-suite train --robot tick --algorithm ppo --minutes 10
  arc-suite train --robot queen --algorithm imitation --row preset=tuned
  arc-suite train --robot queen --algorithm sope --prior arc_suite/queen/walk/cpg-medium-v0 -o runs/queen-sope
  arc-suite train --spec examples/spider.json --algorithm speq --row phase_updates=7500
  arc-suite evaluate --robot tick --policy runs/tick-walk-sac-0
"""

import os
from pathlib import Path

from absl import flags

from arc_suite.agents import algorithms
from arc_suite.agents.training import Run, train
from arc_suite.cli.flags import bodies, define_body, define_task, task
from arc_suite.cli.program import progress
from arc_suite.robots import ROBOTS

FLAGS = flags.FLAGS
define_body()
define_task()
_ROBOT = flags.DEFINE_string("robot", "queen", f"One of {', '.join(ROBOTS)}.")
flags.DEFINE_string(
    "algorithm",
    "sac",
    f"One of {', '.join(algorithms.ALGORITHMS)}, or module:attribute, an Algorithm on Python's path.",
)
flags.DEFINE_multi_string("row", [], "Number of the algorithm's row, name=value; repeat it for several.")
flags.DEFINE_integer("seed", 0, "Seed of the run.", lower_bound=0)
flags.DEFINE_integer("steps", None, "Environment steps. [default: the algorithm's]", lower_bound=1)
flags.DEFINE_string("prior", None, "Id of a dataset of prior data, for algorithms that take any.")
flags.DEFINE_integer("evaluate_every", None, "Steps between evaluations. [default: the algorithm's]", lower_bound=1)
flags.DEFINE_float("minutes", None, "Stop after so many minutes; the same command goes on.", lower_bound=0.0)
flags.DEFINE_integer("threads", 1, "Threads to simulate on; the run does not depend on it.", lower_bound=1)
flags.DEFINE_string("output", None, "Folder of the run. [default: runs/ROBOT-TASK-ALGORITHM-SEED]", short_name="o")

# One thread a run: two runs on two cores learn twice as much, two threads in a run hardly more than one.
_ONE_THREAD = {"NPROC": "1", "OMP_NUM_THREADS": "1", "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false"}


def main() -> None:
    """Train, and print what the policy earns."""
    for name, value in _ONE_THREAD.items():
        os.environ.setdefault(name, value)  # read when JAX is imported
    definition = algorithms.algorithm(FLAGS.algorithm).with_row(algorithms.changes(FLAGS.row))
    walkers = bodies(_ROBOT)
    if len(walkers) > 1:
        raise ValueError("--robot=all: a run has one robot")
    (body,) = walkers.values()
    steps = FLAGS.steps or definition.steps
    run = Run(body, FLAGS.algorithm, definition, *task(), FLAGS.seed, steps, FLAGS.prior, FLAGS.evaluate_every)
    folder = Path(FLAGS.output or run.folder())
    try:
        finished = train(run, folder, FLAGS.minutes, FLAGS.threads, progress)
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"interrupted; the same command goes on with {folder}") from None
    print(f"{folder}: {'finished' if finished else 'stopped; the same command goes on'}")
