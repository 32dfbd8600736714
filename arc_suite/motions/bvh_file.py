"""Reads skeletons from BVH files that others may have written, within limits.

The format is that of Biovision: a tree of joints with offsets, then a line of numbers for each frame. Joints are bound
without rotations.
"""

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import checks, files, parsers, rotations
from arc_suite.motions.motion import MAX_FRAMES, MAX_RATE, MIN_RATE
from arc_suite.motions.skeletons import FROM_Y_UP, LOOP_SUFFIX, Skeleton

EXTENSION = ".bvh"

_MAX_BYTES = 1 << 25
_MAX_JOINTS = 1024
_MAX_DEPTH = 256
_AXES = {"X": 0, "Y": 1, "Z": 2}
_MOTION = "MOTION"  # word behind the tree, before frames


class _Joint(NamedTuple):
    """A joint of the tree.

    Attributes:
        name: its name.
        parent: index of the joint above; -1 for the root.
        offset: (3,) from the joint above.
        channels: names of its numbers in a frame, such as Zrotation.
    """

    name: str
    parent: int
    offset: np.ndarray
    channels: list[str]


def read(path: str | os.PathLike[str]) -> Skeleton:
    """Read a file as a skeleton; y points up in most files.

    Raises:
        ValueError: a damaged file; one line.
        OSError: the file cannot be read.
    """
    text = files.read_utf8(path, _MAX_BYTES)
    with parsers.guard(f"{path}"):
        words = text.split()
        if _MOTION not in words:
            raise ValueError("expected HIERARCHY and MOTION of a BVH file")
        joints, words_of_frames = _read_joints(words)
        rate, numbers = _read_frames(words_of_frames, sum(len(joint.channels) for joint in joints))
        stem = Path(path).stem
        positions, turns = _pose(joints, numbers)
    bind_positions = np.zeros((len(joints), 3))
    for index, joint in enumerate(joints):
        above = bind_positions[joint.parent] if joint.parent >= 0 else 0.0
        bind_positions[index] = above + joint.offset
    return Skeleton(
        name=stem.removesuffix(LOOP_SUFFIX) or stem,
        frame_rate=rate,
        loops=stem.endswith(LOOP_SUFFIX),
        bones=tuple([joint.name for joint in joints]),
        bind_positions=bind_positions @ FROM_Y_UP.T,
        positions=positions @ FROM_Y_UP.T,
        turns=FROM_Y_UP @ turns @ FROM_Y_UP.T,
    )


def _read_joints(words: list[str]) -> tuple[list[_Joint], list[str]]:
    """Return the joints of a tree, those above first and without ends, and the words behind it and behind MOTION."""
    joints: list[_Joint] = []
    open_joints: list[int] = []  # indices of joints whose braces are open; -1 for an end
    pending: int | None = None  # the joint or end whose brace comes next
    index = 1 if words[:1] == ["HIERARCHY"] else 0
    while index < len(words) and words[index] != _MOTION:  # a bone may have this name, too
        word = words[index]
        if word in ("ROOT", "JOINT"):
            above = open_joints[-1] if open_joints else -1
            joints.append(_Joint(words[index + 1], above, np.zeros(3), []))
            pending = len(joints) - 1
            index += 2
        elif word == "End":
            pending = -1
            index += 2
        elif word == "{":
            if pending is None:
                raise ValueError("a brace opens without a joint")
            open_joints.append(pending)
            pending = None
            index += 1
        elif word == "}":
            open_joints.pop()
            index += 1
        elif word == "OFFSET":
            offset = np.array([_number(text) for text in words[index + 1 : index + 4]])
            if open_joints[-1] >= 0:
                joints[open_joints[-1]] = joints[open_joints[-1]]._replace(offset=offset)
            index += 4
        elif word == "CHANNELS":
            count = checks.integer("CHANNELS", int(words[index + 1][:3]), 0, 6)
            joints[open_joints[-1]].channels.extend(words[index + 2 : index + 2 + count])
            index += 2 + count
        else:
            raise ValueError(f"unknown word {checks.preview(word)}")
        if len(joints) > _MAX_JOINTS or len(open_joints) > _MAX_DEPTH:
            raise ValueError(f"expected at most {_MAX_JOINTS} joints, and {_MAX_DEPTH} within each other")
    if not joints:
        raise ValueError("expected joints, and there are none")
    return joints, words[index + 1 :]


def _read_frames(words: list[str], channels: int) -> tuple[float, np.ndarray]:
    """Return the frame rate, Hz, and the numbers (frames, channels)."""
    if words[0] != "Frames:" or words[2:4] != ["Frame", "Time:"]:
        raise ValueError("expected Frames: and Frame Time: after MOTION")
    frames = checks.integer("Frames", int(words[1][:12]), 2, MAX_FRAMES)
    frame_time = checks.number("Frame Time", _number(words[4]), 1.0 / MAX_RATE, 1.0 / MIN_RATE)
    numbers = words[5:]
    if len(numbers) != frames * channels:
        raise ValueError(f"expected {frames} frames of {channels} numbers, got {len(numbers)} numbers")
    values = np.array(numbers, float).reshape(frames, channels)
    if not np.isfinite(values).all():
        raise ValueError("expected finite numbers in frames")
    return 1.0 / frame_time, values


def _number(text: str) -> float:
    return checks.number("number", float(text))


def _pose(joints: list[_Joint], numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the positions (frames, joints, 3) and rotations (frames, joints, 3, 3) of joints in the world."""
    frames = len(numbers)
    positions = np.zeros((frames, len(joints), 3))
    turns = np.zeros((frames, len(joints), 3, 3))
    column = 0
    for index, joint in enumerate(joints):
        local_position = np.tile(joint.offset, (frames, 1))
        quaternion = np.tile(rotations.NO_TURN, (frames, 1))
        for channel in joint.channels:
            axis = _AXES[channel[:1]]
            if channel[1:] == "position":  # in place of the offset
                local_position[:, axis] = numbers[:, column]
            elif channel[1:] == "rotation":
                half_angle = np.radians(0.5 * numbers[:, column])
                turn = np.zeros((frames, 4))
                turn[:, 0] = np.cos(half_angle)
                turn[:, 1 + axis] = np.sin(half_angle)
                quaternion = rotations.product(quaternion, turn)
            else:
                raise ValueError(f"unknown channel {checks.preview(channel)}")
            column += 1
        local_turn = rotations.matrix(quaternion)
        if joint.parent < 0:
            positions[:, index] = local_position
            turns[:, index] = local_turn
        else:
            above = turns[:, joint.parent]
            positions[:, index] = positions[:, joint.parent] + (above @ local_position[..., None])[..., 0]
            turns[:, index] = above @ local_turn
    return positions, turns
