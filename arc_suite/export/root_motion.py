"""Root motion of recordings: a root that moves over the ground, and a body that moves relative to it.

A loop is found by recurrence: the pose is compared with the pose a whole number of control steps
later, as a gait cycle may not be a whole number of them. The difference at the seam is spread over
the loop.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.export.recordings import Recording
from arc_suite.models.sizing import SUBSTEPS

CLOSED = np.radians(0.5)  # a seam up to which no longer loop is tried
OPEN = np.radians(2.0)  # a seam from which a loop is refused
MOST_CYCLES = 12  # of a loop

_RETURNED = 0.3  # of the largest distance between two poses: a cycle later the distance is less
_USUAL = 0.01  # by which share a loop's speed may differ from the walk's
_SPEED = 10.0  # how much more a loop's speed matters than its drift and turn, in the choice among loops
_NEAREST = 1.2  # times the least seam: where none closes, loops that are chosen among
_TRIED = 200  # loops that are chosen among, at most about
_STRIDE = 5  # substeps: every so many poses are compared in the search for the cycle


class Motion(NamedTuple):
    """A body over the time of a clip, at even steps, ends included.

    Attributes:
        step: s between two samples.
        root: (samples, 3) the root on the ground: x, y, m, and yaw, rad, from 0.
        positions: (samples, 3) of the torso in the root's frame, m.
        quaternions: (samples, 4) of the torso in the root's frame, w first.
        joints: (samples, joints) rad.
        twist: (3,) mean velocity of the root in its own frame: forward and left, m/s, turning, rad/s.
        seam: rad, difference of the last pose and the first before it was closed; 0 if the motion is no loop.
    """

    step: float
    root: np.ndarray
    positions: np.ndarray
    quaternions: np.ndarray
    joints: np.ndarray
    twist: np.ndarray
    seam: float = 0.0

    @property
    def seconds(self) -> float:
        """Duration, s."""
        return self.step * (len(self.joints) - 1)

    def qpos(self) -> np.ndarray:
        """Return MuJoCo's positions in the world, (samples, 7 + joints)."""
        heading = self.root[:, 2]
        ahead, left, height = self.positions.T
        across = rotations.headed(np.stack([ahead, left], axis=-1), -heading)
        place = np.concatenate([self.root[:, :2] + across, height[:, None]], axis=-1)
        return np.concatenate([place, rotations.turned(self.quaternions, heading), self.joints], axis=-1)

    def lowered(self, height: float) -> "Motion":
        """Return the motion with the torso lower by a height, m."""
        return self._replace(positions=self.positions - (0.0, 0.0, height))

    def begun(self, sample: int) -> "Motion":
        """Return the loop with another of its samples first."""

        def rolled(values):
            turned = np.roll(values[:-1], -sample, axis=0)
            return np.concatenate([turned, turned[:1]])

        return self._replace(
            positions=rolled(self.positions), quaternions=rolled(self.quaternions), joints=rolled(self.joints)
        )

    def part(self, first: int, samples: int) -> "Motion":
        """Return a part of the motion, `samples` after the first one, whose root starts at 0."""
        rows = slice(first, first + samples + 1)
        fields = {name: getattr(self, name)[rows] for name in ("positions", "quaternions", "joints")}
        root = relative(self.root[first], self.root[rows])
        return self._replace(root=root, **fields, twist=logarithm(root[-1]) / (self.step * (len(root) - 1)))

    def at(self, times: np.ndarray) -> "Motion":
        """Return the motion at even times (frames,), s, interpolated between samples."""
        place = (np.asarray(times) / self.step).clip(0.0, len(self.joints) - 1)
        before = np.minimum(place.astype(int), len(self.joints) - 2)
        share = (place - before)[:, None]

        def between(values):
            return (1.0 - share) * values[before] + share * values[before + 1]

        quaternions = between(self.quaternions)  # 2 ms apart, where a straight line is as good as an arc
        quaternions /= np.linalg.norm(quaternions, axis=-1, keepdims=True)
        return self._replace(
            step=float(times[1] - times[0]),
            root=between(self.root),
            positions=between(self.positions),
            quaternions=quaternions,
            joints=between(self.joints),
        )


def period(recording: Recording) -> float | None:
    """Return the period of the poses, s; None if they do not return.

    It is the first minimum of the mean distance of two poses by the time between them, among those that
    are well below the largest distance.
    """
    joints = recording.qpos[:, 7:]
    longest = len(joints) // 2
    first = joints[:longest:_STRIDE]
    distances = np.array(
        [np.sqrt(((joints[lag : lag + longest : _STRIDE] - first) ** 2).mean()) for lag in range(longest)]
    )
    middle = distances[1:-1]
    returns = (middle <= distances[:-2]) & (middle < distances[2:]) & (middle < _RETURNED * distances.max())
    return float(recording.step * (1 + returns.argmax())) if returns.any() else None


class Closing(NamedTuple):
    """How well a recording closes to loops of one length.

    Attributes:
        seam: rad, difference of the poses at both ends of the best of them.
        samples: of a loop; the sample after the last is the first one again.
    """

    seam: float
    samples: int


def closings(recording: Recording, cycle: float) -> Mapping[int, Closing]:
    """Return how a recording closes, by the number of cycles.

    Args:
        recording: with some cycles more than the longest loop.
        cycle: s.
    """
    found = {}
    for cycles in range(1, MOST_CYCLES + 1):
        length = cycles * cycle / recording.step / SUBSTEPS
        lengths = {SUBSTEPS * int(np.floor(length)), SUBSTEPS * int(np.ceil(length))}
        loops = [
            Closing(float(_seams(recording.qpos[:-samples], recording.qpos[samples:]).min()), samples)
            for samples in lengths
            if 0 < samples < len(recording.qpos)
        ]
        if loops:
            found[cycles] = min(loops)
    return found


class Stretch(NamedTuple):
    """A part of a recording that can be a loop.

    Attributes:
        first: sample with which it begins.
        samples: of it; the sample after the last is the first one again.
        usual: whether its root has the mean speed of the whole recording, to 1 %.
    """

    first: int
    samples: int
    usual: bool


def usual(recording: Recording, samples: int) -> Stretch:
    """Return the most typical loop with a number of samples, among those that close, or nearly so if none does.

    Loops are compared by the displacement of the root, as the torso's depends on where in its sway the loop begins.
    """
    place = _places(recording.qpos)
    mean = logarithm(relative(place[:-samples], place[samples:]))
    speed, (_, left, turning) = np.hypot(mean[:, 0], mean[:, 1]).mean(), mean.mean(axis=0)
    seams = _seams(recording.qpos[:-samples], recording.qpos[samples:])
    firsts = np.flatnonzero(seams <= max(CLOSED, _NEAREST * seams.min()))
    firsts = firsts[:: -(-len(firsts) // _TRIED)]
    displacements = np.stack([_rooted(place[first : first + samples + 1])[0] for first in firsts])
    wrong = abs(np.hypot(displacements[:, 0], displacements[:, 1]) - speed)
    astray = abs(displacements[:, 1] - left) + recording.qpos[:, 2].mean() * abs(displacements[:, 2] - turning)
    best = (_SPEED * wrong + astray).argmin()
    return Stretch(int(firsts[best]), samples, bool(wrong[best] <= _USUAL * speed))


def loop(recording: Recording, stretch: Stretch) -> Motion:
    """Return a part of a recording as a loop: a root of constant velocity, and a pose that returns exactly."""
    qpos = recording.qpos[stretch.first : stretch.first + stretch.samples + 1]
    displacement, local = _rooted(_places(qpos))
    root = along(displacement, np.linspace(0.0, 1.0, len(qpos)))
    motion = _closed(_on_root(recording, qpos, root, local))
    return motion._replace(twist=displacement / motion.seconds, seam=float(_seams(qpos[:1], qpos[-1:])[0]))


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
    place = relative(place[0], place)
    local = relative(along(logarithm(place[-1]), np.linspace(0.0, 1.0, len(place))), place)
    centre = local[:-1].mean(axis=0)
    return logarithm(relative(centre, after(place[-1], centre))), relative(centre, local)


def passage(recording: Recording, first: int, samples: int, window: int) -> Motion:
    """Return a part of a recording unchanged, whose root follows the moving average of the torso's path.

    Args:
        recording: with half a window more at both ends.
        first: sample with which the motion begins.
        samples: of it, without the last.
        window: samples that the mean is taken over, a gait cycle.
    """
    qpos = recording.qpos
    place = _places(qpos)
    low, sums = first - window // 2, np.cumsum(np.concatenate([np.zeros((1, 3)), place]), axis=0)
    path = (sums[low + window : low + window + samples + 1] - sums[low : low + samples + 1]) / window
    rows = slice(first, first + samples + 1)
    motion = _on_root(recording, qpos[rows], relative(path[0], path), relative(path, place[rows]))
    path = motion.root
    return motion._replace(twist=logarithm(path[-1]) / motion.seconds)


def _places(qpos) -> np.ndarray:
    """Return where the torso is, seen from above: (samples, 3) x, y, m, and yaw, rad, that does not jump."""
    return np.concatenate([qpos[:, :2], np.unwrap(rotations.yaw(qpos[:, 3:7]))[:, None]], axis=-1)


def _on_root(recording: Recording, qpos, root, local) -> Motion:
    """Put poses onto a root, given where the torso is (samples, 3) in the root's frame, seen from above."""
    turn = local[:, 2] - rotations.yaw(qpos[:, 3:7])
    return Motion(
        step=recording.step,
        root=root,
        positions=np.concatenate([local[:, :2], qpos[:, 2:3]], axis=-1),
        quaternions=_continuous(rotations.turned(qpos[:, 3:7], turn)),
        joints=qpos[:, 7:].copy(),
        twist=np.zeros(3),
    )


def _closed(motion: Motion) -> Motion:
    """Close a loop: spread the difference of its last pose and its first over it, half to either end."""
    share = np.linspace(-0.5, 0.5, len(motion.joints))[:, None]
    joints = motion.joints - share * (motion.joints[-1] - motion.joints[0])
    positions = motion.positions - share * (motion.positions[-1] - motion.positions[0])
    first, last = motion.quaternions[0], motion.quaternions[-1]
    turn = rotations.product(last, first * (1.0, -1.0, -1.0, -1.0))
    angle = np.arctan2(np.linalg.norm(turn[1:]), turn[0])  # half of that of the turn
    axis = turn[1:] / max(np.linalg.norm(turn[1:]), 1e-12)
    back = np.concatenate([np.cos(share * angle), -np.sin(share * angle) * axis], axis=-1)
    quaternions = rotations.product(back, motion.quaternions)
    for values in (joints, positions, quaternions):
        values[-1] = values[0]  # up to rounding they are equal already
    return motion._replace(joints=joints, positions=positions, quaternions=quaternions)


def _continuous(quaternions) -> np.ndarray:
    """Return the same orientations (samples, 4) with continuous signs."""
    flips = (quaternions[1:] * quaternions[:-1]).sum(axis=-1) < 0.0
    signs = np.concatenate([[1.0], np.cumprod(np.where(flips, -1.0, 1.0))])
    return quaternions * (np.sign(quaternions[0, 0]) or 1.0) * signs[:, None]


# Places on the ground: (..., 3) x, y and yaw.


def relative(origin, place) -> np.ndarray:
    """Return places relative to others."""
    origin, place = np.asarray(origin, float), np.asarray(place, float)
    offset = rotations.headed(place[..., :2] - origin[..., :2], origin[..., 2])
    return np.concatenate([offset, place[..., 2:] - origin[..., 2:]], axis=-1)


def along(twist, times) -> np.ndarray:
    """Return the places (times, 3) to which a constant velocity in the moving frame leads from 0.

    Args:
        twist: (3,) forward, left, m/s, and turning, rad/s.
        times: (times,) s.
    """
    angle = 0.5 * twist[2] * times
    # A chord of the arc: its length is the arc's by sin(a) / a, its direction that of half the turn.
    chord = times * np.sinc(angle / np.pi)
    displacement = rotations.headed(np.stack([chord * twist[0], chord * twist[1]], axis=-1), -angle)
    return np.concatenate([displacement, 2.0 * angle[:, None]], axis=-1)


def logarithm(place) -> np.ndarray:
    """Return the constant velocities (..., 3) that lead from 0 to places (..., 3) in a unit of time."""
    half = 0.5 * place[..., 2]
    displacement = rotations.headed(place[..., :2], half) / np.sinc(half / np.pi)[..., None]
    return np.concatenate([displacement, place[..., 2:]], axis=-1)


def after(first, second) -> np.ndarray:
    """Return the place (3,) that `second` is relative to `first`."""
    return np.append(first[:2] + rotations.headed(np.asarray(second[:2]), -first[2]), first[2] + second[2])
