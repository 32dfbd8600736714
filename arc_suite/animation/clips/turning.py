"""A turn on the spot, drawn: two groups of legs step in turn, over feet that stay in their stance."""

import math

import numpy as np

from arc_suite.animation.clips import standing_legs
from arc_suite.animation.clips.root_motion import ClipMotion, Pose, away_from_ends, fade_out
from arc_suite.models.standing import time_unit
from arc_suite.robots.spec import Body

# The duration of a turn is that of its start and stop, and a time for its angle, at most a time in s.
_ENDS_DURATION = 1.5  # sqrt(h / g)
_HALF_TURN_DURATION = 8.5  # sqrt(h / g) for 180 degrees
_MAX_SECONDS_OF_HALF_TURN = 1.9

_STILL_SHARE = 0.03  # of the duration, at either end

# Steps are as large as the legs allow, with a torso as high as they allow.
_STEP_ANGLES = np.radians((22.5, 18.0, 15.0))
_SINKS = (0.0, 0.06, 0.12)  # standing heights
_VERTICAL_SHARE = 0.15  # of a swing at either end, in which a foot moves up or down alone
_SMOOTHING_ROUNDS = 1  # more would move feet that stand, as steps are fast
_LIFT = 0.12  # standing heights, of a foot in mid-swing


def turn(body: Body, rest: Pose, angle: float) -> ClipMotion:
    """Return a turn from the pose at rest to the same pose by an angle to the left, rad; the root turns.

    Raises:
        ValueError: legs cannot follow.
    """
    times = standing_legs.sample_times(body, _find_duration(body, angle))
    progress = ((times / times[-1] - _STILL_SHARE) / (1.0 - 2.0 * _STILL_SHARE)).clip(0.0, 1.0)
    yaw = angle * (1.0 - fade_out(progress))
    for step_angle in _STEP_ANGLES:
        steps = max(2, math.ceil(abs(angle) / step_angle))
        foot_yaw, swing = _step_in_turn(body, yaw, progress, steps)
        lifts = _foot_displacements(body, rest, foot_yaw - yaw[:, None], _LIFT * swing)
        for sink in _SINKS:
            poses = np.zeros((len(times), 6))
            # It sinks in the first step, and rises in the last one.
            poses[:, standing_legs.HEIGHT] = -sink * away_from_ends(progress * steps, (1.0 - progress) * steps)
            motion = standing_legs.follow_exactly(body, rest, poses, lifts, _SMOOTHING_ROUNDS)
            if motion is not None:
                root = yaw[:, None] * (0.0, 0.0, 1.0)
                return motion._replace(root=root, twist=root[-1] / motion.seconds)
    raise ValueError(f"the legs do not turn it by {math.degrees(angle):.0f} degrees in {times[-1]:.1f} sqrt(h / g)")


def _find_duration(body: Body, angle: float) -> float:
    """Return the duration of a turn, sqrt(h / g)."""
    half_turns = abs(angle) / math.pi
    max_duration = _MAX_SECONDS_OF_HALF_TURN * max(1.0, half_turns) / time_unit(body)
    return min(_ENDS_DURATION + half_turns * _HALF_TURN_DURATION, max_duration)


def _step_in_turn(body: Body, yaw: np.ndarray, progress: np.ndarray, steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the yaw (samples, legs) of feet about the root, rad, and how high they are lifted, from 0 to 1.

    A foot lands where it is below its hip in the middle of its stance; after its last step, in the end.

    Args:
        body: the spec.
        yaw: (samples,) of the root, rad.
        progress: (samples,) from 0 to 1.
        steps: of both groups together.
    """
    foot_yaw = np.zeros((len(yaw), len(body.legs)))
    swing = np.zeros_like(foot_yaw)
    for leg, (rank, side) in enumerate(zip(body.ranks, [leg.side for leg in body.legs], strict=True)):
        group = int((rank % 2 == 1) != (side == "right"))
        landed_yaw = 0.0
        for step in range(group, steps, 2):
            is_last = step >= steps - 2
            middle_of_stance = 1.0 if is_last else (step + 1.5) / steps
            next_yaw = float(np.interp(middle_of_stance, progress, yaw))
            share = progress * steps - step  # of the step
            foot_yaw[share >= 1.0, leg] = next_yaw
            is_swing = (share >= 0.0) & (share < 1.0)
            weights = fade_out((share[is_swing] - _VERTICAL_SHARE) / (1.0 - 2.0 * _VERTICAL_SHARE))
            foot_yaw[is_swing, leg] = weights * landed_yaw + (1.0 - weights) * next_yaw
            swing[is_swing, leg] = np.sin(np.pi * share[is_swing]) ** 2
            landed_yaw = next_yaw
    return foot_yaw, swing


def _foot_displacements(body: Body, rest: Pose, turns: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Return how far feet are from rest, (samples, legs, 3) standing heights.

    Args:
        body: the spec.
        rest: pose at rest.
        turns: (samples, legs) of feet about the root, rad.
        heights: (samples, legs) above the ground, standing heights.
    """
    x, y, _ = (standing_legs.feet_from_torso(body, rest) + rest.position).T / body.torso.standing_height
    cosine = np.cos(turns)
    sine = np.sin(turns)
    return np.stack([cosine * x - sine * y - x, sine * x + cosine * y - y, heights], axis=-1)
