"""Verifies datasets: replays them and compares bit by bit."""

import contextlib
from collections.abc import Callable

from tqdm import tqdm

from arc_suite import checks, registry
from arc_suite.data import rollouts
from arc_suite.data.collection import NUM_ENVS
from arc_suite.data.dataset import open
from arc_suite.data.episodes import Episode
from arc_suite.policies import Script
from arc_suite.robots.spec import Body


def verify(
    dataset_id: str,
    body: Body | None = None,
    num_envs: int = NUM_ENVS,
    threads: int | None = None,
    progress: Callable = tqdm,
    task: str | None = None,
) -> int:
    """Replay every episode of a dataset from its seed and compare all arrays bit by bit.

    Args:
        dataset_id: Minari's.
        body: the expected body; None for any.
        num_envs: number of episodes that are replayed at a time.
        threads: on which to simulate; None for all cores.
        progress: makes a progress bar as `tqdm` does.
        task: name of the expected task; None for any.

    Returns:
        The number of episodes.

    Raises:
        ValueError: the dataset is missing, damaged, of another body, task, model or version, or needs
            a module that has not been imported, or its replay differs.
    """
    dataset = open(dataset_id)
    settings, was = dataset.settings, dataset.metadata["arc_suite"]
    if body not in (None, settings.setup.body):
        raise ValueError(f"dataset {dataset_id!r} holds episodes of {settings.setup.body.name}, and not of {body.name}")
    setup, now = settings.setup, settings.setup.provenance()
    if task is not None and registry.task_of(task) is not setup.kind:
        raise ValueError(f"dataset {dataset_id!r} holds episodes of the task {setup.task}, and not of {task}")
    for package, version in now["versions"].items():
        if was["versions"].get(package) != version:
            there = f"{package} {checks.quote(was['versions'].get(package))}"
            raise ValueError(f"dataset {dataset_id!r} was collected with {there}; {version} is installed")
    if was.get("task_version") != now["task_version"]:
        there = f"version {checks.quote(was.get('task_version'))} of {setup.kind.name}"
        raise ValueError(f"dataset {dataset_id!r} was collected with {there}; {now['task_version']} is installed")
    if was["model_sha256"] != now["model_sha256"]:
        raise ValueError(f"dataset {dataset_id!r} was collected with another model of {setup.body.name}")
    count, first = len(dataset), settings.seed
    if not count:
        return 0
    num_envs = min(num_envs, count)
    # One step more than any episode has: a replay that goes on shows, and the file alone says how much is allocated.
    steps = min(settings.steps, 1 + max(summary["length"] for summary in dataset.summaries()))
    recorded = {}

    def script(seed):
        episode = dataset[seed - first]
        if episode.seed != seed:
            raise ValueError(f"dataset {dataset_id!r}: episode {seed - first} has seed {episode.seed}, and not {seed}")
        recorded[seed] = episode
        return episode.actions

    environment = settings._replace(steps=steps).environment(num_envs, threads)
    replayer = Script(script, *environment.action_space.shape)
    bar = progress(desc="replaying", leave=False, total=dataset.metadata["total_steps"], unit="step", unit_scale=True)
    with contextlib.closing(environment), bar:
        for step in rollouts.play(environment, replayer, range(first, first + count), steps):
            bar.update(step.playing)
            for episode in step.finished:
                there = recorded.pop(episode.seed)
                if episode._replace(preset=there.preset).digest() != there.digest():
                    where = f"episode {episode.seed - first} differs from its replay: {_difference(there, episode)}"
                    raise ValueError(f"dataset {dataset_id!r}: {where}")
    return count


def _difference(recorded: Episode, replayed: Episode) -> str:
    """Return in words where episodes differ first: the array and the step."""
    if recorded.length != replayed.length:
        return f"{recorded.length} steps were recorded, {replayed.length} replayed"
    if recorded.terms.keys() != replayed.terms.keys():
        return f"terms {', '.join(recorded.terms)} were recorded, {', '.join(replayed.terms)} replayed"
    for (name, there), here in zip(recorded.arrays().items(), replayed.arrays().values(), strict=True):
        for step, (was, now) in enumerate(zip(there, here, strict=True)):
            if was.tobytes() != now.tobytes():
                return f"{name}[{step}]"
    raise AssertionError("episodes with different digests differ")
