"""Planting: feet in stance stay where they touch down, and their soles on the ground, by inverse kinematics."""

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.root_motion import Motion, fade_out, integrate_twist
from arc_suite.models.kinematics import Legs
from arc_suite.robots.spec import Body

_STANDS = 0.01  # of the standing height: a lower sole is in stance
_LIFTS = 0.1  # of a cycle: a sole that is higher for less time stays in stance
_WEIGHTS = np.diag((1.0, 1.0, 8.0))  # of a foot's place: legs of two joints slide rather than sink
_DAMPING = 0.005  # of the standing height
_ROUNDS = 30  # of the search for joint angles
_SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)  # of the correction on the ground: the largest is taken that a leg can follow
_SINKS = 0.005  # of the standing height, and
_FASTER = 6.0  # times the fastest joint of the leg unplanted: a leg that needs more does not follow
_LANDS = 0.05  # of a swing, after and before which its height is as it was: near the ground a foot would still slide
_SMOOTH = 0.036  # of a cycle, to either side, over which corrections are smoothed
_PASSES = 3  # in each, a foot stays in the middle of where the pass before could bring it


def plant_feet(body: Body, motion: Motion, cycle: float, loops: bool) -> Motion:
    """Return the motion with feet that neither slide nor sink in stance.

    A foot in stance stays in the middle of its places. Between two stances the correction of one goes over into that of
    the next. Feet at the ends of a motion that is no loop stay where they are there. A leg of two joints reaches its
    goals in part, and a foot that stays down throughout a loop keeps its slide.

    Args:
        body: the spec.
        motion: whose soles in stance are on the ground.
        cycle: of the gait, s.
        loops: whether the last sample is the first one.
    """
    legs, height = Legs.of(body, used=1.0), body.torso.standing_height
    low = _feet(legs, _repeated(motion) if loops else motion)[..., 2] - legs.radii < _STANDS * height
    longest = len(motion.joints) - 1 if loops else None
    stances = [_stances(each, round(_LIFTS * cycle / motion.time_step), longest) for each in low.T]
    angles = legs.by_leg(motion.joints)
    # A joint may be a little beyond its range, as limits are soft.
    legs = legs._replace(low=np.minimum(legs.low, angles.min(axis=0)), high=np.maximum(legs.high, angles.max(axis=0)))
    fastest, before = _FASTER * _paces(angles), motion.joints
    for _ in range(_PASSES):
        motion = _nearer(legs, height, motion, stances, fastest, loops)
    change = _smooth(motion.joints - before, round(_SMOOTH * cycle / motion.time_step), loops)
    return motion._replace(joints=before + change)


def _smooth(values: np.ndarray, width: int, loops: bool) -> np.ndarray:
    """Return values (samples, n) as means over samples, so that a foot which leaves the ground does not jerk.

    Args:
        values: to smooth; those at the ends of a motion that is no loop stay.
        width: samples to either side.
        loops: whether the last sample is the first one.
    """
    if loops:
        around = values[np.arange(-width, len(values) + width) % (len(values) - 1)]
    else:
        first, last = 2.0 * values[0] - values[width:0:-1], 2.0 * values[-1] - values[-2 : -width - 2 : -1]
        around = np.concatenate([first, values, last])
    weights = np.hanning(2 * width + 3)[1:-1]
    return np.stack([np.convolve(each, weights / weights.sum(), "valid") for each in around.T], axis=-1)


def slip(body: Body, motion: Motion) -> float | None:
    """Return the path of a sole in stance, m a meter of the root, as a mean over the feet; None if the root stays."""
    legs, path = Legs.of(body), np.linalg.norm(np.diff(motion.root[:, :2], axis=0), axis=-1).sum()
    if path < _STANDS * body.torso.standing_height:
        return None
    feet = _feet(legs, motion)
    low = feet[..., 2] - legs.radii < _STANDS * body.torso.standing_height
    paths = np.linalg.norm(np.diff(feet[..., :2], axis=0), axis=-1) * (low[1:] & low[:-1])
    return float(paths.sum(axis=0).mean() / path)


def _nearer(legs: Legs, height: float, motion: Motion, stances, fastest: np.ndarray, loops: bool) -> Motion:
    """Return the motion with feet in stance nearer to a place on the ground that is the same throughout the stance.

    Args:
        legs: of the body.
        height: at which the body stands, m.
        motion: to change.
        stances: of each foot, intervals of samples; in a loop, of three rounds.
        fastest: (legs,) rad, by which a joint of a leg may turn between two samples.
        loops: whether the last sample is the first one.
    """
    count, around = len(motion.joints) - 1, _repeated(motion) if loops else motion
    feet = _feet(legs, around)
    corrections = np.zeros_like(feet)
    for leg, radius in enumerate(legs.radii):
        corrections[:, leg] = _corrections(feet[:, leg], radius, stances[leg], not loops)
    rows = slice(count, 2 * count + 1) if loops else slice(None)
    feet, corrections, poses = feet[rows], corrections[rows], around.poses()[rows]
    turns, places, angles = rotations.matrix(poses[:, 3:7]), poses[:, None, :3], legs.by_leg(poses[:, 7:])
    centers, found, waits = _centers(legs), angles, np.ones(len(legs.radii), bool)
    for share in _SHARES:
        goals = feet + corrections * (share, share, 1.0)
        goals[..., 2] = np.maximum(goals[..., 2], legs.radii)
        seen = (turns.swapaxes(-1, -2)[:, None] @ (goals - places)[..., None])[..., 0]
        reached = centers.reached(angles, seen, _WEIGHTS, _DAMPING * height, _ROUNDS)
        missed = abs((turns[:, None] @ (centers.soles(reached)[0] - seen)[..., None])[..., 2, 0]).max(axis=0)
        follows = waits & (missed <= _SINKS * height) & (_paces(reached) <= fastest)
        found = np.where(follows[:, None], reached, found)
        waits &= ~follows
        if not waits.any():
            break
    joints = legs.by_joint(found)
    if loops:
        joints[-1] = joints[0]
    return motion._replace(joints=joints)


def _centers(legs: Legs) -> Legs:
    """Return the legs with the centers of feet for soles."""
    return legs._replace(radii=np.zeros_like(legs.radii))


def _feet(legs: Legs, motion: Motion) -> np.ndarray:
    """Return the places (samples, legs, 3) of the centers of feet in the world, m."""
    poses = motion.poses()
    places = _centers(legs).soles(legs.by_leg(motion.joints))[0]
    return (rotations.matrix(poses[:, 3:7])[:, None] @ places[..., None])[..., 0] + poses[:, None, :3]


def _paces(angles: np.ndarray) -> np.ndarray:
    """Return the largest turn (legs,) of a joint of each leg between two of the samples (samples, legs, links), rad."""
    return abs(np.diff(angles, axis=0)).max(axis=(0, 2))


def _repeated(motion: Motion) -> Motion:
    """Return a loop three times over, on one path of the root."""
    count = len(motion.joints) - 1
    root = integrate_twist(motion.twist, motion.time_step * np.arange(3 * count + 1))
    return motion.map_arrays(lambda values: values[np.arange(3 * count + 1) % count])._replace(root=root)


def _stances(low: np.ndarray, least: int, longest: int | None) -> list[tuple[int, int]]:
    """Return the intervals of samples in which a foot is low, those apart by less than `least` as one."""
    edges = np.flatnonzero(np.diff(low.astype(int), prepend=0, append=0)).reshape(-1, 2)
    joined: list[tuple[int, int]] = []
    for start, end in edges.tolist():
        if joined and start - joined[-1][1] < least:
            joined[-1] = joined[-1][0], end
        else:
            joined.append((start, end))
    return [(start, end) for start, end in joined if longest is None or end - start < longest]


def _corrections(places: np.ndarray, radius: float, intervals: list[tuple[int, int]], keeps_ends: bool) -> np.ndarray:
    """Return what to add to the places (samples, 3) of a foot, m."""
    count = len(places)
    found = np.zeros_like(places)
    before: tuple[int, np.ndarray] = (0, np.zeros(3))  # the end of the latest stance, and its correction there
    for start, end in intervals:
        share = (np.arange(end - start) / max(end - start - 1, 1))[:, None]
        weights = [fade_out(share), fade_out(1.0 - share)]  # of the motion's own first and last places
        kept = [keeps_ends and start == 0, keeps_ends and end == count]
        anchors = [places[start], places[end - 1]]
        if kept == [False, False]:
            held = 0.5 * (places[start:end].min(axis=0) + places[start:end].max(axis=0))
        elif all(kept):  # the foot goes over from one to the other
            held = weights[0] * anchors[0] + weights[1] * anchors[1]
        else:
            held = anchors[kept.index(True)]
        found[start:end] = held - places[start:end]
        found[start:end, 2] = radius - places[start:end, 2]
        for weight in (weight for weight, keeps in zip(weights, kept, strict=True) if keeps):
            found[start:end, 2] *= 1.0 - weight[:, 0]  # the foot comes to the ground during the stance
        _bridge(found, *before, start, found[start])
        before = end - 1, found[end - 1]
    _bridge(found, *before, count, np.zeros(3))
    return found


def _bridge(found: np.ndarray, start: int, at_start: np.ndarray, end: int, at_end: np.ndarray) -> None:
    """Fill in corrections between two samples; that of the height soon fades."""
    if end > start + 1:
        share = (np.arange(1, end - start) / (end - start))[:, None]
        found[start + 1 : end] = fade_out(share) * at_start + (1.0 - fade_out(share)) * at_end
        height = fade_out(share / _LANDS) * at_start + fade_out((1.0 - share) / _LANDS) * at_end
        found[start + 1 : end, 2] = height[:, 2]
