"""Learning: learners, studies and the benchmark, transfer between bodies; nothing of the core imports it."""

import contextlib
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tqdm import tqdm

from arc_suite.envs.setup import Setup
from arc_suite.policies import network
from arc_suite.robots.spec import Body
from arc_suite.simulation import cores

__all__ = ["train"]


def train(
    robot: str | Body,
    task: str = "walk",
    algorithm: str = "ppo",
    *,
    task_kwargs: Mapping[str, Any] | None = None,
    hyperparameters: Mapping[str, Any] | None = None,
    seed: int = 0,
    steps: int | None = None,
    evaluate_every: int | None = None,
    prior: str | None = None,
    training: Mapping[str, Any] | None = None,
    minutes: float | None = None,
    folder: str | Path | None = None,
    progress: Callable[..., Any] = tqdm,
    on_metrics: Callable[[int, Mapping[str, float]], None] = lambda step, metrics: None,
) -> network.Network:
    """Train a policy, as `arc-suite train` does, and return it; the same call resumes what was interrupted.

    The policy plays wherever one is taken: in `arc_suite.evaluation`, `arc_suite.style` and `arc_suite.animation.show`.
    Its `setup.load()` and `setup.make_vec(num_envs)` make environments for it.

    Args:
        robot, task, task_kwargs: see `arc_suite.load`.
        algorithm, hyperparameters, seed, steps, evaluate_every, prior, training: see
            `agents.configuration.Configuration.of`.
        minutes: CPU time of the run to stop after, but not before its first evaluation; None to train to the end.
        folder: folder of the run; None for one that is deleted at the end.
        progress, on_metrics: see `agents.training.train`.

    Returns:
        The policy of the latest evaluation.

    Raises:
        ValueError: as `agents.training.train`, or a part of the run that does not fit.
        OSError: as `agents.training.train`.
    """
    setup = Setup.of(robot, task, task_kwargs)
    cores.prepare_jax()
    from arc_suite.learning.agents import training as trainer  # not before: programs without learners are light
    from arc_suite.learning.agents.configuration import Configuration, with_network_of_folder

    run = Configuration.of(setup, algorithm, hyperparameters, seed, steps, evaluate_every, prior, training)
    with contextlib.ExitStack() as stack:
        output = Path(folder) if folder else Path(stack.enter_context(tempfile.TemporaryDirectory()), run.name)
        run = with_network_of_folder(run, output)
        trainer.train(run, output, minutes, progress=progress, on_metrics=on_metrics)
        policy = output / network.FILE
        if not policy.exists():  # the minutes ended before the first evaluation
            trainer.train(run, output, progress=progress, on_metrics=on_metrics, stop=policy.exists)
        return network.load(policy)
