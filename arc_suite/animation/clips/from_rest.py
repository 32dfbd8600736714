"""Clips that connect to idle, and some to the walk: gestures, falls, jumps, turns, starts and stops."""

import bisect
import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import cast

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import bounds, on_ground, planting, root_motion, standing_legs, turning
from arc_suite.animation.clips.catalog import BOTH_ENDS, Acted, BlowClip, Passage, Turn, clip_of
from arc_suite.animation.clips.draft import Draft
from arc_suite.animation.clips.recorder import GaitRecording, Recorder, TransitionRecording
from arc_suite.animation.clips.recordings import Recording, stop_at_rest
from arc_suite.animation.clips.root_motion import ClipMotion, Pose
from arc_suite.models import sizing
from arc_suite.robots.spec import Body

_MAX_MEETING_SEAM = np.radians(20.0)  # rad: a stop or a start that is farther from walk or idle is left out
_FREE_SOLE_DEPTH = 0.025  # standing heights: soles that are deeper in the ground are raised
_BLOW_SIZES = tuple(0.15 * 1.4 ** (0.5 * step) for step in range(-4, 19))  # that are tried, sqrt(g h): 0.08 to 3.1
_BLOW_LEVERS = (0.5, 1.0, 2.0, 4.0)  # standing heights, that are tried: higher blows turn wide bodies more
_MAX_SWAYS = (0.4, 0.25, 0.12)  # standing heights, of a torso over feet that stay, which are tried
_RETURN_SLOWNESS = 9.0  # sqrt(h / g) that the way back to idle after a blow lasts longer by each rad of a joint
_MAX_RETURN_DURATION = 2.5  # sqrt(h / g), of this way
_SINK_BY_TILT = 0.5  # standing heights a rad: how far knees give under a torso that tilts over feet that stay
_MIN_TILT_APART = math.radians(30.0)  # of the torsos of bodies that lie in different poses
_MIN_BEND_APART = 0.3  # rad, mean of joints of bodies that lie in different poses
_RAISING_DURATION = 0.5  # sqrt(h / g), to either side of a sample in which a body is raised


def make_clips_from_rest(
    recorder: Recorder,
    transition: TransitionRecording,
    names: Sequence[str],
    walk: Draft | None,
    planted_walk: Draft | None,
    left_out,
) -> dict[str, Draft]:
    """Return the draft of idle, and those of the named clips that connect to it.

    Args:
        recorder: recorder of the body.
        transition: transition from which rest, stops and starts are taken.
        names: names of the clips.
        walk: clip that stops and starts connect to, with feet as in the physics.
        planted_walk: the same with planted feet; None if feet are not to be planted.
        left_out: takes the reasons why clips cannot be made.
    """
    body = recorder.body
    rest_pose = root_motion.stay_at_start(transition.gait.recording, transition.start, samples=1).pose(0)
    idle_clip = cast(Acted, clip_of("idle"))
    idle = _play(body, idle_clip, rest_pose).put_on_ground(body)
    drafts = {"idle": idle}
    for name in names:
        try:
            match clip_of(name):
                case Acted() as clip if name != "idle":
                    drafts[name] = _act(body, clip, idle.start)
                case Turn() as clip:
                    play = functools.partial(turning.turn, angle=math.radians(clip.angle))
                    drafts[name] = _act(body, Acted(play, BOTH_ENDS, steps=True), idle.start)
                case BlowClip() as clip:
                    drafts[name] = _take_blow(recorder, clip, idle.start)
                case Passage() as clip:
                    draft = _make_passage(body, clip, transition, idle.start, walk)
                    if planted_walk is not None:
                        draft = _plant_passage(body, clip, draft, idle.start, walk, planted_walk)
                    drafts[name] = draft
        except ValueError as error:
            left_out[name] = str(error)
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
    return Draft(motion, loops=clip.loops, stands=not clip.steps)


def _act(body: Body, clip: Acted, idle: Pose) -> Draft:
    """Return a motion from the first pose of idle, which meets it at its ends; see `Acted`."""
    draft = _play(body, clip, idle)
    motion = draft.motion
    for end in clip.ends:
        fading_samples = len(motion.joints) // 3
        landed_samples = 0
        if end == -1 and not clip.planted:
            fading_samples, landed_samples = _find_flight(body, motion) or (fading_samples, 0)
        motion = motion.end_with(idle, end, fading_samples, landed_samples)
    if not clip.planted:
        motion = _raise_out_of_ground(body, motion, clip.ends)
    return draft._replace(motion=motion)


def _find_likeness(name: str, drafts: Mapping[str, Draft]) -> str:
    """Return which clip ends as one does that is to end unlike it; "" if there is none."""
    clip = clip_of(name)
    if name not in drafts or not isinstance(clip, Acted):
        return ""
    pose = drafts[name].motion.pose(-1)
    up = rotations.matrix(pose.quaternion)[2]
    for unlike_name in clip.unlike:
        if unlike_name in drafts:
            unlike_pose = drafts[unlike_name].motion.pose(-1)
            tilt = math.acos(min(1.0, up @ rotations.matrix(unlike_pose.quaternion)[2]))
            bend = abs(pose.joints - unlike_pose.joints).mean()
            if tilt < _MIN_TILT_APART and bend < _MIN_BEND_APART:
                apart = f"{math.degrees(tilt):.0f} degrees of the torso and {bend:.2f} rad of joints apart"
                return f"it lies as in {unlike_name}: {apart}"
    return ""


def _take_blow(recorder: Recorder, clip: BlowClip, idle: Pose) -> Draft:
    """Return how a body takes the blow that suits it, from idle to idle.

    Of the lowest blows that tilt the torso enough, it is the strongest; if none does, that which tilts it most.

    Raises:
        ValueError: no blow suits it.
    """
    drafts: list[Draft] = []
    first_reason = ""
    for lever in _BLOW_LEVERS:
        draft, reason = _take_strongest_blow(recorder, clip, lever, idle)
        first_reason = first_reason or reason
        if draft is not None:
            drafts.append(draft)
        if drafts and (not clip.min_tilt or _measure_tilt(drafts[-1].motion.quaternions) >= clip.min_tilt):
            return drafts[-1]
    if not drafts:
        raise ValueError(first_reason)
    return max(drafts, key=lambda draft: _measure_tilt(draft.motion.quaternions))


def _take_strongest_blow(recorder: Recorder, clip: BlowClip, lever: float, idle: Pose) -> tuple[Draft | None, str]:
    """Return how a body takes the strongest blow of a lever, and why the weakest does not suit it, if it does not."""
    drafts = {}
    reasons = {}

    @functools.cache
    def record(size: float) -> GaitRecording:
        return _record_blow(recorder, clip, size, lever)

    def draw(size: float) -> None:
        drafts[size] = _draw_blow(recorder.body, clip, record(size), idle)

    def fails(attempt: Callable[[float], object], size: float) -> bool:
        try:
            attempt(size)
        except ValueError as error:
            reasons[size] = str(error)
        return size in reasons

    sizes = _BLOW_SIZES[: bisect.bisect_left(_BLOW_SIZES, True, key=functools.partial(fails, record))]
    if sizes and fails(draw, sizes[-1]):
        bisect.bisect_left(sizes[:-1], True, key=functools.partial(fails, draw))
    if drafts:
        return drafts[max(drafts)], ""
    size = min(reasons)
    return None, f"under a blow of {size:.2g} sqrt(g h), {reasons[size]}"


def _measure_tilt(quaternions: np.ndarray) -> float:
    """Return the largest angle, degrees, by which a torso tilts from its first pose; quaternions (samples, 4)."""
    up = rotations.matrix(quaternions)[:, :, 2]
    return math.degrees(np.arccos((up @ up[0]).clip(-1.0, 1.0)).max())


def _record_blow(recorder: Recorder, clip: BlowClip, size: float, lever: float) -> GaitRecording:
    """Return a recording of a body that takes a blow of a size and a lever.

    Raises:
        ValueError: the body falls or tilts too far.
    """
    gait = recorder.record_blow(clip.side, size, lever, clip.cycles)
    tilt = _measure_tilt(gait.recording.poses[:, 3:7])
    if tilt > clip.max_tilt:
        raise ValueError(f"its torso tilts by {tilt:.0f} degrees, more than {clip.max_tilt:.0f}")
    return gait._replace(recording=stop_at_rest(gait.recording))


def _draw_blow(body: Body, clip: BlowClip, gait: GaitRecording, idle: Pose) -> Draft:
    """Return a recording of a blow from idle to idle.

    Raises:
        ValueError: the body stands in another pose after it, the legs leave no room for it, or a bound breaks.
    """
    recording = gait.recording
    if clip.cycles:
        motion = _step_after_blow(body, recording, gait.cycle, idle)
    else:
        motion = _stand_on_feet(body, root_motion.stay_at_start(recording, 0, len(recording.poses) - 1), idle)
    reason = bounds.find_excess(body, clip, motion)
    if reason:
        raise ValueError(reason)
    return Draft(motion, loops=False, stands=not clip.cycles)


def _step_after_blow(body: Body, recording: Recording, cycle: float, idle: Pose) -> ClipMotion:
    """Return a blow and the steps after it from idle to idle; a ValueError if the body stands otherwise there."""
    fading_samples = len(recording.poses) // 3
    motion = root_motion.advance_straight(recording).meet(idle, -1, fading_samples).end_with(idle, 0, fading_samples)
    _check_seam(motion, "idle")
    motion = planting.plant_feet(body, _raise_out_of_ground(body, motion, BOTH_ENDS), cycle, loops=False)
    for end in BOTH_ENDS:
        motion = motion.end_with(idle, end, fading_samples)
    return motion


def _return_to(body: Body, first: Pose, motion: ClipMotion) -> ClipMotion:
    """Return how a body at rest at the end of a motion goes over to its first pose."""
    last = motion.pose(-1)
    seam = root_motion.seam_size(first.relative(last))
    duration = min(_RETURN_SLOWNESS * seam, _MAX_RETURN_DURATION)
    samples = max(1, _to_samples(body, duration, motion.time_step))
    return standing_legs.hold_pose(last, samples, motion.time_step).end_with(first, -1, samples)


def _stand_on_feet(body: Body, motion: ClipMotion, idle: Pose) -> ClipMotion:
    """Return how a torso moves from idle, as in a motion from its first pose, over feet that stay, and returns.

    It is as large as legs can follow.

    Raises:
        ValueError: the legs leave no room for it.
    """
    first = motion.pose(0)
    motion = motion.append(_return_to(body, first, motion))
    samples = round(motion.seconds / standing_legs.time_step(body))
    motion = motion.sample_at(np.linspace(0.0, motion.seconds, samples + 1))
    poses = standing_legs.poses_of_motion(body, first, motion)
    poses[:, standing_legs.HEIGHT] = poses[:, standing_legs.HEIGHT].clip(max=0.0)  # feet that stay hold it down
    poses[:, standing_legs.HEIGHT] -= _SINK_BY_TILT * np.linalg.norm(poses[:, 3:5], axis=-1)  # of roll and pitch
    return _follow_sway(body, idle, poses)._replace(time_step=motion.time_step)


def _follow_sway(body: Body, idle: Pose, poses: np.ndarray) -> ClipMotion:
    """Return a motion of the torso (samples, 6) with as much of its tilt as legs can follow; it may sway less.

    Raises:
        ValueError: the legs leave no room for it.
    """
    sway = np.linalg.norm(poses[:, 1:3], axis=-1).max()  # ahead and aside
    motions = []
    for max_sway in _MAX_SWAYS:
        share = max_sway / sway if sway > max_sway else 1.0
        swaying_poses = poses * (1.0, share, share, 1.0, 1.0, 1.0)
        try:
            motion, _ = standing_legs.follow_at_largest_size(body, idle, swaying_poses, action="sway")
        except ValueError as error:
            reason = error
        else:
            motions.append(motion)
    if not motions:
        raise reason
    return max(motions, key=lambda motion: round(_measure_tilt(motion.quaternions), 1))  # of equal ones the first


def _raise_out_of_ground(body: Body, motion: ClipMotion, fixed_ends: Sequence[int]) -> ClipMotion:
    """Return a motion whose torso is higher where, drawn, the body is in the ground, and smoothly so before and after.

    Contacts of the physics are soft, and recordings of policies have no contacts of what is drawn around colliders.

    Args:
        body: the spec.
        motion: any.
        fixed_ends: ends whose poses stay: 0, -1 or both.
    """
    height = body.torso.standing_height
    ground = on_ground.measure_ground(body, motion)
    depths = np.maximum(-ground.lowest_part, -ground.soles.min(axis=-1) - _FREE_SOLE_DEPTH * height)
    if depths.max() <= 0.0:
        return motion
    width = _to_samples(body, _RAISING_DURATION, motion.time_step)
    padded = np.pad(depths.clip(0.0), 2 * width, mode="edge")
    largest = np.lib.stride_tricks.sliding_window_view(padded, 2 * width + 1).max(axis=-1)
    weights = np.hanning(2 * width + 3)[1:-1]
    raises = np.convolve(largest, weights / weights.sum(), "valid")
    for end in fixed_ends:
        weights = root_motion.fade_out(1.0 - np.arange(len(raises)) / width)
        raises = raises * (weights if end == 0 else weights[::-1])
    return motion._replace(positions=motion.positions + raises[:, None] * (0.0, 0.0, 1.0))


def _to_samples(body: Body, duration: float, time_step: float) -> int:
    """Return the number of samples in a multiple of sqrt(h / g)."""
    return round(duration * sizing.time_unit(body) / time_step)


def _find_flight(body: Body, motion: ClipMotion) -> tuple[int, int] | None:
    """Return the samples of the last flight, and those after it; None if a foot is always near the ground."""
    in_air = on_ground.find_flight(body, motion)
    if not len(in_air):
        return None
    landing = int(in_air[-1])
    takeoff = int(in_air[np.flatnonzero(np.diff(in_air, prepend=-2) > 1)[-1]])
    return landing - takeoff + 1, len(motion.joints) - 1 - landing


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


def _make_passage(body: Body, clip: Passage, transition: TransitionRecording, idle: Pose, walk: Draft | None) -> Draft:
    """Return a stop or a start, which meets idle and the walk.

    Raises:
        ValueError: there is no walk, or its pose is far from that of the passage.
    """
    if walk is None:
        raise ValueError("there is no walk that it connects to")
    draft = cut_passage(body, clip, transition)
    idle_end, walk_end = _ends_of_passage(clip)
    motion = draft.motion.meet(idle, idle_end, draft.cycle_samples)
    motion = motion.meet(walk.start, walk_end, draft.cycle_samples)
    _check_seam(motion, "the walk or of idle")
    return draft._replace(motion=_raise_out_of_ground(body, motion, BOTH_ENDS))


def _check_seam(motion: ClipMotion, name: str) -> None:
    """Raise a ValueError if a pose that a motion was made to meet, that of a name, is far from its own."""
    if motion.seam > _MAX_MEETING_SEAM:
        seam = np.degrees(motion.seam)
        max_seam = np.degrees(_MAX_MEETING_SEAM)
        raise ValueError(f"its pose is {seam:.0f} degrees from that of {name}, more than {max_seam:.0f}")


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
