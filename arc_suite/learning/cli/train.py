"""Train a policy, into a folder that every program takes as `--policy`.

Killed at any moment, the same command resumes, bit-exactly. The folder holds tables of returns and losses, a
checkpoint, the policy, and a picture of its returns, drawn anew after each evaluation. README.md is a model card.

  arc-suite train --robot tick
  arc-suite train --robot queen --task steer --algorithm dagger
  arc-suite train --robot tick --algorithm sac_parallel --minutes 5
  arc-suite train --robot tick --seed 0,1,2 --jobs 3 --until_score .9
  arc-suite train --robot queen --steps 1000000 --best
  arc-suite train --robot queen --seeds 0-15 --hp simulation=warp
  arc-suite train --robot queen --task steer --algorithm finetune --hp start=runs/queen-steer-dagger-0
  arc-suite train --robot queen --algorithm sope --prior arc_suite/queen/walk/cpg-medium-v0 -o runs/queen-sope
  arc-suite train --robot tick --task steer --train_set kicks=1.5
  arc-suite train --spec spider --algorithm speq --hp phase_updates=7500
  arc-suite train --config runs/queen-sope/config.json -o runs/queen-sope-again
  arc-suite train --robot varied:0-127 --algorithm dagger_bodies

A run ends with 100 episodes that judge its policy; Ctrl-C skips them, and the same command plays them later. Then come
the commands that score, film and play the policy. Of several seeds, it is the best one.
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

from arc_suite import checks, evaluation, files, registry
from arc_suite.cli import outputs
from arc_suite.cli.flags import (
    custom_body,
    define_body,
    define_modules,
    define_task,
    hint_import,
    import_modules,
    named_values,
    only_body,
    refuse_flags,
    task_from_flags,
)
from arc_suite.cli.interrupts import TERMINATED
from arc_suite.cli.program import progress, resumable, say, watch_for_termination
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors
from arc_suite.learning import best, cards, finals, onnx_file, outcomes, processes, trackers
from arc_suite.learning.agents import algorithms, configuration, run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.hyperparameters import DEVICE_DEFAULTS
from arc_suite.learning.agents.learner import MAX_RUN_SEED
from arc_suite.learning.agents.training import group_by_program, train, train_in_one_program
from arc_suite.learning.next_commands import has_built_pages, next_commands
from arc_suite.policies import network
from arc_suite.simulation.cores import prepare_jax, usable_cores


def group_algorithms(value: Callable[[algorithms.Algorithm], Any]) -> dict[Any, list[str]]:
    """Return the names of algorithms by a value of theirs."""
    names_by_value = {}
    for name, algorithm in algorithms.ALGORITHMS.items():
        names_by_value.setdefault(value(algorithm), []).append(name)
    return names_by_value


def describe_defaults(field: str) -> str:
    """Return a default of the algorithms as text: the most common value, then others with their algorithms."""
    names_by_default = group_algorithms(operator.attrgetter(field))
    most_common, *exceptions = sorted(names_by_default, key=lambda default: -len(names_by_default[default]))
    texts = [f"{default} for {', '.join(names_by_default[default])}" for default in exceptions]
    return "; ".join([str(most_common), *texts])


def describe_hyperparameters() -> str:
    """Return the names of the hyperparameters of all algorithms as text."""
    names_by_fields = group_algorithms(lambda algorithm: tuple(dataclasses.asdict(algorithm.hyperparameters)))
    texts = [f"of {', '.join(names)}: {', '.join(fields)}" for fields, names in names_by_fields.items()]
    return "; ".join(texts)


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
flags.DEFINE_multi_string("hp", [], f"Hyperparameter, name=value, {describe_hyperparameters()}.")
flags.DEFINE_list(
    "seed",
    ["0"],
    "Seed of the run. Several, such as 0,1 or 0-15, are as many runs: each a process, or on a GPU all in one program.",
)
flags.DEFINE_alias("seeds", "seed")
flags.DEFINE_integer(
    "steps",
    None,
    f"Environment steps; of bc, updates. ppo takes {algorithms.ALGORITHMS['ppo'].terrain_steps} on uneven ground. "
    f"[default: {describe_defaults('steps')}]",
    lower_bound=1,
)
flags.DEFINE_string("prior", None, "Id of a dataset of prior data, for algorithms that take any.")
flags.DEFINE_integer(
    "evaluate_every",
    None,
    f"Steps between evaluations. [default: {describe_defaults('evaluate_every')}]",
    lower_bound=1,
)
flags.DEFINE_string(
    "config",
    None,
    "Train as config.json of another run's folder says. It stands for the flags of body, policy and task, and for "
    "--seed, --steps and --evaluate_every.",
)
define_modules("--config")
flags.DEFINE_float(
    "minutes",
    None,
    "Stop after so many minutes of CPU time, over all processes that the run has had; more minutes resume it.",
    lower_bound=0.0,
)
flags.DEFINE_float("until_score", None, "Stop after an evaluation with this score; see docs/benchmark.md.")
flags.DEFINE_bool("best", False, "Keep the best checkpoint, too: in RUN/best, chosen in 100 episodes of validation.")
flags.DEFINE_integer("jobs", None, "Runs of several seeds at a time. [default: as many as cores]", lower_bound=1)
flags.DEFINE_integer("threads", 1, "Threads of the simulation; results do not depend on it.", lower_bound=1)
flags.DEFINE_bool("tensorboard", False, "Write metrics for TensorBoard too, into the folder of the run.")
flags.DEFINE_bool("wandb", False, "Hand metrics to Weights & Biases, too; without an account by WANDB_MODE=offline.")
flags.DEFINE_string(
    "output",
    None,
    "Folder of the run, or of the runs of several seeds. [default: runs/ROBOT-TASK-ALGORITHM-SEED, or runs]",
    short_name="o",
)

_LINES_OF_RESULT = 2  # that a run prints when it is complete: its latest evaluation, and the episodes that judge it

# Flags that make up the configuration, with --evaluate_every.
_CONFIGURATION_FLAGS = (
    "robot",
    "spec",
    "legs",
    "links",
    "length",
    "palette",
    "task",
    "set",
    "arena",
    "train_set",
    "algorithm",
    "hp",
    "seed",
    "steps",
    "prior",
)


def main() -> int:
    """Train, print the return at the end, and return the exit status."""
    outputs.check_folders("output")
    prepare_jax()
    runs = configurations_from_flags()
    if len(runs) == 1 and not is_one_of_several():
        refuse_flags(["jobs"], "goes with several seeds, such as --seed=0,1,2")
    # Before the first step, as a score may be unreachable.
    threshold = None if FLAGS.until_score is None else outcomes.return_of_score(runs[0], FLAGS.until_score)
    if len(runs) == 1:
        return train_run(runs[0], threshold)
    return train_seeds_on_device(runs) if runs[0].learns_on_device else train_seeds(runs)


def is_one_of_several() -> bool:
    """Return whether `train_seeds` has started this process: it adds a seed to the flags, which may have --jobs."""
    return FLAGS["seed"].present > 1


def train_run(run: Configuration, threshold: float | None) -> int:
    """Train a run, print its result, and return the exit status.

    Args:
        run: configuration of the run.
        threshold: mean return of an evaluation after which the run stops; None to train to the end.
    """
    folder = Path(FLAGS.output or Path(files.RUNS_FOLDER, run.name))
    run = configuration.with_network_of_folder(run, folder)

    def success_step() -> int | None:
        return None if threshold is None else outcomes.first_step_above(folder, threshold)

    with contextlib.ExitStack() as stack:
        listen = stack.enter_context(open_listeners(run, folder))

        def on_metrics(step, metrics):
            if "return" in metrics:
                say(f"{folder}: return {metrics['return']:.1f} after {step} steps")
            listen(step, metrics)

        def start_progress(*args, initial, **kwargs):
            say(f"{folder}: {run.setup}, {run.algorithm}, {run.steps} steps{describe_next_evaluation(run, initial)}")
            return progress(*args, initial=initial, **kwargs)

        with resumable(folder), watch_for_termination() as is_terminated:

            def stop():
                return is_terminated() or success_step() is not None

            finished = train(
                run,
                folder,
                minutes=FLAGS.minutes,
                threads=FLAGS.threads,
                progress=start_progress,
                on_metrics=on_metrics,
                stop=stop,
            )
            step = success_step()
            terminated = is_terminated()
    is_complete = finished or step is not None
    has_policy = bool(run_folder.lines(folder, "evaluations"))
    if has_policy:
        save_onnx(run, folder)
    say(f"{folder}: {describe_end(folder, step, finished, terminated)}, {outcomes.latest_result(run, folder)}")
    if terminated:
        return TERMINATED
    with resumable(folder):
        if is_complete:
            play_final_episodes(run, folder, FLAGS.threads)
        if has_policy:
            cards.write(run, folder)
    if has_policy and FLAGS["seed"].present <= 1:  # the log of one of several seeds ends with its result
        print_next_commands(run, folder)
    return 0


def print_next_commands(run: Configuration, folder: Path) -> None:
    """Print the commands that a person wants after a training."""
    print("next:", *next_commands(run.policy_setup, folder, has_built_pages()), sep="\n  ")


def print_next_commands_of_best(runs: Sequence[Configuration], folder: Path) -> None:
    """Print the commands for the seed with the best latest evaluation; nothing without one.

    Args:
        runs: runs of several seeds.
        folder: folder that holds the folders of the runs.
    """
    best_run = outcomes.best_run(runs, folder)
    if best_run is not None:
        print_next_commands(best_run, folder / best_run.name)


def describe_next_evaluation(run: Configuration, evaluated_step: int) -> str:
    """Return after which step a run is evaluated next; "" for one whose last evaluation is over."""
    if evaluated_step >= run.steps:
        return ""
    next_step = run.context(Path()).next_evaluation(evaluated_step)
    return f"; the next evaluation comes after {next_step} (--evaluate_every)"


def play_final_episodes(run: Configuration, folder: Path, threads: int | None) -> None:
    """Play the episodes that judge the final policy of a run, and print their result; keep the best one if asked to."""
    step = run_folder.read_progress(folder)["evaluated"]
    # The log of one of several seeds ends with its result, without the lines of a bar.
    bar = finals.NO_BAR if is_one_of_several() else progress
    print(f"{folder}: {finals.describe(run, finals.play_once(run, folder, step, threads, bar))}")
    if FLAGS.best:
        print(f"{folder}: {best.describe(*best.keep_best(run, folder, threads))}")


def describe_end(folder: Path, step: int | None, finished: bool, terminated: bool) -> str:
    """Return why a run has ended: at a score, after its last step, by SIGTERM, or after minutes."""
    judging = "; the same command judges it" if terminated else ""
    if step is not None:
        return f"score {FLAGS.until_score:g} reached {outcomes.when(folder, step)}{judging}"
    if finished:
        return f"finished{judging}"
    if terminated:
        return "stopped; the same command resumes it"
    return f"stopped at --minutes={FLAGS.minutes:g} of CPU time; more minutes resume it"


def train_seeds(runs: Sequence[Configuration]) -> int:
    """Train runs of several seeds, print their results and their mean, and return the exit status.

    Each run is a process of this command with one seed.
    """
    folder = files.folder(FLAGS.output or files.RUNS_FOLDER)
    arguments = sys.argv[sys.argv.index("train") + 1 :]

    def command(run):
        return ["train", *arguments, f"--seed={run.seed}", f"--output={folder / run.name}"]  # the last of a flag holds

    def result(name):
        return processes.last_line(processes.log(folder, name), _LINES_OF_RESULT + FLAGS.best)

    commands = {run.name: functools.partial(command, run) for run in runs}
    with contextlib.ExitStack() as stack, resumable(folder):
        bars = {}
        for position, run in enumerate(runs):
            bar = progress(total=run.steps, desc=run.name, position=position, unit="step", unit_scale=True)
            bars[run.name] = stack.enter_context(bar)
        watch = functools.partial(update_bars, folder, bars)
        failed_names = processes.run(commands, folder, FLAGS.jobs or usable_cores(), result, watch)
    successful_runs = [run for run in runs if run.name not in failed_names]
    print(f"{folder}: {outcomes.mean(successful_runs, folder)}")
    print_next_commands_of_best(successful_runs, folder)
    return int(bool(failed_names))


def train_seeds_on_device(runs: Sequence[Configuration]) -> int:
    """Train runs of several seeds, print their results and their mean, and return the exit status.

    Seeds whose folders hold checkpoints of equal steps learn in one program, one program after the other.
    """
    refuse_flags(("jobs", "minutes", "until_score"), "goes without several seeds in one program")
    folder = files.folder(FLAGS.output or files.RUNS_FOLDER)
    folders = [folder / run.name for run in runs]
    with resumable(folder), watch_for_termination() as is_terminated, contextlib.ExitStack() as stack:
        listeners = [stack.enter_context(open_listeners(*pair)) for pair in zip(runs, folders, strict=True)]
        finished_runs = set()
        for group in group_by_program(runs, folders):
            if train_in_one_program(
                [runs[index] for index in group],
                [folders[index] for index in group],
                progress,
                [listeners[index] for index in group],
                stop=is_terminated,
            ):
                finished_runs.update(runs[index].name for index in group)
            if is_terminated():
                break
        terminated = is_terminated()
    for run, run_folder_path in zip(runs, folders, strict=True):
        finished = run.name in finished_runs
        end = describe_end(run_folder_path, None, finished, terminated)
        print(f"{run_folder_path}: {end}, {outcomes.latest_result(run, run_folder_path)}")
        if run_folder.lines(run_folder_path, "evaluations"):
            save_onnx(run, run_folder_path)
        if finished and not terminated:
            play_final_episodes(run, run_folder_path, threads=None)
            cards.write(run, run_folder_path)
    print(f"{folder}: {outcomes.mean(runs, folder)}")
    if terminated:
        return TERMINATED
    print_next_commands_of_best(runs, folder)
    return 0


def save_onnx(run: Configuration, folder: Path) -> None:
    """Write the policy of a run of one body in ONNX's format, if ONNX is installed."""
    if importlib.util.find_spec("onnx") and not run.setup.several:
        onnx_file.save(folder / "policy.onnx", network.load(folder), run.training_setup)


def update_bars(folder: Path, bars: Mapping[str, Any]) -> None:
    """Update progress bars, by name of a run, from the folders of the runs."""
    for name, bar in bars.items():
        with contextlib.suppress(ValueError, OSError):  # the process of the run reports a damaged file
            lines = run_folder.lines(folder / name, "times", ("step",))
            if lines:
                bar.update(int(lines[-1]["step"]) - bar.n)
            state = run_folder.read_progress(folder / name)
            if "return" in state:
                bar.set_postfix_str(f"return {state['return']:.4g}", refresh=False)


def configurations_from_flags() -> list[Configuration]:
    """Return the configurations that the flags give, one for each seed.

    Raises:
        ValueError: a flag that does not fit.
        OSError: a file that cannot be read.
    """
    import_modules()
    if FLAGS.config is not None:
        refuse_flags(
            (*_CONFIGURATION_FLAGS, "evaluate_every"), "expected none with --config, which has the whole configuration"
        )
        with hint_import("--modules"):
            return [configuration.read(Path(FLAGS.config))]
    hyperparameters = named_values("hp", FLAGS.hp)
    training = named_values("train_set", FLAGS.train_set)
    several_bodies = registry.names_several_bodies(FLAGS.robot) and custom_body() is None
    if several_bodies:
        refuse_flags(("length", "palette"), "goes with one body, not with several")
    task, settings = task_from_flags()
    _refuse_hyperparameters(settings)
    setup = Setup.of(FLAGS.robot if several_bodies else only_body(), task, settings)
    seeds = parse_seeds(FLAGS.seed)
    if len(seeds) > 1:
        hyperparameters = with_worlds_of_seeds(hyperparameters)
    return [
        Configuration.of(
            setup,
            FLAGS.algorithm,
            hyperparameters,
            seed,
            steps=FLAGS.steps,
            evaluate_every=FLAGS.evaluate_every,
            prior=FLAGS.prior,
            training=training,
        )
        for seed in seeds
    ]


def _refuse_hyperparameters(settings: Mapping[str, Any]) -> None:
    """Raise ValueError for a setting of the task that is a hyperparameter, by its name or that of another library."""
    names = dataclasses.asdict(algorithms.algorithm(FLAGS.algorithm).hyperparameters)
    setting_names = registry.setting_names()
    for name, value in settings.items():
        meanings = [meaning for meaning in checks.meanings(name) if meaning in names]
        if meanings and name not in setting_names:
            cure = f"; did you mean --hp {meanings[0]}={checks.quote(value)}?"
            raise ValueError(f"--set {name}={checks.quote(value)}: it is a hyperparameter{cure}")


def with_worlds_of_seeds(hyperparameters: Mapping[str, Any]) -> dict[str, Any]:
    """Return hyperparameters with the worlds that each of several seeds has by default where a GPU simulates."""
    simulation = hyperparameters.get("simulation")
    if simulation not in DEVICE_DEFAULTS:
        return dict(hyperparameters)
    return {"num_envs": DEVICE_DEFAULTS[simulation].num_envs_of_seeds, **hyperparameters}


def parse_seeds(texts: Sequence[str]) -> list[int]:
    """Return the seeds of --seed.

    Raises:
        ValueError: a text that is neither an integer nor a range of them, too many seeds, or a seed twice.
    """
    refusal = ValueError(f"--seed={checks.quote(','.join(texts))}: expected different integers, such as 0,1,2 or 0-15")
    seeds = []
    for text in texts:
        first_text, _, last_text = text.partition("-")
        first = checks.digits(first_text)
        last = checks.digits(last_text or first_text)
        if first is None or last is None or not 0 <= last - first <= MAX_RUN_SEED:
            raise refusal
        seeds += range(first, last + 1)
    if not seeds or len(set(seeds)) < len(seeds):
        raise refusal
    return seeds


@contextlib.contextmanager
def open_listeners(run: Configuration, folder: Path) -> Iterator[trackers.Listener]:
    """Yield a function that hands the metrics of a run to its picture of returns, and to the trackers of the flags.

    Raises:
        ValueError: a package is not installed.
    """
    with contextlib.ExitStack() as stack:
        listeners = [functools.partial(plot_returns, run, folder)]
        if FLAGS.tensorboard:
            listeners.append(stack.enter_context(trackers.open_tensorboard(folder)))
        if FLAGS.wandb:
            listeners.append(stack.enter_context(trackers.open_wandb(run, folder)))

        def listen(step, metrics):
            for listener in listeners:
                listener(step, metrics)

        yield listen


def plot_returns(run: Configuration, folder: Path, step: int, metrics: Mapping[str, float]) -> None:
    """Write the picture of a run's returns, if metrics are those of an evaluation."""
    from arc_suite.learning.agents import plots  # needs matplotlib

    if "return" in metrics:
        scale = anchors.anchors(run.validation)
        levels = {"standing still": scale.zero}
        if scale.demonstrator is not None:
            levels[f"demonstrator {scale.preset}"] = scale.demonstrator
        paper_returns = evaluation.published_returns(run.setup, [run.algorithm], run.steps)
        evaluations = run_folder.table(folder, "evaluations")
        figure = plots.plot_run(evaluations, run.algorithm, folder.name, levels, paper_returns)
        with files.writing(folder / "curve.png") as temporary:
            figure.savefig(temporary)
