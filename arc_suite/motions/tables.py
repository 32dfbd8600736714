"""Reads motions from tables of frames, as other tools write them: `.csv` and `.npz`, columns by name of the joint.

Angles and the pose of the root are those of the robot's own file; the suite counts both from its standing pose.
"""

import os
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from arc_suite import checks, files, parsers, rotations
from arc_suite.models import source
from arc_suite.motions.motion import MAX_FRAMES, Motion, continue_signs, make, make_continuous
from arc_suite.motions.skeletons import CURE, close_loop
from arc_suite.robots.spec import Body

EXTENSION = ".csv"

_MAX_BYTES = 1 << 27
_MAX_COLUMNS = 1024
_POSITION = ("x", "y", "z")
_QUATERNION = ("qw", "qx", "qy", "qz")
_TIME = "time"
# Arrays of an .npz file: of mjlab's motions, root first among bodies.
_RATE_ARRAY = "fps"
_ANGLES_ARRAY = "joint_pos"
_NAMES_ARRAY = "joint_names"
_POSITIONS_ARRAY = "body_pos_w"
_QUATERNIONS_ARRAY = "body_quat_w"


def read_csv(path: str | os.PathLike[str], body: Body, rate: float | None, loops: bool) -> tuple[Motion, list[str]]:
    """Read a table of frames, and return it with a line for each thing that was changed.

    Columns are `x`, `y`, `z`, `qw`, `qx`, `qy`, `qz` of the root and the joints' names; with `time`, s, also at an
    uneven rate. Joints of an imported robot may have their names of its file. Without a line of names the columns are
    x, y, z, qx, qy, qz, qw and the joints in the body's order.

    Args:
        path: path of the file.
        body: the body that moves.
        rate: frames a second; None where the file says it.
        loops: whether the motion repeats.

    Raises:
        ValueError: a damaged file, columns of another body, or a rate besides that of the file; one line.
        OSError: the file cannot be read.
    """
    text = files.read_utf8(path, _MAX_BYTES)
    with parsers.guard(f"{path}"):
        columns = _read_columns(text, body)
        times = columns.pop(_TIME, None)
        table = _stack_columns(body, columns)
        if times is None:
            return _make(path, body, _choose_rate(rate, None), loops, table)
        return _make(path, body, _choose_rate(rate, _measure_rate(times)), loops, _sample_evenly(times, table))


def read_arrays(
    path: str | os.PathLike[str], arrays: dict[str, np.ndarray], body: Body, rate: float | None, loops: bool
) -> tuple[Motion, list[str]]:
    """Return the motion of arrays by name, and a line for each thing that was changed; see `read_csv`.

    The arrays are `joint_pos`, `body_pos_w` and `body_quat_w`, with `fps` and `joint_names` where the file says them.

    Raises:
        ValueError: arrays are missing, or do not fit the body, or a rate besides that of the file.
    """
    with parsers.guard(f"{path}"):
        names = body.joint_names
        if _NAMES_ARRAY in arrays:
            names = _name_as_body(body, [str(name) for name in arrays[_NAMES_ARRAY].ravel()])
        if _ANGLES_ARRAY not in arrays:
            if "policy" in arrays:
                raise ValueError("expected a motion, got a policy, which arc-suite render and arc-suite view show")
            raise ValueError(f"expected a motion, or arrays as mjlab has them, and there is no {_ANGLES_ARRAY}")
        angles = _numbers(arrays, _ANGLES_ARRAY, 2)
        if angles.shape[1] != len(names):
            raise ValueError(f"{_ANGLES_ARRAY}: expected {len(names)} joints, got {angles.shape[1]}")
        positions = _numbers(arrays, _POSITIONS_ARRAY, 3)[:, 0]
        quaternions = _numbers(arrays, _QUATERNIONS_ARRAY, 3)[:, 0]
        if positions.shape != (len(angles), 3) or quaternions.shape != (len(angles), 4):
            raise ValueError(f"expected {len(angles)} positions and quaternions of the root, w first")
        file_rate = None
        if _RATE_ARRAY in arrays:
            file_rate = checks.number(_RATE_ARRAY, np.asarray(arrays[_RATE_ARRAY], float).ravel()[0].item(), 1.0)
        columns = dict(zip(_POSITION, positions.T, strict=True))
        columns |= zip(_QUATERNION, quaternions.T, strict=True)
        columns |= zip(names, angles.T, strict=True)
        table = _stack_columns(body, columns)
        return _make(path, body, _choose_rate(rate, file_rate), loops, table)


def _read_columns(text: str, body: Body) -> dict[str, np.ndarray]:
    """Return the columns (frames,) of a table by name; without a line of names, those of `read_csv`."""
    lines = [line for line in text.splitlines() if line.strip()]
    if not 2 <= len(lines) <= MAX_FRAMES + 1:
        raise ValueError(f"expected from 2 to {MAX_FRAMES} frames, got {len(lines)} lines")
    first_words = [word.strip().strip('"') for word in lines[0].split(",")]
    if len(first_words) > _MAX_COLUMNS:
        raise ValueError(f"expected at most {_MAX_COLUMNS} columns, got {len(first_words)}")
    names = [*_POSITION, *_QUATERNION[1:], _QUATERNION[0], *body.joint_names]
    first_frame = 0  # index of its line
    if not _is_number(first_words[0]):
        names = _name_as_body(body, first_words)
        first_frame = 1
    frames = []
    for number, line in enumerate(lines[first_frame:], start=first_frame + 1):
        frames.append(_read_line(line, len(names), number))
    table = np.array(frames)
    columns = {name: table[:, index] for index, name in enumerate(names)}
    if len(columns) < len(names):
        raise ValueError("expected each column once")
    return columns


def _name_as_body(body: Body, names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of columns, with a body's names of joints in place of those in the file of an imported one."""
    joint_of_alias = {joint.alias: name for name, joint in zip(body.joint_names, body.joints, strict=True)}
    return tuple([name if name in body.joint_names else joint_of_alias.get(name, name) for name in names])


def _stack_columns(body: Body, columns: dict[str, np.ndarray]) -> np.ndarray:
    """Return columns (frames,) by name as a table (frames, 3 + 4 + joints): position, quaternion and joints."""
    expected_names = (*_POSITION, *_QUATERNION, *body.joint_names)
    _check_names(body, columns, expected_names)
    table = np.stack([columns[name] for name in expected_names], axis=-1)
    if not np.isfinite(table).all():
        frame = int(np.isfinite(table).all(axis=-1).argmin())
        raise ValueError(f"expected finite numbers in frame {frame}")
    return table


def _choose_rate(rate: float | None, file_rate: float | None) -> float:
    """Return the one rate, Hz, that is given: by the caller or by the file."""
    if rate is None and file_rate is None:
        raise ValueError("fps: expected frames a second, as the file does not say them")
    if rate is not None and file_rate is not None:
        raise ValueError(f"fps: the file says {file_rate:g} frames a second; leave fps out")
    return file_rate if rate is None else rate


def _make(
    path: str | os.PathLike[str], body: Body, rate: float, loops: bool, table: np.ndarray
) -> tuple[Motion, list[str]]:
    """Return the motion of a table at a rate, Hz, and a line for each thing that was changed; see `_stack_columns`."""
    positions = table[:, :3]
    quaternions = make_continuous(table[:, 3:7])
    angles = table[:, 7:]
    if body.source:
        positions, quaternions, angles = _count_from_standing_pose(body, positions, quaternions, angles)
    notes = []
    if loops:
        positions, quaternions, angles, notes = close_loop(body, positions, quaternions, angles)
    return make(body, Path(path).stem, rate, loops, positions, quaternions, angles), notes


def _check_names(body: Body, columns: Collection[str], expected_names: Sequence[str]) -> None:
    """Raise ValueError for a column that is missing, or one that the body does not have."""
    for name in expected_names:
        if name not in columns:
            hint = checks.hint(name, columns)
            raise ValueError(f"columns: expected those of {body.name}, and there is no {name}{hint}{CURE}")
    for name in columns:
        if name not in expected_names:
            hint = checks.hint(name, expected_names)
            raise ValueError(f"columns: {checks.preview(name)} is no joint of {body.name}{hint}")


def _count_from_standing_pose(
    body: Body, positions: np.ndarray, quaternions: np.ndarray, angles: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return poses of an imported body's own file as the suite has them: of the torso, and from the standing pose.

    Args:
        body: with a source.
        positions: (frames, 3) of the root body, m.
        quaternions: (frames, 4) of the root body.
        angles: (frames, joints) rad.
    """
    home = source.angles_at_home(body)
    home_angles = np.array([home[name] for name in body.joint_names])
    torso_quaternions = rotations.product(quaternions, rotations.inverse(source.file_orientation(body)))
    torso_in_root = source.torso_place(body)
    offsets = (rotations.matrix(torso_quaternions) @ torso_in_root[:, None])[..., 0]
    return positions + offsets, torso_quaternions, angles - home_angles


def _measure_rate(times: np.ndarray) -> float:
    """Return the mean rate of frames at times (frames,), s, in Hz."""
    if not (np.isfinite(times).all() and (np.diff(times) > 0.0).all()):
        raise ValueError(f"{_TIME}: expected numbers that grow")
    return float((len(times) - 1) / (times[-1] - times[0]))


def _sample_evenly(times: np.ndarray, table: np.ndarray) -> np.ndarray:
    """Return a table with frames at times (frames,), s, as one with as many frames at an even rate."""
    positions, quaternions, angles = np.split(table, (3, 7), axis=1)
    table = np.concatenate([positions, continue_signs(quaternions), angles], axis=1)
    even_times = np.linspace(times[0], times[-1], len(times))
    return np.stack([np.interp(even_times, times, column) for column in table.T], axis=-1)


def _read_line(line: str, columns: int, number: int) -> list[float]:
    words = line.split(",")
    if len(words) != columns:
        raise ValueError(f"line {number}: expected {columns} numbers, got {len(words)}")
    return [float(word) for word in words]


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _numbers(arrays: dict[str, np.ndarray], name: str, dimensions: int) -> np.ndarray:
    array = arrays[name]
    if array.ndim != dimensions or array.dtype.kind not in "fiu" or not 2 <= len(array) <= MAX_FRAMES:
        raise ValueError(f"{name}: expected {dimensions} axes of numbers, got {array.shape} of {array.dtype}")
    return array.astype(float)
