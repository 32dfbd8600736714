"""Passages between idle and the walk: starts and stops, cut from a recording, which meet both in pose."""

import numpy as np

from arc_suite.animation.clips import on_ground, root_motion
from arc_suite.animation.clips.catalog import BOTH_ENDS, Passage
from arc_suite.animation.clips.draft import Draft
from arc_suite.animation.clips.recorder import TransitionRecording
from arc_suite.animation.clips.root_motion import ClipMotion, Pose
from arc_suite.motions.ground_poses import relative_pose, twist_to
from arc_suite.robots.spec import Body

_MAX_MEETING_SEAM = np.radians(20.0)  # rad: a stop or a start that is farther from walk or idle is left out


def cut_passage(body: Body, clip: Passage, transition: TransitionRecording) -> Draft:
    """Return a stop or a start as it was recorded, with soles in stance on the ground."""
    gait = transition.gait
    cycle_samples = round(gait.cycle / gait.recording.time_step)
    samples = clip.cycles * cycle_samples
    if clip.starts:
        first = transition.start
        samples -= transition.delay  # so that it ends at a scheduled touchdown
    else:
        first = transition.stop
    motion = root_motion.follow_mean_path(gait.recording, first, samples, window=cycle_samples)
    return Draft(motion, clip.cycles, gait.cycle, loops=False).put_on_ground(body)


def make_passage(
    body: Body,
    clip: Passage,
    transition: TransitionRecording,
    idle: Pose,
    walk: Draft | None,
    planted_walk: Draft | None,
    straight: bool = False,
) -> Draft:
    """Return a stop or a start, which meets idle and the walk.

    Args:
        body: the spec.
        clip: the stop or the start.
        transition: recording from which it is cut.
        idle: first pose of idle.
        walk: with feet as in the physics.
        planted_walk: the same with planted feet; None if feet are not to be planted.
        straight: whether the root goes exactly ahead.

    Raises:
        ValueError: there is no walk, or its pose is far from that of the passage.
    """
    if walk is None:
        raise ValueError("there is no walk that it connects to")
    draft = cut_passage(body, clip, transition)
    idle_end, walk_end = _ends_of_passage(clip)
    motion = draft.motion.meet(idle, idle_end, draft.cycle_samples)
    motion = motion.meet(walk.start, walk_end, draft.cycle_samples)
    check_seam(motion, "the walk or of idle")
    if straight:
        motion = _straighten(motion)
    draft = draft._replace(motion=on_ground.raise_out_of_ground(body, motion, BOTH_ENDS))
    if planted_walk is None:
        return draft
    return _plant_passage(body, clip, draft, idle, walk, planted_walk)


def _straighten(motion: ClipMotion) -> ClipMotion:
    """Return a motion whose root goes exactly ahead, as far as it went ahead; poses in the root's frame stay."""
    steps = relative_pose(motion.root[:-1], motion.root[1:])
    root = np.zeros_like(motion.root)
    root[1:, 0] = np.cumsum(steps[:, 0])
    return motion._replace(root=root, twist=twist_to(root[-1]) / motion.seconds)


def _plant_passage(body: Body, clip: Passage, draft: Draft, idle: Pose, walk: Draft, planted_walk: Draft) -> Draft:
    """Return a stop or a start with planted feet, which meets idle, and the planted walk in pose and velocity.

    The passage is planted together with the walk, so that a foot whose stance goes on in the walk stays in one place.

    Args:
        body: the spec.
        clip: the stop or the start.
        draft: its draft with feet as in the physics, which meets idle and the walk.
        idle: first pose of idle.
        walk: with feet as in the physics.
        planted_walk: the same with planted feet.
    """
    samples = len(draft.motion.joints)
    if clip.starts:
        motion_with_walk = draft.motion.append(walk.motion)
        passage_samples = slice(None, samples)
    else:
        motion_with_walk = walk.motion.append(draft.motion)
        passage_samples = slice(-samples, None)
    planted_with_walk = draft._replace(motion=motion_with_walk).plant_feet(body).motion
    idle_end, walk_end = _ends_of_passage(clip)
    motion = draft.motion._replace(joints=planted_with_walk.joints[passage_samples])
    motion = motion.end_with(idle, idle_end, draft.cycle_samples)
    motion = motion.end_with(planted_walk.start, walk_end, draft.cycle_samples)
    return draft._replace(motion=motion)


def _ends_of_passage(clip: Passage) -> tuple[int, int]:
    """Return the end, 0 or -1, at which a passage meets idle, and that at which it meets the walk."""
    if clip.starts:
        return 0, -1
    return -1, 0


def check_seam(motion: ClipMotion, name: str) -> None:
    """Raise a ValueError if a pose that a motion was made to meet, that of a name, is far from its own."""
    if motion.seam > _MAX_MEETING_SEAM:
        seam = np.degrees(motion.seam)
        max_seam = np.degrees(_MAX_MEETING_SEAM)
        raise ValueError(f"its pose is {seam:.0f} degrees from that of {name}, more than {max_seam:.0f}")
