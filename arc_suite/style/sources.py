"""Sources of tracks: a policy that is recorded, a file in which they were saved, or a dataset that is replayed."""

import functools
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import checks, policies
from arc_suite.cpg.selection import check_preset_name
from arc_suite.envs.setup import Setup
from arc_suite.style.files import load
from arc_suite.style.tracks import Track, record

HELP = (
    f"{policies.HELP} Or a file of tracks that --save wrote (.npz), or the id of a Minari dataset, which is replayed."
)


class Source(NamedTuple):
    """A source of tracks.

    Attributes:
        label: its name in tables.
        setup: setup of the tracks that it has; None for a policy, which is recorded in any.
        recorders: takes a setup and seeds; returns functions that return a track each.
    """

    label: str
    setup: Setup | None
    recorders: Callable[[Setup, Sequence[int]], list[Callable[[], Track]]]


def source(name: str, preset: str | None = None) -> Source:
    """Open a source, of a kind that follows from its name.

    Args:
        name: a policy, see `policies.policy`, which is recorded once for every seed; a file of tracks,
            path/to/file.npz; or the id of a dataset, arc_suite/queen/walk/cpg-medium-v0. Of the latter two, at most as
            many tracks are taken as there are seeds.
        preset: preset of the demonstrator; None for the one that suits the task and the body.

    Raises:
        ValueError: an unknown name, a file that holds no tracks, or a dataset that cannot be opened.
            `recorders` raises it for a policy that does not fit the body and for tracks of another setup; its
            functions for an invalid action and for a replay with other rewards than those recorded.
        OSError: a file cannot be read.
    """
    if preset is not None:
        check_preset_name(preset)
    if policies.is_file(name):
        return _play_source(name, preset)
    if name.lower().endswith(".npz"):
        return _saved_source(name)
    if ":" in name:
        return _play_source(name, preset)
    if re.search(r"-v\d+$", name):
        return _replay_source(name)
    if "/" not in name:
        policies.refuse_other_files(name)
        policies.refuse_other_words(name, policies.POLICIES)
        checks.name(name, policies.POLICIES, "policy")
    elif not Path(name).exists():
        raise OSError(f"cannot read {name}: no such file; the id of a dataset ends in a version, such as {name}-v0")
    return _play_source(name, preset)


def _play_source(name: str, preset: str | None) -> Source:
    def recorders(setup, seeds):
        seeds = [checks.seed(seed) for seed in seeds]
        environment = setup.load()
        policy = policies.policy(name, setup.body, preset, task=environment.task.definition)
        return [functools.partial(record, environment, policy, seed) for seed in seeds]

    return Source(f"cpg {preset}" if name == "cpg" and preset else name, None, recorders)


def _saved_source(path: str) -> Source:
    tracks = load(path)

    def recorders(setup, seeds):
        _check_setup(path, tracks[0].setup, setup)
        return [functools.partial(lambda track: track, track) for track in tracks[: len(seeds)]]

    return Source(Path(path).name, tracks[0].setup, recorders)


def _replay_source(dataset_id: str) -> Source:
    try:
        from arc_suite import data
    except ImportError as error:
        raise ValueError(str(error)) from None
    dataset = data.open(dataset_id)

    def replay(environment, index):
        episode = dataset[index]
        track = record(environment, episode.playback(), episode.seed, episode.length)
        if not np.array_equal(track.rewards, episode.rewards):
            raise ValueError(
                f"dataset {dataset_id!r}: episode {index} earned {episode.total:.3f} and its replay "
                f"{track.rewards.sum():.3f}; arc-suite collect --verify={dataset_id} shows more"
            )
        return track

    def recorders(setup, seeds):
        _check_setup(dataset_id, dataset.settings.setup, setup)
        if not len(dataset):
            raise ValueError(f"dataset {dataset_id!r} has no episodes")
        environment = setup.load()
        return [functools.partial(replay, environment, index) for index in range(min(len(seeds), len(dataset)))]

    return Source(dataset_id, dataset.settings.setup, recorders)


def _check_setup(name: str, setup: Setup, expected: Setup) -> None:
    """Raise a ValueError of one line if tracks have another setup than the expected one."""
    if not setup.body.moves_like(expected.body):
        have_same_name = setup.body.name == expected.body.name
        body_name = "another body of that name" if have_same_name else setup.body.name
        raise ValueError(f"{name}: expected tracks of {expected.body.name}, got those of {body_name}")
    if not setup.moves_like(expected):
        raise ValueError(f"{name}: expected tracks of {expected}, got those of {setup}")
