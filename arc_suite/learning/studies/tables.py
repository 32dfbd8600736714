"""Tables of runs: what a study is made of, and the studies of the benchmark's divisions."""

import collections
import itertools
from collections.abc import Mapping
from typing import Any, NamedTuple

from arc_suite import checks
from arc_suite.cpg.selection import suited_preset
from arc_suite.data import DatasetSettings
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.studies.divisions import DIVISIONS, PLACES, SEEDS

_EPISODES = 1000  # of prior data, as in the paper


class Prior(NamedTuple):
    """Prior data: episodes of the body's demonstrator in the task of the run.

    Attributes:
        preset: of the demonstrator.
        episodes: number of episodes.
    """

    preset: str = "medium"
    episodes: int = _EPISODES

    def settings(self, setup: Setup) -> DatasetSettings:
        """Return the settings of the dataset."""
        return DatasetSettings(setup, "cpg", (self.preset,))

    def dataset_id(self, setup: Setup) -> str:
        """Return the id of the dataset."""
        whole = self.settings(setup).dataset_id()
        few = f"-{self.episodes}episodes-v0"
        return whole if self.episodes == _EPISODES else whole.removesuffix("-v0") + few


class Run(NamedTuple):
    """A run of a study; `run` makes it.

    Attributes:
        configuration: of the training.
        label: name of its kind in the report; empty for the algorithm.
        prior: data that are collected before the run; None for none.
    """

    configuration: Configuration
    label: str = ""
    prior: Prior | None = None

    @property
    def kind(self) -> str:
        """Name of this run and its other seeds."""
        return self.label or self.configuration.algorithm

    @property
    def name(self) -> str:
        """Name of its folder."""
        setup, seed = self.configuration.setup, self.configuration.seed
        return folder_name(f"{setup.body.name}-{setup.kind.name}-{self.kind}-{seed}")

    @property
    def place(self) -> str:
        """Robot, task and settings of its evaluations, by which results are grouped."""
        return str(self.configuration.validation)


def run(
    robot: str,
    algorithm: str,
    steps: int,
    seed: int = 0,
    task: str = "walk",
    task_kwargs: Mapping[str, Any] | None = None,
    hyperparameters: Mapping[str, Any] | None = None,
    prior: Prior | None = None,
    evaluate_every: int | None = None,
    label: str = "",
    training: Mapping[str, Any] | None = None,
) -> Run:
    """Return a run.

    Args:
        robot: name of a robot, or `module:name`.
        algorithm, steps, seed, hyperparameters, evaluate_every, training: see `Configuration.of`.
        task: name of the task.
        task_kwargs: its settings, as in `arc_suite.load`.
        prior: prior data; None for none.
        label: name of its kind in the report; empty for the algorithm.

    Raises:
        ValueError: an unknown robot, task, algorithm or hyperparameter.
    """
    setup = Setup.of(robot, task, task_kwargs)
    dataset = None if prior is None else prior.dataset_id(setup)
    configuration = Configuration.of(setup, algorithm, hyperparameters, seed, steps, evaluate_every, dataset, training)
    return Run(configuration, label, prior)


class Study(NamedTuple):
    """A study.

    Attributes:
        title: of its report; names what is not as in the paper.
        runs: the most urgent first.
    """

    title: str
    runs: tuple[Run, ...]


def benchmark(division: str, algorithm: str) -> Study:
    """Return the study of an algorithm on a division of the benchmark: all places with the first seed, then the others.

    Raises:
        ValueError: an unknown division or algorithm, or one that learns from something else than the division gives.
    """
    rule = DIVISIONS[checks.name(division, DIVISIONS, "division")]
    if (source := algorithms.algorithm(algorithm).source) != rule.source:
        fit = ", ".join(name for name, each in algorithms.ALGORITHMS.items() if each.source == rule.source)
        what = f"algorithm {algorithm} learns from {source}, and the division {division} takes those that learn from"
        raise ValueError(f"{what} {rule.source}: {fit}")
    runs = []
    for seed, (robot, task) in itertools.product(range(SEEDS), PLACES):
        prior = Prior(_collects(robot, task), rule.episodes) if rule.episodes else None
        runs.append(run(robot, algorithm, rule.steps_in(task), seed, task, prior=prior))
    return Study(f"division {division} of the benchmark: {algorithm}", tuple(runs))


def _collects(robot: str, task: str) -> str:
    """The preset that collects prior data of a place: on `walk` that of the paper, elsewhere the one that suits."""
    return "medium" if task == "walk" else suited_preset(Setup.of(robot, task).definition)


def folder_name(name: str) -> str:
    """Return the name of a folder, without the colon of `module:attribute`."""
    return name.replace(":", ".")


def study(name: str) -> Study:
    """Return the study `<division>-<algorithm>` of the benchmark, or `module:attribute`, a `Study` on Python's path.

    Raises:
        ValueError: there is none, or two of its runs have one name.
    """
    division, _, algorithm = name.partition("-")
    if division in DIVISIONS:
        return benchmark(division, algorithm)
    if ":" not in name:
        expected = "expected module:attribute, a Study on Python's path, or <division>-<algorithm> of the benchmark"
        raise ValueError(f"study {checks.preview(name)}: {expected}, such as {next(iter(DIVISIONS))}-ppo")
    found = checks.import_object(name, "study")
    if not isinstance(found, Study):
        raise ValueError(f"study {checks.preview(name)}: expected a Study, got {type(found).__name__}")
    for each, count in collections.Counter(each.name for each in found.runs).items():
        if count > 1:
            raise ValueError(f"study {checks.preview(name)}: {count} runs are named {each}; a label tells them apart")
    return found
