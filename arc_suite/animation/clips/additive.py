"""Additive clips over other clips, as engines apply them: is every sole still on the ground?"""

from collections.abc import Mapping

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.catalog import Difference, WalkLoop, clip_of, is_additive
from arc_suite.animation.clips.foot_contacts import sole_heights
from arc_suite.animation.clips.root_motion import Motion, Pose
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compiled

_DEEPEST = 0.03  # standing heights, that a sole may be below the ground
_STARTS = 4  # phases of a loop in which a clip that is not in step with it begins


def find_bases(body: Body, name: str, motion: Mapping[str, Motion], loops: Mapping[str, bool], idle: Pose) -> list[str]:
    """Return the names of the loops over which an additive clip brings no sole deeper than 0.03 standing heights.

    Args:
        body: the spec.
        name: of the additive clip.
        motion: of each clip, by name, with frames of one rate.
        loops: whether each of them loops.
        idle: first pose of the idle clip, which engines subtract.
    """
    return [
        base
        for base in motion
        if loops[base] and not is_additive(base) and _depth(body, name, base, motion, idle) <= _DEEPEST
    ]


def add_clip(clip: Motion, idle: Pose, base: Motion, indices: np.ndarray) -> np.ndarray:
    """Return the poses (frames, 7 + joints) of a clip added to samples (frames,) of another, over a root at 0."""
    turns = rotations.product(clip.quaternions, idle.quaternion * (1.0, -1.0, -1.0, -1.0))
    positions = base.positions[indices] + clip.positions - idle.position
    joints = base.joints[indices] + clip.joints - idle.joints
    return np.concatenate([positions, rotations.product(turns, base.quaternions[indices]), joints], axis=-1)


def _depth(body: Body, name: str, base: str, motion: Mapping[str, Motion], idle: Pose) -> float:
    """Return how deep a sole is below the ground, standing heights."""
    clip, under = motion[name], motion[base]
    frames, around = np.arange(len(clip.joints)), len(under.joints) - 1
    if isinstance(clip_of(name), Difference) and isinstance(clip_of(base), WalkLoop):  # in step
        starts = np.round(frames * around / frames[-1]).astype(int)[None]
    else:
        starts = frames + np.arange(_STARTS)[:, None] * around // _STARTS
    poses = np.concatenate([add_clip(clip, idle, under, each % around) for each in starts])
    return -float(sole_heights(compiled(body), body, poses).min()) / body.torso.standing_height
