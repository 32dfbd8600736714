"""Sources of tracks: a policy that is recorded, a file in which they were saved, or a dataset that is replayed."""

import functools
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from arc_suite import checks, policies, registry
from arc_suite.envs.dm import load as load_environment
from arc_suite.robots.spec import Body
from arc_suite.style.files import load
from arc_suite.style.tracks import Track, record

HELP = (
    f"{policies.HELP} Or a file of tracks that --save wrote (.npz), or the id of a Minari dataset, which is replayed."
)


class Stage(NamedTuple):
    """What is to be recorded: a body in a task.

    Attributes:
        body: that moves.
        task: name of the task.
        task_kwargs: its settings, as in `arc_suite.load`.
    """

    body: Body
    task: str = "walk"
    task_kwargs: Mapping[str, Any] = {}


class Source(NamedTuple):
    """A source of tracks.

    Attributes:
        label: by which it is shown.
        stage: of what it has tracks; None if it can play any.
        takes: of a stage and seeds, the functions that give its tracks, one for each.
    """

    label: str
    stage: Stage | None
    takes: Callable[[Stage, Sequence[int]], list[Callable[[], Track]]]


def source(name: str, preset: str = "medium") -> Source:
    """Open a source, told by its form.

    Args:
        name: a policy, as `policies.policy` takes it, of which there is a track for every seed, but for a
            policy's file by its name alone; a file
            of tracks, path/to/file.npz, or the id of a dataset, arc_suite/queen/walk/cpg-medium-v0,
            whose first episodes there are, as many as seeds, or all.
        preset: of the demonstrator.

    Raises:
        ValueError: an unknown name, a file that holds no tracks, or a dataset that cannot be opened;
            one line. `takes` raises it too, of a policy that does not go with the body, a seed that
            is none, and tracks of another body, task or settings; so do a policy whose action is none, and a
            replay whose rewards are not those recorded.
        OSError: a file cannot be read; one line.
    """
    checks.name(preset, policies.preset_names(), "preset")
    if policies.is_file(name):
        return _played(name, preset)
    if name.endswith(".npz"):
        return _saved(name)
    if ":" not in name and re.search(r"/|-v\d+$", name):
        return _replayed(name)
    if ":" not in name:
        checks.name(name, policies.POLICIES, "policy")
    return _played(name, preset)


def _played(name: str, preset: str) -> Source:
    def takes(stage, seeds):
        seeds = [checks.seed(seed) for seed in seeds]
        environment = load_environment(*stage)
        policy = policies.policy(name, stage.body, preset, task=environment.task.definition)
        return [functools.partial(record, environment, policy, seed) for seed in seeds]

    return Source(f"cpg {preset}" if name == "cpg" else name, None, takes)


def _saved(path: str) -> Source:
    tracks = load(path)
    first = tracks[0]
    stage = Stage(first.body, first.task, first.task_kwargs)
    same = (stage, first.progress.keys(), first.parameters is None)
    for track in tracks:
        if (Stage(track.body, track.task, track.task_kwargs), track.progress.keys(), track.parameters is None) != same:
            raise ValueError(f"{path}: expected tracks of one task with the same settings")
    try:
        for kind, name in (("task", stage.task), ("arena", str(stage.task_kwargs.get("arena", "flat")))):
            registry.imported(kind, name)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None

    def takes(wanted, seeds):
        _check_stage(path, stage, wanted)
        return [functools.partial(lambda track: track, track) for track in tracks[: len(seeds)]]

    return Source(Path(path).name, stage, takes)


def _replayed(dataset_id: str) -> Source:
    try:
        from arc_suite import data
    except ImportError as error:
        raise ValueError(str(error)) from None
    dataset = data.open(dataset_id)
    setup = dataset.settings.setup
    stage = Stage(setup.body, setup.task, setup.task_kwargs)

    def replay(environment, index):
        episode = dataset[index]
        track = record(environment, episode.playback(), episode.seed, episode.length)
        if not np.array_equal(track.rewards, episode.rewards):
            raise ValueError(
                f"dataset {dataset_id!r}: episode {index} earned {episode.total:.3f} and its replay "
                f"{track.rewards.sum():.3f}; arc-suite collect --verify={dataset_id} tells more"
            )
        return track

    def takes(wanted, seeds):
        _check_stage(dataset_id, stage, wanted)
        if not len(dataset):
            raise ValueError(f"dataset {dataset_id!r} has no episodes")
        environment = dataset.environment()
        return [functools.partial(replay, environment, index) for index in range(min(len(seeds), len(dataset)))]

    return Source(dataset_id, stage, takes)


def _check_stage(name: str, stage: Stage, wanted: Stage) -> None:
    """Raise a ValueError of one line, unless tracks are of the body, the task and the settings that are wanted."""
    if stage.body != wanted.body:
        other = "another body of that name" if stage.body.name == wanted.body.name else stage.body.name
        raise ValueError(f"{name}: expected tracks of {wanted.body.name}, got those of {other}")
    # The name alone tells tasks apart: what stands before it is the module that registers it.
    if stage.task.rpartition(":")[2] != wanted.task.rpartition(":")[2]:
        raise ValueError(f"{name}: expected tracks of the task {wanted.task}, got those of {stage.task}")
    there, asked = (checks.json_text("task_kwargs", each.task_kwargs) for each in (stage, wanted))
    if there != asked:
        raise ValueError(f"{name}: expected tracks with the settings {asked}, got those with {there}")
