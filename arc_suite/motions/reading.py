"""Motions from files of any kind: those of the suite, and files of other tools for a body."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import archives, checks, files, parsers
from arc_suite.motions import bvh_file, gltf_file, motion_files, tables
from arc_suite.motions.motion import Motion
from arc_suite.motions.skeletons import fit_skeleton
from arc_suite.robots.spec import Body

EXTENSIONS = (motion_files.EXTENSION, gltf_file.EXTENSION, bvh_file.EXTENSION, tables.EXTENSION)
OPTIONS = {  # extensions of the files that take an option
    "clip": (gltf_file.EXTENSION,),
    "loop": (gltf_file.EXTENSION, bvh_file.EXTENSION, tables.EXTENSION, motion_files.EXTENSION),
    "fps": (tables.EXTENSION, motion_files.EXTENSION),
}

_EXTENSIONS_FOR_BLENDER = (".blend", ".dae", ".fbx", ".gltf", ".usd", ".usda", ".usdc", ".usdz")

_MIN_EXCESS = np.radians(1.0)  # rad, beyond the range of a joint


class Options(NamedTuple):
    """What a file does not say.

    Attributes:
        clip: name of an animation of a file with several.
        loop: whether the motion repeats; None for what the file says, or else no loop.
        fps: frames a second of a table that does not say them.
    """

    clip: str | None = None
    loop: bool | None = None
    fps: float | None = None


NO_OPTIONS = Options()


def check_extension(path: str | os.PathLike[str]) -> str:
    """Return the extension of a file of a motion, in lower case.

    Raises:
        ValueError: the file has another extension, or none. The message names a program that converts it, if any does.
    """
    try:
        return checks.extension(path, EXTENSIONS)
    except ValueError as error:
        if Path(path).suffix.lower() not in _EXTENSIONS_FOR_BLENDER:
            raise
        raise ValueError(f"{error}; Blender reads it, and writes a .glb or a .bvh") from None


def holds_motion(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is one of `save`, which names its body and takes no options."""
    if Path(path).suffix.lower() != motion_files.EXTENSION:
        return False
    files.read_bytes(path, 0)
    with parsers.guard(f"{path}: no motion, or a damaged one"):
        return "format" in archives.read(path, motion_files.MAX_BYTES, only="format")


def read(
    path: str | os.PathLike[str], body: Body | None = None, options: Options = NO_OPTIONS
) -> tuple[Motion, list[str]]:
    """Read a motion, and return it with a line for each thing that was changed.

    Args:
        path: a file of `save`; `.glb` or `.bvh` with the bones of the body; a table of frames, `.csv` or `.npz`.
        body: the body that moves; a file of `save` needs none.
        options: what the file does not say.

    Raises:
        ValueError: an unknown kind of file, a damaged file, one of another body, or an option without effect; one line.
        OSError: the file cannot be read.
    """
    extension = check_extension(path)
    is_motion = holds_motion(path)
    for name, value in options._asdict().items():
        if value is not None and (is_motion or extension not in OPTIONS[name]):
            kind = "a motion" if is_motion else f"a {extension}"
            raise ValueError(f"{path}: {name}: it has no effect on {kind}; leave it out")
    if is_motion:
        return motion_files.load(path), []
    if body is None:
        raise ValueError(f"{path}: expected the body that moves")
    if options.fps is not None:
        checks.number("fps", options.fps, 1.0, 1000.0)
    return _READERS[extension](path, body, options)


def _read_skeleton(path: str | os.PathLike[str], body: Body, options: Options) -> tuple[Motion, list[str]]:
    if Path(path).suffix.lower() == gltf_file.EXTENSION:
        skeleton = gltf_file.read(path, options.clip)
    else:
        skeleton = bvh_file.read(path)
    if options.loop is not None:
        skeleton = skeleton._replace(loops=options.loop)
    with parsers.guard(f"{path}"):
        return fit_skeleton(body, skeleton)


def _read_csv(path: str | os.PathLike[str], body: Body, options: Options) -> tuple[Motion, list[str]]:
    return tables.read_csv(path, body, options.fps, bool(options.loop))


def _read_arrays(path: str | os.PathLike[str], body: Body, options: Options) -> tuple[Motion, list[str]]:
    with parsers.guard(f"{path}"):
        arrays = archives.read(path, motion_files.MAX_BYTES)
    return tables.read_arrays(path, arrays, body, options.fps, bool(options.loop))


_READERS: dict[str, Callable[[str | os.PathLike[str], Body, Options], tuple[Motion, list[str]]]] = {
    motion_files.EXTENSION: _read_arrays,
    gltf_file.EXTENSION: _read_skeleton,
    bvh_file.EXTENSION: _read_skeleton,
    tables.EXTENSION: _read_csv,
}


def describe_limits(motion: Motion, body: Body) -> list[str]:
    """Return a line for each joint of a body that a motion turns beyond its range."""
    lines = []
    low, high = np.radians([joint.range_deg for joint in body.joints]).T
    beyond = np.maximum(motion.angles - high, low - motion.angles).max(axis=0)
    for name, excess in zip(motion.joint_names, beyond.tolist(), strict=True):
        if excess > _MIN_EXCESS:
            lines.append(f"{name} turns {np.degrees(excess):.2g} degrees beyond its range")
    return lines
