"""Where tracks come from: a policy that is recorded, or a file in which they were saved."""

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import arc_suite
from arc_suite import names, policies
from arc_suite.cpg import PRESETS
from arc_suite.spec import Body
from arc_suite.style.files import load
from arc_suite.style.tracks import Track, record

HELP = f"{policies.HELP} Or a file of tracks that --save wrote (.npz)."


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
        name: a policy, as `policies.policy` takes it, of which there is a track for every seed; or a
            file of tracks, path/to/file.npz, of which there are as many as seeds, or all.
        preset: of the demonstrator.

    Raises:
        ValueError: an unknown name, or a file that holds no tracks; one line. `takes` raises it too,
            of a policy that does not go with the body, and of tracks of another body.
        OSError: a file cannot be read; one line.
    """
    names.check(preset, PRESETS, "preset")
    if name.endswith(".npz"):
        return _saved(name)
    if ":" not in name:
        names.check(name, policies.POLICIES, "policy")
    return _played(name, preset)


def _played(name: str, preset: str) -> Source:
    def takes(body, seeds):
        environment, policy = arc_suite.load(body, "walk"), policies.policy(name, body, preset, seeds[0])
        return [functools.partial(record, environment, policy, seed) for seed in seeds]

    return Source(f"cpg {preset}" if name == "cpg" else name, None, takes)


def _saved(path: str) -> Source:
    tracks = load(path)
    body = tracks[0].body

    def takes(wanted, seeds):
        check_body(path, body, wanted)
        return [functools.partial(lambda track: track, track) for track in tracks[: len(seeds)]]

    return Source(Path(path).name, body, takes)


def check_body(name: str, body: Body, wanted: Body) -> None:
    """Raises a ValueError of one line, unless tracks are of the body that is wanted."""
    if body != wanted:
        other = "another body of that name" if body.name == wanted.name else body.name
        raise ValueError(f"{name}: expected tracks of {wanted.name}, got those of {other}")
