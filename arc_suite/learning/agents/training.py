"""Training: from a configuration to a folder with a policy, resumed bit-exactly after a kill at any moment."""

import contextlib
import os
import shutil
import time
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from arc_suite import checks, evaluation, files, seed_ranges, usage
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import task_results
from arc_suite.learning.agents import algorithms, priors, run_folder, run_usage, slices
from arc_suite.learning.agents.configuration import PRIOR_SHA256, TRAINING_SEEDS, Configuration
from arc_suite.learning.agents.evaluating import Evaluator, Lines, ProcessEvaluator
from arc_suite.learning.agents.learner import UNLEARNED_PREFIXES, Damaged, Diverged, RunContext, Slice
from arc_suite.learning.agents.run_folder import RunFolder
from arc_suite.policies import checkpoints, network
from arc_suite.policies.checkpoints import Agent
from arc_suite.policies.network import Network
from arc_suite.simulation.cores import usable_cores

_SAVE_INTERVAL = 30.0  # s between two checkpoints of a learner that stays on a device
_FLAW_STEPS = 50  # control steps in which a task's results are looked at once a learner has diverged
_UNITS = {"reward": " a step"}  # of metrics behind a progress bar


def train(
    configuration: Configuration,
    folder: Path,
    minutes: float | None = None,
    threads: int = 1,
    progress: Callable[..., Any] = tqdm,
    on_metrics: Callable[[int, Mapping[str, float]], None] = lambda step, metrics: None,
    stop: Callable[[], bool] = lambda: False,
) -> bool:
    """Train, resume, or extend a run to more steps if its algorithm can.

    Args:
        configuration: configuration of the run.
        folder: folder of the run.
        minutes: CPU time of the run to stop after, all its processes together; None to train to the end.
        threads: threads of the simulation; results do not depend on it.
        progress: makes a progress bar as `tqdm` does.
        on_metrics: called after each line of training.csv, and after each evaluation, with the environment step and
            metrics by name; the metric of an evaluation is `return`.
        stop: returns whether to stop; called as soon as there is a checkpoint, and after each.

    Returns:
        Whether the run is finished.

    Raises:
        ValueError: a part of the run or minutes that do not fit, the folder of another run, or a damaged one.
        Diverged: a value of the learner is not finite; the checkpoint before stays.
        OSError: the disk is full, or the like; the checkpoint before stays.
    """
    if minutes is not None:
        checks.number("minutes", minutes, 0.0)
    with (
        _record(
            configuration, folder, threads, configuration.learns_on_device, [configuration.seed], on_metrics
        ) as recorder,
        contextlib.closing(slices.begin_learning(configuration, recorder.context)) as learned_slices,
        recorder.open_bar(progress),
        _report_flaw_of_task(recorder.context.training),
    ):
        while not recorder.finished:
            is_time_up = minutes is not None and recorder.cpu_seconds() > 60.0 * minutes
            if (recorder.has_checkpoint and stop()) or is_time_up:
                recorder.flush()
                return False
            with _report_damage([recorder.folder]):
                learned_slice = slices.next_slice(
                    configuration.algorithm, learned_slices, recorder.usage.steps, recorder.context.steps
                )
            recorder.begin(learned_slice)
            recorder.complete(learned_slice)
    return True


def train_in_one_program(
    configurations: Sequence[Configuration],
    folders: Sequence[Path],
    progress: Callable[..., Any] = tqdm,
    listeners: Sequence[Callable[[int, Mapping[str, float]], None]] = (),
    stop: Callable[[], bool] = lambda: False,
) -> bool:
    """Train or resume several runs side by side, in one program of JAX's device; see `algorithms.program_of`.

    Args:
        configurations: configurations of the runs.
        folders: folder of each run, which it has as if it were trained alone.
        progress: makes a progress bar as `tqdm` does.
        listeners: function of each run that is called as `on_metrics` of `train`; none for no calls.
        stop: returns whether to stop; called after each slice.

    Returns:
        Whether all runs are finished.

    Raises:
        ValueError: runs of several programs, see `group_by_program`, or as `train`.
        Diverged, OSError: as `train`.
    """
    if len(listeners) == 0:
        listeners = [_ignore_metrics] * len(folders)
    with contextlib.ExitStack() as stack:
        recorders = []
        run_seeds = [configuration.seed for configuration in configurations]
        for configuration, folder, on_metrics in zip(configurations, folders, listeners, strict=True):
            recording = _record(configuration, folder, usable_cores(), True, run_seeds, on_metrics)
            with usage.pause():  # a policy whose evaluation is pending is no source of the runs before it
                recorders.append(stack.enter_context(recording))
        contexts = [recorder.context for recorder in recorders]
        all_hyperparameters = [configuration.hyperparameters for configuration in configurations]
        _check_one_program(recorders, all_hyperparameters)
        all_slices = stack.enter_context(
            contextlib.closing(algorithms.learn_in_one_program(all_hyperparameters, contexts))
        )
        for recorder in recorders:
            stack.enter_context(recorder.open_bar(progress))
        stack.enter_context(_report_flaw_of_task(contexts[0].training))
        while not all(recorder.finished for recorder in recorders):
            with _report_damage(folders), usage.run_learner(configurations[0].algorithm):
                next_slices = next(all_slices)
            _record_slices(recorders, next_slices)
            if stop():
                for recorder in recorders:
                    recorder.flush()
                return all(recorder.finished for recorder in recorders)
    return True


def _record_slices(recorders: Sequence["_Recorder"], next_slices: Sequence[Slice | None]) -> None:
    """Record the slices of runs that are not finished; evaluations of all runs begin before the first completes."""
    new_slices = [
        (recorder, learned_slice)
        for recorder, learned_slice in zip(recorders, next_slices, strict=True)
        if learned_slice is not None and not recorder.finished
    ]
    for recorder, learned_slice in new_slices:
        recorder.begin(learned_slice)
    for recorder, learned_slice in new_slices:
        recorder.complete(learned_slice)


def group_by_program(configurations: Sequence[Configuration], folders: Sequence[Path]) -> list[list[int]]:
    """Return indices of runs in groups that `train_in_one_program` takes together, in the order of their first runs.

    Checkpoints of runs of one program have made equal numbers of steps: a run that was trained on alone is in a group
    of its own.

    Args:
        configurations: configurations of the runs.
        folders: folder of each run.

    Raises:
        ValueError: a run that learns alone, or a damaged checkpoint; begins with the folder.
    """
    groups: dict[Hashable, list[int]] = {}
    for index, (configuration, folder) in enumerate(zip(configurations, folders, strict=True)):
        context = configuration.context(folder, checkpoint=run_folder.read_arrays(folder))
        try:
            program = algorithms.program_of(configuration.hyperparameters, context)
        except ValueError as error:
            raise ValueError(f"{folder}: {error}") from None
        groups.setdefault(program, []).append(index)
    return list(groups.values())


def _check_one_program(recorders: Sequence["_Recorder"], all_hyperparameters: Sequence[Any]) -> None:
    """Raise ValueError if runs differ in what is compiled or in the steps so far."""
    programs = [
        algorithms.program_of(hyperparameters, recorder.context)
        for recorder, hyperparameters in zip(recorders, all_hyperparameters, strict=True)
    ]
    for recorder, program in zip(recorders, programs, strict=True):
        if program != programs[0]:
            expected = f"expected a run of one program with {recorders[0].folder}, after as many steps"
            raise ValueError(f"{recorder.folder}: {expected}; `group_by_program` says which learn together")


def _ignore_metrics(step: int, metrics: Mapping[str, float]) -> None:
    """Do nothing with metrics."""


class _Recorder:
    """Writes what a learner yields into the folder of its run: tables, policies and checkpoints.

    Attributes:
        folder: folder of the run.
        context: what the learner takes.
        usage: what the run has used so far; its steps are those of the run.
        has_checkpoint: whether the folder has a checkpoint, or will have one by `flush`.
    """

    def __init__(
        self,
        configuration: Configuration,
        run_files: RunFolder,
        context: RunContext,
        evaluator: Evaluator | ProcessEvaluator,
        training_seeds: seed_ranges.Ranges | None,
        interval: float,
        run_seeds: Sequence[int],
        on_metrics: Callable[[int, Mapping[str, float]], None],
    ):
        """Begin where the folder's checkpoint stands.

        Args:
            configuration: configuration of the run.
            run_files: the open folder.
            context: what the learner takes.
            evaluator: evaluates policies.
            training_seeds: seeds of the episodes that policies learn from.
            interval: seconds between two checkpoints; 0 to write each.
            run_seeds: seeds of the runs that this process trains, which share its CPU time and environments.
            on_metrics: see `train`.
        """
        self.folder = run_files.path
        self.context = context
        self.has_checkpoint = run_files.arrays is not None
        self._configuration = configuration
        self._run_files = run_files
        self._evaluator = evaluator
        self._training_seeds = training_seeds
        self._runs = len(run_seeds)
        self._bar = None
        self._on_metrics = on_metrics
        self._writer = _CheckpointWriter(run_files, interval)
        # How far the run has come, which its folder keeps with a checkpoint.
        self._progress = {"evaluated": 0, "pending": [], "wall": 0.0, "cpu": 0.0} | run_files.progress
        self.usage = run_usage.begin(configuration, run_files, run_seeds)
        self._step_watch = run_usage.StepWatch(configuration.algorithm)
        self._policy_step = self._progress["evaluated"]  # of the latest policy whose evaluation has begun
        self._is_policy_new = False  # whether the latest slice has a policy to evaluate
        # Where the clocks stood when the run began, if it had never stopped.
        self._wall_start = time.monotonic() - self._progress["wall"]
        self._cpu_start = _cpu_clock() - self._runs * self._progress["cpu"]
        for step in self._progress["pending"]:
            evaluator.begin(step, network.load(_checkpoint_folder(self.folder, step)))
            self._policy_step = step

    @property
    def finished(self) -> bool:
        """Whether the last policy has been evaluated."""
        return self._progress["evaluated"] >= self.context.steps

    def open_bar(self, make_bar: Callable[..., Any]):
        """Return a new progress bar, made as `tqdm` makes one: a context."""
        evaluated_step = self._progress["evaluated"]
        options = {"total": self.context.steps, "initial": evaluated_step, "unit": "step", "unit_scale": True}
        self._bar = make_bar(desc=self.folder.name, **options)
        return self._bar

    def cpu_seconds(self) -> float:
        """Return the CPU time of the run so far, with that of evaluations that have ended."""
        return (_cpu_clock() - self._cpu_start) / self._runs

    def flush(self) -> None:
        """Write the latest checkpoint if it has not been written."""
        self._writer.flush()

    @usage.pause()
    def begin(self, learned_slice: Slice) -> None:
        """Write the line of a slice, and begin the evaluation of its policy if it is due.

        Raises:
            ValueError: an algorithm that does not act, by its definition, has made environment steps, or a learner has
                counted no step in many slices.
            Diverged: a metric or an array of the slice is not finite.
        """
        step = self.usage.steps
        metrics = learned_slice.metrics
        run_usage.check_steps(self.usage, self._configuration)
        if learned_slice.is_complete:
            self._step_watch.check(step)
        _check_finite(learned_slice, step, self.folder)
        self._bar.update(step - self._bar.n)
        if metrics is not None:
            self._run_files.append("training", {"step": step, **metrics})
            self._on_metrics(step, metrics)
            self._bar.set_postfix_str(_postfix(metrics, self._progress), refresh=False)
        is_due = step >= self.context.next_evaluation(self._policy_step)
        self._is_policy_new = learned_slice.is_complete and is_due
        if self._is_policy_new:
            self._policy_step = step
            policy_setup = self._configuration.policy_setup
            policy = Network(learned_slice.policy, policy_setup, self._evaluator.block_sizes, self._training_seeds)
            network.save(files.folder(_checkpoint_folder(self.folder, step)) / network.FILE, policy)
            self._evaluator.begin(step, policy)

    @usage.pause()
    def complete(self, learned_slice: Slice) -> None:
        """Write the results of evaluations, times, and the checkpoint of a slice.

        It waits for the evaluation of the last policy.
        """
        is_last = self._policy_step >= self.context.steps
        for evaluated_step, lines in self._evaluator.pop_results(wait=is_last):
            mean_return = _record_evaluation(self._configuration, self._run_files, evaluated_step, lines)
            self._progress |= {"return": mean_return, "evaluated": evaluated_step}
            self._on_metrics(evaluated_step, {"return": mean_return})
        self._progress["pending"] = list(self._evaluator.pending)
        self._progress["wall"] = time.monotonic() - self._wall_start  # s, of all processes of a run
        self._progress["cpu"] = self.cpu_seconds()  # s, of all processes of a run
        self._progress |= self.usage.to_dict()
        if learned_slice.metrics is not None or self._is_policy_new:
            seconds = {f"{name}_seconds": round(self._progress[name], 3) for name in ("wall", "cpu")}
            self._run_files.append("times", {"step": self.usage.steps, **seconds})
        self._writer.write(learned_slice.checkpoint, self._progress, at_once=is_last)
        self.has_checkpoint = True


@contextlib.contextmanager
def _record(
    configuration: Configuration,
    folder: Path,
    threads: int,
    stays_on_device: bool,
    run_seeds: Sequence[int],
    on_metrics: Callable[[int, Mapping[str, float]], None],
) -> Iterator[_Recorder]:
    """Open the folder of a run, record its usage, and yield its recorder.

    Args:
        configuration, folder, threads, on_metrics: see `train`.
        stays_on_device: whether the learner stays on a device: checkpoints are rarer, and other processes evaluate.
        run_seeds: seeds of the runs that this process trains.
    """
    folder = Path(folder)
    _check_start(configuration)
    record = configuration.record()
    if configuration.prior is not None:  # the data under an id may change
        record[PRIOR_SHA256] = priors.dataset_digest(configuration.prior)
    training_seeds = _training_seeds(configuration, folder)
    record[TRAINING_SEEDS] = seed_ranges.to_json(training_seeds)
    task_results.check_results_of_others(configuration.setup)
    evaluation.check_ends(configuration.setup.definition.step_limit)
    growing_fields = ("steps",) if configuration.definition.extends else ()
    with run_folder.open_run(folder, record, growing_fields) as run_files, contextlib.ExitStack() as stack:
        evaluated_step = run_files.progress.get("evaluated", 0)
        run_folder.check_latest_evaluation(folder, evaluated_step)
        context = configuration.context(folder, threads, run_files.arrays)
        if stays_on_device:
            evaluator = ProcessEvaluator(configuration, folder, len(run_seeds))
        else:
            evaluator = Evaluator(configuration, threads)
        stack.enter_context(contextlib.closing(evaluator))
        # A buffer that overwrites transitions goes on from recent checkpoints alone.
        overwrites = getattr(configuration.hyperparameters, "buffer_size", context.steps) < context.steps
        interval = _SAVE_INTERVAL if stays_on_device and not overwrites else 0.0
        recorder = _Recorder(
            configuration, run_files, context, evaluator, training_seeds, interval, run_seeds, on_metrics
        )
        stack.enter_context(usage.record(recorder.usage))
        yield recorder


def _cpu_clock() -> float:
    """Return the CPU time of this process and of its ended children, s."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


@contextlib.contextmanager
def _report_damage(folders: Sequence[Path]) -> Iterator[None]:
    """Raise ValueError with the path of the checkpoint in place of `Damaged`."""
    try:
        yield
    except Damaged as error:
        paths = ", ".join(str(folder / run_folder.CHECKPOINT) for folder in folders)
        raise ValueError(f"{paths} is damaged: {error}; delete it to start the run over") from None


@contextlib.contextmanager
def _report_flaw_of_task(setup: Setup) -> Iterator[None]:
    """Say in the error `Diverged` if the task itself gives results that are not finite, under random actions."""
    try:
        yield
    except Diverged as error:
        with usage.pause():
            flaw = task_results.find_non_finite(setup, _FLAW_STEPS)
        if flaw is not None:
            error.args = (f"{error}; the task {setup.task} gives such results itself: {flaw} under random actions",)
        raise


class _CheckpointWriter:
    """Writes the checkpoints of a run, at most one in an interval of time."""

    def __init__(self, run_files: RunFolder, interval: float):
        """Remember the folder, and the seconds between two checkpoints; 0 writes each."""
        self._run_files = run_files
        self._interval = interval
        self._next_time = 0.0  # s of the monotonic clock
        self._unwritten = None

    def write(self, arrays: Mapping[str, Any], progress_values: Mapping[str, Any], at_once: bool) -> None:
        """Write a checkpoint if it is time, or at once; otherwise keep it for `flush`."""
        self._unwritten = (arrays, dict(progress_values))
        if at_once or time.monotonic() >= self._next_time:
            self.flush()

    def flush(self) -> None:
        """Write the latest checkpoint if it has not been written."""
        if self._unwritten is None:
            return
        self._run_files.save(*self._unwritten)
        self._unwritten = None
        self._next_time = time.monotonic() + self._interval


def _check_finite(learned_slice: Slice, step: int, folder: Path) -> None:
    """Raise Diverged for a metric or an array of the learner that is not finite at an environment step."""
    for name, metric in (learned_slice.metrics or {}).items():
        if not np.isfinite(metric):
            raise Diverged(f"{name} is {metric}", step, folder)
    for name, array in learned_slice.checkpoint.items():
        is_learned = array.dtype.kind == "f" and not name.startswith(UNLEARNED_PREFIXES)
        if is_learned and not np.isfinite(array).all():
            raise Diverged(f"{name} is not finite", step, folder)


def _postfix(metrics: Mapping[str, float], progress_values: Mapping[str, Any]) -> str:
    """Return the text after a progress bar: the latest evaluation's return, and the learner's first two metrics."""
    values = {}
    if "return" in progress_values:
        values["return"] = progress_values["return"]
    values |= dict(list(metrics.items())[:2])
    return ", ".join(f"{name} {value:.4g}{_UNITS.get(name, '')}" for name, value in values.items())


def _check_start(configuration: Configuration) -> None:
    """Raise ValueError for an algorithm that learns from a policy, without the policy to start from."""
    if configuration.definition.source == usage.POLICY and getattr(configuration.hyperparameters, "start", None) == "":
        raise ValueError("start: expected the folder of a run whose policy is where learning starts, got none")


def _training_seeds(configuration: Configuration, folder: Path) -> seed_ranges.Ranges | None:
    """Return the seeds of the episodes that a policy learned from; None if they are not known.

    They are those of the run, of its prior data, and of the policy that it starts from. A run that has begun has them
    in its record: the policy may be gone by now.
    """
    if run_folder.is_begun(folder):
        try:
            return seed_ranges.from_json(run_folder.read_config(folder).get(TRAINING_SEEDS))
        except (TypeError, ValueError):
            raise ValueError(f"{folder}: {TRAINING_SEEDS}: expected pairs of seeds") from None
    ranges = [seed_ranges.of_run(configuration.seed)]
    if configuration.prior is not None:
        ranges.append(priors.dataset_seeds(configuration.prior))
    start = getattr(configuration.hyperparameters, "start", "")
    if not start:
        return tuple(ranges)
    start_ranges = network.load(start).training_seeds
    if start_ranges is None:
        return None
    return tuple(dict.fromkeys((*start_ranges, *ranges)))


def _record_evaluation(configuration: Configuration, run_files: RunFolder, step: int, lines: Lines) -> float:
    """Write the lines of an evaluation and its policy into the folder of a run, and return the mean return."""
    checkpoint_folder = _checkpoint_folder(run_files.path, step)
    for line in lines:
        run_files.append("evaluations", line)
    with files.writing(run_files.path / network.FILE) as temporary:
        shutil.copyfile(checkpoint_folder / network.FILE, temporary)
    mean_return = float(np.mean([line["return"] for line in lines]))
    agent = Agent(configuration.algorithm, step, configuration.seed, mean_return)
    checkpoints.save(checkpoint_folder, agent)
    return mean_return


def _checkpoint_folder(folder: Path, step: int) -> Path:
    """Return the folder of the policy of a step, in the folder of a run."""
    return folder / checkpoints.FOLDER / str(step)
