"""Prior data of a run: the transitions of a dataset, in memory-mapped files.

The files are next to the folder of the run: runs with the same prior data share them.
"""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from arc_suite import checks, files, parsers, seed_ranges
from arc_suite.learning.agents.learner import RunContext
from arc_suite.learning.agents.replay import Replay
from arc_suite.tasks import Task

_COUNTERS = "count.json"  # file of the counters of the transitions; written last: without it the files are incomplete


def check_prior(prior: str | None, needed: bool) -> None:
    """Check that a run names prior data if and only if its algorithm needs them.

    Raises:
        ValueError: they are missing, or not taken.
    """
    if (prior is not None) != needed:
        expected = "needs the id of a dataset, which arc-suite collect makes" if needed else "takes no prior data"
        raise ValueError(f"prior: the algorithm {expected}, got {checks.preview(prior)}")


def dataset_digest(prior: str) -> str:
    """Return the sha256 of the content of a dataset.

    Raises:
        ValueError: no such dataset, or one that is damaged.
    """
    return _digest_of_episodes(_open_dataset(prior).summaries())


def dataset_seeds(prior: str) -> range:
    """Return the seeds of the episodes of a dataset.

    Raises:
        ValueError: no such dataset, or one with episodes of evaluation.
    """
    seeds = _open_dataset(prior).seeds
    if seed_ranges.common_seeds([seeds], seed_ranges.EVALUATION):
        first_allowed = seed_ranges.COLLECTING.start
        expected = f"expected seeds from {first_allowed} on, got {seeds.start}"
        raise ValueError(f"prior {checks.preview(prior)}: {expected}; collect it anew")
    return seeds


def open_replay(context: RunContext, task: Task) -> Replay:
    """Return the prior data of a run; where its files are missing, they are written from the dataset.

    Observations are those of the task, which may leave out blocks of the dataset's.

    Raises:
        ValueError: no such dataset, one that is damaged, or of another body or task, or damaged files.
        OSError: the disk is full, or the like.
    """
    dataset = _open_dataset(context.prior)
    _check_dataset(dataset, context)
    summaries = dataset.summaries()
    count = sum(summary["length"] for summary in summaries)
    if not count:
        raise ValueError(f"prior {checks.preview(context.prior)}: holds no episode")
    size = task.size
    joints = len(context.setup.body.joint_names)
    dataset_blocks = context.setup.definition.sizes
    left_out = "".join(f"-{name}" for name in dataset_blocks if name not in task.sizes)
    folder_name = f"prior-{_digest_of_episodes(summaries)[:16]}{left_out}"
    folder = files.folder(Path(context.folder).parent / folder_name)
    with files.hold_lock(folder / ".lock"):
        if not (folder / _COUNTERS).exists():
            # Which numbers of the dataset's observations the task has, (size of these,) booleans.
            is_in_task = np.concatenate(
                [np.full(block_size, name in task.sizes) for name, block_size in dataset_blocks.items()]
            )
            replay = Replay(folder, count, size, joints)
            _add_episodes(replay, dataset, is_in_task)
            with files.writing_json(folder / _COUNTERS) as file:
                file.update(total=replay.total, ends=replay.ends, checksum=replay.checksum, dataset=context.prior)
    with parsers.guard(f"prior {checks.preview(context.prior)}: {folder} is damaged", cure="; delete it"):
        replay = Replay(folder, count, size, joints, mode="r")
        counters = checks.mapping(_COUNTERS, files.read_json(folder / _COUNTERS))
        replay.restore(
            total=checks.integer("total", counters["total"], 0),
            ends=checks.integer("ends", counters["ends"], 0),
            checksum=checks.integer("checksum", counters["checksum"], 0),
        )
        return replay


def _open_dataset(prior: str):
    try:
        from arc_suite import data
    except ImportError as error:
        raise ValueError(f"prior: {error}") from None
    return data.open(prior)


def _check_dataset(dataset, context: RunContext) -> None:
    """Raise ValueError for a dataset of another body, task, settings or version of the task than those of a run."""
    dataset_setup = dataset.settings.setup
    setup = context.setup
    prior = checks.preview(context.prior)
    if not dataset_setup.body.moves_like(setup.body):
        raise ValueError(f"prior {prior}: of {dataset_setup.body.name}, and not of {setup.body.name}")
    if dataset_setup.moves_like(setup) and not setup.moves_like(setup.learning()):
        names = ", ".join(setup.kind.training)
        raise ValueError(f"prior {prior}: expected other {names} than those of judges; collect it anew")
    if not dataset_setup.moves_like(setup.learning()):
        raise ValueError(f"prior {prior}: of {dataset_setup}, and not of {setup}")
    version = dataset.metadata["arc_suite"].get("task_version")
    if version != setup.kind.version:  # of other dynamics, rewards or observations
        installed = f"{setup.kind.version} is installed"
        raise ValueError(f"prior {prior}: of version {checks.quote(version)} of {setup.kind.name}; {installed}")


def _add_episodes(replay: Replay, dataset, is_in_task: np.ndarray) -> None:
    """Add the transitions of all episodes of a dataset, with the numbers of observations that the task has."""
    for episode in dataset:
        observations = episode.observations[:, is_in_task]
        for step in range(episode.length):
            replay.add(
                observations[step],
                episode.actions[step],
                episode.rewards[step],
                terminated=bool(episode.terminations[step]),
                next_observation=observations[step + 1],
                is_last=step == episode.length - 1,
            )


def _digest_of_episodes(summaries: Sequence[Mapping]) -> str:
    return hashlib.sha256("".join(summary["sha256"] for summary in summaries).encode()).hexdigest()
