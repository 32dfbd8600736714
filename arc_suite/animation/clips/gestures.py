"""Motions drawn over standing feet, from the pose at rest: breaths, looks, leans, strikes.

A gesture is a table of tracks. A track has keys of time and value; between keys the value is eased. Lengths are in
standing heights h, times in sqrt(h / g). Numbers of the torso's pose are those of `posture.POSE_NAMES`.
"""

import warnings
from collections.abc import Mapping

import numpy as np

from arc_suite import checks
from arc_suite.animation.clips.root_motion import ClipMotion, Pose, fade_out
from arc_suite.animation.clips.standing_legs import (
    HEIGHT,
    feet_from_torso,
    follow_at_largest_size,
    follow_exactly,
    follow_foot,
    keep_feet_in_place,
    measure_belly_height,
    pose_motion,
    sample_times,
)
from arc_suite.models import posture
from arc_suite.models.standing import time_unit
from arc_suite.robots.spec import Body

_LEFT = posture.POSE_NAMES.index("left")
_ROLL = posture.POSE_NAMES.index("roll")
_PITCH = posture.POSE_NAMES.index("pitch")

_SMALL_SIZES = (0.1, 0.05, 0.02)  # of a gesture that is left out, which are tried for its error

# A breath, and weight that shifts to either side once in two breaths.
_BREATH_DEPTH = 0.065  # h
_BREATH_PITCH = 0.03  # rad, ahead, of a torso that has sunk
_MAX_BREATH_SHARE = 0.4  # of the height of the belly
_SMALL_BREATH_DEPTH = 0.012  # h, with other movements
_BREATH_PERIOD = 12.0
_SWAY = 0.02  # h, to the left
_SWAY_ROLL = 0.012  # rad
_SWAY_SIZES = (1.0, 0.6, 0.3, 0.1, 0.0)  # that are tried
_MAX_IDLE_SLIDE = 0.035  # h, of a sole in idle

# A look around.
_LOOK_DURATION = 24.0
_LOOK_TRACKS = {
    "yaw": ((1.0, 0.0), (4.0, 0.24), (7.5, 0.24), (11.5, -0.24), (15.5, -0.24), (19.0, 0.0)),
    "roll": ((1.5, 0.0), (4.5, -0.05), (7.5, -0.03), (11.5, 0.05), (15.0, 0.03), (18.5, 0.0)),
    "pitch": ((3.0, 0.0), (5.5, 0.07), (8.5, 0.0), (12.0, -0.07), (14.0, 0.06), (16.0, 0.0)),
    "left": ((0.5, 0.0), (3.5, -0.03), (7.0, -0.03), (11.0, 0.03), (15.5, 0.03), (19.5, 0.0)),
}

# A weight that shifts to the other feet, and a foot that rises and is set down again, twice.
_SETTLE_DURATION = 24.0
_SETTLE_LIFT_TRACK = ((3.0, 0.0), (4.6, 0.16), (5.0, 0.16), (6.6, 0.0))  # of the foot, h
_SETTLE_SHIFT_TRACK = ((0.5, 0.0), (2.8, 0.06), (6.6, 0.06), (9.0, -0.02), (11.5, 0.0))  # of the torso, h

# A strike: the torso draws back, then leans into it.
_STRIKE_DURATION = 9.0
_MAX_STRIKE_SECONDS = 1.49  # s; a longer one is quicker
_STRIKE_TORSO_TRACKS = {
    "forward": ((0.3, 0.0), (2.2, -0.08), (3.0, -0.08), (3.8, 0.1), (4.6, 0.1), (7.5, 0.0)),
    "pitch": ((0.3, 0.0), (2.2, -0.14), (3.0, -0.15), (3.8, 0.12), (4.6, 0.1), (7.5, 0.0)),
    "height": ((0.3, 0.0), (2.0, -0.03), (3.0, 0.0), (3.8, -0.08), (4.6, -0.06), (7.5, 0.0)),
}
_STRIKE_REACH = 0.4  # h
_STRIKE_FOOT_FORWARD_TRACK = (
    (0.8, 0.0),
    (2.4, 0.1),
    (3.0, 0.12),
    (3.8, _STRIKE_REACH),
    (4.8, _STRIKE_REACH),
    (6.6, 0.0),
)
_STRIKE_FOOT_UP_TRACK = ((0.8, 0.0), (2.4, 0.7), (3.0, 0.72), (3.8, 0.0), (4.8, 0.0), (5.7, 0.15), (6.6, 0.0))
_STRIKE_SHARE = 0.25  # of the way from the torso to its front foot, by which a long body strikes further
_MAX_REACH_SIZE = 1.5  # of the reach of others

# A turn of the torso.
_MAX_TURN = 0.2  # rad
_MIN_TURN = 0.03  # rad
_TURN_ROOM_SHARE = 0.8  # of the room that legs leave the torso
_TURN_EASE_DURATION = 3.0  # to the turned pose, and back
_TURN_HOLD_DURATION = 4.0


# Gestures.


def torso_gesture(body: Body, rest: Pose, tracks: Mapping[str, tuple], duration: float) -> ClipMotion:
    """Return a torso that moves over standing feet, as far as the legs can follow; a warning says what is left of it.

    Args:
        body: the spec.
        rest: pose from which it moves.
        tracks: by a number of the pose, see `posture.POSE_NAMES`: pairs of a time, sqrt(h / g), in ascending order from
            0 to the duration, and a value, standing heights or rad.
        duration: sqrt(h / g).

    Raises:
        ValueError: an unknown number of the pose, a time out of range or order, or legs that leave no room for it.
    """
    _check_tracks(tracks, duration)
    poses = _poses_of_tracks(sample_times(body, duration), tracks)
    try:
        motion, size = follow_at_largest_size(body, rest, poses, action="move so")
    except ValueError as error:
        raise ValueError(f"{error}: {_describe_fitting_size(body, rest, poses)}") from None
    if size < 1.0:
        names = ", ".join(tracks)
        warnings.warn(f"{body.name}: legs follow {size:g} of a gesture of {names}, which is made smaller", stacklevel=2)
    return motion


def _check_tracks(tracks: Mapping[str, tuple], duration: float) -> None:
    """Raise ValueError for tracks that `torso_gesture` cannot take."""
    duration = checks.number("duration", duration, 0.0)
    for name, keys in tracks.items():
        checks.name(name, posture.POSE_NAMES, "track")
        if not (isinstance(keys, tuple | list) and keys and all(np.shape(key) == (2,) for key in keys)):
            raise ValueError(f"track {name}: expected pairs of a time and a value, got {checks.preview(keys)}")
        previous_time = 0.0
        for time, value in keys:
            time = checks.number(f"track {name}: time", time, 0.0, duration)
            if time < previous_time:
                raise ValueError(
                    f"track {name}: expected times in ascending order, got {time:g} after {previous_time:g}"
                )
            previous_time = time
            checks.number(f"track {name}: value", value)


def _describe_fitting_size(body: Body, rest: Pose, poses: np.ndarray) -> str:
    """Return which size of a gesture (samples, 6) legs can follow that is too small to be made of it."""
    lifts = np.zeros((len(poses), len(body.legs), 3))
    for size in _SMALL_SIZES:
        if follow_exactly(body, rest, size * poses, lifts) is not None:
            return f"{size:g} of it fits"
    return f"not even {_SMALL_SIZES[-1]:g} of it fits"


def idle(body: Body, rest: Pose) -> ClipMotion:
    """Return a standing body as a loop that begins with the pose at rest: two breaths, and weight that shifts.

    The torso sinks and rises, and goes to either side, while joints bend so that the soles stay where they are; less
    where legs have too few joints for that, to either side first.
    """
    times = sample_times(body, 2.0 * _BREATH_PERIOD)
    phase = 2.0 * np.pi * times / times[-1]
    sway = np.sin(phase) * np.sin(0.5 * phase) ** 2  # at rest at both ends
    max_depth = _MAX_BREATH_SHARE * measure_belly_height(body, rest) / body.torso.standing_height
    breaths = _breathe(times, np.clip(max_depth, 0.0, _BREATH_DEPTH))
    while (slide := _measure_idle_slide(body, rest, breaths)) > _MAX_IDLE_SLIDE:
        breaths *= 0.99 * _MAX_IDLE_SLIDE / slide  # a slide shrinks less than a breath
    sways = np.zeros_like(breaths)
    sways[:, _LEFT] = _SWAY * sway
    sways[:, _ROLL] = -_SWAY_ROLL * sway
    sways[:, _PITCH] = -_BREATH_PITCH / _BREATH_DEPTH * breaths[:, HEIGHT]
    for size in _SWAY_SIZES:
        poses = breaths + size * sways
        if _measure_idle_slide(body, rest, poses) <= _MAX_IDLE_SLIDE:
            break
    joints, _ = keep_feet_in_place(body, rest, poses)
    return _close_loop(pose_motion(body, rest, poses, joints))


def _measure_idle_slide(body: Body, rest: Pose, poses: np.ndarray) -> float:
    """Return how far a sole slides under a torso that moves (samples, 6), standing heights."""
    _, misses = keep_feet_in_place(body, rest, poses)
    return float(np.linalg.norm(np.ptp(misses, axis=0), axis=-1).max() / body.torso.standing_height)


def glance(body: Body, rest: Pose) -> ClipMotion:
    """Return a standing body that looks to either side and down, as a loop.

    Raises:
        ValueError: the legs leave no room for it.
    """
    times = sample_times(body, _LOOK_DURATION)
    poses = _poses_of_tracks(times, _LOOK_TRACKS) + _breathe(times, _SMALL_BREATH_DEPTH)
    motion, _ = follow_at_largest_size(body, rest, poses, action="look around")
    return _close_loop(motion)


def settle(body: Body, rest: Pose) -> ClipMotion:
    """Return a standing body that shifts its weight and sets two feet anew, one after the other, as a loop.

    Raises:
        ValueError: the legs leave no room for it.
    """
    times = sample_times(body, _SETTLE_DURATION)
    feet = feet_from_torso(body, rest)
    poses = _breathe(times, _SMALL_BREATH_DEPTH)
    lifts = np.zeros((len(times), len(feet), 3))
    first_leg = 0
    farthest_leg = int(np.linalg.norm(feet - feet[first_leg], axis=-1).argmax())
    for leg, start in ((first_leg, 0.0), (farthest_leg, 0.5 * _SETTLE_DURATION)):
        away_from_foot = -feet[leg, :2] / np.linalg.norm(feet[leg, :2])
        forward, left = away_from_foot
        shift = _track_values(times - start, _SETTLE_SHIFT_TRACK)
        poses[:, 1:3] += shift[:, None] * away_from_foot  # forward and left
        poses[:, 3:5] += shift[:, None] * (-left, forward)  # roll and pitch: the torso leans where its weight goes
        lifts[:, leg, 2] = _track_values(times - start, _SETTLE_LIFT_TRACK)
    motion, _ = follow_at_largest_size(body, rest, poses, action="shift its weight", lifts=lifts)
    return _close_loop(motion)


def strike(body: Body, rest: Pose) -> ClipMotion:
    """Return how a body raises its front leg and strikes the ground ahead.

    Raises:
        ValueError: the legs leave no room for it.
    """
    seconds = _STRIKE_DURATION * time_unit(body)
    haste = max(1.0, seconds / _MAX_STRIKE_SECONDS)
    times = haste * sample_times(body, _STRIKE_DURATION / haste)  # of the tracks
    feet = feet_from_torso(body, rest)
    front_leg = int(feet[:, 0].argmax())
    lifts = np.zeros((len(times), len(feet), 3))
    foot_ahead = feet[front_leg, 0] / body.torso.standing_height
    reach_size = np.clip(_STRIKE_SHARE * foot_ahead / _STRIKE_REACH, 1.0, _MAX_REACH_SIZE)
    lifts[:, front_leg, 0] = reach_size * _track_values(times, _STRIKE_FOOT_FORWARD_TRACK)
    lifts[:, front_leg, 2] = _track_values(times, _STRIKE_FOOT_UP_TRACK)
    poses = _poses_of_tracks(times, _STRIKE_TORSO_TRACKS)
    return follow_foot(body, rest, poses, lifts, action="strike")


def turn_torso(body: Body, rest: Pose, number: str, sign: float) -> ClipMotion:
    """Return how a torso turns over its feet, stays so, and turns back.

    Args:
        body: the spec.
        rest: pose from which it turns.
        number: number of the pose that changes; see `posture.POSE_NAMES`.
        sign: sign of the change.

    Raises:
        ValueError: the legs have no room for it.
    """
    lowest, highest = posture.measure_room(body, planted=False)[posture.POSE_NAMES.index(number)]  # rad
    room = abs(highest if sign > 0.0 else lowest)
    turn = sign * min(_MAX_TURN, _TURN_ROOM_SHARE * room)
    if abs(turn) < _MIN_TURN:
        raise ValueError(f"the legs leave the torso no room to {number}")
    hold_end = _TURN_EASE_DURATION + _TURN_HOLD_DURATION
    duration = hold_end + _TURN_EASE_DURATION
    track = ((0.0, 0.0), (_TURN_EASE_DURATION, turn), (hold_end, turn), (duration, 0.0))
    poses = _poses_of_tracks(sample_times(body, duration), {number: track})
    motion, _ = follow_at_largest_size(body, rest, poses, action=number)
    return motion


def _breathe(times: np.ndarray, depth: float) -> np.ndarray:
    """Return poses (samples, 6) of a torso that sinks by a depth, standing heights, and rises in each breath."""
    shares = 0.5 - 0.5 * np.cos(2.0 * np.pi * times / _BREATH_PERIOD)
    height_only = np.eye(6)[HEIGHT]
    return -depth * shares[:, None] * height_only


def _close_loop(motion: ClipMotion) -> ClipMotion:
    """Return the motion with its first sample as its last one, too."""
    return motion.map_arrays(lambda values: np.concatenate([values[:-1], values[:1]]))


# Tracks.


def _poses_of_tracks(times: np.ndarray, tracks: Mapping[str, tuple]) -> np.ndarray:
    """Return poses (samples, 6) of the torso by tracks of their numbers; numbers without a track are 0."""
    zero_track = ((0.0, 0.0),)
    return np.stack([_track_values(times, tracks.get(name, zero_track)) for name in posture.POSE_NAMES], axis=-1)


def _track_values(times: np.ndarray, track: tuple) -> np.ndarray:
    """Return the values (samples,) of a track, whose keys are pairs of a time and a value."""
    key_times, key_values = np.array(track).T
    if len(key_times) > 2:
        previous_keys = np.searchsorted(key_times[1:-1], times, side="right")
    else:
        previous_keys = np.zeros(len(times), int)
    next_keys = np.minimum(previous_keys + 1, len(key_times) - 1)
    key_intervals = key_times[next_keys] - key_times[previous_keys]
    share = (times - key_times[previous_keys]) / np.maximum(key_intervals, 1e-9)  # a track of one key has no interval
    previous_values = key_values[previous_keys]
    next_values = key_values[next_keys]
    return next_values + (previous_values - next_values) * fade_out(share)
