"""Loops of steps for another body: the path of each foot by its own phase, in the other body's gait.

All lengths are in standing heights, and times in shares of the loop.
"""

from typing import NamedTuple

import numpy as np

from arc_suite import robots, rotations
from arc_suite.models.stride import fitted_gait
from arc_suite.motions.ground_poses import (
    compose,
    fit_twist,
    ground_poses,
    integrate_twist,
    place_points,
    relative_points,
    relative_pose,
)
from arc_suite.motions.motion import Motion, continue_signs, find_rest
from arc_suite.motions.paths import Paths, Size, match_feet, scale_heights, shrink_turns, time_scale
from arc_suite.motions.runs import find_runs
from arc_suite.motions.sampling import sample_linearly
from arc_suite.robots import gaits
from arc_suite.robots.spec import Body

_MIN_DUTY_FACTOR = 0.05
_MAX_DUTY_FACTOR = 0.95
_MIN_HEIGHT = 1e-6  # standing heights, of a swing, in divisions
_MAX_STRETCH = 1.5  # of a swing's height, which ends on the ground


class _Steps(NamedTuple):
    """Steps of a foot in a loop: shares of the loop in which stances begin, and how long they last."""

    starts: np.ndarray
    durations: np.ndarray


class _SourceGait(NamedTuple):
    """The gait of the motion that is transferred.

    Attributes:
        cycles: number of cycles in the loop.
        duty_factor: mean share of the loop in which regular feet stand.
        steps: steps of each foot.
        is_regular: (feet,) whether a foot steps once in each cycle.
    """

    cycles: int
    duty_factor: float
    steps: list[_Steps]
    is_regular: np.ndarray


class _Root(NamedTuple):
    """A frame that moves over the ground with the mean of the torso.

    Attributes:
        path: (frames, 3) ground poses, x and y in standing heights.
        twist: (3,) in a loop.
    """

    path: np.ndarray
    twist: np.ndarray


def count_cycles(motion: Motion) -> int:
    """Return how many steps feet take in a loop, most of them; 0 for a motion without steps.

    Where half of the feet step more often, it is the number of the other half.
    """
    if not motion.loops:
        return 0
    counts = sorted(len(_find_steps(planted).starts) for planted in motion.planted[:-1].T)
    step_counts = [count for count in counts if count > 0]
    return step_counts[(len(step_counts) - 1) // 2] if len(step_counts) > 1 else 0


def find_gait(body: Body) -> gaits.Gait:
    """Return the gait in which a body walks: that of the four robots, or else the fitted one."""
    if robots.is_robot(body):
        return gaits.gait(body, "trot" if len(body.legs) == 4 else "tripod")
    return fitted_gait(body)


def transfer(motion: Motion, body: Body, size: Size) -> tuple[Paths, list[str]]:
    """Return the paths of a body's torso and feet, and a line for each thing that was changed.

    Args:
        motion: a loop of steps.
        body: the body that is to move.
        size: of steps and of the torso's movement.
    """
    source_gait = _measure_gait(motion)
    gait = find_gait(body)
    height = body.torso.standing_height
    rest_soles, rest_height = find_rest(body)
    rest_soles = rest_soles / height
    partners = _find_partners(motion, rest_soles)

    # With the same strides at the same speed, a loop of a shorter stance takes less time.
    time_ratio = source_gait.duty_factor / gait.duty_factor
    seconds = motion.seconds * time_ratio * time_scale(motion.standing_height, height)
    shares = np.linspace(0.0, 1.0, max(motion.frames, round(seconds * motion.frame_rate) + 1))
    source_root = _find_root(motion)
    root = integrate_twist(source_root.twist * time_ratio * size.all * (1.0, size.side, 1.0), shares)
    offsets = size.ahead_left_up * (_soles_on_root(motion, source_root) - motion.rest_soles)  # (frames, feet, 3)

    begin = _find_begin(source_gait, partners, gait)
    soles = []
    planted = []
    for leg, foot in enumerate(partners):
        if source_gait.is_regular[foot]:
            first_start = begin - gait.offsets[leg] / source_gait.cycles
            is_planted = _find_stance(shares, first_start, gait, source_gait.cycles)
            source_shares = _warp(shares, first_start, gait, source_gait.steps[foot])
            path = place_points(root, rest_soles[leg] + _sample(offsets[:, foot], source_shares))
            path = _hold_stances(path, is_planted, root)
        else:
            is_planted = motion.planted[_nearest_frames(shares, motion.frames), foot]
            path = place_points(root, rest_soles[leg] + _sample(offsets[:, foot], shares))
        soles.append(path)
        planted.append(is_planted)
    positions, quaternions = _move_torso(motion, source_root, root, shares, rest_height / height, size)
    paths = Paths(seconds, positions, quaternions, np.stack(soles, axis=1), np.stack(planted, axis=1))
    gait_note = (
        f"gait: {source_gait.cycles} cycles with a duty factor of {gait.duty_factor:.2f}, "
        f"before {source_gait.duty_factor:.2f}; {seconds:.3f} s, before {motion.seconds:.3f} s"
    )
    return paths, [gait_note, *_note_irregular_feet(body, partners, source_gait.is_regular)]


def _note_irregular_feet(body: Body, partners: list[int], is_regular: np.ndarray) -> list[str]:
    """Return a line that names the legs whose partners do not step once in each cycle; none without such legs."""
    names = [body.legs[leg].name for leg, foot in enumerate(partners) if not is_regular[foot]]
    return [f"without steps of their own in each cycle: {', '.join(names)}"] if names else []


def _measure_gait(motion: Motion) -> _SourceGait:
    """Return the gait of a loop of steps."""
    cycles = count_cycles(motion)
    steps = [_find_steps(planted) for planted in motion.planted[:-1].T]
    is_regular = np.array([len(foot_steps.starts) == cycles for foot_steps in steps])
    stance_shares = [steps[foot].durations.sum() for foot in np.flatnonzero(is_regular)]
    duty_factor = min(max(float(np.mean(stance_shares)), _MIN_DUTY_FACTOR), _MAX_DUTY_FACTOR)
    return _SourceGait(cycles, duty_factor, steps, is_regular)


def _find_partners(motion: Motion, rest_soles: np.ndarray) -> list[int]:
    """Return the foot of the motion that each foot follows: its partner, or the nearest one of the same side."""
    partners = match_feet(motion.rest_soles, rest_soles)
    nearest = []
    for sole, partner in zip(rest_soles, partners, strict=True):
        if partner is None:
            distances = np.linalg.norm(motion.rest_soles - sole, axis=-1)
            is_across = motion.rest_soles[:, 1] * sole[1] < 0.0
            partner = int(np.where(is_across, np.inf, distances).argmin())
        nearest.append(partner)
    return nearest


def _find_steps(planted: np.ndarray) -> _Steps:
    """Return the steps of a foot, given whether it stands (frames,) in a loop without its last frame."""
    frames = len(planted)
    starts = np.flatnonzero(planted & ~np.roll(planted, 1))
    ends = np.flatnonzero(~planted & np.roll(planted, 1))
    if not len(starts):
        return _Steps(np.zeros(0), np.zeros(0))
    durations = ((ends - starts[:, None]) % frames).min(axis=1)  # from each start to the next end
    return _Steps(starts / frames, durations / frames)


def _find_root(motion: Motion) -> _Root:
    """Return the frame that moves as the torso does in the mean of a loop."""
    shares = np.linspace(0.0, 1.0, motion.frames)
    poses = np.concatenate([motion.positions, motion.quaternions], axis=-1)
    torso = ground_poses(poses) / (motion.standing_height, motion.standing_height, 1.0)
    twist, drift = fit_twist(torso)
    path = integrate_twist(twist, shares) + shares[:, None] * drift
    mean_offset = relative_pose(path, relative_pose(torso[0], torso))[:-1].mean(axis=0)
    path = compose(torso[0], compose(path, mean_offset))
    return _Root(path, fit_twist(path)[0])


def _soles_on_root(motion: Motion, root: _Root) -> np.ndarray:
    """Return the soles (frames, legs, 3) in the frame of the root."""
    return relative_points(root.path[:, None], motion.soles)


def _find_begin(source_gait: _SourceGait, partners: list[int], gait: gaits.Gait) -> float:
    """Return when the gait's cycle begins, so that the first foot that steps touches down as its partner does."""
    for leg, foot in enumerate(partners):
        if source_gait.is_regular[foot]:
            return float(source_gait.steps[foot].starts[0] + gait.offsets[leg] / source_gait.cycles)
    return 0.0


def _find_stance(shares: np.ndarray, first_start: float, gait: gaits.Gait, cycles: int) -> np.ndarray:
    """Return whether a foot stands at shares (frames,) of a loop of a gait, in which a stance begins at a share."""
    return (shares - first_start) % (1.0 / cycles) < gait.duty_factor / cycles


def _warp(shares: np.ndarray, first_start: float, gait: gaits.Gait, steps: _Steps) -> np.ndarray:
    """Return the shares of a motion's loop at which its foot is in the phase of a foot of another gait.

    Both begin a stance at the same time, and end it. In between, time goes evenly.

    Args:
        shares: (frames,) shares of the loop of the other gait.
        first_start: share at which a stance begins there.
        gait: the other gait.
        steps: steps of the motion's foot, one in each cycle.
    """
    cycles = len(steps.starts)
    starts = np.arange(cycles) / cycles + first_start
    duration = gait.duty_factor / cycles
    # The step of the motion that begins nearest to the first of the gait comes first, and the starts of others grow.
    first = int(abs((steps.starts - starts[0] + 0.5) % 1.0 - 0.5).argmin())
    order = np.roll(np.arange(cycles), -first)
    source_starts = steps.starts[order] - np.floor(steps.starts[order] - steps.starts[order[0]])
    source_starts = source_starts + np.round(starts[0] - source_starts[0])
    knots = []
    source_knots = []
    for lap in range(-2, 3):  # the loop goes on before and after
        for start, source_start, source_duration in zip(starts, source_starts, steps.durations[order], strict=True):
            knots += [start + lap, start + lap + duration]
            source_knots += [source_start + lap, source_start + lap + source_duration]
    return np.interp(shares, knots, source_knots)


def _sample(offsets: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return offsets (n, 3) at shares (n,) of a loop of frames (frames, 3), both ends included."""
    return sample_linearly(offsets, (shares % 1.0) * (len(offsets) - 1))


def _nearest_frames(shares: np.ndarray, frames: int) -> np.ndarray:
    return np.rint(shares * (frames - 1)).astype(int)


def _hold_stances(soles: np.ndarray, planted: np.ndarray, root: np.ndarray) -> np.ndarray:
    """Return the path (frames, 3) of a sole that stays in one place in each stance, on the ground.

    A stance takes place in the middle of its path. A swing takes up the differences at its ends, and keeps its height
    over the mean of stances.

    Args:
        soles: (frames, 3) in the world, of a loop with both ends.
        planted: (frames,) when it stands.
        root: (frames, 3) ground poses, by which the loop goes on.
    """
    if not planted[:-1].any():
        return soles
    frames = len(soles) - 1
    path = _repeat_three_times(soles, root)
    path = path + _correct_stances(path, np.tile(planted[:-1], 3))
    loop = path[frames : 2 * frames]
    swing_height = soles[:, 2].max() - soles[planted, 2].mean()
    loop[:, 2] *= (swing_height / max(loop[:, 2].max(), _MIN_HEIGHT)).clip(1.0, _MAX_STRETCH)
    last = place_points(root[-1], relative_points(root[0], loop[:1]))
    return np.concatenate([loop, last])


def _repeat_three_times(soles: np.ndarray, root: np.ndarray) -> np.ndarray:
    """Return the path of a sole in the loop before, in the loop and in the one after it, without its last frame."""
    back = relative_pose(relative_pose(root[0], root[-1]), np.zeros(3))
    starts = (compose(root[0], back), root[0], root[-1])  # where the root begins the three loops
    path_on_root = relative_points(root[0], soles[:-1])
    return np.concatenate([place_points(start, path_on_root) for start in starts])


def _correct_stances(path: np.ndarray, is_planted: np.ndarray) -> np.ndarray:
    """Return what to add to a path (frames, 3) so that a sole stays in one place of the ground in each stance."""
    stance_frames = np.flatnonzero(is_planted)
    corrections = []  # of these frames
    for start, end in find_runs(is_planted).tolist():
        place = np.append(path[start:end, :2].mean(axis=0), 0.0)
        corrections.append(place - path[start:end])
    components = np.concatenate(corrections).T
    frames = np.arange(len(path))
    return np.stack([np.interp(frames, stance_frames, component) for component in components], axis=-1)


def _move_torso(
    motion: Motion, source_root: _Root, root: np.ndarray, shares: np.ndarray, rest_height: float, size: Size
) -> tuple[np.ndarray, np.ndarray]:
    """Return the positions (frames, 3) and quaternions (frames, 4) of a torso that moves on another root as before."""
    ground = rotations.to_heading_frame(
        motion.positions[:, :2] / motion.standing_height - source_root.path[:, :2], source_root.path[:, 2]
    )
    heights = scale_heights(motion.positions[:, 2:] / motion.standing_height, motion.rest_height, rest_height)
    heights = rest_height + size.all * (heights - rest_height)
    local_positions = _sample(np.concatenate([size.ahead_left_up[:2] * ground, heights], axis=-1), shares)
    turns_on_root = rotations.turn_about_z(motion.quaternions, -source_root.path[:, 2])
    local_quaternions = continue_signs(shrink_turns(turns_on_root, size.all * size.side))
    quaternions = _sample(local_quaternions, shares)
    quaternions /= np.linalg.norm(quaternions, axis=-1, keepdims=True)
    return place_points(root, local_positions), rotations.turn_about_z(quaternions, root[:, 2])
