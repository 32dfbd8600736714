"""Tables of runs: what a study is made of, and the studies of the benchmark's divisions."""

import collections
import itertools
import os
from collections.abc import Mapping
from typing import Any, NamedTuple

from arc_suite import checks, usage
from arc_suite.cpg.selection import memoryless_preset
from arc_suite.data import DatasetSettings
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.studies.divisions import DIVISIONS, PLACES, SEEDS, SETTINGS, place_setup

_EPISODES = 1000  # of prior data, as in the paper


class Prior(NamedTuple):
    """Prior data: episodes of the body's demonstrator in the task of the run.

    Attributes:
        preset: preset of the demonstrator.
        episodes: number of episodes.
    """

    preset: str = "medium"
    episodes: int = _EPISODES

    def settings(self, setup: Setup) -> DatasetSettings:
        """Return the settings of the dataset."""
        return DatasetSettings(setup, "cpg", (self.preset,))

    def dataset_id(self, setup: Setup) -> str:
        """Return the id of the dataset."""
        default_id = self.settings(setup).dataset_id()
        if self.episodes == _EPISODES:
            return default_id
        return default_id.removesuffix("-v0") + f"-{self.episodes}episodes-v0"


class Run(NamedTuple):
    """A run of a study; `run` makes it.

    Attributes:
        configuration: configuration of the training.
        label: name of its kind in the report; empty for the name of the algorithm.
        prior: data that are collected before the run; None for none.
    """

    configuration: Configuration
    label: str = ""
    prior: Prior | None = None

    @property
    def kind(self) -> str:
        """Name that the runs of all seeds share."""
        return self.label or self.configuration.algorithm

    @property
    def name(self) -> str:
        """Name of its folder."""
        setup = self.configuration.setup
        return folder_name(f"{setup.name}-{setup.kind.name}-{self.kind}-{self.configuration.seed}")

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
        task_kwargs: settings of the task, as in `arc_suite.load`.
        prior: prior data; None for none.
        label: name of its kind in the report; empty for the name of the algorithm.

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
        title: title of its report; it names what differs from the paper.
        runs: runs, the most urgent first.
    """

    title: str
    runs: tuple[Run, ...]


def benchmark(division: str, algorithm: str) -> Study:
    """Return the study of an algorithm on a division of the benchmark.

    All places with the first seed come first, then those with the second, and so on.

    Raises:
        ValueError: an unknown division or algorithm, or one that learns from something else than the division gives.
    """
    rule = DIVISIONS[checks.name(division, DIVISIONS, "division")]
    source = algorithms.algorithm(algorithm).source
    if source not in (rule.source, usage.UNKNOWN):
        fitting_names = [name for name, entry in algorithms.ALGORITHMS.items() if entry.source == rule.source]
        what = f"algorithm {algorithm} learns from {source}, and the division {division} takes those that learn from"
        raise ValueError(f"{what} {rule.source}: {', '.join(fitting_names)}")
    runs = []
    for seed, (robot, task) in itertools.product(range(SEEDS), PLACES):
        prior = prior_of_division(division, robot, task)
        settings = SETTINGS.get((robot, task))
        runs.append(run(robot, algorithm, rule.steps_in(task), seed, task, settings, prior=prior))
    return Study(benchmark_title(division, algorithm), tuple(runs))


def benchmark_title(division: str, algorithm: str) -> str:
    """Return the title of the study of an algorithm on a division."""
    return f"division {division} of the benchmark: {algorithm}"


def prior_of_division(division: str, robot: str, task: str) -> Prior | None:
    """Return the prior data that a division gives in a place; None for none."""
    episodes = DIVISIONS[division].episodes
    return Prior(_collecting_preset(robot, task), episodes) if episodes else None


def _collecting_preset(robot: str, task: str) -> str:
    """Return the preset that collects prior data: on `walk` that of the paper, elsewhere see `memoryless_preset`."""
    return "medium" if task == "walk" else memoryless_preset(place_setup(robot, task).definition)


def folder_name(name: str) -> str:
    """Return the name of a folder, without the colon of `module:attribute`."""
    return name.replace(":", ".")


def study(name: str) -> Study:
    """Return the study `<division>-<algorithm>` of the benchmark, or `module:attribute`, a `Study` on Python's path.

    Raises:
        ValueError: there is none, two of its runs have one name, or a label is no name of a folder.
    """
    division, _, algorithm = name.partition("-")
    if division in DIVISIONS:
        if "." in algorithm and ":" not in algorithm:
            module, _, attribute = name.rpartition(".")
            raise ValueError(f"study {checks.preview(name)}: it is a folder; did you mean {module}:{attribute}?")
        return benchmark(division, algorithm)
    if ":" not in name:
        expected = "expected module:attribute, a Study on Python's path, or <division>-<algorithm> of the benchmark"
        clone_studies = "tools/study.py of a clone runs those of its folder studies"
        raise ValueError(
            f"study {checks.preview(name)}: {expected}, such as {next(iter(DIVISIONS))}-ppo; {clone_studies}"
        )
    imported = checks.import_object(name, "study")
    if not isinstance(imported, Study):
        raise ValueError(f"study {checks.preview(name)}: expected a Study, got {type(imported).__name__}")
    labels = [run.label for run in imported.runs if os.sep in run.label]
    if labels:
        hint = f"as it names a folder; {checks.preview(labels[0].replace(os.sep, '-'))} is one"
        label_text = f"label {checks.preview(labels[0])}"
        raise ValueError(f"study {checks.preview(name)}: {label_text}: expected no {os.sep}, {hint}")
    run_names = collections.Counter(run.name for run in imported.runs)
    for run_name, count in run_names.items():
        if count > 1:
            what = f"{count} runs are named {run_name}; a label tells them apart"
            raise ValueError(f"study {checks.preview(name)}: {what}")
    return imported
