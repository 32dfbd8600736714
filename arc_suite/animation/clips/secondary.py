"""Secondary motion of clips: bones of ornaments follow the torso on their springs.

A loop swings as if it had gone on forever, so that its ends meet. Other clips begin and end at rest, as idle does. A
start ends as the walk begins, and a stop begins so.
"""

from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.catalog import Difference, Kind, Passage, Showcase, WalkLoop
from arc_suite.animation.clips.root_motion import ClipMotion, fade_out
from arc_suite.models import swinging
from arc_suite.models.swinging import SwingingBone
from arc_suite.robots.spec import Body

_FADING_SHARE = 1.0 / 3.0  # of a clip, in which the difference to the pose at its end fades


class _Swings(NamedTuple):
    """How a bone swings in a loop.

    Attributes:
        turns: (samples, 3) in the torso's frame, rad, without a limit.
        begin: its state in the first sample.
    """

    turns: np.ndarray
    begin: swinging.State


def swing(body: Body, kind: Kind, motion: ClipMotion, walk: ClipMotion | None) -> np.ndarray:
    """Return how bones of ornaments are turned in the torso's frame, (samples, bones, 4).

    Args:
        body: the spec.
        kind: kind of the clip.
        motion: motion of the clip.
        walk: walk that starts and stops connect to.
    """
    match kind:
        case WalkLoop() | Showcase() | Difference():
            return swing_bones(body, motion, loops=True)
        case Passage(starts=True):
            return swing_bones(body, motion, loops=False, after=walk)
        case Passage():
            return swing_bones(body, motion, loops=False, before=walk)
        case _:
            return swing_bones(body, motion, loops=False)


def swing_bones(
    body: Body, motion: ClipMotion, loops: bool, before: ClipMotion | None = None, after: ClipMotion | None = None
) -> np.ndarray:
    """Return how bones of ornaments are turned in the torso's frame, (samples, bones, 4).

    Args:
        body: the spec.
        motion: any.
        loops: whether its last sample is its first one.
        before: loop that the motion comes from; None for rest.
        after: loop that it leads to; None for rest.
    """
    positions, orientations = _place_torso(motion)
    quaternions = []
    for bone in swinging.list_bones(body):
        turns = _swing_in_loop(bone, motion).turns if loops else _swing_once(bone, motion, before, after)
        quaternions.append(swinging.orient(bone, positions, orientations, turns))
    if not quaternions:
        return np.zeros((len(motion.joints), 0, 4))
    return np.stack(quaternions, axis=1)


def _swing_in_loop(bone: SwingingBone, motion: ClipMotion) -> _Swings:
    """Return how a bone swings in a loop, as if it had gone on forever."""
    positions, orientations = _place_torso(motion)
    anchor = swinging.hold_mass(bone, positions, orientations)
    turn = np.array(rotations.matrix(rotations.turn_about_z(np.array(rotations.NO_TURN), motion.root[-1, 2])))
    last_velocity = (anchor[-1] - anchor[-2]) / motion.time_step
    begin = swinging.rest(anchor[0])._replace(velocity=last_velocity @ turn)  # as it was a round before
    rings = _follow(bone, motion.time_step, anchor, begin)
    # What is left of the first z after a round, and what the round adds, are together the first z again.
    left = swinging.decay(bone, motion.seconds)
    first_ring = np.linalg.solve(np.eye(3) - left * turn.T, turn.T @ rings[-1])
    begin = begin._replace(ring=first_ring)
    rings = _follow(bone, motion.time_step, anchor, begin)
    turns = swinging.turn_vectors(bone, orientations, rings)
    turns[-1] = turns[0]
    return _Swings(turns, begin)


def _swing_once(
    bone: SwingingBone, motion: ClipMotion, before: ClipMotion | None, after: ClipMotion | None
) -> np.ndarray:
    """Return how a bone swings from rest or a loop to rest or a loop, (samples, 3)."""
    positions, orientations = _place_torso(motion)
    anchor = swinging.hold_mass(bone, positions, orientations)
    begin = swinging.rest(anchor[0])
    if before is not None:
        begin = _swing_in_loop(bone, before).begin._replace(anchor=anchor[0])
    end_turn = np.zeros(3) if after is None else _swing_in_loop(bone, after).turns[0]
    turns = swinging.turn_vectors(bone, orientations, _follow(bone, motion.time_step, anchor, begin))
    share = np.linspace(1.0, 0.0, len(turns)) / _FADING_SHARE
    return turns + fade_out(share)[:, None] * (end_turn - turns[-1])


def _follow(bone: SwingingBone, time_step: float, anchor: np.ndarray, state: swinging.State) -> np.ndarray:
    """Return z (samples, 3) of a mass that is anchor at places (samples, 3), from a state at the first of them."""
    rings = [state.ring]
    for place in anchor[1:]:
        state = swinging.advance(bone, state, place, time_step)
        rings.append(state.ring)
    return np.stack(rings)


def _place_torso(motion: ClipMotion) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (samples, 3) and matrices (samples, 3, 3) of the torso in the world."""
    poses = motion.poses()
    return poses[:, :3], rotations.matrix(poses[:, 3:7])
