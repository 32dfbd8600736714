"""Train a policy, into a folder that every program takes as `--policy`.

Killed at any moment, the same command resumes, bit-exactly. The folder holds tables of returns and losses, a
checkpoint, the policy, and a picture of its returns, drawn anew after each evaluation.

  arc-suite train --robot tick
  arc-suite train --robot queen --task steer --algorithm dagger
  arc-suite train --robot tick --algorithm sac_parallel --minutes 5
  arc-suite train --robot tick --seed 0,1,2 --jobs 3 --until_score .9
  arc-suite train --robot queen --task steer --algorithm finetune --hp start=runs/queen-steer-dagger-0
  arc-suite train --robot queen --algorithm sope --prior arc_suite/queen/walk/cpg-medium-v0 -o runs/queen-sope
  arc-suite train --robot tick --task steer --train_set kicks=1.5
  arc-suite train --spec spider --algorithm speq --hp phase_updates=7500
  arc-suite train --config runs/queen-sope/config.json -o runs/queen-sope-again
  arc-suite train --robot varied:0-127 --algorithm dagger_bodies
  arc-suite evaluate --policy runs/tick-walk-ppo-0
"""

import contextlib
import dataclasses
import functools
import importlib.util
import operator
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from absl import flags

from arc_suite import checks, evaluation, files, registry, versions
from arc_suite.cli.flags import custom_body, define_body, define_task, named_values, only_body, task_from_flags
from arc_suite.cli.program import TERMINATED, progress, resumable, say, watch_for_termination
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors
from arc_suite.learning import onnx_file, outcomes, processes
from arc_suite.learning.agents import algorithms, configuration, run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.training import train
from arc_suite.policies import network
from arc_suite.simulation.cores import usable_cores, use_one_thread


def algorithms_by(value: Callable[[algorithms.Algorithm], Any]) -> dict[Any, list[str]]:
    """Return the names of algorithms by what they have."""
    found = {}
    for name, algorithm in algorithms.ALGORITHMS.items():
        found.setdefault(value(algorithm), []).append(name)
    return found


def defaults(field: str) -> str:
    """Return a default number of the algorithms, as text: that of the most, then those of others."""
    (usual, _), *others = sorted(algorithms_by(operator.attrgetter(field)).items(), key=lambda item: -len(item[1]))
    return "; ".join([str(usual), *(f"{number} for {', '.join(names)}" for number, names in others)])


def hyperparameters() -> str:
    """Return the names of the hyperparameters of all algorithms, as text."""
    fields = algorithms_by(lambda algorithm: tuple(dataclasses.asdict(algorithm.hyperparameters)))
    return "; ".join(f"of {', '.join(names)}: {', '.join(every)}" for every, names in fields.items())


FLAGS = flags.FLAGS
define_body(more="; or several with commas, such as varied:0-127,queen, for a policy of any body")
define_task()
flags.DEFINE_string(
    "algorithm",
    "ppo",
    f"One of {', '.join(algorithms.ALGORITHMS)}, or module:name of one that another package has.",
)
flags.DEFINE_multi_string(
    "train_set", [], "Setting of the task in training alone, name=value, in place of that of --set."
)
flags.DEFINE_multi_string("hp", [], f"Hyperparameter, name=value, {hyperparameters()}.")
flags.DEFINE_list("seed", ["0"], "Seed of the run; several with commas are as many runs, each a process.")
flags.DEFINE_integer(
    "steps",
    None,
    f"Environment steps; of bc, updates. ppo takes {algorithms.ALGORITHMS['ppo'].terrain_steps} on uneven ground. "
    f"[default: {defaults('steps')}]",
    lower_bound=1,
)
flags.DEFINE_string("prior", None, "Id of a dataset of prior data, for algorithms that take any.")
flags.DEFINE_integer(
    "evaluate_every", None, f"Steps between evaluations. [default: {defaults('evaluate_every')}]", lower_bound=1
)
flags.DEFINE_string(
    "config",
    None,
    "Train as config.json of another run's folder says. It stands for the flags of body, policy and task, and for "
    "--seed, --steps and --evaluate_every.",
)
flags.DEFINE_list(
    "modules",
    [],
    "Modules, with commas between them, that register what --config names: files themselves import nothing.",
)
flags.DEFINE_float(
    "minutes",
    None,
    "Stop after so many minutes of CPU time, over all processes that the run has had; more minutes resume it.",
    lower_bound=0.0,
)
flags.DEFINE_float("until_score", None, "Stop after an evaluation with this score; see docs/benchmark.md.")
flags.DEFINE_integer("jobs", None, "Runs of several seeds at a time. [default: as many as cores]", lower_bound=1)
flags.DEFINE_integer("threads", 1, "Threads of the simulation; results do not depend on it.", lower_bound=1)
flags.DEFINE_bool("tensorboard", False, "Write metrics for TensorBoard too, into the folder of the run.")
flags.DEFINE_string(
    "output",
    None,
    "Folder of the run, or of the runs of several seeds. [default: runs/ROBOT-TASK-ALGORITHM-SEED, or runs]",
    short_name="o",
)

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
    runs = configured()
    level = None if FLAGS.until_score is None else outcomes.level(runs[0], FLAGS.until_score)
    return several(runs) if len(runs) > 1 else only(runs[0], level)


def only(run: Configuration, level: float | None) -> int:
    """Train a run, print its result, and return the exit status.

    Args:
        run: to train.
        level: mean return of an evaluation to stop after; None to train to the end.
    """
    folder = Path(FLAGS.output or Path("runs", run.name))

    def reached():
        return None if level is None else outcomes.reached(folder, level)

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
        with resumable(folder), watch_for_termination() as terminated:

            def stop():
                return terminated() or reached() is not None

            finished = train(run, folder, **limits, progress=begun, on_metrics=on_metrics, stop=stop)
            step, killed = reached(), terminated()
    done = finished or step is not None
    if done and importlib.util.find_spec("onnx") and not run.setup.several:
        onnx_file.save(folder / "policy.onnx", network.load(folder))
    print(f"{folder}: {end(folder, step, finished, killed)}, {outcomes.earned(run, folder)}")
    return TERMINATED if killed and not done else 0


def end(folder: Path, step: int | None, finished: bool, killed: bool) -> str:
    """Return why a run has ended: at a score, after its last step, by SIGTERM, or after minutes."""
    if step is not None:
        return f"score {FLAGS.until_score:g} reached {outcomes.when(folder, step)}"
    if finished:
        return "finished"
    if killed:
        return "stopped; the same command resumes it"
    return f"stopped at --minutes={FLAGS.minutes:g} of CPU time; more minutes resume it"


def several(runs: Sequence[Configuration]) -> int:
    """Train runs of several seeds, each by this command with one of them, and print their results and their mean."""
    folder = files.folder(FLAGS.output or "runs")
    given = sys.argv[sys.argv.index("train") + 1 :]

    def command(run):
        return ["train", *given, f"--seed={run.seed}", f"--output={folder / run.name}"]

    def result(name):
        return processes.last_line(processes.log(folder, name))

    commands = {run.name: functools.partial(command, run) for run in runs}
    with contextlib.ExitStack() as stack, resumable(folder):
        bars = {}
        for position, run in enumerate(runs):
            bar = progress(total=run.steps, desc=run.name, position=position, unit="step", unit_scale=True)
            bars[run.name] = stack.enter_context(bar)
        jobs, watch = FLAGS.jobs or usable_cores(), functools.partial(watched, folder, bars)
        failed = processes.run(commands, folder, jobs, result, watch)
    print(f"{folder}: {outcomes.mean([run for run in runs if run.name not in failed], folder)}")
    return int(bool(failed))


def watched(folder: Path, bars: Mapping[str, Any]) -> None:
    """Bring progress bars, by name of a run, to what the folders of the runs hold."""
    for name, bar in bars.items():
        with contextlib.suppress(ValueError, OSError):  # it is for its process to say what is damaged
            if lines := run_folder.lines(folder / name, "times", ("step",)):
                bar.update(int(lines[-1]["step"]) - bar.n)
            if "return" in (state := run_folder.read_progress(folder / name)):
                bar.set_postfix_str(f"return {state['return']:.4g}", refresh=False)


def configured() -> list[Configuration]:
    """Return the configurations that the flags give, one for each seed.

    Raises:
        ValueError: a flag that does not fit.
        OSError: a file that cannot be read.
    """
    for module in FLAGS.modules:
        registry.import_module(module, "--modules")
    if FLAGS.config is not None:
        for name in (*_OF_THE_RUN, "evaluate_every"):
            if FLAGS[name].present:
                raise ValueError(f"--{name}: expected none with --config, which has the whole configuration")
        try:
            return [configuration.read(Path(FLAGS.config))]
        except registry.NotImported as error:
            raise ValueError(f"{error}, by --modules") from None
    hyperparameters = named_values("hp", FLAGS.hp)
    run = FLAGS.steps, FLAGS.evaluate_every, FLAGS.prior, named_values("train_set", FLAGS.train_set)
    several = registry.names_several_bodies(FLAGS.robot) and custom_body() is None
    setup = Setup.of(FLAGS.robot if several else only_body(), *task_from_flags())
    return [Configuration.of(setup, FLAGS.algorithm, hyperparameters, seed, *run) for seed in seeds(FLAGS.seed)]


def seeds(texts: Sequence[str]) -> list[int]:
    """Return the seeds of --seed.

    Raises:
        ValueError: something else, or one twice.
    """
    found = [int(text) for text in texts if text.isdecimal()]
    if not texts or len(set(found)) < len(texts):
        raise ValueError(f"--seed={checks.quote(','.join(texts))}: expected different integers, such as 0,1,2")
    return found


def draw(run: Configuration, folder: Path, step: int, metrics: Mapping[str, float]) -> None:
    """Draw the returns anew after an evaluation."""
    from arc_suite.learning.agents import plots  # needs matplotlib

    if "return" in metrics:
        scale = anchors.anchors(run.validation)
        lines = {"standing still": scale.zero}
        if scale.demonstrator is not None:
            lines[f"demonstrator {scale.preset}"] = scale.demonstrator
        finals = evaluation.published_returns(run.setup, [run.algorithm], run.steps)
        figure = plots.plot_run(run_folder.table(folder, "evaluations"), run.algorithm, folder.name, lines, finals)
        with files.writing(folder / "curve.png") as temporary:
            figure.savefig(temporary)


@contextlib.contextmanager
def events(folder: Path) -> Iterator[Callable]:
    """Yield a listener that writes metrics for TensorBoard.

    Raises:
        ValueError: tensorboardX is not installed.
    """
    with versions.require_extra("--tensorboard needs tensorboardX", "learn"):
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
