"""Loops of steps for another body: the path of each foot by its own phase, in the other body's gait.

All lengths are in standing heights, and times in shares of the loop.
"""

from typing import NamedTuple

import numpy as np

from arc_suite import robots, rotations
from arc_suite.models.stride import fitted_gait
from arc_suite.motions import motion as values
from arc_suite.motions.ground_poses import compose, ground_poses, integrate_twist, relative_pose, twist_to
from arc_suite.motions.motion import Motion
from arc_suite.motions.paths import Paths, Size, match_feet, scale_heights, shrink_turns, time_scale
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


class _Root(NamedTuple):
    """A frame that moves over the ground with the mean of the torso.

    Attributes:
        path: (frames, 3) ground poses, x and y in standing heights.
        twist: (3,) in a loop.
    """

    path: np.ndarray
    twist: np.ndarray


def count_cycles(motion: Motion) -> int:
    """Return how many steps feet take in a loop, most of them; 0 for a motion without steps."""
    if not motion.loops:
        return 0
    counts = np.array([len(_find_steps(planted).starts) for planted in motion.planted[:-1].T])
    return int(np.median(counts[counts > 0])) if (counts > 0).sum() > 1 else 0


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
    cycles = count_cycles(motion)
    gait = find_gait(body)
    height = body.torso.standing_height
    rest_soles, rest_height = values.find_rest(body)
    rest_soles = rest_soles / height
    partners = _find_partners(motion, rest_soles)
    steps = [_find_steps(planted) for planted in motion.planted[:-1].T]
    is_regular = np.array([len(of_foot.starts) == cycles for of_foot in steps])
    duty_factor = float(np.mean([steps[foot].durations.sum() for foot in np.flatnonzero(is_regular)]))
    duty_factor = min(max(duty_factor, _MIN_DUTY_FACTOR), _MAX_DUTY_FACTOR)

    # With the same strides at the same speed, a loop of a shorter stance takes less time.
    time_ratio = duty_factor / gait.duty_factor
    seconds = motion.seconds * time_ratio * time_scale(motion.standing_height, height)
    notes = [
        f"gait: {cycles} cycles with a duty factor of {gait.duty_factor:.2f}, before {duty_factor:.2f}; "
        f"{seconds:.3f} s, before {motion.seconds:.3f} s"
    ]
    frames = max(motion.frames, round(seconds * motion.frame_rate) + 1)
    shares = np.linspace(0.0, 1.0, frames)
    source_root = _find_root(motion)
    root = integrate_twist(source_root.twist * time_ratio * size.all * (1.0, size.side, 1.0), shares)
    offsets = size.ahead_left_up * (_soles_on_root(motion, source_root) - motion.rest_soles)  # (frames, feet, 3)

    soles = np.empty((frames, len(partners), 3))
    planted = np.empty((frames, len(partners)), bool)
    begin = _find_begin(steps, partners, gait, cycles, is_regular)
    for leg, foot in enumerate(partners):
        if not is_regular[foot]:
            planted[:, leg] = motion.planted[_nearest_frames(shares, motion.frames), foot]
            soles[:, leg] = _place(root, rest_soles[leg] + _sample(offsets[:, foot], shares))
            continue
        first_start = begin - gait.offsets[leg] / cycles
        step_duration = gait.duty_factor / cycles
        planted[:, leg] = (shares - first_start) % (1.0 / cycles) < step_duration
        source_shares = _warp(shares, np.arange(cycles) / cycles + first_start, step_duration, steps[foot])
        soles[:, leg] = _place(root, rest_soles[leg] + _sample(offsets[:, foot], source_shares))
        soles[:, leg] = _hold_stances(soles[:, leg], planted[:, leg], root)
    notes += _note_irregular_feet(body, partners, is_regular)
    positions, quaternions = _move_torso(motion, source_root, root, shares, rest_height / height, size)
    return Paths(seconds, positions, quaternions, soles, planted), notes


def _note_irregular_feet(body: Body, partners: list[int], is_regular: np.ndarray) -> list[str]:
    """Return a line that names the legs whose partners do not step once in each cycle; none without such legs."""
    names = [body.legs[leg].name for leg, foot in enumerate(partners) if not is_regular[foot]]
    return [f"without steps of their own in each cycle: {', '.join(names)}"] if names else []


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
    next_ends = np.array([ends[(ends - start) % frames == ((ends - start) % frames).min()][0] for start in starts])
    return _Steps(starts / frames, ((next_ends - starts) % frames) / frames)


def _find_root(motion: Motion) -> _Root:
    """Return the frame that moves as the torso does in the mean of a loop."""
    shares = np.linspace(0.0, 1.0, motion.frames)
    poses = np.concatenate([motion.positions, motion.quaternions], axis=-1)
    torso = ground_poses(poses) / (motion.standing_height, motion.standing_height, 1.0)
    path = integrate_twist(twist_to(relative_pose(torso[0], torso[-1])), shares)
    mean_offset = relative_pose(path, relative_pose(torso[0], torso))[:-1].mean(axis=0)
    path = compose(torso[0], compose(path, mean_offset))
    return _Root(path, twist_to(relative_pose(path[0], path[-1])))


def _soles_on_root(motion: Motion, root: _Root) -> np.ndarray:
    """Return the soles (frames, legs, 3) in the frame of the root."""
    ground = rotations.to_heading_frame(motion.soles[..., :2] - root.path[:, None, :2], root.path[:, None, 2])
    return np.concatenate([ground, motion.soles[..., 2:]], axis=-1)


def _find_begin(steps, partners, gait: gaits.Gait, cycles: int, is_regular) -> float:
    """Return when the gait's cycle begins, so that the first foot that steps touches down as its partner does."""
    for leg, foot in enumerate(partners):
        if is_regular[foot]:
            return float(steps[foot].starts[0] + gait.offsets[leg] / cycles)
    return 0.0


def _warp(shares: np.ndarray, starts: np.ndarray, duration: float, steps: _Steps) -> np.ndarray:
    """Return the shares of a motion's loop at which its foot is in the phase of another foot.

    Args:
        shares: (frames,) shares of the other loop.
        starts: (cycles,) shares at which stances begin there.
        duration: of these stances.
        steps: steps of the motion's foot.
    """
    first = int(abs((steps.starts - starts[0] + 0.5) % 1.0 - 0.5).argmin())
    laps = np.arange(-2, 3)
    order = np.roll(np.arange(len(starts)), -first)
    source_starts = steps.starts[order] - np.floor(steps.starts[order] - steps.starts[order[0]])
    source_starts = source_starts + np.round(starts[0] - source_starts[0])
    knots = []
    source_knots = []
    for lap in laps:
        for start, source_start, source_duration in zip(starts, source_starts, steps.durations[order], strict=True):
            knots += [start + lap, start + lap + duration]
            source_knots += [source_start + lap, source_start + lap + source_duration]
    return np.interp(shares, knots, source_knots)


def _sample(offsets: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """Return offsets (n, 3) at shares (n,) of a loop of frames (frames, 3), both ends included."""
    places = (shares % 1.0) * (len(offsets) - 1)
    previous = np.minimum(places.astype(int), len(offsets) - 2)
    share = (places - previous)[:, None]
    return (1.0 - share) * offsets[previous] + share * offsets[previous + 1]


def _nearest_frames(shares: np.ndarray, frames: int) -> np.ndarray:
    return np.rint(shares * (frames - 1)).astype(int)


def _place(root: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return points (..., 3) of the root's frame in the world, given ground poses (..., 3) of the root."""
    return np.concatenate([compose(root, points)[..., :2], points[..., 2:]], axis=-1)


def _hold_stances(soles: np.ndarray, planted: np.ndarray, root: np.ndarray) -> np.ndarray:
    """Return the path (frames, 3) of a sole that stays in one place in each stance, on the ground.

    A stance takes place in the middle of its path. A swing takes up the differences at its ends, and keeps its height
    over the mean of stances.

    Args:
        soles: (frames, 3) in the world, of a loop with both ends.
        planted: (frames,) when it stands.
        root: (frames, 3) ground poses, by which the loop goes on.
    """
    frames = len(soles) - 1
    displacement = relative_pose(root[0], root[-1])
    back = relative_pose(displacement, np.zeros(3))
    # Three cycles in a row, the middle one being the loop.
    cycle_starts = [compose(root[0], back), root[0], root[-1]]
    local = [_to_frame(soles[:-1], root[0])] * 3
    path = np.concatenate([_place(start, part) for start, part in zip(cycle_starts, local, strict=True)])
    stands = np.tile(planted[:-1], 3)
    edges = np.flatnonzero(np.diff(stands.astype(int), prepend=0, append=0)).reshape(-1, 2)
    standing = []
    corrections = []
    for start, end in edges.tolist():
        place = np.append(path[start:end, :2].mean(axis=0), 0.0)
        standing += list(range(start, end))
        corrections += list(place - path[start:end])
    if not standing:
        return soles
    indices = np.arange(len(path))
    correction = np.stack([np.interp(indices, standing, component) for component in np.array(corrections).T], axis=-1)
    middle = (path + correction)[frames : 2 * frames]
    swing_height = soles[:, 2].max() - soles[planted, 2].mean()
    middle[:, 2] *= (swing_height / max(middle[:, 2].max(), _MIN_HEIGHT)).clip(1.0, _MAX_STRETCH)
    last = _place(root[-1], _to_frame(middle[:1], root[0]))
    return np.concatenate([middle, last])


def _to_frame(points: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """Return points (n, 3) of the world in the frame of a ground pose (3,)."""
    ground = rotations.to_heading_frame(points[:, :2] - frame[:2], frame[2])
    return np.concatenate([ground, points[:, 2:]], axis=-1)


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
    local_quaternions = shrink_turns(
        rotations.turn_about_z(motion.quaternions, -source_root.path[:, 2]), size.all * size.side
    )
    quaternions = _sample(local_quaternions, shares)
    quaternions /= np.linalg.norm(quaternions, axis=-1, keepdims=True)
    return _place(root, local_positions), rotations.turn_about_z(quaternions, root[:, 2])
