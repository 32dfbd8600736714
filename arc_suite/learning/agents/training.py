"""Training: from a configuration to a folder with a policy, resumed bit-exactly after a kill at any moment."""

import contextlib
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from arc_suite import checks, evaluation, files, seed_ranges
from arc_suite.learning.agents import priors, run_folder
from arc_suite.learning.agents.configuration import PRIOR_SHA256, TRAINING_SEEDS, Configuration
from arc_suite.learning.agents.evaluating import Evaluator, Lines, ProcessEvaluator
from arc_suite.learning.agents.learner import UNLEARNED_PREFIXES, Damaged, Diverged, Slice
from arc_suite.learning.agents.run_folder import RunFolder
from arc_suite.policies import checkpoints, network
from arc_suite.policies.checkpoints import Agent
from arc_suite.policies.network import Network

_SAVE_INTERVAL = 30.0  # s between two checkpoints of a learner that stays on a device


def train(
    configuration: Configuration,
    folder: Path,
    minutes: float | None = None,
    threads: int = 1,
    progress: Callable = tqdm,
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
    folder = Path(folder)
    algorithm = configuration.definition
    record = configuration.record()
    if configuration.prior is not None:  # the data under an id may change
        record[PRIOR_SHA256] = priors.dataset_digest(configuration.prior)
    training_seeds = _training_seeds(configuration, folder)
    record[TRAINING_SEEDS] = seed_ranges.to_json(training_seeds)
    evaluation.check_ends(configuration.setup.definition.step_limit)
    growing_fields = ("steps",) if algorithm.extends else ()
    with run_folder.open_run(folder, record, growing_fields) as run_files, contextlib.ExitStack() as stack:
        progress_values = {"evaluated": 0, "pending": [], "wall": 0.0, "cpu": 0.0} | run_files.progress
        run_folder.check_latest_evaluation(folder, progress_values["evaluated"])
        context = configuration.context(folder, threads, run_files.arrays)
        slices = stack.enter_context(contextlib.closing(algorithm.learn(algorithm.hyperparameters, context)))
        evaluator = _make_evaluator(configuration, threads, folder)
        stack.enter_context(contextlib.closing(evaluator))
        policy_step = progress_values["evaluated"]  # of the latest policy whose evaluation has begun
        for policy_step in progress_values["pending"]:
            evaluator.begin(policy_step, network.load(_checkpoint_folder(folder, policy_step)))
        writer = _CheckpointWriter(run_files, _SAVE_INTERVAL if configuration.learns_on_device else 0.0)
        # Where the clocks stood when the run began, if it had never stopped.
        wall_start = time.monotonic() - progress_values["wall"]
        cpu_start = time.process_time() - progress_values["cpu"]
        bar = progress(
            total=context.steps, initial=progress_values["evaluated"], desc=folder.name, unit="step", unit_scale=True
        )
        stack.enter_context(bar)
        has_checkpoint = run_files.arrays is not None
        while progress_values["evaluated"] < context.steps:
            is_time_up = minutes is not None and time.process_time() - cpu_start > 60.0 * minutes
            if (has_checkpoint and stop()) or is_time_up:
                writer.flush()
                return False
            learned_slice = _next_slice(slices, run_files)
            step = learned_slice.step
            metrics = learned_slice.metrics
            _check_finite(learned_slice)
            bar.update(step - bar.n)
            if metrics is not None:
                run_files.append("training", {"step": step, **metrics})
                on_metrics(step, metrics)
                bar.set_postfix_str(_postfix(metrics, progress_values), refresh=False)
            is_evaluated = step >= context.next_evaluation(policy_step)
            if is_evaluated:
                policy_step = step
                policy_setup = configuration.policy_setup
                policy = Network(learned_slice.policy, policy_setup, evaluator.block_sizes, training_seeds)
                network.save(files.folder(_checkpoint_folder(folder, step)) / network.FILE, policy)
                evaluator.begin(step, policy)
            is_last = policy_step >= context.steps
            for evaluated_step, lines in evaluator.pop_results(wait=is_last):
                progress_values["return"] = _record_evaluation(configuration, run_files, evaluated_step, lines)
                progress_values["evaluated"] = evaluated_step
                on_metrics(evaluated_step, {"return": progress_values["return"]})
            progress_values["pending"] = list(evaluator.pending)
            progress_values["wall"] = time.monotonic() - wall_start  # s, of all processes of a run
            progress_values["cpu"] = time.process_time() - cpu_start  # s, of all processes of a run
            if metrics is not None or is_evaluated:
                seconds = {f"{name}_seconds": round(progress_values[name], 3) for name in ("wall", "cpu")}
                run_files.append("times", {"step": step, **seconds})
            writer.write(learned_slice.checkpoint, progress_values, at_once=is_last)
            has_checkpoint = True
    return True


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


def _next_slice(slices: Iterator[Slice], run_files: RunFolder) -> Slice:
    """Return the next slice of a learner; raise ValueError with the path of a damaged checkpoint."""
    try:
        return next(slices)
    except Damaged as error:
        path = run_files.path / run_folder.CHECKPOINT
        raise ValueError(f"{path} is damaged: {error}; delete it to start the run over") from None


def _check_finite(learned_slice: Slice) -> None:
    """Raise Diverged for a metric or an array of the learner that is not finite."""
    for name, metric in (learned_slice.metrics or {}).items():
        if not np.isfinite(metric):
            raise Diverged(f"{name} is {metric}", learned_slice.step)
    for name, array in learned_slice.checkpoint.items():
        is_learned = array.dtype.kind == "f" and not name.startswith(UNLEARNED_PREFIXES)
        if is_learned and not np.isfinite(array).all():
            raise Diverged(f"{name} is not finite", learned_slice.step)


def _postfix(metrics: Mapping[str, float], progress_values: Mapping[str, Any]) -> str:
    """Return the text after a progress bar: the latest evaluation's return, and the learner's first two metrics."""
    values = {}
    if "return" in progress_values:
        values["return"] = progress_values["return"]
    values |= dict(list(metrics.items())[:2])
    return ", ".join(f"{name} {value:.4g}" for name, value in values.items())


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


def _make_evaluator(configuration: Configuration, threads: int, folder: Path) -> Evaluator | ProcessEvaluator:
    """Return what evaluates the policies of a run: in processes of its own for a learner that stays on a device."""
    if configuration.learns_on_device:
        return ProcessEvaluator(configuration, threads, folder)
    return Evaluator(configuration, threads)


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
