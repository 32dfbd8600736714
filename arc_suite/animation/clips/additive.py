"""Additive clips over other clips, as engines apply them: loops over which no sole sinks into the ground."""

from collections.abc import Mapping

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.catalog import Difference, WalkLoop, clip_of, is_additive
from arc_suite.animation.clips.foot_contacts import sole_heights
from arc_suite.animation.clips.root_motion import ClipMotion, Pose
from arc_suite.robots.spec import Body

_MAX_SOLE_DEPTH = 0.03  # standing heights, that a sole may be below the ground
_TRIED_PHASES = 4  # of a base loop, in which a clip that is not in step with it begins


def find_bases(
    body: Body, name: str, motion_of_clip: Mapping[str, ClipMotion], loops: Mapping[str, bool], idle: Pose
) -> list[str]:
    """Return the names of the loops over which an additive clip brings no sole deeper than 0.03 standing heights.

    Args:
        body: the spec.
        name: name of the additive clip.
        motion_of_clip: motions by name, with frames of one rate.
        loops: whether each clip loops, by name.
        idle: first pose of the idle clip, which engines subtract from additive clips.
    """
    bases = []
    for base in motion_of_clip:
        if loops[base] and not is_additive(base):
            depth = _measure_sole_depth(body, name, base, motion_of_clip, idle)
            if depth <= _MAX_SOLE_DEPTH:
                bases.append(base)
    return bases


def _measure_sole_depth(
    body: Body, name: str, base: str, motion_of_clip: Mapping[str, ClipMotion], idle: Pose
) -> float:
    """Return how deep a sole is below the ground, standing heights, while an additive clip plays over a base loop."""
    motion = motion_of_clip[name]
    base_motion = motion_of_clip[base]
    frames = np.arange(len(motion.joints))
    base_frames_in_loop = len(base_motion.joints) - 1
    in_step = isinstance(clip_of(name), Difference) and isinstance(clip_of(base), WalkLoop)
    if in_step:
        tried_base_frames = np.round(frames * base_frames_in_loop / frames[-1]).astype(int)[None]
    else:
        first_frames = np.arange(_TRIED_PHASES) * base_frames_in_loop // _TRIED_PHASES
        tried_base_frames = frames + first_frames[:, None]
    poses = [
        add_clip(motion, idle, base_motion, base_frames % base_frames_in_loop) for base_frames in tried_base_frames
    ]
    lowest = float(sole_heights(body, np.concatenate(poses)).min())  # m
    return -lowest / body.torso.standing_height


def add_clip(motion: ClipMotion, idle: Pose, base_motion: ClipMotion, base_frames: np.ndarray) -> np.ndarray:
    """Return the poses (frames, 7 + joints) of an additive clip over a base, with a root at 0.

    Args:
        motion: motion of the additive clip.
        idle: pose that is subtracted from it.
        base_motion: motion of the base.
        base_frames: (frames,) the frame of the base for each frame of the additive clip.
    """
    turns = rotations.product(motion.quaternions, rotations.inverse(idle.quaternion))
    positions = base_motion.positions[base_frames] + motion.positions - idle.position
    quaternions = rotations.product(turns, base_motion.quaternions[base_frames])
    joints = base_motion.joints[base_frames] + motion.joints - idle.joints
    return np.concatenate([positions, quaternions, joints], axis=-1)
