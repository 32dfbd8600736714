"""Clips of blows: a body at rest takes the strongest blow that suits it, and comes to rest, with steps or without."""

import bisect
import math
from collections.abc import Callable, Sequence

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import bounds, on_ground, planting, root_motion, standing_legs
from arc_suite.animation.clips.catalog import BOTH_ENDS, BlowClip
from arc_suite.animation.clips.draft import Draft
from arc_suite.animation.clips.passages import check_seam
from arc_suite.animation.clips.recorder import GaitRecording, Recorder
from arc_suite.animation.clips.recordings import Recording, stop_at_rest
from arc_suite.animation.clips.root_motion import ClipMotion, Pose
from arc_suite.models.standing import time_unit
from arc_suite.robots.spec import Body

_SIZES = tuple(0.15 * 1.4 ** (0.5 * step) for step in range(-4, 19))  # that are tried, sqrt(g h): 0.08 to 3.1
_LEVERS = (0.5, 1.0, 2.0, 4.0)  # standing heights, that are tried: higher blows turn wide bodies more
_MAX_SWAYS = (0.4, 0.25, 0.12)  # standing heights, of a torso over feet that stay, which are tried
_RETURN_SLOWNESS = 9.0  # sqrt(h / g) that the way back to idle after a blow lasts longer by each rad of a joint
_MAX_RETURN_DURATION = 2.5  # sqrt(h / g), of this way
_SINK_BY_TILT = 0.5  # standing heights a rad: how far knees give under a torso that tilts over feet that stay


def record_blow(recorder: Recorder, clip: BlowClip, idle: Pose) -> Draft:
    """Return how a body takes the blow that suits it, from idle to idle.

    Of the lowest blows that tilt the torso enough, it is the strongest; if none does, that which tilts it most.

    Raises:
        ValueError: no blow suits it.
    """
    drafts: list[Draft] = []
    first_reason = ""
    for lever in _LEVERS:
        draft, reason = _take_strongest_blow(recorder, clip, lever, idle)
        first_reason = first_reason or reason
        if draft is not None:
            drafts.append(draft)
        if drafts and (not clip.min_tilt or _measure_tilt(drafts[-1].motion.quaternions) >= clip.min_tilt):
            return drafts[-1]
    if not drafts:
        raise ValueError(first_reason)
    return max(drafts, key=lambda draft: _measure_tilt(draft.motion.quaternions))


class _Trials:
    """Blows of one lever to one body. Each size is recorded and drawn once.

    Attributes:
        drafts: drafts of the blows that suit the body, by size.
        reasons: why other blows do not suit it, by size.
    """

    def __init__(self, recorder: Recorder, clip: BlowClip, lever: float, idle: Pose):
        """Begin without a blow."""
        self._recorder = recorder
        self._clip = clip
        self._lever = lever
        self._idle = idle
        self._recordings: dict[float, GaitRecording] = {}
        self.drafts: dict[float, Draft] = {}
        self.reasons: dict[float, str] = {}

    def record(self, size: float) -> bool:
        """Record a blow of a size, and return whether the body stays upright."""
        if size not in self._recordings:
            try:
                self._recordings[size] = _record_blow(self._recorder, self._clip, size, self._lever)
            except ValueError as error:
                self.reasons[size] = str(error)
        return size in self._recordings

    def draw(self, size: float) -> bool:
        """Draw a blow of a size from idle to idle, and return whether it suits the body."""
        if self.record(size):
            try:
                self.drafts[size] = _draw_blow(self._recorder.body, self._clip, self._recordings[size], self._idle)
            except ValueError as error:
                self.reasons[size] = str(error)
        return size in self.drafts


def _take_strongest_blow(recorder: Recorder, clip: BlowClip, lever: float, idle: Pose) -> tuple[Draft | None, str]:
    """Return how a body takes the strongest blow of a lever, and why the weakest does not suit it, if it does not."""
    trials = _Trials(recorder, clip, lever, idle)
    sizes = _select_possible(_SIZES, trials.record)
    if sizes and not trials.draw(sizes[-1]):
        _select_possible(sizes[:-1], trials.draw)
    if trials.drafts:
        return trials.drafts[max(trials.drafts)], ""
    size = min(trials.reasons)
    return None, f"under a blow of {size:.2g} sqrt(g h), {trials.reasons[size]}"


def _select_possible(sizes: Sequence[float], attempt: Callable[[float], bool]) -> Sequence[float]:
    """Return the sizes for which an attempt succeeds, by bisection: for each one, it succeeds for all smaller ones.

    Args:
        sizes: in ascending order.
        attempt: returns whether it succeeds for a size.
    """
    return sizes[: bisect.bisect_left(sizes, True, key=lambda size: not attempt(size))]


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
    check_seam(motion, "idle")
    motion = planting.plant_feet(body, on_ground.raise_out_of_ground(body, motion, BOTH_ENDS), cycle, loops=False)
    for end in BOTH_ENDS:
        motion = motion.end_with(idle, end, fading_samples)
    return motion


def _return_to(body: Body, first: Pose, motion: ClipMotion) -> ClipMotion:
    """Return how a body at rest at the end of a motion goes over to its first pose."""
    last = motion.pose(-1)
    seam = root_motion.seam_size(first.relative(last))
    duration = min(_RETURN_SLOWNESS * seam, _MAX_RETURN_DURATION)
    samples = max(1, round(duration * time_unit(body) / motion.time_step))
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


def _measure_tilt(quaternions: np.ndarray) -> float:
    """Return the largest angle, degrees, by which a torso tilts from its first pose; quaternions (samples, 4)."""
    up = rotations.matrix(quaternions)[:, :, 2]
    return math.degrees(np.arccos((up @ up[0]).clip(-1.0, 1.0)).max())
