"""Train a policy, from nothing to a folder that every program takes.

Killed at any moment, the same command goes on, to the same bits. The folder holds tables of returns
and losses, a checkpoint, the policy, and a picture of its returns, which grows while it learns;
`--policy FOLDER` has it walk in every program.

  arc-suite train --robot tick --algorithm sac --steps 200000
  arc-suite train --robot tick --algorithm ppo --minutes 10
  arc-suite train --robot queen --task steer --algorithm imitation
  arc-suite train --robot queen --task steer --algorithm finetune --row start=runs/queen-steer-imitation-0
  arc-suite train --robot queen --algorithm sope --prior arc_suite/queen/walk/cpg-medium-v0 -o runs/queen-sope
  arc-suite train --spec examples/spider.json --algorithm speq --row phase_updates=7500
  arc-suite evaluate --robot tick --policy runs/tick-walk-sac-0
"""

import contextlib
import importlib.util
from collections.abc import Callable, Iterator
from pathlib import Path

from absl import flags

from arc_suite import evaluation, files
from arc_suite.agents import algorithms, run_folder
from arc_suite.agents.training import Run, train
from arc_suite.cli.flags import ROBOT_HELP, define_body, define_task, named_values, only_body, task
from arc_suite.cli.program import progress, use_one_thread
from arc_suite.envs.setup import Setup
from arc_suite.policies import network, onnx_file

FLAGS = flags.FLAGS
define_body()
define_task()
_ROBOT = flags.DEFINE_string("robot", "queen", f"{ROBOT_HELP}.")
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
flags.DEFINE_bool("tensorboard", False, "Write figures for TensorBoard too, into the folder of the run.")
flags.DEFINE_string("output", None, "Folder of the run. [default: runs/ROBOT-TASK-ALGORITHM-SEED]", short_name="o")


def main() -> None:
    """Train, and print what the policy earns at the end."""
    use_one_thread()
    definition = algorithms.algorithm(FLAGS.algorithm).with_row(named_values("row", FLAGS.row))
    body = only_body(_ROBOT)
    steps = FLAGS.steps or definition.steps
    run = Run(body, FLAGS.algorithm, definition, *task(), FLAGS.seed, steps, FLAGS.prior, FLAGS.evaluate_every)
    folder = Path(FLAGS.output or run.folder())
    with contextlib.ExitStack() as stack:
        listeners = [picture(run, folder), *([stack.enter_context(events(folder))] if FLAGS.tensorboard else [])]

        def told(step, figures):
            for listener in listeners:
                listener(step, figures)

        try:
            finished = train(run, folder, minutes=FLAGS.minutes, threads=FLAGS.threads, progress=progress, told=told)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(f"interrupted; the same command goes on with {folder}") from None
    if finished and importlib.util.find_spec("onnx"):
        onnx_file.save(folder / "policy.onnx", network.load(folder))
    print(f"{folder}: {earned(folder) if finished else 'stopped; the same command goes on'}")


def earned(folder: Path) -> str:
    """Return what the policy of a finished run earns, in words."""
    returns = run_folder.latest_returns(run_folder.table(folder, "evaluations"))
    return f"finished, return {returns.mean():.1f} +- {returns.std():.1f}"


def picture(run: Run, folder: Path) -> Callable:
    """Return what draws the returns anew after each evaluation; nothing without matplotlib."""
    if not importlib.util.find_spec("matplotlib"):
        return lambda step, figures: None
    from arc_suite.agents import plots

    expert = evaluation.expert_return(Setup.of(run.body, run.task, run.task_kwargs))
    lines = {} if expert is None else {"the paper's demonstrator": expert}

    def draw(step, figures):
        if "return" in figures:
            figure = plots.returns(run_folder.table(folder, "evaluations"), folder.name, lines)
            with files.writing(folder / "curve.png") as temporary:
                figure.savefig(temporary)

    return draw


@contextlib.contextmanager
def events(folder: Path) -> Iterator[Callable]:
    """Yield what writes figures for TensorBoard.

    Raises:
        ValueError: tensorboardX is not installed; one line.
    """
    try:
        from tensorboardX import SummaryWriter
    except ImportError as error:
        raise ValueError(f"--tensorboard needs tensorboardX: pip install 'arc_suite[tensorboard]' ({error})") from None
    writers = []

    def write(step, figures):
        if not writers:  # what was written after the checkpoint from which the run goes on is purged
            writers.append(SummaryWriter(str(folder / "tensorboard"), purge_step=step))
        for name, value in figures.items():
            writers[0].add_scalar(name, value, step)

    try:
        yield write
    finally:
        for writer in writers:
            writer.close()
