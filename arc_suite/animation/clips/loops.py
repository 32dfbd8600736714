"""Loops: parts of recordings whose pose returns.

A loop is found by recurrence: a pose is compared with the pose a whole number of control steps later, as a gait cycle
may not be a whole number of them. The difference at the seam is spread over the loop.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.recordings import Recording
from arc_suite.animation.clips.root_motion import ClipMotion, put_on_root
from arc_suite.motions.ground_poses import compose, ground_poses, integrate_twist, relative_pose, twist_to

GOOD_SEAM = np.radians(0.5)  # rad: up to this seam, loops are equally good
MAX_SEAM = np.radians(2.0)  # rad: a loop with a larger seam is refused

_MAX_RETURN_DISTANCE = 0.3  # of the largest distance between two poses: a cycle later the distance is less
_COMPARED_SAMPLES_STRIDE = 5  # samples between the poses that are compared in the search for the cycle
_NEAREST_SEAMS = 1.2  # times the least seam: up to this seam, loops are candidates where none closes
_MAX_CANDIDATES = 200  # about: candidates are thinned out to this number
_SPEED_WEIGHT = 10.0  # of a loop's speed, against its drift and turn, in the choice among candidates


def period(recording: Recording) -> float | None:
    """Return the period of the poses, s; None if they do not return.

    The distance of two poses is averaged over the recording, by the time between them. The period is the first minimum
    of this mean that is well below the largest distance.
    """
    joints = recording.poses[:, 7:]
    max_lag = len(joints) // 2
    earlier = joints[:max_lag:_COMPARED_SAMPLES_STRIDE]
    distance_of_lag = np.empty(max_lag)
    for lag in range(max_lag):
        later = joints[lag : lag + max_lag : _COMPARED_SAMPLES_STRIDE]
        distance_of_lag[lag] = np.sqrt(((later - earlier) ** 2).mean())
    middle = distance_of_lag[1:-1]
    is_minimum = (middle <= distance_of_lag[:-2]) & (middle < distance_of_lag[2:])
    returns = is_minimum & (middle < _MAX_RETURN_DISTANCE * distance_of_lag.max())
    if not returns.any():
        return None
    period_samples = 1 + returns.argmax()
    return float(recording.time_step * period_samples)


class Closing(NamedTuple):
    """How well a recording closes to loops of one length.

    Attributes:
        seam: rad, difference of the poses at both ends of the best of these loops.
        samples: samples of a loop; the sample after the last is the first one again.
    """

    seam: float
    samples: int


def find_closings(recording: Recording, cycle: float, most_cycles: int) -> Mapping[int, Closing]:
    """Return how a recording closes, by the number of gait cycles in a loop.

    Args:
        recording: with some cycles more than the longest loop.
        cycle: cycle of the gait, s.
        most_cycles: in a loop.
    """
    substeps = recording.substeps
    closing_of_cycles = {}
    for cycles in range(1, most_cycles + 1):
        control_steps = cycles * cycle / recording.time_step / substeps
        # A cycle of a whole number of control steps is one up to rounding.
        shorter = substeps * int(np.floor(control_steps + 1e-6))
        longer = substeps * int(np.ceil(control_steps - 1e-6))
        candidates = []
        for samples in {shorter, longer}:
            if 0 < samples < len(recording.poses):
                seams = _measure_seams(recording.poses[:-samples], recording.poses[samples:])
                candidates.append(Closing(float(seams.min()), samples))
        if candidates:
            closing_of_cycles[cycles] = min(candidates)  # by the seam
    return closing_of_cycles


def choose_cycles(closings: Mapping[str, Mapping[int, Closing]], good_seam: float) -> int:
    """Return the number of gait cycles with which several recordings close best.

    The fewest recordings have a seam over `MAX_SEAM`, then the fewest one over `good_seam`; of equal numbers the least.

    Args:
        closings: closings of each recording, by its name; see `find_closings`.
        good_seam: rad.

    Raises:
        ValueError: the recordings have no number of cycles in common.
    """
    cycles_of_each = [set(closing_of_cycles) for closing_of_cycles in closings.values()]
    common_cycles = sorted(set.intersection(*cycles_of_each))
    if not common_cycles:
        raise ValueError("loops: no number of cycles fits all recordings")

    def count_bad_seams(cycles):
        seams = [closing_of_cycles[cycles].seam for closing_of_cycles in closings.values()]
        refused = sum(seam > MAX_SEAM for seam in seams)
        not_good = sum(seam > good_seam for seam in seams)
        return refused, not_good

    return min(common_cycles, key=count_bad_seams)


def find_starts(recording: Recording, samples: int) -> np.ndarray:
    """Return samples (n,) with which loops begin that close, or nearly so if none does; about 200 at most.

    Args:
        recording: recording to choose from.
        samples: samples of the loop.
    """
    seams = _measure_seams(recording.poses[:-samples], recording.poses[samples:])
    nearly_closed = min(_NEAREST_SEAMS * seams.min(), MAX_SEAM)
    starts = np.flatnonzero(seams <= max(GOOD_SEAM, nearly_closed, seams.min()))
    stride = -(-len(starts) // _MAX_CANDIDATES)  # rounded up
    return starts[::stride]


def choose_start(recording: Recording, samples: int, starts: np.ndarray) -> int:
    """Return the sample with which the most typical loop begins.

    Loops are compared by the displacement of the root, as the torso's depends on where in its sway the loop begins.

    Args:
        recording: recording to choose from.
        samples: samples of the loop.
        starts: (n,) samples to choose from.
    """
    torso = ground_poses(recording.poses)
    displacements = twist_to(relative_pose(torso[:-samples], torso[samples:]))
    mean_distance = np.hypot(displacements[:, 0], displacements[:, 1]).mean()
    _, mean_left, mean_turn = displacements.mean(axis=0)

    root_displacements = np.stack([_fit_root(torso[first : first + samples + 1])[0] for first in starts])
    distances = np.hypot(root_displacements[:, 0], root_displacements[:, 1])
    distance_errors = abs(distances - mean_distance)
    mean_height = recording.poses[:, 2].mean()
    drifts = abs(root_displacements[:, 1] - mean_left) + mean_height * abs(root_displacements[:, 2] - mean_turn)
    best = (_SPEED_WEIGHT * distance_errors + drifts).argmin()
    return int(starts[best])


def cut_loop(recording: Recording, first: int, samples: int) -> ClipMotion:
    """Return a part of a recording as a loop: a root of constant velocity, and a pose that returns exactly.

    Args:
        recording: recording to take the loop from.
        first: sample with which the loop begins.
        samples: samples of the loop; the sample after the last is the first one again.
    """
    poses = recording.poses[first : first + samples + 1]
    displacement, torso_on_root = _fit_root(ground_poses(poses))
    root = integrate_twist(displacement, np.linspace(0.0, 1.0, len(poses)))
    motion = close_loop(put_on_root(recording.time_step, poses, root, torso_on_root))
    (seam,) = _measure_seams(poses[:1], poses[-1:])
    return motion._replace(twist=displacement / motion.seconds, seam=float(seam))


def close_loop(motion: ClipMotion) -> ClipMotion:
    """Close a loop: spread the difference between its last pose and its first over it, half to either end."""
    difference = motion.pose(0).relative(motion.pose(-1))
    motion = motion.add_difference(difference, np.linspace(-0.5, 0.5, len(motion.joints)))
    for values in (motion.joints, motion.positions, motion.quaternions):
        values[-1] = values[0]  # up to rounding they are equal already
    return motion


def straighten_loop(motion: ClipMotion, course: float) -> ClipMotion:
    """Return a loop whose root goes in a constant direction, without turning, at the same speed.

    Args:
        motion: a loop.
        course: direction in the root's frame, rad: 0 is forward, positive to the left.
    """
    forward, left, _ = motion.twist
    speed = np.hypot(forward, left)
    drift = np.arctan2(left, forward) - course  # rad
    twist = np.array((speed * np.cos(course), speed * np.sin(course), 0.0))
    horizontal = rotations.to_heading_frame(motion.positions[:, :2], drift)
    return motion._replace(
        root=integrate_twist(twist, motion.time_step * np.arange(len(motion.joints))),
        positions=np.concatenate([horizontal, motion.positions[:, 2:]], axis=-1),
        quaternions=rotations.turn_about_z(motion.quaternions, -drift),
        twist=twist,
    )


def _measure_seams(earlier, later) -> np.ndarray:
    """Return the differences (n,), rad, of poses (n, 7 + joints): the largest of joint angles and the torso's tilt."""
    joint_differences = abs(later[:, 7:] - earlier[:, 7:]).max(axis=-1)
    # The vertical in the torso's frame: two unit vectors, whose distance is nearly the angle between them.
    tilts = rotations.matrix(later[:, 3:7])[:, 2] - rotations.matrix(earlier[:, 3:7])[:, 2]
    return np.maximum(joint_differences, np.linalg.norm(tilts, axis=-1))


def _fit_root(torso) -> tuple[np.ndarray, np.ndarray]:
    """Return the twist (3,) of a loop's root, in a unit of time, and the torso's ground poses in the root's frame.

    The root runs below the middle of the torso's path, with the torso's mean heading.

    Args:
        torso: (samples, 3) its ground poses in the world, both ends included.
    """
    torso = relative_pose(torso[0], torso)  # from here on, in the frame of the first
    arc = integrate_twist(twist_to(torso[-1]), np.linspace(0.0, 1.0, len(torso)))
    torso_on_arc = relative_pose(arc, torso)
    center = torso_on_arc[:-1].mean(axis=0)
    root_twist = twist_to(relative_pose(center, compose(torso[-1], center)))
    return root_twist, relative_pose(center, torso_on_arc)
