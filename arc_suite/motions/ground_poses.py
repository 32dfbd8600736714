"""Poses on the ground and twists.

A ground pose is (..., 3): x and y, m, and yaw, rad. A twist is (..., 3): the velocity forward and to the left in the
moving frame, m/s, and the turning rate, rad/s.
"""

import numpy as np

from arc_suite import rotations

_MAX_SLOPE = 0.7  # sine of the angle of the forward axis to the horizontal, up to which yaw follows its turns
_MAX_ARC_TURN = 1.5 * np.pi  # rad, up to which the ends of a path say its twist: those of a whole turn lie together


def ground_poses(poses) -> np.ndarray:
    """Return the ground poses (samples, 3) of the torso in poses (samples, 7 + joints); yaw does not jump."""
    return np.concatenate([poses[:, :2], find_headings(poses[:, 3:7])[:, None]], axis=-1)


def find_headings(quaternions) -> np.ndarray:
    """Return the yaw (samples,) of orientations (samples, 4) that follow each other; it does not jump by whole turns.

    While the forward axis is steep, as in a somersault, yaw itself may jump by half a turn. There, the turns about the
    vertical count.
    """
    yaw = np.unwrap(rotations.yaw(quaternions))
    is_steep = abs(rotations.matrix(quaternions)[:, 2, 0]) > _MAX_SLOPE
    if not is_steep.any():
        return yaw
    turns = rotations.product(quaternions[1:], rotations.inverse(quaternions[:-1]))  # in the world
    turns_about_vertical = 2.0 * np.arctan2(turns[:, 3], turns[:, 0])
    turns_about_vertical = rotations.wrap_angle(turns_about_vertical)  # q and -q are one rotation
    steps = np.where(is_steep[1:] | is_steep[:-1], turns_about_vertical, np.diff(yaw))
    expected_yaw = yaw[0] + np.concatenate([np.zeros(1), np.cumsum(steps)])
    return yaw + 2.0 * np.pi * np.round((expected_yaw - yaw) / (2.0 * np.pi))


def relative_pose(origin, ground_pose) -> np.ndarray:
    """Return ground poses (..., 3) in the frames of others, `origin` (..., 3)."""
    origin = np.asarray(origin, float)
    ground_pose = np.asarray(ground_pose, float)
    offset = rotations.to_heading_frame(ground_pose[..., :2] - origin[..., :2], origin[..., 2])
    return np.concatenate([offset, ground_pose[..., 2:] - origin[..., 2:]], axis=-1)


def compose(origin, local) -> np.ndarray:
    """Return the ground poses (..., 3) in the world that are `local` (..., 3) in the frames of `origin` (..., 3)."""
    origin = np.asarray(origin, float)
    local = np.asarray(local, float)
    position = origin[..., :2] + rotations.to_heading_frame(local[..., :2], -origin[..., 2])
    return np.concatenate([position, origin[..., 2:] + local[..., 2:]], axis=-1)


def place_points(origin, points) -> np.ndarray:
    """Return the points (..., 3) in the world that are `points` (..., 3) in the frames of `origin` (..., 3)."""
    return np.concatenate([compose(origin, points)[..., :2], points[..., 2:]], axis=-1)


def relative_points(origin, points) -> np.ndarray:
    """Return points (..., 3) of the world in the frames of ground poses `origin` (..., 3)."""
    ground = rotations.to_heading_frame(points[..., :2] - origin[..., :2], origin[..., 2])
    return np.concatenate([ground, points[..., 2:]], axis=-1)


def integrate_twist(twist, times) -> np.ndarray:
    """Return the ground poses (times, 3) to which a constant twist leads from 0.

    Args:
        twist: (3,) forward, left, m/s, and turning, rad/s.
        times: (times,) s.
    """
    half_turn = 0.5 * twist[2] * times
    # The path is an arc. Its chord is shorter by sin(a) / a, a being half the turn, and has the direction of half
    # the turn.
    chord_time = times * np.sinc(half_turn / np.pi)
    chord = np.stack([chord_time * twist[0], chord_time * twist[1]], axis=-1)
    displacement = rotations.to_heading_frame(chord, -half_turn)
    return np.concatenate([displacement, 2.0 * half_turn[:, None]], axis=-1)


def twist_to(ground_pose) -> np.ndarray:
    """Return the constant twists (..., 3) that lead from 0 to ground poses (..., 3) in a unit of time."""
    half_turn = 0.5 * ground_pose[..., 2]
    chord = rotations.to_heading_frame(ground_pose[..., :2], half_turn)
    velocity = chord / np.sinc(half_turn / np.pi)[..., None]
    return np.concatenate([velocity, ground_pose[..., 2:]], axis=-1)


def fit_twist(path) -> tuple[np.ndarray, np.ndarray]:
    """Return the constant twist (3,) of a path, in a unit of time, and how far (3,) its end is from the path's.

    The end is the same up to three quarters of a turn. Beyond, the velocity is the mean one in the moving frame.

    Args:
        path: (samples, 3) ground poses, both ends included.
    """
    displacement = relative_pose(path[0], path[-1])
    if abs(displacement[2]) <= _MAX_ARC_TURN:
        return twist_to(displacement), np.zeros(3)
    twist = twist_to(relative_pose(path[:-1], path[1:])).sum(axis=0)
    return twist, displacement - integrate_twist(twist, np.ones(1))[0]
