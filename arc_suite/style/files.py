"""Saves and loads tracks: one .npz file of plain arrays, with the body and the versions that made them, and no pickles.

Track i's field positions is the array `i/positions`; what is a mapping or a tuple of names, such as
the reward's terms, has an array for each, `i/terms/forward`. Numbers are arrays without axes.
"""

import json
import os
from collections.abc import Mapping, Sequence

import numpy as np

from arc_suite import checks, versions
from arc_suite.robots.spec_files import body_from_json, body_to_json
from arc_suite.style.tracks import Track
from arc_suite.tasks import terms

FORMAT = "arc_suite tracks 2"  # another number for every change of what a file holds


def save(path: str | os.PathLike, tracks: Sequence[Track]) -> None:
    """Write tracks of one body.

    Raises:
        ValueError: no tracks, tracks of several bodies, or settings of a task that JSON cannot hold;
            one line.
        OSError: the file cannot be written.
    """
    bodies = {track.body for track in tracks}
    if len(bodies) != 1:
        raise ValueError(f"tracks: expected those of one body, got {sorted(body.name for body in bodies)}")
    arrays = {"format": FORMAT, "body": body_to_json(*bodies), "versions": json.dumps(versions.recorded())}
    for index, track in enumerate(tracks):
        fields = track._asdict() | {"task_kwargs": checks.json_text("task_kwargs", track.task_kwargs)}
        del fields["body"]
        arrays |= _flat({name: value for name, value in fields.items() if value is not None}, str(index))
    with open(path, "wb") as file:
        np.savez(file, **arrays)


def _flat(fields: Mapping, path: str) -> dict:
    """Return the values of a mapping and of the mappings and named tuples in it, by path."""
    values = {}
    for name, value in fields.items():
        value = value._asdict() if hasattr(value, "_asdict") else value
        below = f"{path}/{name}"
        values |= _flat(value, below) if isinstance(value, Mapping) else {below: value}
    return values


def load(path: str | os.PathLike) -> list[Track]:
    """Read tracks, equal to the bit to those that were saved.

    Raises:
        ValueError: the file holds no tracks, or those of another format, or is damaged; one line.
        OSError: the file cannot be read; one line.
    """
    try:
        file = open(path, "rb")  # noqa: SIM115
    except OSError as error:
        raise OSError(f"cannot read {path}: {error.strerror.lower()}") from None
    with file:
        try:
            with np.load(file, allow_pickle=False) as archive:
                arrays = dict(archive)
            if (found := str(arrays.get("format", "no tracks"))) == FORMAT:
                body = body_from_json(arrays["body"].item())
                count = 1 + max(int(name.split("/")[0]) for name in arrays if "/" in name)
                return [_track(body, arrays, index) for index in range(count)]
        except Exception as error:  # a damaged archive raises whatever its damage leads to
            raise ValueError(f"{path}: not a file of tracks, or a damaged one: {error}") from None
    raise ValueError(f"{path}: expected {FORMAT!r}, got {found!r}; record them anew")


def _track(body, arrays, index) -> Track:
    """Return the track of an index; arrays without axes become numbers, and those of `Track`'s tuples tuples."""
    fields = {}
    for name, array in arrays.items():
        top, *path = name.split("/")
        if top == str(index):
            mapping = fields
            for key in path[:-1]:
                mapping = mapping.setdefault(key, {})
            mapping[path[-1]] = array if array.ndim else array.item()
    if "parameters" in fields:
        low, high = fields["parameters"]["healthy_range"].tolist()
        fields["parameters"] = terms.Parameters(**fields["parameters"] | {"healthy_range": (low, high)})
    absent = {"phases": None, "parameters": None, "progress": {}}
    values = {"legs": tuple(fields["legs"].tolist()), "task_kwargs": json.loads(fields["task_kwargs"])}
    return Track(body=body, **absent | fields | values)
