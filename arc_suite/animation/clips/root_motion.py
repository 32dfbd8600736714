"""Motions of clips: a root that moves over the ground, and a body that moves relative to it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.recordings import Recording
from arc_suite.motions.ground_poses import compose, ground_poses, relative_pose, twist_to
from arc_suite.motions.motion import continue_signs
from arc_suite.motions.sampling import sample_linearly

_MIN_DIVISOR = 1e-9  # of values and paths that may be 0 throughout, and stay 0


class Pose(NamedTuple):
    """A pose in the root's frame, or the difference of two.

    Attributes:
        position: (3,) position of the torso, m.
        quaternion: (4,) quaternion of the torso, w first.
        joints: (joints,) rad.
    """

    position: np.ndarray
    quaternion: np.ndarray
    joints: np.ndarray

    def relative(self, origin: "Pose") -> "Pose":
        """Return the difference that leads from another pose to this one."""
        return Pose(
            position=self.position - origin.position,
            quaternion=rotations.product(self.quaternion, rotations.inverse(origin.quaternion)),
            joints=self.joints - origin.joints,
        )


class ClipMotion(NamedTuple):
    """A body over the time of a clip, at even time steps, both ends included.

    Attributes:
        time_step: s between two samples.
        root: (samples, 3) ground poses of the root; yaw is continuous and starts at 0.
        positions: (samples, 3) positions of the torso in the root's frame, m.
        quaternions: (samples, 4) quaternions of the torso in the root's frame, w first.
        joints: (samples, joints) rad.
        twist: (3,) mean velocity of the root in its own frame.
        seam: rad, largest difference that was spread over the motion so that an end meets another pose.
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

    def pose(self, sample: int) -> Pose:
        """Return the pose of a sample."""
        return Pose(self.positions[sample], self.quaternions[sample], self.joints[sample])

    def poses(self) -> np.ndarray:
        """Return poses in the world, (samples, 7 + joints); see `Recording`."""
        yaw = self.root[:, 2]
        forward, left, height = self.positions.T
        offsets = rotations.to_heading_frame(np.stack([forward, left], axis=-1), -yaw)
        world_positions = np.concatenate([self.root[:, :2] + offsets, height[:, None]], axis=-1)
        world_quaternions = rotations.turn_about_z(self.quaternions, yaw)
        return np.concatenate([world_positions, world_quaternions, self.joints], axis=-1)

    def lower(self, height: float) -> "ClipMotion":
        """Return the motion with the torso lower by a height, m."""
        return self._replace(positions=self.positions - (0.0, 0.0, height))

    def map_arrays(self, change: Callable[[np.ndarray], np.ndarray]) -> "ClipMotion":
        """Return the motion with positions, quaternions and joints, (samples, ...) each, changed by a function."""
        return self._replace(
            positions=change(self.positions), quaternions=change(self.quaternions), joints=change(self.joints)
        )

    def start_at(self, sample: int) -> "ClipMotion":
        """Return the loop with another of its samples first."""
        order = np.roll(np.arange(len(self.joints) - 1), -sample)
        closed_order = [*order, order[0]]
        return self.map_arrays(lambda values: values[closed_order])

    def stretch_to(self, seconds: float) -> "ClipMotion":
        """Return the motion over another duration, s."""
        ratio = seconds / self.seconds
        return self._replace(time_step=self.time_step * ratio, twist=self.twist / ratio)

    def sample_at(self, times: np.ndarray) -> "ClipMotion":
        """Return the motion at even times (frames,), s, interpolated between samples."""
        places = (np.asarray(times) / self.time_step).clip(0.0, len(self.joints) - 1)  # fractions of samples
        # Samples are 2 ms apart: a straight line is as good as an arc.
        motion = self.map_arrays(lambda values: sample_linearly(values, places))
        return motion._replace(
            time_step=float(times[1] - times[0]),
            root=sample_linearly(self.root, places),
            quaternions=motion.quaternions / np.linalg.norm(motion.quaternions, axis=-1, keepdims=True),
        )

    def append(self, later: "ClipMotion") -> "ClipMotion":
        """Return this motion followed by another, which begins with its last pose and has the same time step."""
        later_root = compose(self.root[-1], later.root)
        return self._replace(
            root=np.concatenate([self.root[:-1], later_root]),
            positions=np.concatenate([self.positions[:-1], later.positions]),
            quaternions=np.concatenate([self.quaternions[:-1], later.quaternions]),
            joints=np.concatenate([self.joints[:-1], later.joints]),
        )

    def add_difference(self, difference: Pose, shares: np.ndarray) -> "ClipMotion":
        """Return the motion with a share (samples,) of a difference of poses added to each sample."""
        shares = shares[:, None]
        sine = np.linalg.norm(difference.quaternion[1:])
        half_angle = np.arctan2(sine, difference.quaternion[0])
        if half_angle > 0.5 * np.pi:  # q and -q are one orientation: take the shorter way
            half_angle -= np.pi
        axis = difference.quaternion[1:] / max(sine, 1e-12)
        turns = np.concatenate([np.cos(shares * half_angle), np.sin(shares * half_angle) * axis], axis=-1)
        return self._replace(
            positions=self.positions + shares * difference.position,
            quaternions=rotations.product(turns, self.quaternions),
            joints=self.joints + shares * difference.joints,
        )

    def put_on_root(self, root: np.ndarray) -> "ClipMotion":
        """Return the same motion in the world on another path of the root, ground poses (samples, 3)."""
        world_poses = self.poses()
        torso_on_root = relative_pose(root, ground_poses(world_poses))
        motion = put_on_root(self.time_step, world_poses, root, torso_on_root)
        return motion._replace(twist=self.twist, seam=self.seam)

    def meet(self, pose: Pose, end: int, samples: int) -> "ClipMotion":
        """Return the motion with a pose at one of its ends, at which feet stay where they are in the world.

        The root takes up the difference on the ground, over the whole motion. The remaining difference is spread over
        the samples next to the end.

        Args:
            pose: pose to meet, in the root's frame.
            end: 0 or -1.
            samples: samples over which the remaining difference fades.
        """
        torso = ground_poses(self.poses()[[end]])[0]
        torso_on_root = np.append(pose.position[:2], rotations.yaw(pose.quaternion))
        desired_root = compose(torso, relative_pose(torso_on_root, np.zeros(3)))
        correction = relative_pose(self.root[end], desired_root)
        correction[2] = rotations.wrap_angle(desired_root[2] - self.root[end, 2])
        root_weights = self._end_weights(end, len(self.joints) - 1)
        corrected_root = compose(self.root, root_weights[:, None] * correction)
        motion = self.put_on_root(corrected_root)
        root = relative_pose(corrected_root[0], corrected_root)
        motion = motion._replace(root=root, twist=twist_to(root[-1]) / motion.seconds)
        return motion.end_with(pose, end, samples)

    def end_with(self, pose: Pose, end: int, samples: int, held_samples: int = 0) -> "ClipMotion":
        """Return the motion with a pose at one of its ends, on the same path of the root.

        Args:
            pose: pose to end with, in the root's frame.
            end: 0 or -1.
            samples: over which the difference of the poses fades.
            held_samples: samples between these and the end, which take the whole difference.
        """
        difference = pose.relative(self.pose(end))
        motion = self.add_difference(difference, self._end_weights(end, samples, held_samples))
        return motion._replace(seam=max(self.seam, seam_size(difference)))

    def _end_weights(self, end: int, samples: int, held_samples: int = 0) -> np.ndarray:
        """Return weights (samples,) that stay 1 next to an end, 0 or -1, then fall to 0 over a number of samples."""
        weights = fade_out((np.arange(len(self.joints)) - held_samples) / samples)
        if end == 0:
            return weights
        return weights[::-1]


def seam_size(difference: Pose) -> float:
    """Return the size of a difference of poses, rad: the largest of the joint angles and the torso's turn."""
    sine = np.linalg.norm(difference.quaternion[1:])
    torso_turn = 2.0 * np.arctan2(sine, abs(difference.quaternion[0]))
    return float(max(abs(difference.joints).max(), torso_turn))


def fade_out(share: np.ndarray) -> np.ndarray:
    """Return weights that fall smoothly from 1 at a share of 0 to 0 at a share of 1 and beyond."""
    share = share.clip(0.0, 1.0)
    return 1.0 - share**2 * (3.0 - 2.0 * share)


def away_from_ends(from_start: np.ndarray, to_end: np.ndarray) -> np.ndarray:
    """Return weights that rise smoothly from 0 at the start to 1, and fall to 0 at the end.

    Args:
        from_start: (samples,) distance of each sample from the start, as a share of the rise.
        to_end: (samples,) its distance from the end, as a share of the fall.
    """
    return (1.0 - fade_out(from_start)) * (1.0 - fade_out(to_end))


def share_of_largest(values: np.ndarray) -> np.ndarray:
    """Return values (n,) as shares of the largest absolute one; 0 if all are 0."""
    return values / max(abs(values).max(), _MIN_DIVISOR)


# Motions from recordings.


def follow_mean_path(recording: Recording, first: int, samples: int, window: int) -> ClipMotion:
    """Return a part of a recording unchanged, whose root follows the moving average of the torso's path.

    Args:
        recording: with half a window more at both ends.
        first: sample with which the motion begins.
        samples: samples of the motion, without the last.
        window: samples that the mean is taken over, a gait cycle.
    """
    torso = ground_poses(recording.poses)
    sums = np.cumsum(np.concatenate([np.zeros((1, 3)), torso]), axis=0)  # sums[n] is that of the first n samples
    low = first - window // 2
    mean_path = (sums[low + window : low + window + samples + 1] - sums[low : low + samples + 1]) / window
    indices = slice(first, first + samples + 1)
    motion = put_on_root(
        recording.time_step,
        recording.poses[indices],
        root=relative_pose(mean_path[0], mean_path),
        torso_on_root=relative_pose(mean_path, torso[indices]),
    )
    return motion._replace(twist=twist_to(motion.root[-1]) / motion.seconds)


def stay_at_start(recording: Recording, first: int, samples: int) -> ClipMotion:
    """Return a part of a recording whose root stays below the torso of its first sample."""
    poses = recording.poses[first : first + samples + 1]
    torso = ground_poses(poses)
    root = np.zeros((len(poses), 3))
    return put_on_root(recording.time_step, poses, root, torso_on_root=relative_pose(torso[0], torso))


def stay_at_end(recording: Recording, first: int) -> ClipMotion:
    """Return a recording from a sample on, whose root stays below the torso of its last sample."""
    poses = recording.poses[first:]
    torso = ground_poses(poses)
    root = np.zeros((len(poses), 3))
    return put_on_root(recording.time_step, poses, root, torso_on_root=relative_pose(torso[-1], torso))


def advance_straight(recording: Recording) -> ClipMotion:
    """Return a recording whose root goes below the torso on the line from its first place to its last."""
    torso = ground_poses(recording.poses)
    displacements = relative_pose(torso[0], torso) * (1.0, 1.0, 0.0)
    course = displacements[-1] / max(np.linalg.norm(displacements[-1]), _MIN_DIVISOR)
    root = (displacements @ course)[:, None] * course
    motion = put_on_root(
        recording.time_step, recording.poses, root, relative_pose(root, relative_pose(torso[0], torso))
    )
    return motion._replace(twist=twist_to(root[-1]) / motion.seconds)


def put_on_root(time_step: float, poses, root, torso_on_root) -> ClipMotion:
    """Return the motion of poses in the world on a path of the root.

    Args:
        time_step: s between two samples.
        poses: (samples, 7 + joints) in the world.
        root: (samples, 3) its ground poses.
        torso_on_root: (samples, 3) ground poses of the torso in the root's frame.
    """
    turn = torso_on_root[:, 2] - rotations.yaw(poses[:, 3:7])
    return ClipMotion(
        time_step=time_step,
        root=root,
        positions=np.concatenate([torso_on_root[:, :2], poses[:, 2:3]], axis=-1),
        quaternions=continue_signs(rotations.turn_about_z(poses[:, 3:7], turn)),
        joints=poses[:, 7:].copy(),
        twist=np.zeros(3),
    )
