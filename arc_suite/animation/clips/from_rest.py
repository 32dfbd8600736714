"""Clips that connect to idle, and some to the walk: gestures, falls, jumps, turns, starts and stops."""

import functools
import math
from collections.abc import Mapping, Sequence
from typing import cast

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import on_ground, root_motion, turning
from arc_suite.animation.clips.blow_clips import record_blow
from arc_suite.animation.clips.catalog import BOTH_ENDS, Acted, BlowClip, Kind, Passage, Turn, clip_of
from arc_suite.animation.clips.draft import Draft
from arc_suite.animation.clips.passages import make_passage
from arc_suite.animation.clips.recorder import Recorder, TransitionRecording
from arc_suite.animation.clips.root_motion import ClipMotion, Pose
from arc_suite.robots.spec import Body

_MIN_TILT_APART = math.radians(30.0)  # of the torsos of bodies that lie in different poses
_MIN_BEND_APART = 0.3  # rad, mean of joints of bodies that lie in different poses


def make_clips_from_rest(
    recorder: Recorder,
    transition: TransitionRecording,
    names: Sequence[str],
    walk: Draft | None,
    planted_walk: Draft | None,
    left_out,
    straight: bool = False,
) -> dict[str, Draft]:
    """Return the draft of idle, and those of the named clips that connect to it.

    Args:
        recorder: recorder of the body.
        transition: transition from which rest, stops and starts are taken.
        names: names of the clips.
        walk: clip that stops and starts connect to, with feet as in the physics.
        planted_walk: the same with planted feet; None if feet are not to be planted.
        left_out: takes the reasons why clips cannot be made.
        straight: whether stops and starts go exactly ahead.
    """
    body = recorder.body
    rest_pose = root_motion.stay_at_start(transition.gait.recording, transition.start, samples=1).pose(0)
    idle_clip = cast(Acted, clip_of("idle"))
    idle = _play(body, idle_clip, rest_pose).put_on_ground(body)
    drafts = {"idle": idle}

    def make_draft(clip: Kind) -> Draft | None:
        """Return the draft of a clip; None for a clip that does not connect to idle."""
        match clip:
            case Acted():
                return _act(body, clip, idle.start)
            case Turn():
                play = functools.partial(turning.turn, angle=math.radians(clip.angle))
                return _act(body, Acted(play, BOTH_ENDS, steps=True), idle.start)
            case BlowClip():
                return record_blow(recorder, clip, idle.start)
            case Passage():
                return make_passage(body, clip, transition, idle.start, walk, planted_walk, straight)
            case _:
                return None

    for name in names:
        if name == "idle":
            continue
        try:
            draft = make_draft(clip_of(name))
        except ValueError as error:
            left_out[name] = str(error)
        else:
            if draft is not None:
                drafts[name] = draft
    for name in names:
        reason = _find_likeness(name, drafts)
        if reason:
            left_out[name] = reason
            del drafts[name]
    return drafts


def _play(body: Body, clip: Acted, rest: Pose) -> Draft:
    """Return a motion from the pose at rest.

    Raises:
        ValueError: the clip plays no motion, as one of another package may.
    """
    motion = clip.play(body, rest)
    if not isinstance(motion, ClipMotion):
        raise ValueError(f"expected a ClipMotion of its play, got {type(motion).__name__}")
    return Draft(motion, loops=clip.loops, stands=clip.planted and not clip.steps)


def _act(body: Body, clip: Acted, idle: Pose) -> Draft:
    """Return a motion from the first pose of idle, which meets it at its ends; see `Acted`."""
    draft = _play(body, clip, idle)
    motion = draft.motion
    for end in clip.ends:
        fading_samples = len(motion.joints) // 3
        landed_samples = 0
        if end == -1 and not clip.planted:
            fading_samples, landed_samples = _measure_last_flight(body, motion) or (fading_samples, 0)
        motion = motion.end_with(idle, end, fading_samples, landed_samples)
    if not clip.planted:
        motion = on_ground.raise_out_of_ground(body, motion, clip.ends)
    return draft._replace(motion=motion)


def _find_likeness(name: str, drafts: Mapping[str, Draft]) -> str:
    """Return which clip ends as one does that is to end unlike it; "" if there is none."""
    clip = clip_of(name)
    if name not in drafts or not isinstance(clip, Acted):
        return ""
    pose = drafts[name].motion.pose(-1)
    up = rotations.matrix(pose.quaternion)[2]
    for unlike_name in clip.unlike:
        if unlike_name not in drafts:
            continue
        unlike_pose = drafts[unlike_name].motion.pose(-1)
        tilt = math.acos(min(1.0, up @ rotations.matrix(unlike_pose.quaternion)[2]))
        bend = abs(pose.joints - unlike_pose.joints).mean()
        if tilt < _MIN_TILT_APART and bend < _MIN_BEND_APART:
            apart = f"{math.degrees(tilt):.0f} degrees of the torso and {bend:.2f} rad of joints apart"
            return f"it lies as in {unlike_name}: {apart}"
    return ""


def _measure_last_flight(body: Body, motion: ClipMotion) -> tuple[int, int] | None:
    """Return the numbers of samples in the last flight and after it; None if a foot is always near the ground."""
    in_air = on_ground.find_flight(body, motion)
    if not len(in_air):
        return None
    landing = int(in_air[-1])
    takeoff = int(in_air[np.flatnonzero(np.diff(in_air, prepend=-2) > 1)[-1]])
    return landing - takeoff + 1, len(motion.joints) - 1 - landing
