"""Motions: a root that moves over the ground, and a body that moves relative to it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.recordings import Recording


class Pose(NamedTuple):
    """A pose in the root's frame, or the difference of two.

    Attributes:
        position: (3,) of the torso, m.
        quaternion: (4,) of the torso, w first.
        joints: (joints,) rad.
    """

    position: np.ndarray
    quaternion: np.ndarray
    joints: np.ndarray

    def relative(self, origin: "Pose") -> "Pose":
        """Return the difference that leads from another pose to this one."""
        turn = rotations.product(self.quaternion, origin.quaternion * (1.0, -1.0, -1.0, -1.0))
        return Pose(self.position - origin.position, turn, self.joints - origin.joints)


class Motion(NamedTuple):
    """A body over the time of a clip, at even steps, ends included.

    Attributes:
        time_step: s between two samples.
        root: (samples, 3) the root on the ground: x, y, m, and yaw, rad, from 0.
        positions: (samples, 3) of the torso in the root's frame, m.
        quaternions: (samples, 4) of the torso in the root's frame, w first.
        joints: (samples, joints) rad.
        twist: (3,) mean velocity of the root in its own frame: forward and left, m/s, turning, rad/s.
        seam: rad, largest difference of poses at an end that was made to meet another pose, before it met.
    """

    time_step: float
    root: np.ndarray
    positions: np.ndarray
    quaternions: np.ndarray
    joints: np.ndarray
    twist: np.ndarray
    seam: float = 0.0

    @property
    def seconds(self) -> float:
        """Duration, s."""
        return self.time_step * (len(self.joints) - 1)

    def poses(self) -> np.ndarray:
        """Return poses in the world, (samples, 7 + joints); see `Recording`."""
        heading = self.root[:, 2]
        ahead, left, height = self.positions.T
        across = rotations.to_heading_frame(np.stack([ahead, left], axis=-1), -heading)
        place = np.concatenate([self.root[:, :2] + across, height[:, None]], axis=-1)
        return np.concatenate([place, rotations.turn_about_z(self.quaternions, heading), self.joints], axis=-1)

    def lower(self, height: float) -> "Motion":
        """Return the motion with the torso lower by a height, m."""
        return self._replace(positions=self.positions - (0.0, 0.0, height))

    def map_arrays(self, change: Callable[[np.ndarray], np.ndarray]) -> "Motion":
        """Return the motion with positions, quaternions and joints, (samples, ...) each, that a function changes."""
        positions, quaternions, joints = map(change, (self.positions, self.quaternions, self.joints))
        return self._replace(positions=positions, quaternions=quaternions, joints=joints)

    def start_at(self, sample: int) -> "Motion":
        """Return the loop with another of its samples first."""
        order = np.roll(np.arange(len(self.joints) - 1), -sample)
        return self.map_arrays(lambda values: values[[*order, order[0]]])

    def pose(self, sample: int) -> Pose:
        """Return the pose of a sample."""
        return Pose(self.positions[sample], self.quaternions[sample], self.joints[sample])

    def stretch_to(self, seconds: float) -> "Motion":
        """Return the motion over another duration, s."""
        ratio = seconds / self.seconds
        return self._replace(time_step=self.time_step * ratio, twist=self.twist / ratio)

    def add_difference(self, difference: Pose, shares: np.ndarray) -> "Motion":
        """Return the motion with a share (samples,) of a difference of poses added to each sample."""
        shares = shares[:, None]
        half = np.arctan2(np.linalg.norm(difference.quaternion[1:]), difference.quaternion[0])
        half -= np.pi * (half > 0.5 * np.pi)  # q and -q are one orientation
        axis = difference.quaternion[1:] / max(np.linalg.norm(difference.quaternion[1:]), 1e-12)
        turns = np.concatenate([np.cos(shares * half), np.sin(shares * half) * axis], axis=-1)
        return self._replace(
            positions=self.positions + shares * difference.position,
            quaternions=rotations.product(turns, self.quaternions),
            joints=self.joints + shares * difference.joints,
        )

    def put_on_root(self, root: np.ndarray) -> "Motion":
        """Return the same motion in the world on another path (samples, 3) of the root."""
        poses = self.poses()
        return put_on_root(self.time_step, poses, root, relative_pose(root, ground_poses(poses)))._replace(
            twist=self.twist, seam=self.seam
        )

    def meet(self, pose: Pose, end: int, samples: int) -> "Motion":
        """Return the motion with a pose at one of its ends.

        The root takes up what differs on the ground, over the whole motion, so that feet stay where they are. The
        rest is spread over the samples next to the end.

        Args:
            pose: to meet.
            end: 0 or -1.
            samples: over which the difference of the poses fades.
        """
        place = ground_poses(self.poses()[[end]])[0]
        wanted = compose(place, relative_pose(_place(pose), np.zeros(3)))
        error = relative_pose(self.root[end], wanted) * (1.0, 1.0, 0.0)
        error[2] = rotations.wrap_angle(wanted[2] - self.root[end, 2])
        root = compose(self.root, self._fading(end, len(self.joints) - 1)[:, None] * error)
        motion = self.put_on_root(root)
        root = relative_pose(root[0], root)
        return motion._replace(root=root, twist=twist_to(root[-1]) / motion.seconds).end_with(pose, end, samples)

    def append(self, later: "Motion") -> "Motion":
        """Return the motion with another after it, which begins with its last pose, at the same step."""
        joined = later._replace(root=compose(self.root[-1], later.root))
        names = ("root", "positions", "quaternions", "joints")
        return self._replace(
            **{name: np.concatenate([getattr(self, name)[:-1], getattr(joined, name)]) for name in names}
        )

    def end_with(self, pose: Pose, end: int, samples: int) -> "Motion":
        """Return the motion with a pose at one of its ends, on the same path of the root.

        Args:
            pose: to end with.
            end: 0 or -1.
            samples: next to the end, over which the difference of the poses fades.
        """
        difference = pose.relative(self.pose(end))
        return self.add_difference(difference, self._fading(end, samples))._replace(
            seam=max(self.seam, seam_size(difference))
        )

    def _fading(self, end: int, samples: int) -> np.ndarray:
        """Return weights (samples,) that fall from 1 at an end, 0 or -1, to 0 over a number of samples."""
        weights = fade_out(np.arange(len(self.joints)) / samples)
        return weights if end == 0 else weights[::-1]

    def sample_at(self, times: np.ndarray) -> "Motion":
        """Return the motion at even times (frames,), s, interpolated between samples."""
        place = (np.asarray(times) / self.time_step).clip(0.0, len(self.joints) - 1)
        before = np.minimum(place.astype(int), len(self.joints) - 2)
        share = (place - before)[:, None]

        def between(values):
            return (1.0 - share) * values[before] + share * values[before + 1]

        motion = self.map_arrays(between)  # 2 ms apart, where a straight line is as good as an arc
        quaternions = motion.quaternions / np.linalg.norm(motion.quaternions, axis=-1, keepdims=True)
        return motion._replace(time_step=float(times[1] - times[0]), root=between(self.root), quaternions=quaternions)


def seam_size(difference: Pose) -> float:
    """Return the size of a difference of poses, rad: the largest of joint angles and the torso's turn."""
    turn = 2.0 * np.arctan2(np.linalg.norm(difference.quaternion[1:]), abs(difference.quaternion[0]))
    return float(max(abs(difference.joints).max(), turn))


def fade_out(share: np.ndarray) -> np.ndarray:
    """Return weights that fall smoothly from 1 at 0 to 0 at 1 and beyond."""
    share = share.clip(0.0, 1.0)
    return 1.0 - share**2 * (3.0 - 2.0 * share)


def ground_poses(poses) -> np.ndarray:
    """Return where the torso is, seen from above: (samples, 3) x, y, m, and yaw, rad, that does not jump."""
    return np.concatenate([poses[:, :2], np.unwrap(rotations.yaw(poses[:, 3:7]))[:, None]], axis=-1)


def follow_mean_path(recording: Recording, first: int, samples: int, window: int) -> Motion:
    """Return a part of a recording unchanged, whose root follows the moving average of the torso's path.

    Args:
        recording: with half a window more at both ends.
        first: sample with which the motion begins.
        samples: of it, without the last.
        window: samples that the mean is taken over, a gait cycle.
    """
    place = ground_poses(recording.poses)
    low, sums = first - window // 2, np.cumsum(np.concatenate([np.zeros((1, 3)), place]), axis=0)
    path = (sums[low + window : low + window + samples + 1] - sums[low : low + samples + 1]) / window
    rows = slice(first, first + samples + 1)
    motion = put_on_root(
        recording.time_step, recording.poses[rows], relative_pose(path[0], path), relative_pose(path, place[rows])
    )
    return motion._replace(twist=twist_to(motion.root[-1]) / motion.seconds)


def stay_at_start(recording: Recording, first: int, samples: int) -> Motion:
    """Return a part of a recording whose root stays below the torso of its first sample."""
    poses = recording.poses[first : first + samples + 1]
    place, root = ground_poses(poses), np.zeros((len(poses), 3))
    return put_on_root(recording.time_step, poses, root, relative_pose(place[0], place))


def advance_straight(recording: Recording) -> Motion:
    """Return a recording whose root goes straight ahead below the torso."""
    place = ground_poses(recording.poses)
    root = (place - place[0]) * (1.0, 0.0, 0.0)
    motion = put_on_root(
        recording.time_step, recording.poses, root, relative_pose(root, relative_pose(place[0], place))
    )
    return motion._replace(twist=twist_to(root[-1]) / motion.seconds)


def put_on_root(step: float, poses, root, local) -> Motion:
    """Put poses onto a root, given where the torso is (samples, 3) in the root's frame, seen from above."""
    turn = local[:, 2] - rotations.yaw(poses[:, 3:7])
    positions = np.concatenate([local[:, :2], poses[:, 2:3]], axis=-1)
    quaternions = _continuous(rotations.turn_about_z(poses[:, 3:7], turn))
    return Motion(step, root, positions, quaternions, poses[:, 7:].copy(), np.zeros(3))


def _place(pose: Pose) -> np.ndarray:
    """Return where the torso is in the root's frame, seen from above, (3,)."""
    return np.append(pose.position[:2], rotations.yaw(pose.quaternion))


def _continuous(quaternions) -> np.ndarray:
    """Return the same orientations (samples, 4) with continuous signs."""
    flips = (quaternions[1:] * quaternions[:-1]).sum(axis=-1) < 0.0
    signs = np.concatenate([[1.0], np.cumprod(np.where(flips, -1.0, 1.0))])
    return quaternions * (np.sign(quaternions[0, 0]) or 1.0) * signs[:, None]


# Places on the ground: (..., 3) x, y and yaw.


def relative_pose(origin, place) -> np.ndarray:
    """Return places relative to others."""
    origin, place = np.asarray(origin, float), np.asarray(place, float)
    offset = rotations.to_heading_frame(place[..., :2] - origin[..., :2], origin[..., 2])
    return np.concatenate([offset, place[..., 2:] - origin[..., 2:]], axis=-1)


def integrate_twist(twist, times) -> np.ndarray:
    """Return the places (times, 3) to which a constant velocity in the moving frame leads from 0.

    Args:
        twist: (3,) forward, left, m/s, and turning, rad/s.
        times: (times,) s.
    """
    angle = 0.5 * twist[2] * times
    # A chord of the arc: its length is the arc's by sin(a) / a, its direction that of half the turn.
    chord = times * np.sinc(angle / np.pi)
    displacement = rotations.to_heading_frame(np.stack([chord * twist[0], chord * twist[1]], axis=-1), -angle)
    return np.concatenate([displacement, 2.0 * angle[:, None]], axis=-1)


def twist_to(place) -> np.ndarray:
    """Return the constant velocities (..., 3) that lead from 0 to places (..., 3) in a unit of time."""
    half = 0.5 * place[..., 2]
    displacement = rotations.to_heading_frame(place[..., :2], half) / np.sinc(half / np.pi)[..., None]
    return np.concatenate([displacement, place[..., 2:]], axis=-1)


def compose(first, second) -> np.ndarray:
    """Return the places (..., 3) that `second` are relative to `first`."""
    first, second = np.asarray(first, float), np.asarray(second, float)
    moved = first[..., :2] + rotations.to_heading_frame(second[..., :2], -first[..., 2])
    return np.concatenate([moved, first[..., 2:] + second[..., 2:]], axis=-1)
