"""Training: from a configuration to a folder with a policy, resumed bit-exactly after a kill at any moment."""

import contextlib
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from tqdm import tqdm

from arc_suite import checks, evaluation, files, seed_ranges
from arc_suite.learning.agents import priors, run_folder
from arc_suite.learning.agents.configuration import PRIOR_SHA256, TRAINING_SEEDS, Configuration
from arc_suite.learning.agents.learner import UNLEARNED_PREFIXES, Damaged, Diverged, Slice
from arc_suite.learning.agents.run_folder import RunFolder
from arc_suite.policies import checkpoints, network
from arc_suite.policies.checkpoints import Agent
from arc_suite.policies.network import Network


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
        progress_values = {"evaluated": 0, "wall": 0.0, "cpu": 0.0} | run_files.progress
        run_folder.check_latest_evaluation(folder, progress_values["evaluated"])
        context = configuration.context(folder, threads, run_files.arrays)
        slices = stack.enter_context(contextlib.closing(algorithm.learn(algorithm.hyperparameters, context)))
        evaluator = _Evaluator(configuration, threads, training_seeds)
        stack.enter_context(contextlib.closing(evaluator))
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
                return False
            learned_slice = _next_slice(slices, run_files)
            step = learned_slice.step
            metrics = learned_slice.metrics
            _check_finite(learned_slice)
            bar.update(step - bar.n)
            is_evaluated = step >= context.next_evaluation(progress_values["evaluated"])
            if metrics is not None:
                run_files.append("training", {"step": step, **metrics})
                on_metrics(step, metrics)
                bar.set_postfix_str(_postfix(metrics, progress_values), refresh=False)
            if is_evaluated:
                progress_values["return"] = evaluator.evaluate(learned_slice, run_files)
                progress_values["evaluated"] = step
                on_metrics(step, {"return": progress_values["return"]})
            progress_values["wall"] = time.monotonic() - wall_start  # s, of all processes of a run
            progress_values["cpu"] = time.process_time() - cpu_start  # s, of all processes of a run
            if metrics is not None or is_evaluated:
                seconds = {f"{name}_seconds": round(progress_values[name], 3) for name in ("wall", "cpu")}
                run_files.append("times", {"step": step, **seconds})
            run_files.save(learned_slice.checkpoint, progress_values)
            has_checkpoint = True
    return True


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


class _Evaluator:
    """Evaluates the policies of a run while it learns."""

    def __init__(self, configuration: Configuration, threads: int, training_seeds: seed_ranges.Ranges | None):
        """Make the environments of evaluation."""
        self._configuration = configuration
        self._training_seeds = training_seeds
        self._environment = configuration.validation.make_vec(
            evaluation.CURVE_EPISODES, num_threads=threads, autoreset_mode=AutoresetMode.DISABLED
        )
        # Tasks of one body are read as the policy has them, without the blocks that networks do not see.
        task = self._environment.task if configuration.setup.several else configuration.policy_setup.definition
        self._block_sizes = dict(task.sizes)

    def close(self) -> None:
        """Close the environments."""
        self._environment.close()

    def evaluate(self, learned_slice: Slice, run_files: RunFolder) -> float:
        """Evaluate the policy of a slice, write it and its returns into the folder, and return their mean."""
        step = learned_slice.step
        policy_setup = self._configuration.policy_setup
        policy = Network(learned_slice.policy, policy_setup, self._block_sizes, self._training_seeds)
        network.save(run_files.path / network.FILE, policy)
        checkpoint_folder = files.folder(run_files.path / checkpoints.FOLDER / str(step))
        network.save(checkpoint_folder / network.FILE, policy)
        episodes = evaluation.episodes_in_batch(self._environment, policy)
        for seed, episode in enumerate(episodes):
            numbers = {"seed": seed, "return": episode.total, "length": episode.length, **episode.progress}
            run_files.append("evaluations", {"step": step, **numbers})
        mean_return = float(np.mean([episode.total for episode in episodes]))
        agent = Agent(self._configuration.algorithm, step, self._configuration.seed, mean_return)
        checkpoints.save(checkpoint_folder, agent)
        return mean_return
