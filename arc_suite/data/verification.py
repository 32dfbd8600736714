"""Verification of datasets: `verify` replays episodes and compares them bit by bit."""

import contextlib
from collections.abc import Callable
from typing import Any

from tqdm import tqdm

from arc_suite import checks, registry
from arc_suite.data import rollouts
from arc_suite.data.collection import NUM_ENVS
from arc_suite.data.dataset import Dataset, open
from arc_suite.data.episodes import Episode
from arc_suite.envs.setup import Setup
from arc_suite.policies import Script
from arc_suite.robots.spec import Body
from arc_suite.simulation.model_hash import PHYSICS


def verify(
    dataset_id: str,
    body: Body | None = None,
    num_envs: int = NUM_ENVS,
    threads: int | None = None,
    progress: Callable[..., Any] = tqdm,
    task: str | None = None,
) -> int:
    """Replay every episode of a dataset from its seed and compare all arrays bit by bit.

    Args:
        dataset_id: Minari's.
        body: the expected body; None for any.
        num_envs: number of episodes that are replayed at a time.
        threads: number of threads of the simulation; None for all cores.
        progress: makes a progress bar as `tqdm` does.
        task: name of the expected task; None for any.

    Returns:
        The number of episodes.

    Raises:
        ValueError: the dataset is missing, damaged, of another body, task, model or version, or needs
            a module that has not been imported, or its replay differs.
    """
    dataset = open(dataset_id)
    settings = dataset.settings
    _check_body_and_task(dataset_id, settings.setup, body, task)
    _check_provenance(dataset)
    count = len(dataset)
    first_seed = settings.seed
    if count == 0:
        return 0
    num_envs = min(num_envs, count)
    # One step more than the longest episode, so that a replay that does not end is noticed. The steps in the settings
    # might be so many that memory does not suffice.
    steps = min(settings.steps, 1 + max(summary["length"] for summary in dataset.summaries()))
    recorded_episodes = {}  # by seed

    def script(seed):
        index = seed - first_seed
        episode = dataset[index]
        if episode.seed != seed:
            raise ValueError(f"dataset {dataset_id!r}: episode {index} has seed {episode.seed}, and not {seed}")
        recorded_episodes[seed] = episode
        return episode.actions

    environment = settings._replace(steps=steps).environment(num_envs, threads)
    replayer = Script(script, *environment.action_space.shape)
    bar = progress(desc="replaying", leave=False, total=dataset.metadata["total_steps"], unit="step", unit_scale=True)
    with contextlib.closing(environment), bar:
        for step in rollouts.play(environment, replayer, range(first_seed, first_seed + count), steps):
            bar.update(step.playing)
            for episode in step.finished:
                recorded = recorded_episodes.pop(episode.seed)
                if episode._replace(preset=recorded.preset).digest() != recorded.digest():
                    index = episode.seed - first_seed
                    difference = _difference(recorded, episode)
                    raise ValueError(f"dataset {dataset_id!r}: episode {index} differs from its replay: {difference}")
    return count


def _check_body_and_task(dataset_id: str, setup: Setup, body: Body | None, task: str | None) -> None:
    """Check that a dataset's setup has the expected body and task; None for any."""
    if body not in (None, setup.body):
        raise ValueError(f"dataset {dataset_id!r} holds episodes of {setup.body.name}, and not of {body.name}")
    if task is not None and registry.task_of(task) is not setup.kind:
        raise ValueError(f"dataset {dataset_id!r} holds episodes of the task {setup.task}, and not of {task}")


def _check_provenance(dataset: Dataset) -> None:
    """Check that a dataset was collected with the installed versions, the present task and the present model.

    Raises:
        ValueError: it was not.
    """
    setup = dataset.settings.setup
    stored = dataset.metadata["arc_suite"]
    present = setup.provenance()
    for package, version in present["versions"].items():
        if stored["versions"].get(package) != version:
            stored_version = f"{package} {checks.quote(stored['versions'].get(package))}"
            raise ValueError(f"dataset {dataset.id!r} was collected with {stored_version}; {version} is installed")
    task_version = present["task_version"]
    if stored.get("task_version") != task_version:
        stored_version = f"version {checks.quote(stored.get('task_version'))} of {setup.kind.name}"
        raise ValueError(f"dataset {dataset.id!r} was collected with {stored_version}; {task_version} is installed")
    if stored.get(PHYSICS, present[PHYSICS]) != present[PHYSICS]:
        raise ValueError(f"dataset {dataset.id!r} was collected with another model of {setup.body.name}")


def _difference(recorded: Episode, replayed: Episode) -> str:
    """Return a text on the first difference of two episodes: the array and the step."""
    if recorded.length != replayed.length:
        return f"{recorded.length} steps were recorded, {replayed.length} replayed"
    if recorded.terms.keys() != replayed.terms.keys():
        return f"terms {', '.join(recorded.terms)} were recorded, {', '.join(replayed.terms)} replayed"
    replayed_arrays = replayed.arrays()
    for name, recorded_array in recorded.arrays().items():
        pairs = zip(recorded_array, replayed_arrays[name], strict=True)
        for step, (recorded_row, replayed_row) in enumerate(pairs):
            if recorded_row.tobytes() != replayed_row.tobytes():
                return f"{name}[{step}]"
    raise AssertionError("expected a difference, as the digests of the episodes differ")
