"""Training: from a configuration to a folder with a policy, resumed bit-exactly after a kill at any moment."""

import contextlib
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode
from tqdm import tqdm

from arc_suite import checks, evaluation, files, seed_ranges
from arc_suite.envs.vector import VectorEnv
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
        configuration: of the run.
        folder: of the run.
        minutes: of CPU time of the run to stop after, all its processes together; None to train to the end.
        threads: of the simulation; results do not depend on it.
        progress: makes a progress bar as `tqdm` does.
        on_metrics: called after each line of training.csv, and after each evaluation, with the environment step and
            metrics by name; the metric of an evaluation is `return`.
        stop: returns whether to stop; asked as soon as there is a checkpoint, and after each.

    Returns:
        Whether the run is finished.

    Raises:
        ValueError: a part of the run or minutes that do not fit, the folder of another run, or a damaged one.
        Diverged: a value of the learner is not finite; the checkpoint before stays.
        OSError: the disk is full, or the like; the checkpoint before stays.
    """
    if minutes is not None:
        checks.number("minutes", minutes, 0.0)
    record, definition, setup = configuration.record(), configuration.definition, configuration.setup
    if configuration.prior is not None:  # the data under an id may change
        record[PRIOR_SHA256] = priors.dataset_digest(configuration.prior)
    training_seeds = _training_seeds(configuration, Path(folder))
    record[TRAINING_SEEDS] = seed_ranges.to_json(training_seeds)
    evaluation.check_ends(setup.definition.step_limit)
    policy_setup = configuration.policy_setup
    growing = ("steps",) if definition.extends else ()
    with run_folder.open_run(folder, record, growing) as run_files, contextlib.ExitStack() as stack:
        state = {"evaluated": 0, "wall": 0.0, "cpu": 0.0} | run_files.progress
        run_folder.check_latest_evaluation(folder, state["evaluated"])
        context = configuration.context(folder, threads, run_files.arrays)
        slices = stack.enter_context(contextlib.closing(definition.learn(definition.hyperparameters, context)))
        options = {"num_threads": threads, "autoreset_mode": AutoresetMode.DISABLED}
        vector = configuration.validation.make_vec(evaluation.CURVE_EPISODES, **options)
        environment = stack.enter_context(contextlib.closing(vector))
        sizes = dict((environment.task if setup.several else policy_setup.definition).sizes)
        wall, cpu = time.monotonic() - state["wall"], time.process_time() - state["cpu"]
        bar = progress(
            total=context.steps, initial=state["evaluated"], desc=Path(folder).name, unit="step", unit_scale=True
        )
        stack.enter_context(bar)
        saved = run_files.arrays is not None
        while state["evaluated"] < context.steps:
            if (saved and stop()) or (minutes is not None and time.process_time() - cpu > 60.0 * minutes):
                return False
            try:
                found = next(slices)
            except Damaged as error:
                where = f"{run_files.path / run_folder.CHECKPOINT} is damaged"
                raise ValueError(f"{where}: {error}; delete it to start the run over") from None
            _check_finite(found)
            bar.update(found.step - bar.n)
            is_evaluated = found.step >= context.next_evaluation(state["evaluated"])
            if found.metrics is not None:
                run_files.append("training", {"step": found.step, **found.metrics})
                on_metrics(found.step, found.metrics)
                bar.set_postfix_str(_postfix(found.metrics, state), refresh=False)
            if is_evaluated:
                policy = Network(found.policy, policy_setup, sizes, training_seeds)
                state["return"] = _evaluate(configuration, environment, run_files, found.step, policy)
                state["evaluated"] = found.step
                on_metrics(found.step, {"return": state["return"]})
            state |= {"wall": time.monotonic() - wall, "cpu": time.process_time() - cpu}  # s of all processes of a run
            if found.metrics is not None or is_evaluated:
                seconds = {f"{name}_seconds": round(state[name], 3) for name in ("wall", "cpu")}
                run_files.append("times", {"step": found.step, **seconds})
            run_files.save(found.checkpoint, state)
            saved = True
    return True


def _check_finite(found: Slice) -> None:
    for name, metric in (found.metrics or {}).items():
        if not np.isfinite(metric):
            raise Diverged(f"{name} is {metric}", found.step)
    for name, array in found.checkpoint.items():
        is_learned = array.dtype.kind == "f" and not name.startswith(UNLEARNED_PREFIXES)
        if is_learned and not np.isfinite(array).all():
            raise Diverged(f"{name} is not finite", found.step)


def _postfix(metrics: Mapping[str, float], state: Mapping[str, Any]) -> str:
    """The return of the latest evaluation, and the first metrics of the learner."""
    shown = {"return": state["return"]} if "return" in state else {}
    shown |= dict(list(metrics.items())[:2])
    return ", ".join(f"{name} {value:.4g}" for name, value in shown.items())


def _training_seeds(configuration: Configuration, folder: Path) -> seed_ranges.Ranges | None:
    """Seeds of the episodes of a run, of its prior data, and of the policy that it starts from; None if unknown.

    Those of a run that has begun are in its record: the policy may be gone by now.
    """
    if run_folder.is_begun(folder):
        try:
            return seed_ranges.from_json(run_folder.read_config(folder).get(TRAINING_SEEDS))
        except (TypeError, ValueError):
            raise ValueError(f"{folder}: {TRAINING_SEEDS}: expected pairs of seeds") from None
    found = [seed_ranges.of_run(configuration.seed)]
    if configuration.prior is not None:
        found.append(priors.dataset_seeds(configuration.prior))
    if start := getattr(configuration.hyperparameters, "start", ""):
        before = network.load(start).training_seeds
        return None if before is None else tuple(dict.fromkeys((*before, *found)))
    return tuple(found)


def _evaluate(
    configuration: Configuration, environment: VectorEnv, run_files: RunFolder, step: int, policy: Network
) -> float:
    """Evaluate a policy by the protocol, write it and its returns into the folder, and return their mean."""
    network.save(run_files.path / network.FILE, policy)
    kept = files.folder(run_files.path / checkpoints.FOLDER / str(step))
    network.save(kept / network.FILE, policy)
    episodes = evaluation.episodes_in_batch(environment, policy)
    for seed, episode in enumerate(episodes):
        numbers = {"seed": seed, "return": episode.total, "length": episode.length, **episode.progress}
        run_files.append("evaluations", {"step": step, **numbers})
    mean = float(np.mean([episode.total for episode in episodes]))
    checkpoints.save(kept, Agent(configuration.algorithm, step, configuration.seed, mean))
    return mean
