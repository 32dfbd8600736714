"""Planting: feet in stance stay where they touch down, and their soles on the ground, by inverse kinematics."""

import numpy as np

from arc_suite import rotations
from arc_suite.cpg.kinematics import Legs
from arc_suite.export.root_motion import Motion, along, fading
from arc_suite.robots.spec import Body

_STANDS = 0.01  # of the standing height: a lower sole is in stance
_LIFTS = 0.1  # of a cycle: a sole that is higher for less time stays in stance
_WEIGHTS = np.diag((1.0, 1.0, 8.0))  # of a foot's place: legs of two joints slide rather than sink
_DAMPING = 0.005  # of the standing height
_ROUNDS = 30  # of the search for joint angles
_SHARES = (1.0, 0.75, 0.5, 0.25, 0.0)  # of the correction on the ground: the largest is taken that a leg can follow
_SINKS = 0.005  # of the standing height, and
_FASTER = 6.0  # times the fastest joint of the leg before: a leg that needs more does not follow
_LANDS = 0.25  # of a swing, after and before which its height is as it was


def planted(body: Body, motion: Motion, cycle: float, loops: bool) -> Motion:
    """Return the motion with feet that neither slide nor sink in stance.

    A foot in stance stays at the mean of its places. Between two stances the correction of one goes over into that of
    the next. Feet at the ends of a motion that is no loop stay where they are there. A leg of two joints reaches its
    goals in part, and a foot that stays down throughout a loop keeps its slide.

    Args:
        body: the spec.
        motion: whose soles in stance are on the ground.
        cycle: of the gait, s.
        loops: whether the last sample is the first one.
    """
    count = len(motion.joints) - 1
    legs = Legs.of(body, used=1.0)
    radii, legs = legs.radii, legs._replace(radii=np.zeros_like(legs.radii))
    around = _repeated(motion) if loops else motion
    qpos = around.qpos()
    turns, angles = rotations.matrix(qpos[:, 3:7]), legs.by_leg(around.joints)
    feet = (turns[:, None] @ legs.soles(angles)[0][..., None])[..., 0] + qpos[:, None, :3]
    corrections = np.zeros_like(feet)
    for leg, radius in enumerate(radii):
        low = feet[:, leg, 2] - radius < _STANDS * body.torso.standing_height
        intervals = _stances(low, round(_LIFTS * cycle / motion.step), count if loops else None)
        corrections[:, leg] = _corrections(feet[:, leg], radius, intervals, not loops)
    rows = slice(count, 2 * count + 1) if loops else slice(None)
    feet, corrections, places, turns, angles = (
        values[rows] for values in (feet, corrections, qpos[:, None, :3], turns, angles)
    )
    # A joint may be a little beyond its range, as limits are soft.
    legs = legs._replace(low=np.minimum(legs.low, angles.min(axis=0)), high=np.maximum(legs.high, angles.max(axis=0)))
    height, found, waits = body.torso.standing_height, angles, np.ones(len(radii), bool)
    for share in _SHARES:
        goals = feet + corrections * (share, share, 1.0)
        goals[..., 2] = np.maximum(goals[..., 2], radii)
        seen = (turns.swapaxes(-1, -2)[:, None] @ (goals - places)[..., None])[..., 0]
        reached = legs.reached(angles, seen, _WEIGHTS, _DAMPING * height, _ROUNDS)
        missed = abs((turns[:, None] @ (legs.soles(reached)[0] - seen)[..., None])[..., 2, 0]).max(axis=0)
        paces, before = (abs(np.diff(each, axis=0)).max(axis=(0, 2)) for each in (reached, angles))
        follows = waits & (missed <= _SINKS * height) & (paces <= _FASTER * before)
        found = np.where(follows[:, None], reached, found)
        waits &= ~follows
    joints = legs.by_joint(found)
    if loops:
        joints[-1] = joints[0]
    return motion._replace(joints=joints)


def _repeated(motion: Motion) -> Motion:
    """Return a loop three times over, on one path of the root."""
    count = len(motion.joints) - 1

    def tiled(values):
        return np.concatenate([np.tile(values[:-1], (3, 1)), values[:1]])

    return motion._replace(
        root=along(motion.twist, motion.step * np.arange(3 * count + 1)),
        positions=tiled(motion.positions),
        quaternions=tiled(motion.quaternions),
        joints=tiled(motion.joints),
    )


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


def _corrections(places: np.ndarray, radius: float, intervals, keeps_ends: bool) -> np.ndarray:
    """Return what to add to the places (samples, 3) of a foot, m."""
    count = len(places)
    found = np.zeros_like(places)
    before = 0, np.zeros(3)  # the end of the latest stance, and its correction there
    for start, end in intervals:
        share = (np.arange(end - start) / max(end - start - 1, 1))[:, None]
        weights = [fading(share), fading(1.0 - share)]  # of the motion's own first and last places
        kept = [keeps_ends and start == 0, keeps_ends and end == count]
        anchors = [places[start], places[end - 1]]
        if kept == [False, False]:
            held = places[start:end].mean(axis=0)
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
        found[start + 1 : end] = fading(share) * at_start + (1.0 - fading(share)) * at_end
        height = fading(share / _LANDS) * at_start + fading((1.0 - share) / _LANDS) * at_end
        found[start + 1 : end, 2] = height[:, 2]
