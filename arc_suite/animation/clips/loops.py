"""Loops: parts of recordings whose pose returns.

A loop is found by recurrence: the pose is compared with the pose a whole number of control steps
later, as a gait cycle may not be a whole number of them. The difference at the seam is spread over
the loop.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.recordings import Recording
from arc_suite.animation.clips.root_motion import (
    Motion,
    compose,
    ground_poses,
    integrate_twist,
    put_on_root,
    relative_pose,
    twist_to,
)

GOOD_SEAM = np.radians(0.5)  # a seam up to which loops are equally good
MAX_SEAM = np.radians(2.0)  # a seam from which a loop is refused

_RETURNED = 0.3  # of the largest distance between two poses: a cycle later the distance is less
_SPEED = 10.0  # how much more a loop's speed matters than its drift and turn, in the choice among loops
_NEAREST = 1.2  # times the least seam: where none closes, loops that are chosen among
_TRIED = 200  # loops that are chosen among, at most about
_STRIDE = 5  # substeps: every so many poses are compared in the search for the cycle


def period(recording: Recording) -> float | None:
    """Return the period of the poses, s; None if they do not return.

    It is the first minimum of the mean distance of two poses by the time between them, among those that
    are well below the largest distance.
    """
    joints = recording.poses[:, 7:]
    longest = len(joints) // 2
    first = joints[:longest:_STRIDE]
    distances = np.array(
        [np.sqrt(((joints[lag : lag + longest : _STRIDE] - first) ** 2).mean()) for lag in range(longest)]
    )
    middle = distances[1:-1]
    returns = (middle <= distances[:-2]) & (middle < distances[2:]) & (middle < _RETURNED * distances.max())
    return float(recording.time_step * (1 + returns.argmax())) if returns.any() else None


class Closing(NamedTuple):
    """How well a recording closes to loops of one length.

    Attributes:
        seam: rad, difference of the poses at both ends of the best of them.
        samples: of a loop; the sample after the last is the first one again.
    """

    seam: float
    samples: int


def find_closings(recording: Recording, cycle: float, most: int) -> Mapping[int, Closing]:
    """Return how a recording closes, by the number of cycles.

    Args:
        recording: with some cycles more than the longest loop.
        cycle: s.
        most: cycles of a loop.
    """
    found, substeps = {}, recording.substeps
    for cycles in range(1, most + 1):
        length = cycles * cycle / recording.time_step / substeps
        # A cycle of a whole number of control steps is one up to rounding.
        lengths = {substeps * int(np.floor(length + 1e-6)), substeps * int(np.ceil(length - 1e-6))}
        loops = [
            Closing(float(_seams(recording.poses[:-samples], recording.poses[samples:]).min()), samples)
            for samples in lengths
            if 0 < samples < len(recording.poses)
        ]
        if loops:
            found[cycles] = min(loops)
    return found


def choose_cycles(closings: Mapping[str, Mapping[int, Closing]], bound: float) -> int:
    """Return the least number of cycles with which the fewest of several recordings are refused or over a bound.

    Args:
        closings: of each recording, by a name.
        bound: of the seam, rad.

    Raises:
        ValueError: the recordings have no number of cycles in common.
    """
    common = sorted(set.intersection(*map(set, closings.values())))
    if not common:
        raise ValueError("loops: no number of cycles fits all recordings")

    def over(cycles):
        seams = [each[cycles].seam for each in closings.values()]
        return sum(seam > MAX_SEAM for seam in seams), sum(seam > bound for seam in seams)

    return min(common, key=over)


def choose_start(recording: Recording, samples: int) -> int:
    """Return the sample with which the most typical loop begins, among those that close, or nearly so if none does.

    Loops are compared by the displacement of the root, as the torso's depends on where in its sway the loop begins.

    Args:
        recording: to choose from.
        samples: of the loop.
    """
    place = ground_poses(recording.poses)
    mean = twist_to(relative_pose(place[:-samples], place[samples:]))
    speed, (_, left, turning) = np.hypot(mean[:, 0], mean[:, 1]).mean(), mean.mean(axis=0)
    seams = _seams(recording.poses[:-samples], recording.poses[samples:])
    bound = max(GOOD_SEAM, min(_NEAREST * seams.min(), MAX_SEAM), seams.min())
    firsts = np.flatnonzero(seams <= bound)
    firsts = firsts[:: -(-len(firsts) // _TRIED)]
    displacements = np.stack([_rooted(place[first : first + samples + 1])[0] for first in firsts])
    wrong = abs(np.hypot(displacements[:, 0], displacements[:, 1]) - speed)
    astray = abs(displacements[:, 1] - left) + recording.poses[:, 2].mean() * abs(displacements[:, 2] - turning)
    return int(firsts[(_SPEED * wrong + astray).argmin()])


def cut_loop(recording: Recording, first: int, samples: int) -> Motion:
    """Return a part of a recording as a loop: a root of constant velocity, and a pose that returns exactly.

    Args:
        recording: to take it from.
        first: sample with which it begins.
        samples: of it; the sample after the last is the first one again.
    """
    poses = recording.poses[first : first + samples + 1]
    displacement, local = _rooted(ground_poses(poses))
    root = integrate_twist(displacement, np.linspace(0.0, 1.0, len(poses)))
    motion = close_loop(put_on_root(recording.time_step, poses, root, local))
    return motion._replace(twist=displacement / motion.seconds, seam=float(_seams(poses[:1], poses[-1:])[0]))


def close_loop(motion: Motion) -> Motion:
    """Close a loop: spread the difference of its last pose and its first over it, half to either end."""
    difference = motion.pose(0).relative(motion.pose(-1))
    motion = motion.add_difference(difference, np.linspace(-0.5, 0.5, len(motion.joints)))
    for values in (motion.joints, motion.positions, motion.quaternions):
        values[-1] = values[0]  # up to rounding they are equal already
    return motion


def straighten_loop(motion: Motion, course: float) -> Motion:
    """Return a loop whose root goes in a constant direction, without turning, at the same speed.

    Args:
        motion: a loop.
        course: direction in the root's frame, rad: 0 is forward, positive to the left.
    """
    forward, left, _ = motion.twist
    speed, astray = np.hypot(forward, left), np.arctan2(left, forward) - course
    twist = np.array((speed * np.cos(course), speed * np.sin(course), 0.0))
    return motion._replace(
        root=integrate_twist(twist, motion.time_step * np.arange(len(motion.joints))),
        positions=np.concatenate(
            [rotations.to_heading_frame(motion.positions[:, :2], astray), motion.positions[:, 2:]], axis=-1
        ),
        quaternions=rotations.turn_about_z(motion.quaternions, -astray),
        twist=twist,
    )


def _seams(before, later) -> np.ndarray:
    """Return the differences of poses (n, nq): the largest of joint angles and the torso's tilt, (n,) rad."""
    apart = abs(later[:, 7:] - before[:, 7:]).max(axis=-1)
    # Of two unit vectors, the vertical as the torso sees it: nearly the angle between them.
    tilt = rotations.matrix(later[:, 3:7])[:, 2] - rotations.matrix(before[:, 3:7])[:, 2]
    return np.maximum(apart, np.linalg.norm(tilt, axis=-1))


def _rooted(place) -> tuple[np.ndarray, np.ndarray]:
    """Return the displacement (3,) of a loop's root, and the torso's places (samples, 3) in the root's frame.

    The root runs below the middle of the torso's path, with the torso's mean heading.

    Args:
        place: (samples, 3) of the torso in the world, both ends included.
    """
    place = relative_pose(place[0], place)
    local = relative_pose(integrate_twist(twist_to(place[-1]), np.linspace(0.0, 1.0, len(place))), place)
    center = local[:-1].mean(axis=0)
    return twist_to(relative_pose(center, compose(place[-1], center))), relative_pose(center, local)
