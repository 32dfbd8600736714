"""Where tracks come from: a policy that is recorded, a file in which they were saved, or a dataset that is replayed."""

import functools
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import checks, policies, registry
from arc_suite.cpg import PRESETS
from arc_suite.robots.spec import Body
from arc_suite.style.files import load
from arc_suite.style.tracks import Track, record

HELP = (
    f"{policies.HELP} Or a file of tracks that --save wrote (.npz), or the id of a Minari dataset, which is replayed."
)


class Source(NamedTuple):
    """Something that gives tracks.

    Attributes:
        label: by which it is shown.
        body: whose tracks it has; None if it can walk any.
        takes: of a body and seeds, the functions that give its tracks, one for each.
    """

    label: str
    body: Body | None
    takes: Callable[[Body, Sequence[int]], list[Callable[[], Track]]]


def source(name: str, preset: str = "medium") -> Source:
    """Opens a source, told by its form.

    Args:
        name: a policy, as `policies.policy` takes it, of which there is a track for every seed; a file
            of tracks, path/to/file.npz, or the id of a dataset, arc_suite/queen/cpg-medium-v0, whose
            first episodes there are, as many as seeds, or all.
        preset: of the demonstrator.

    Raises:
        ValueError: an unknown name, a file that holds no tracks, or a dataset that cannot be opened;
            one line. `takes` raises it too, of a policy that does not go with the body, a seed that
            is none, and tracks of another body; so do a policy whose action is none, and a replay whose
            rewards are not those recorded.
        OSError: a file cannot be read; one line.
    """
    checks.name(preset, PRESETS, "preset")
    if name.endswith(".npz"):
        return _saved(name)
    if ":" not in name and re.search(r"/|-v\d+$", name):
        return _replayed(name)
    if ":" not in name:
        checks.name(name, policies.POLICIES, "policy")
    return _played(name, preset)


def _played(name: str, preset: str) -> Source:
    def play(environment, policy, seed):
        try:
            return record(environment, policy, seed)
        except ValueError as error:
            raise ValueError(f"policy {name!r}: episode of seed {seed}: {error}") from None

    def takes(body, seeds):
        seeds = [checks.seed(seed) for seed in seeds]
        environment, policy = registry.load(body, "walk"), policies.policy(name, body, preset, seeds[0])
        return [functools.partial(play, environment, policy, seed) for seed in seeds]

    return Source(f"cpg {preset}" if name == "cpg" else name, None, takes)


def _saved(path: str) -> Source:
    tracks = load(path)
    body = tracks[0].body

    def takes(wanted, seeds):
        _check_body(path, body, wanted)
        return [functools.partial(lambda track: track, track) for track in tracks[: len(seeds)]]

    return Source(Path(path).name, body, takes)


def _replayed(dataset_id: str) -> Source:
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
                f"{track.rewards.sum():.3f}; tools/collect.py --verify={dataset_id} tells more"
            )
        return track

    def takes(wanted, seeds):
        _check_body(dataset_id, dataset.body, wanted)
        if not len(dataset):
            raise ValueError(f"dataset {dataset_id!r} has no episodes")
        environment = dataset.environment()
        return [functools.partial(replay, environment, index) for index in range(min(len(seeds), len(dataset)))]

    return Source(dataset_id, dataset.body, takes)


def _check_body(name: str, body: Body, wanted: Body) -> None:
    """Raises a ValueError of one line, unless tracks are of the body that is wanted."""
    if body != wanted:
        other = "another body of that name" if body.name == wanted.name else body.name
        raise ValueError(f"{name}: expected tracks of {wanted.name}, got those of {other}")
