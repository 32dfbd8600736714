"""Prior data of a run: the transitions of a dataset, in memory-mapped files.

The files are next to the folder of the run: runs with the same prior data share them.
"""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from arc_suite import checks, files, seed_ranges
from arc_suite.learning.agents.learner import Damaged, RunContext
from arc_suite.learning.agents.replay import Replay
from arc_suite.tasks import Task

_COUNT = "count.json"  # written last: without it the files are incomplete


def check_prior_is_named(prior: str | None, needed: bool) -> None:
    """Check that a run names prior data if its algorithm needs them, and else none.

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
    return _digest(_opened(prior).summaries())


def dataset_seeds(prior: str) -> range:
    """Return the seeds of the episodes of a dataset.

    Raises:
        ValueError: no such dataset, or one with episodes of evaluation.
    """
    found = _opened(prior).seeds
    if seed_ranges.common_seeds([found], seed_ranges.EVALUATION):
        least = seed_ranges.COLLECTING.start
        expected = f"expected seeds from {least} on, got {found.start}"
        raise ValueError(f"prior {checks.preview(prior)}: {expected}; collect it anew")
    return found


def open_replay(context: RunContext, task: Task) -> Replay:
    """Return the prior data of a run; its files are written from the dataset first, where they are missing.

    Observations are those of the task, which may leave out blocks of the dataset's.

    Raises:
        ValueError: no such dataset, one that is damaged, or of another body or task, or damaged files.
        OSError: the disk is full, or the like.
    """
    dataset = _opened(context.prior)
    found, setup = dataset.settings.setup, context.setup
    whole = setup.definition.sizes
    if found.body != setup.body:
        raise ValueError(f"prior {checks.preview(context.prior)}: of {found.body.name}, and not of {setup.body.name}")
    if found != setup:
        raise ValueError(f"prior {checks.preview(context.prior)}: of {found}, and not of {setup}")
    version = dataset.metadata["arc_suite"].get("task_version")
    if version != setup.kind.version:  # of other dynamics, rewards or observations
        there, here = checks.quote(version), f"{setup.kind.version} is installed"
        raise ValueError(f"prior {checks.preview(context.prior)}: of version {there} of {setup.kind.name}; {here}")
    summaries = dataset.summaries()
    size, joints = task.size, len(setup.body.joint_names)
    count = sum(summary["length"] for summary in summaries)
    if not count:
        raise ValueError(f"prior {checks.preview(context.prior)}: holds no episode")
    columns = np.concatenate([np.full(count, name in task.sizes) for name, count in whole.items()])
    left_out = "".join(f"-{name}" for name in whole if name not in task.sizes)
    folder = files.folder(Path(context.folder).parent / f"prior-{_digest(summaries)[:16]}{left_out}")
    with files.hold_lock(folder / ".lock"):
        if not (folder / _COUNT).exists():
            replay = Replay(folder, count, size, joints)
            for episode in dataset:
                last = episode.length - 1
                observations = episode.observations[:, columns]
                for step in range(episode.length):
                    here, there = observations[step], observations[step + 1]
                    ended = bool(episode.terminations[step])
                    replay.add(here, episode.actions[step], episode.rewards[step], ended, there, step == last)
            with files.writing_json(folder / _COUNT) as file:
                file.update(total=replay.total, ends=replay.ends, checksum=replay.checksum, dataset=context.prior)
    try:
        replay = Replay(folder, count, size, joints, mode="r")
        known = checks.mapping(_COUNT, files.read_json(folder / _COUNT))
        replay.restore(*(checks.integer(name, known[name], 0) for name in ("total", "ends", "checksum")))
        return replay
    except (Damaged, ValueError, KeyError, TypeError) as error:
        damage = f"{folder} is damaged: {checks.quote(error)}"
        raise ValueError(f"prior {checks.preview(context.prior)}: {damage}; delete it") from None


def _opened(prior: str):
    try:
        from arc_suite import data
    except ImportError as error:
        raise ValueError(f"prior: {error}") from None
    return data.open(prior)


def _digest(summaries: Sequence[Mapping]) -> str:
    return hashlib.sha256("".join(summary["sha256"] for summary in summaries).encode()).hexdigest()
