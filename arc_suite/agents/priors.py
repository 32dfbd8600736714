"""Prior data of a run: the transitions of a dataset, in files that are mapped into memory for reading alone.

The files lie beside the folder of the run, as runs with the same prior data share them.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from arc_suite import files
from arc_suite.agents.learner import Stage
from arc_suite.agents.replay import Replay
from arc_suite.tasks import Task

_COUNT = "count.json"  # written last: files without it are not whole


def digest(prior: str) -> str:
    """Return the sha256 of all that a dataset holds.

    Raises:
        ValueError: no such dataset, or one that is damaged; one line.
    """
    return _digest(_opened(prior).summaries())


def mapped(stage: Stage, task: Task) -> Replay:
    """Return the prior data of a run, read from the dataset where that has not been done before.

    Raises:
        ValueError: no such dataset, one that is damaged, or of another body or task; one line.
        OSError: the disk is full, or the like; one line.
    """
    dataset = _opened(stage.prior)
    settings = dataset.settings.setup
    if settings.body != stage.body:
        raise ValueError(f"prior {stage.prior!r}: of {settings.body.name}, and not of {stage.body.name}")
    asked, found = (json.dumps({"task": name, **kwargs}) for name, kwargs in _tasks(stage, settings))
    if json.loads(asked) != json.loads(found):
        raise ValueError(f"prior {stage.prior!r}: of the task {found}, and not of {asked}")
    summaries = dataset.summaries()
    size, joints = task.size, len(stage.body.joint_names)
    count = sum(summary["length"] for summary in summaries)
    if not count:
        raise ValueError(f"prior {stage.prior!r}: holds no episode")
    folder = files.folder(Path(stage.folder).parent / f"prior-{_digest(summaries)[:16]}")
    with files.locked(folder):
        if not (folder / _COUNT).exists():
            replay = Replay(folder, count, size, joints)
            for episode in dataset:
                last = episode.length - 1
                for step in range(episode.length):
                    here, following = episode.observations[step], episode.observations[step + 1]
                    ended = bool(episode.terminations[step])
                    replay.add(here, episode.actions[step], episode.rewards[step], ended, following, step == last)
            with files.writing_json(folder / _COUNT) as file:
                file.update(total=replay.total, ends=replay.ends, dataset=stage.prior)
    replay = Replay(folder, count, size, joints, mode="r")
    known = json.loads((folder / _COUNT).read_text())
    replay.restore(known["total"], known["ends"])
    return replay


def _opened(prior: str):
    try:
        from arc_suite import data
    except ImportError as error:
        raise ValueError(f"prior: {error}") from None
    return data.open(prior)


def _digest(summaries: Sequence[Mapping]) -> str:
    return hashlib.sha256("".join(summary["sha256"] for summary in summaries).encode()).hexdigest()


def _tasks(stage: Stage, settings):
    return (stage.task.rpartition(":")[2], stage.task_kwargs), (settings.task.rpartition(":")[2], settings.task_kwargs)
