"""Trains: an algorithm on a task, from nothing to a folder with a policy, resumed to the bit wherever it was killed."""

import contextlib
import dataclasses
import functools
import hashlib
import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from gymnasium.vector import AutoresetMode
from tqdm import tqdm

from arc_suite import checks, evaluation, files, registry, versions
from arc_suite.agents import priors, run_folder
from arc_suite.agents.algorithms import Algorithm
from arc_suite.agents.learner import ENVIRONMENT, MOST_SEEDS, Diverged, Learner, Stage
from arc_suite.agents.run_folder import RunFolder
from arc_suite.data.settings import model_sha256
from arc_suite.envs.vector import VectorEnv
from arc_suite.policies import checkpoints, network
from arc_suite.policies.checkpoints import Agent
from arc_suite.policies.network import Network
from arc_suite.robots import is_robot
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import body_to_json

PRIOR_SHA256 = "prior_sha256"  # name in a configuration; `Run.config` does not ask for the data


class Run(NamedTuple):
    """All that a run depends on.

    Attributes:
        body: what moves.
        algorithm: its name, for the folder to tell.
        definition: what the name stands for.
        task: name of the task.
        task_kwargs: its settings, as in `arc_suite.load`; plain values, which JSON can hold.
        seed: of everything random.
        steps: environment steps.
        prior: id of a dataset of prior data; None for none.
        evaluate_every: environment steps between evaluations; None for what the algorithm says.
    """

    body: Body
    algorithm: str
    definition: Algorithm
    task: str = "walk"
    task_kwargs: Mapping[str, Any] = {}
    seed: int = 0
    steps: int = 1_000_000
    prior: str | None = None
    evaluate_every: int | None = None

    @property
    def robot(self) -> str:
        """Name of the robot, or the JSON text of a body that is none."""
        return self.body.name if is_robot(self.body) else body_to_json(self.body)

    @property
    def interval(self) -> int:
        """Environment steps between evaluations."""
        return self.evaluate_every or self.definition.evaluate_every

    def folder(self) -> Path:
        """Return the folder that it has if no other is given."""
        name = f"{self.body.name}-{registry.task_of(self.task).name}-{self.algorithm}-{self.seed}"
        return Path("runs", name.replace(":", "."))

    def config(self) -> dict[str, Any]:
        """Return, JSON-able, all that the run depends on, with versions and hashes.

        Raises:
            ValueError: a value that does not fit; one line.
        """
        checks.integer("seed", self.seed, 0, MOST_SEEDS)
        checks.integer("steps", self.steps, 1)
        checks.integer("evaluate_every", self.interval, 1)
        task = registry.task_of(self.task)
        return {
            "robot": self.robot,
            "task": task.name,
            "task_version": task.version,
            "task_kwargs": json.loads(checks.json_text("task_kwargs", self.task_kwargs)),
            "algorithm": self.algorithm,
            "learner": self.definition.learner,
            "row": dataclasses.asdict(self.definition.row),
            "seed": self.seed,
            "steps": self.steps,
            "evaluate_every": self.interval,
            "episodes": evaluation.EPISODES,
            "prior": self.prior,
            "body_sha256": hashlib.sha256(body_to_json(self.body).encode()).hexdigest(),
            "model_sha256": model_sha256(self.body, self.task, self.task_kwargs),
            "versions": versions.recorded() | {name: versions.installed(name) for name in ("jax", "jaxlib", "optax")},
        }


def train(
    run: Run,
    folder: Path,
    minutes: float | None = None,
    threads: int = 1,
    progress: Callable = tqdm,
    told: Callable[[int, Mapping[str, float]], None] = lambda step, figures: None,
) -> bool:
    """Train, or go on.

    Args:
        run: what the run depends on.
        folder: of the run.
        minutes: to stop after, of wall clock; None to train to the end.
        threads: on which rows are simulated; nothing depends on it but time.
        progress: makes a progress bar as `tqdm` does.
        told: called after each line of training.csv, and after each evaluation, with the environment
            step and figures by name; an evaluation's is `return`.

    Returns:
        Whether the run is finished.

    Raises:
        ValueError: something of the run that does not fit, the folder of another run, or a damaged one; one line.
        Diverged: numbers of the learner are no longer finite; the checkpoint before stays.
        OSError: the disk is full, or the like; the checkpoint before stays.
    """
    began = time.monotonic()
    config, definition = run.config(), run.definition
    if run.prior is not None:  # by its id alone nobody would know whether it is still what it was
        config[PRIOR_SHA256] = priors.digest(run.prior)
    module = definition.module
    with run_folder.opened(folder, config) as run_files:
        places = run.seed, run.steps, Path(folder), run.prior, threads, run_files.arrays is not None
        stage = Stage(run.body, run.task, run.task_kwargs, *places)
        learner = module.begin(definition.row, stage)
        state = {"evaluated": 0, "wall": 0.0, "cpu": 0.0} | run_files.progress
        if run_files.arrays is not None:
            _restore(learner, run_files)
        judge = _Judge(run, threads)
        clock = _Clock(state)
        bar = progress(total=run.steps, initial=learner.step, desc=Path(folder).name, unit="step", unit_scale=True)
        with bar, contextlib.closing(judge):
            while state["evaluated"] < run.steps:
                if minutes is not None and time.monotonic() - began > 60.0 * minutes:
                    return False
                due = min((state["evaluated"] // run.interval + 1) * run.interval, run.steps)
                figures = learner.advance(due)
                bar.update(learner.step - bar.n)
                arrays = learner.arrays()
                _check_finite(arrays, learner.step)
                if figures is not None:
                    _record(run_files, learner, figures)
                    told(learner.step, figures)
                    bar.set_postfix_str(_shown(figures, state), refresh=False)
                if learner.step >= due:
                    state["return"] = judge(run_files, learner)
                    state["evaluated"] = learner.step
                    told(learner.step, {"return": state["return"]})
                clock.read(run_files, learner.step, write=figures is not None or learner.step >= due)
                run_files.save(arrays, state)
    return True


def _restore(learner: Learner, run_files: RunFolder) -> None:
    try:
        learner.restore(run_files.arrays)
    except (KeyError, ValueError) as error:
        where = f"{run_files.path / run_folder.CHECKPOINT} is damaged"
        raise ValueError(f"{where}: {checks.quoted(error)}; delete it to start the run over") from None


def _record(run_files: RunFolder, learner: Learner, figures: Mapping[str, float]) -> None:
    for name, figure in figures.items():
        if not np.isfinite(figure):
            raise Diverged(_diverged(f"{name} is {figure}", learner.step))
    run_files.append("training", {"step": learner.step, **figures})


def _check_finite(arrays: Mapping[str, np.ndarray], step: int) -> None:
    for name, array in arrays.items():
        is_learnt = array.dtype.kind == "f" and not name.startswith(ENVIRONMENT)  # commands of tasks may be NaN
        if is_learnt and not np.isfinite(array).all():
            raise Diverged(_diverged(f"{name} is not finite", step))


def _diverged(what: str, step: int) -> str:
    return f"the learner diverged: {what} at step {step}; the checkpoint before stays"


def _shown(figures: Mapping[str, float], state: Mapping[str, Any]) -> str:
    """The latest return of an evaluation, and the first figures of the learner."""
    shown = {"return": state["return"]} if "return" in state else {}
    shown |= dict(list(figures.items())[:2])
    return ", ".join(f"{name} {value:.4g}" for name, value in shown.items())


class _Clock:
    """Adds seconds up over all processes of a run, into its times."""

    def __init__(self, state: dict[str, Any]):
        self._state, self._latest = state, (time.monotonic(), time.process_time())

    def read(self, run_files: RunFolder, step: int, write: bool) -> None:
        now = time.monotonic(), time.process_time()
        self._state["wall"] += now[0] - self._latest[0]
        self._state["cpu"] += now[1] - self._latest[1]
        self._latest = now
        if write:
            seconds = {f"{name}_seconds": round(self._state[name], 3) for name in ("wall", "cpu")}
            run_files.append("times", {"step": step, **seconds})


class _Judge:
    """Evaluates a learner's policy by the protocol, and writes it and what it earns into the folder."""

    def __init__(self, run: Run, threads: int):
        self._run, self._threads = run, threads

    @functools.cached_property
    def _environment(self) -> VectorEnv:
        run = self._run
        rows = evaluation.EPISODES
        return VectorEnv(run.body, run.task, rows, self._threads, AutoresetMode.DISABLED, task_kwargs=run.task_kwargs)

    def __call__(self, run_files: RunFolder, learner: Learner) -> float:
        run, task = self._run, self._environment.task
        policy = Network(tuple(learner.policy()), run.robot, task.name, dict(run.task_kwargs), dict(task.blocks))
        network.save(run_files.path / network.FILE, policy)
        kept = files.folder(run_files.path / checkpoints.FOLDER / str(learner.step))
        network.save(kept / network.FILE, policy)
        episodes = evaluation.episodes_in_rows(self._environment, policy)
        for seed, episode in enumerate(episodes):
            figures = {"seed": seed, "return": episode.total, "length": episode.length, **episode.progress}
            run_files.append("evaluations", {"step": learner.step, **figures})
        mean = float(np.mean([episode.total for episode in episodes]))
        checkpoints.save(kept, Agent(run.algorithm, learner.step, run.seed, mean))
        return mean

    def close(self) -> None:
        if "_environment" in vars(self):
            self._environment.close()
