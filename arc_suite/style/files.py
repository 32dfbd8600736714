"""Saves and loads tracks of one setup: an .npz file of plain arrays, with the versions that made them, and no pickles.

The array `setup` is the setup's JSON. The field positions of track i is the array `i/positions`; a mapping, such as
the reward's terms, has an array for each entry, `i/terms/forward`. Numbers are arrays without axes.
"""

import json
import os
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from arc_suite import archives, checks, files, parsers, registry, versions
from arc_suite.envs.setup import Setup
from arc_suite.robots.spec import Body
from arc_suite.style.tracks import UNTIMED, Track, only_setup
from arc_suite.tasks.parameters import Parameters

FORMAT = "arc_suite tracks 4"  # another number for every change of what a file holds

_MAX_BYTES = 1 << 30  # bytes of all arrays

# Types of single values, and shapes of arrays.
_FIELDS = {
    "seed": int,
    **dict.fromkeys(("time_step", "target_velocity", "mass", "gravity"), float),
    **dict.fromkeys(("positions", "linear_velocities", "angular_velocities"), ("steps", 3)),
    "quaternions": ("steps", 4),
    **dict.fromkeys(("joint_angles", "joint_velocities", "actions", "torques"), ("steps", "joints")),
    **dict.fromkeys(("torso_heights", "phases", "duty_factors"), ("steps",)),
    **dict.fromkeys(("foot_positions", "foot_velocities"), ("steps", "feet", 3)),
    **dict.fromkeys(("foot_heights", "leg_phases", "contacts"), ("steps", "feet")),
}
_PARAMETERS = dict.fromkeys(Parameters._fields, float) | {"phase_offsets": ("feet",)}
_KINDS = {"contacts": "b"}  # of dtype; others are numbers


class _OtherFormat(ValueError):
    """A file of another format."""


def save(path: str | os.PathLike[str], tracks: Iterable[Track]) -> None:
    """Write tracks of one setup, atomically.

    Raises:
        ValueError: no tracks, or tracks of several setups.
        OSError: the file cannot be written.
    """
    tracks = list(tracks)
    setup = only_setup(tracks)
    arrays: dict[str, Any] = {
        "format": FORMAT,
        "setup": json.dumps(setup.to_dict()),
        "versions": json.dumps(versions.dependency_versions()),
    }
    for index, track in enumerate(tracks):
        fields = track._asdict()
        del fields["setup"]
        arrays |= _flatten({name: value for name, value in fields.items() if value is not None}, str(index))
    with files.writing(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, **arrays)


def _flatten(fields: Mapping, path: str) -> dict:
    """Return the values of a mapping and of the mappings and named tuples in it, by path."""
    values = {}
    for name, value in fields.items():
        value_path = f"{path}/{name}"
        if hasattr(value, "_asdict"):
            value = value._asdict()
        if isinstance(value, Mapping):
            values |= _flatten(value, value_path)
        else:
            values[value_path] = value
    return values


def load(path: str | os.PathLike[str]) -> list[Track]:
    """Read tracks, bit-equal to those that were saved; nothing that the file names is imported.

    Raises:
        ValueError: the file holds no tracks, or those of another format, is damaged, or names a module that has not
            been imported.
        OSError: the file cannot be read.
    """
    files.read_bytes(path, 0)  # the file can be read; later errors mean that it is damaged
    try:
        with parsers.guard(
            f"{path}: not a file of tracks, or a damaged one", passes=(registry.NotImported, _OtherFormat)
        ):
            return _read(path)
    except registry.NotImported as error:
        raise ValueError(f"{path}: {error}") from None


def _read(path: str | os.PathLike[str]) -> list[Track]:
    """Return the tracks of a file; a damaged one raises anything."""
    arrays = archives.read(path, _MAX_BYTES)
    file_format = str(arrays.get("format", "no tracks"))[:80]
    if file_format != FORMAT:
        raise _OtherFormat(f"{path}: expected {FORMAT!r}, got {file_format!r}; record them anew")
    setup = Setup.from_dict(json.loads(_check_value("setup", arrays["setup"], str)))
    arrays_by_index: dict[str, dict[str, np.ndarray]] = {}
    for name, array in arrays.items():
        index, slash, path_in_track = name.partition("/")
        if slash:
            arrays_by_index.setdefault(index, {})[path_in_track] = array
    tracks = [_track(setup, arrays_by_index[str(index)]) for index in range(len(arrays_by_index))]
    if any(_names(track) != _names(tracks[0]) for track in tracks):
        raise ValueError("expected the same progress and gait in all tracks")
    return tracks


def _names(track: Track) -> tuple:
    return track.terms.keys(), track.progress.keys(), track.parameters is None


def _track(setup: Setup, arrays: Mapping[str, np.ndarray]) -> Track:
    """Return the track of arrays by their paths in it; arrays without axes become numbers."""
    fields: dict[str, Any] = {}
    for name, array in arrays.items():
        field, slash, key = name.partition("/")
        value = array if array.ndim > 0 else array.item()
        if slash:
            fields.setdefault(field, {})[key] = value
        else:
            fields[field] = value
    _check(fields, setup.body)
    if "parameters" in fields:
        fields["parameters"] = Parameters(**fields["parameters"])
    defaults = {**UNTIMED, "parameters": None, "progress": {}}
    return Track(setup=setup, **defaults | fields)


def _check(fields: Mapping[str, Any], body: Body) -> None:
    """Raise a ValueError of one line, unless values are of the kinds and shapes that a track of the body has."""
    lengths = {"steps": len(fields["positions"]), "joints": len(body.joint_names), "feet": len(body.legs)}
    if not lengths["steps"]:
        raise ValueError("positions: expected at least one row")
    values = {name: value for name, value in fields.items() if name not in ("terms", "weights", "progress")}
    parameters = values.pop("parameters", None)
    for name, value in values.items():
        _check_value(name, value, _FIELDS[name], lengths)
    for name, value in fields["terms"].items():
        _check_value(f"terms/{name}", value, ("steps",), lengths)
    for name, value in (fields["weights"] | fields.get("progress", {})).items():
        _check_value(name, value, float)
    unknown_weights = sorted(fields["weights"].keys() - fields["terms"].keys())
    if unknown_weights:
        raise ValueError(f"weights: expected those of terms, got {unknown_weights}")
    if parameters is not None:
        for name, value in parameters.items():
            is_of_joints = name == "default_angles" and np.ndim(value) == 1
            expected = ("joints",) if is_of_joints else _PARAMETERS[name]
            _check_value(f"parameters/{name}", value, expected, lengths)
        for name in UNTIMED:
            if name not in fields:
                raise ValueError(f"{name}: missing, and there are parameters of a gait")
    for name in ("time_step", "mass", "gravity"):
        checks.number(name, fields[name], 1e-12)
    checks.seed(fields["seed"])


def _check_value(name: str, value, expected, lengths: Mapping[str, int] | None = None):
    """Return a value if it has the expected type, or the expected shape, a tuple of names of lengths and numbers."""
    if isinstance(expected, type):
        if isinstance(value, np.ndarray) and value.ndim == 0:
            value = value.item()
        types = (int, float) if expected is float else expected
        if isinstance(value, bool) or not isinstance(value, types):
            raise ValueError(f"{name}: expected one {expected.__name__}")
        return value
    shape = tuple(lengths.get(length, length) for length in expected)
    array = np.asarray(value)
    if array.shape != shape or array.dtype.kind not in _KINDS.get(name, "bif"):
        raise ValueError(f"{name}: expected {shape} numbers, got {array.shape} of {array.dtype}")
    if array.dtype.kind == "f" and not np.isfinite(array).all():
        raise ValueError(f"{name}: expected finite numbers")
    return value
