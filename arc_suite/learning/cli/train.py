"""Train a policy, into a folder that every program takes as `--policy`.

Killed at any moment, the same command resumes, bit-exactly. The folder holds tables of returns and losses, a
checkpoint, the policy, and a picture of its returns, drawn anew after each evaluation.

  arc-suite train --robot tick
  arc-suite train --robot queen --task steer --algorithm dagger
  arc-suite train --robot tick --algorithm sac_parallel --minutes 5
  arc-suite train --robot queen --task steer --algorithm finetune --hp start=runs/queen-steer-dagger-0
  arc-suite train --robot queen --algorithm sope --prior arc_suite/queen/walk/cpg-medium-v0 -o runs/queen-sope
  arc-suite train --robot tick --task steer --train_set kicks=1.5
  arc-suite train --spec spider --algorithm speq --hp phase_updates=7500
  arc-suite train --config runs/queen-sope/config.json -o runs/queen-sope-again
  arc-suite train --robot varied:0-127 --algorithm dagger_bodies
  arc-suite evaluate --policy runs/tick-walk-ppo-0
"""

import contextlib
import functools
import importlib.util
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from absl import flags

from arc_suite import evaluation, files, registry, versions
from arc_suite.cli.flags import define_body, define_task, made_body, named_values, only_body, task
from arc_suite.cli.program import TERMINATED, progress, resumable, say, termination, use_one_thread
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors
from arc_suite.learning import onnx_file
from arc_suite.learning.agents import algorithms, configuration, run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.training import train
from arc_suite.policies import network

FLAGS = flags.FLAGS
define_body(more="; or several with commas, such as varied:0-127,queen, for a policy of any body")
define_task()
flags.DEFINE_string(
    "algorithm",
    "ppo",
    f"One of {', '.join(algorithms.ALGORITHMS)}, or module:attribute, an Algorithm on Python's path.",
)
flags.DEFINE_multi_string(
    "train_set", [], "Setting of the task in training alone, name=value, in place of that of --set."
)
flags.DEFINE_multi_string("hp", [], "Hyperparameter of the algorithm, name=value; repeat it for several.")
flags.DEFINE_integer("seed", 0, "Seed of the run.", lower_bound=0)
flags.DEFINE_integer("steps", None, "Environment steps. [default: the algorithm's]", lower_bound=1)
flags.DEFINE_string("prior", None, "Id of a dataset of prior data, for algorithms that take any.")
flags.DEFINE_integer("evaluate_every", None, "Steps between evaluations. [default: the algorithm's]", lower_bound=1)
flags.DEFINE_string("config", None, "JSON file with the configuration of the run, in place of all flags above.")
flags.DEFINE_float("minutes", None, "Stop after so many minutes; the same command resumes.", lower_bound=0.0)
flags.DEFINE_integer("threads", 1, "Threads of the simulation; results do not depend on it.", lower_bound=1)
flags.DEFINE_bool("tensorboard", False, "Write metrics for TensorBoard too, into the folder of the run.")
flags.DEFINE_string("output", None, "Folder of the run. [default: runs/ROBOT-TASK-ALGORITHM-SEED]", short_name="o")

# Flags that make up the configuration.
_OF_THE_RUN = (
    "robot",
    "spec",
    "legs",
    "links",
    "task",
    "set",
    "train_set",
    "algorithm",
    "hp",
    "seed",
    "steps",
    "prior",
)


def main() -> int:
    """Train, print the return at the end, and return the exit status."""
    use_one_thread()
    run = configured()
    folder = Path(FLAGS.output or Path("runs", run.name))
    with contextlib.ExitStack() as stack:
        listeners = [functools.partial(draw, run, folder)]
        if FLAGS.tensorboard:
            listeners.append(stack.enter_context(events(folder)))

        def on_metrics(step, metrics):
            if "return" in metrics:
                say(f"{folder}: return {metrics['return']:.1f} after {step} steps")
            for listener in listeners:
                listener(step, metrics)

        def begun(*args, **kwargs):
            say(f"{folder}: {run.setup}, {run.algorithm}, {run.steps} steps")
            return progress(*args, **kwargs)

        limits = {"minutes": FLAGS.minutes, "threads": FLAGS.threads}
        with resumable(folder), termination() as terminated:
            finished = train(run, folder, **limits, progress=begun, on_metrics=on_metrics, stop=terminated)
    if finished and importlib.util.find_spec("onnx") and not run.setup.several:
        onnx_file.save(folder / "policy.onnx", network.load(folder))
    print(f"{folder}: {earned(run, folder) if finished else 'stopped; the same command resumes it'}")
    return TERMINATED if not finished and terminated() else 0


def configured() -> Configuration:
    """Return the configuration that the flags give.

    Raises:
        ValueError: a flag that does not fit.
        OSError: a file that cannot be read.
    """
    if FLAGS.config is not None:
        for name in (*_OF_THE_RUN, "evaluate_every"):
            if FLAGS[name].present:
                raise ValueError(f"--{name}: expected none with --config, which has the whole configuration")
        return configuration.read(Path(FLAGS.config))
    hyperparameters = named_values("hp", FLAGS.hp)
    run = FLAGS.seed, FLAGS.steps, FLAGS.evaluate_every, FLAGS.prior, named_values("train_set", FLAGS.train_set)
    several = registry.names_several(FLAGS.robot) and made_body() is None
    setup = Setup.of(FLAGS.robot if several else only_body(), *task())
    return Configuration.of(setup, FLAGS.algorithm, hyperparameters, *run)


def earned(run: Configuration, folder: Path) -> str:
    """Return the result of a finished run, for people."""
    returns = run_folder.latest_returns(run_folder.table(folder, "evaluations"))
    result, scale = returns.mean(), anchors.anchors(run.validation)
    levels = f"standing still {scale.zero:.1f}"
    if scale.demonstrator is not None:
        levels = f"score {scale.score(result):z.2f} ({levels}, demonstrator {scale.preset} {scale.demonstrator:.1f})"
    return f"finished, return {result:.1f} +- {returns.std():.1f}, {levels}"


def draw(run: Configuration, folder: Path, step: int, metrics: Mapping[str, float]) -> None:
    """Draw the returns anew after an evaluation."""
    from arc_suite.learning.agents import plots  # needs matplotlib

    if "return" in metrics:
        scale = anchors.anchors(run.validation)
        lines = {"standing still": scale.zero}
        if scale.demonstrator is not None:
            lines[f"demonstrator {scale.preset}"] = scale.demonstrator
        finals = evaluation.published_returns(run.setup, [run.algorithm], run.steps)
        figure = plots.returns(run_folder.table(folder, "evaluations"), run.algorithm, folder.name, lines, finals)
        with files.writing(folder / "curve.png") as temporary:
            figure.savefig(temporary)


@contextlib.contextmanager
def events(folder: Path) -> Iterator[Callable]:
    """Yield a listener that writes metrics for TensorBoard.

    Raises:
        ValueError: tensorboardX is not installed.
    """
    with versions.needing("--tensorboard needs tensorboardX", "learn"):
        from tensorboardX import SummaryWriter
    writers = []

    def write(step, metrics):
        if not writers:  # purges what was written after the checkpoint
            writers.append(SummaryWriter(str(folder / "tensorboard"), purge_step=step))
        for name, value in metrics.items():
            writers[0].add_scalar(name, value, step)

    try:
        yield write
    finally:
        for writer in writers:
            writer.close()
