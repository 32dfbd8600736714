"""Prior data of a run: the transitions of a dataset, in files that are mapped into memory for reading alone.

The files lie beside the folder of the run, as runs with the same prior data share them.
"""

import hashlib
import json
from pathlib import Path

from arc_suite import files
from arc_suite.agents.learner import Stage
from arc_suite.agents.replay import Replay
from arc_suite.tasks import Task

_COUNT = "count.json"  # written last: files without it are not whole


def mapped(stage: Stage, task: Task) -> Replay:
    """Return the prior data of a run, read from the dataset where that has not been done before.

    Raises:
        ValueError: no such dataset, one that is damaged, or of another body or task; one line.
        OSError: the disk is full, or the like; one line.
    """
    try:
        from arc_suite import data
    except ImportError as error:
        raise ValueError(f"prior: {error}") from None
    dataset = data.open(stage.prior)
    settings = dataset.settings
    if settings.body != stage.body:
        raise ValueError(f"prior {stage.prior!r}: of {settings.body.name}, and not of {stage.body.name}")
    asked, found = ({"task": name, **dict(kwargs)} for name, kwargs in _tasks(stage, settings))
    if asked != found:
        raise ValueError(f"prior {stage.prior!r}: of the task {json.dumps(found)}, and not of {json.dumps(asked)}")
    summaries = dataset.summaries()
    size, joints = task.size, len(stage.body.joint_names)
    count = sum(summary["length"] for summary in summaries)
    if not count:
        raise ValueError(f"prior {stage.prior!r}: holds no episode")
    digest = hashlib.sha256("".join(summary["sha256"] for summary in summaries).encode()).hexdigest()
    folder = files.folder(Path(stage.folder).parent / f"prior-{digest[:16]}")
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


def _tasks(stage: Stage, settings):
    return (stage.task.rpartition(":")[2], stage.task_kwargs), (settings.task.rpartition(":")[2], settings.task_kwargs)
