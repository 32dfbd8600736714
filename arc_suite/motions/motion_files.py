"""Saves and loads motions: an .npz file of plain arrays, without pickles, one for each field of `Motion`."""

import hashlib
import os
from typing import Any

import numpy as np

from arc_suite import archives, checks, files, parsers
from arc_suite.motions.motion import Motion, check_motion, check_name

EXTENSION = ".npz"
FORMAT = "arc_suite motion 1"  # another number for every change of what a file holds

MAX_BYTES = 1 << 28  # bytes of all arrays
_MAX_NAMES = 1024  # joints or legs
_MAX_FORMAT = 200  # characters of a format in an error

TEXTS = ("name", "body")
SCALARS = ("standing_height", "frame_rate", "rest_height")
NAMES = ("joint_names", "leg_names")
_BOOLEANS = ("planted",)


def save(motion: Motion, path: str | os.PathLike[str]) -> None:
    """Write a motion.

    Raises:
        ValueError: the file's extension is not `.npz`, or `load` would refuse the motion.
        OSError: the file cannot be written.
    """
    checks.extension(path, (EXTENSION,))
    check_motion(motion)
    with files.writing(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, format=FORMAT, **_arrays(motion))


def load(path: str | os.PathLike[str]) -> Motion:
    """Read a motion, bit-equal to the one that was saved.

    Raises:
        ValueError: the file holds no motion, one of another format, or is damaged.
        OSError: the file cannot be read.
    """
    files.read_bytes(path, 0)  # the file can be read; later errors mean that it is damaged
    with parsers.guard(f"{path}: no motion, or a damaged one"):
        return _read(archives.read(path, MAX_BYTES))


def digest(motion: Motion) -> str:
    """Return the hash of a motion's content: the same for equal values on every machine."""
    content = hashlib.sha256()
    for name, value in _arrays(motion).items():
        array = np.asarray(value)
        if array.dtype.kind == "U":
            data = "\0".join(array.ravel().tolist()).encode()
        else:
            data = np.ascontiguousarray(array.astype("?" if array.dtype.kind == "b" else "<f8")).tobytes()
        content.update(f"{name} {array.shape} {len(data)}\n".encode())
        content.update(data)
    return content.hexdigest()


def _arrays(motion: Motion) -> dict[str, Any]:
    return motion._asdict() | {name: np.array(getattr(motion, name), str) for name in NAMES}


def _read(arrays: dict[str, np.ndarray]) -> Motion:
    """Return the motion of arrays by name; a damaged file raises anything."""
    file_format = str(arrays.get("format", "no motion"))[:_MAX_FORMAT]
    if file_format != FORMAT:
        raise ValueError(f"expected {FORMAT!r}, got {file_format!r}")
    fields: dict[str, Any] = {}
    for name in Motion._fields:
        array = arrays[name]
        if name in TEXTS:
            fields[name] = read_names(name, array, 0)[0]
        elif name in NAMES:
            fields[name] = read_names(name, array, 1)
        elif name in SCALARS:
            fields[name] = checks.number(name, array.item() if array.shape == () else None)
        elif name == "loops":
            fields[name] = checks.boolean(name, array.item() if array.shape == () else None)
        else:
            kinds = "b" if name in _BOOLEANS else "fiu"
            if array.dtype.kind not in kinds:
                raise ValueError(f"{name}: expected {'booleans' if kinds == 'b' else 'numbers'}, got {array.dtype}")
            fields[name] = array.astype(bool if kinds == "b" else float)
    return check_motion(Motion(**fields))


def read_names(field: str, array: np.ndarray, dimensions: int) -> tuple[str, ...]:
    """Return the texts of an array; each is printable and not too long."""
    if array.dtype.kind != "U" or array.ndim != dimensions or array.size > _MAX_NAMES:
        raise ValueError(f"{field}: expected up to {_MAX_NAMES} texts, got {array.shape} of {array.dtype}")
    names = tuple(array.ravel().tolist())
    for name in names:
        check_name(field, name)
    if len(set(names)) < len(names):
        raise ValueError(f"{field}: expected each name once")
    return names
