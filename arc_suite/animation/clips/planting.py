"""Planting: feet in stance stay where they touch down, and their soles on the ground, by inverse kinematics."""

from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.root_motion import ClipMotion, fade_out
from arc_suite.animation.clips.standing_legs import FOOT_WEIGHTS
from arc_suite.models.kinematics import Legs
from arc_suite.motions.ground_poses import integrate_twist
from arc_suite.motions.runs import find_runs
from arc_suite.robots.spec import Body

_STANCE_HEIGHT = 0.01  # standing heights: a lower sole is in stance
_MIN_SWING = 0.1  # gait cycles: a sole that is higher for less time stays in stance
_PASSES = 3  # in each, a foot stays in the middle of where the pass before could bring it
_SMOOTHING_WIDTH = 0.036  # gait cycles, to either side, over which corrections are smoothed
_LANDING_SHARE = 0.05  # of a swing: its height is corrected only so near its ends, as a foot slides near the ground

# Inverse kinematics.
_DAMPING = 0.005  # standing heights
_ITERATIONS = 6  # of a round
_MAX_ROUNDS = 5
_STILL_CHANGE = 1e-9  # rad; the last round changes no joint by more

# A leg follows a correction that it can: else a smaller share of it on the ground is tried.
_CORRECTION_SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)
_MAX_SINK = 0.005  # standing heights, by which a foot may miss its goal in height
_MAX_SPEED_RATIO = 6.0  # of the fastest joint of a leg, with and without planting


def plant_feet(body: Body, motion: ClipMotion, cycle: float, loops: bool) -> ClipMotion:
    """Return the motion with feet that neither slide nor sink in stance.

    A foot in stance stays in the middle of its positions. Between two stances the correction of one changes over into
    that of the next. Feet at the ends of a motion that is no loop stay where they are there. A leg of two joints
    reaches its goals in part, and a foot that stays down throughout a loop keeps its slide.

    Args:
        body: the spec.
        motion: motion whose soles in stance are on the ground.
        cycle: cycle of the gait, s.
        loops: whether the last sample is the first one.
    """
    standing_height = body.torso.standing_height
    cycle_samples = cycle / motion.time_step
    legs = Legs.of(body, used=1.0)
    unplanted_angles = legs.by_leg(motion.joints)
    legs = legs.widen_ranges(unplanted_angles)
    stances = _find_stances_of_legs(legs, standing_height, motion, round(_MIN_SWING * cycle_samples), loops)
    max_joint_steps = _MAX_SPEED_RATIO * _largest_joint_steps(unplanted_angles)
    planted_motion = motion
    for _ in range(_PASSES):
        planted_motion = _move_feet_nearer(legs, standing_height, planted_motion, stances, max_joint_steps, loops)
    changes = planted_motion.joints - motion.joints
    smooth_changes = _smooth(changes, round(_SMOOTHING_WIDTH * cycle_samples), loops)
    return motion._replace(joints=motion.joints + smooth_changes)


def slip(body: Body, motion: ClipMotion) -> float | None:
    """Return the mean path of a foot in stance over the ground, m a meter of the root; None if the root stays."""
    legs = Legs.of(body)
    max_height = _STANCE_HEIGHT * body.torso.standing_height
    root_path = np.linalg.norm(np.diff(motion.root[:, :2], axis=0), axis=-1).sum()
    if root_path < max_height:
        return None
    feet = _foot_positions(legs, motion)
    is_low = feet[..., 2] - legs.radii < max_height
    stays_low = is_low[1:] & is_low[:-1]
    foot_steps = np.linalg.norm(np.diff(feet[..., :2], axis=0), axis=-1)
    foot_paths = (foot_steps * stays_low).sum(axis=0)
    return float(foot_paths.mean() / root_path)


# Legs and stances.


def _foot_positions(legs: Legs, motion: ClipMotion) -> np.ndarray:
    """Return the positions (samples, legs, 3) of the centers of feet in the world, m."""
    poses = motion.poses()
    torso_positions = poses[:, None, :3]
    torso_rotations = rotations.matrix(poses[:, 3:7])[:, None]
    feet = legs.foot_centers(legs.by_leg(motion.joints))  # in the torso's frame
    return (torso_rotations @ feet[..., None])[..., 0] + torso_positions


def _largest_joint_steps(angles: np.ndarray) -> np.ndarray:
    """Return the largest turn (legs,) of a joint of each leg between two of the samples (samples, legs, links), rad."""
    return abs(np.diff(angles, axis=0)).max(axis=(0, 2))


def _repeat_three_times(loop: ClipMotion) -> ClipMotion:
    """Return a loop three times over, on one path of the root."""
    loop_samples = len(loop.joints) - 1
    samples = np.arange(3 * loop_samples + 1)
    root = integrate_twist(loop.twist, loop.time_step * samples)
    return loop.map_arrays(lambda values: values[samples % loop_samples])._replace(root=root)


def _find_stances_of_legs(
    legs: Legs, standing_height: float, motion: ClipMotion, min_swing: int, loops: bool
) -> list[list[tuple[int, int]]]:
    """Return the stances of each leg; of a loop, those in three rounds.

    Args:
        legs: legs of the body.
        standing_height: m.
        motion: motion of the body.
        min_swing: samples; a shorter swing does not end a stance.
        loops: whether the last sample is the first one.
    """
    max_stance = None
    if loops:
        max_stance = len(motion.joints) - 1
        motion = _repeat_three_times(motion)
    is_low = _foot_positions(legs, motion)[..., 2] - legs.radii < _STANCE_HEIGHT * standing_height
    return [_find_stances(foot_is_low, min_swing, max_stance) for foot_is_low in is_low.T]


def _find_stances(is_low: np.ndarray, min_swing: int, max_stance: int | None) -> list[tuple[int, int]]:
    """Return the stances of a foot: the first sample of each, and the sample after its last.

    Args:
        is_low: (samples,) whether the foot is low.
        min_swing: samples; a shorter swing does not end a stance.
        max_stance: samples; stances of so many samples or more are left out. None for no limit.
    """
    stances: list[tuple[int, int]] = []
    for start, end in find_runs(is_low).tolist():
        if stances and start - stances[-1][1] < min_swing:
            stances[-1] = (stances[-1][0], end)
        else:
            stances.append((start, end))
    if max_stance is None:
        return stances
    return [(start, end) for start, end in stances if end - start < max_stance]


# Corrections of feet.


def _move_feet_nearer(
    legs: Legs, standing_height: float, motion: ClipMotion, stances, max_joint_steps: np.ndarray, loops: bool
) -> ClipMotion:
    """Return the motion with feet in stance nearer to a point of the ground that is the same throughout the stance.

    Args:
        legs: legs of the body.
        standing_height: m.
        motion: motion to change.
        stances: stances of each leg; of a loop, those in three rounds.
        max_joint_steps: (legs,) rad, by which a joint of a leg may turn between two samples.
        loops: whether the last sample is the first one.
    """
    samples = slice(None)  # of the motion
    corrected_motion = motion
    if loops:  # take the corrections of the second of three rounds, which has stances before and after it
        loop_samples = len(motion.joints) - 1
        samples = slice(loop_samples, 2 * loop_samples + 1)
        corrected_motion = _repeat_three_times(motion)
    feet = _foot_positions(legs, corrected_motion)
    corrections = np.zeros_like(feet)
    for leg, radius in enumerate(legs.radii):
        corrections[:, leg] = _corrections(feet[:, leg], radius, stances[leg], keeps_ends=not loops)
    poses = corrected_motion.poses()[samples]
    angles = _solve_joint_angles(legs, standing_height, poses, feet[samples], corrections[samples], max_joint_steps)
    joints = legs.by_joint(angles)
    if loops:
        joints[-1] = joints[0]
    return motion._replace(joints=joints)


def _solve_joint_angles(
    legs: Legs, standing_height: float, poses, feet, corrections, max_joint_steps: np.ndarray
) -> np.ndarray:
    """Return the angles (samples, legs, links), rad, of legs with the largest share of a correction that they follow.

    Args:
        legs: legs of the body.
        standing_height: m.
        poses: (samples, 7 + joints) in the world.
        feet: (samples, legs, 3) positions of their centers, m.
        corrections: (samples, legs, 3) corrections to be added, m.
        max_joint_steps: (legs,) rad.
    """
    torso_rotations = rotations.matrix(poses[:, 3:7])[:, None]
    torso_positions = poses[:, None, :3]
    start_angles = legs.by_leg(poses[:, 7:])
    angles = start_angles.copy()
    unsolved = np.arange(len(legs.radii))
    for share in _CORRECTION_SHARES:
        centers = legs.choose(unsolved).to_foot_centers()
        goals = feet[:, unsolved] + corrections[:, unsolved] * (share, share, 1.0)
        goals[..., 2] = np.maximum(goals[..., 2], legs.radii[unsolved])
        goals_in_torso = (torso_rotations.swapaxes(-1, -2) @ (goals - torso_positions)[..., None])[..., 0]
        candidates = _bring_near(centers, start_angles[:, unsolved], goals_in_torso, _DAMPING * standing_height)
        misses_in_torso = centers.foot_centers(candidates) - goals_in_torso
        height_misses = abs((torso_rotations @ misses_in_torso[..., None])[..., 2, 0]).max(axis=0)
        is_near = height_misses <= _MAX_SINK * standing_height
        is_slow = _largest_joint_steps(candidates) <= max_joint_steps[unsolved]
        is_solved = is_near & is_slow
        angles[:, unsolved[is_solved]] = candidates[:, is_solved]
        unsolved = unsolved[~is_solved]
        if not len(unsolved):
            break
    return angles


def _bring_near(legs: Legs, angles: np.ndarray, goals: np.ndarray, damping: float) -> np.ndarray:
    """Return the angles (samples, legs, links), rad, that bring feet near goals (samples, legs, 3) in the torso, m."""
    for _ in range(_MAX_ROUNDS):
        previous_angles = angles
        angles = legs.solve_joint_angles(angles, goals, FOOT_WEIGHTS, damping, _ITERATIONS)
        if abs(angles - previous_angles).max() < _STILL_CHANGE:
            break
    return angles


class _Anchor(NamedTuple):
    """A sample of a foot's path, and its correction (3,) there, m."""

    sample: int
    correction: np.ndarray


def _corrections(positions: np.ndarray, radius: float, stances: list[tuple[int, int]], keeps_ends: bool) -> np.ndarray:
    """Return what to add to the positions (samples, 3) of a foot's center, m.

    Args:
        positions: positions of the foot in the world, m.
        radius: radius of the foot, m.
        stances: see `_find_stances`.
        keeps_ends: whether a stance at an end of the motion stays where it is there.
    """
    samples = len(positions)
    corrections = np.zeros_like(positions)
    stance_end = _Anchor(0, np.zeros(3))  # of the latest stance
    for start, end in stances:
        corrections[start:end] = _stance_corrections(
            positions[start:end],
            radius,
            keeps_first=keeps_ends and start == 0,
            keeps_last=keeps_ends and end == samples,
        )
        _bridge_swing(corrections, stance_end, _Anchor(start, corrections[start]))
        stance_end = _Anchor(end - 1, corrections[end - 1])
    _bridge_swing(corrections, stance_end, _Anchor(samples, np.zeros(3)))
    return corrections


def _stance_corrections(positions: np.ndarray, radius: float, keeps_first: bool, keeps_last: bool) -> np.ndarray:
    """Return what to add to the positions (samples, 3) of a foot's center in one stance, m.

    Args:
        positions: positions of the foot in the world, m.
        radius: radius of the foot, m.
        keeps_first: whether the foot stays where it is in the first sample.
        keeps_last: whether the foot stays where it is in the last sample.
    """
    samples = len(positions)
    share = (np.arange(samples) / max(samples - 1, 1))[:, None]
    first_weights = fade_out(share)
    last_weights = fade_out(1.0 - share)
    if keeps_first and keeps_last:  # the foot moves from its first position to its last
        goal = first_weights * positions[0] + last_weights * positions[-1]
    elif keeps_first:
        goal = positions[0]
    elif keeps_last:
        goal = positions[-1]
    else:
        goal = 0.5 * (positions.min(axis=0) + positions.max(axis=0))
    corrections = goal - positions
    corrections[:, 2] = radius - positions[:, 2]
    if keeps_first:  # the foot comes to the ground during the stance
        corrections[:, 2] *= 1.0 - first_weights[:, 0]
    if keeps_last:
        corrections[:, 2] *= 1.0 - last_weights[:, 0]
    return corrections


def _bridge_swing(corrections: np.ndarray, first: _Anchor, last: _Anchor) -> None:
    """Fill in corrections between two samples; that of the height soon fades."""
    samples = last.sample - first.sample
    if samples <= 1:
        return
    share = (np.arange(1, samples) / samples)[:, None]
    swing = slice(first.sample + 1, last.sample)
    corrections[swing] = fade_out(share) * first.correction + (1.0 - fade_out(share)) * last.correction
    after_liftoff = fade_out(share / _LANDING_SHARE)
    before_touchdown = fade_out((1.0 - share) / _LANDING_SHARE)
    height_corrections = after_liftoff * first.correction + before_touchdown * last.correction
    corrections[swing, 2] = height_corrections[:, 2]


def _smooth(values: np.ndarray, width: int, loops: bool) -> np.ndarray:
    """Return values (samples, n) as means over samples, so that a foot which leaves the ground does not jerk.

    Args:
        values: values to smooth; those at the ends of a motion that is no loop stay.
        width: samples to either side.
        loops: whether the last sample is the first one.
    """
    if loops:
        padded = values[np.arange(-width, len(values) + width) % (len(values) - 1)]
    else:  # reflected at both ends, so that these stay
        before = 2.0 * values[0] - values[width:0:-1]
        after = 2.0 * values[-1] - values[-2 : -width - 2 : -1]
        padded = np.concatenate([before, values, after])
    window = np.hanning(2 * width + 3)[1:-1]
    weights = window / window.sum()
    return np.stack([np.convolve(column, weights, "valid") for column in padded.T], axis=-1)
