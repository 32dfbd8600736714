"""Legs under a torso that moves: feet stay, or move as drawn, by inverse kinematics, as far as legs can follow.

Lengths are in standing heights h, times in sqrt(h / g). Numbers of the torso's pose are those of `posture.POSE_NAMES`.
"""

import itertools
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips.root_motion import ClipMotion, Pose, share_of_largest
from arc_suite.models import posture, sizing
from arc_suite.models.kinematics import Legs
from arc_suite.models.outline import torso_box
from arc_suite.models.standing import rate_unit
from arc_suite.robots.spec import Body

HEIGHT = posture.POSE_NAMES.index("height")
_FORWARD_LEFT_UP = [posture.POSE_NAMES.index(name) for name in ("forward", "left", "height")]

_SAMPLES_PER_CONTROL_STEP = 4
_SMOOTHING_ROUNDS = 3  # of a mean over three samples

# Inverse kinematics.
_STAGES = 8  # in which poses grow from rest, so that no leg folds the other way
_ITERATIONS_PER_STAGE = 6
_PROBE_STRIDE = 8  # samples, of which one is solved first: most motions that legs cannot follow show it there
FOOT_WEIGHTS = np.diag((1.0, 1.0, 8.0))  # of the error of a foot: legs of two joints slide rather than sink

# A motion that the legs cannot follow is made smaller. Each size is tried as it is, then with a torso that sinks
# more, as stretched legs cannot follow a tilt.
TRIED_SHARES = (1.0, 0.8, 0.6, 0.4, 0.25, 0.15)  # shares of the full motion, largest first
_SINK_FACTORS = (1.0, 1.6, 2.4)
_DIPS = (0.0, 0.1, 0.2)  # h, by which a torso that follows a foot sinks where it moves most

# What a standing foot may miss, h.
_MAX_SINK = 0.01
_MAX_SMOOTH_SINK = 0.025  # of any foot, after joints are smooth
_MAX_SLIDE = 0.04
_MAX_SLIDE_OF_FEW_JOINTS = 0.16
_FREE_JOINTS = 3  # joints of a leg whose foot can stay under a torso that moves in any direction

_MAX_JOINT_SPEED = 7.0  # rad / sqrt(h / g)


class LegMotion(NamedTuple):
    """Legs that follow the torso.

    Attributes:
        joints: (samples, joints) angles, rad.
        misses: (samples, legs, 3) vectors from goals to feet, m.
    """

    joints: np.ndarray
    misses: np.ndarray


def has_free_feet(body: Body) -> bool:
    """Return whether every foot of a body can stay in place while the torso moves: its leg has three joints or more."""
    return min(len(leg.joints) for leg in body.legs) >= _FREE_JOINTS


def measure_belly_height(body: Body, rest: Pose) -> float:
    """Return the height of the torso's lowest point over the ground at rest, m."""
    lowest_corner, _ = torso_box(body)  # in the torso's frame, m
    return rest.position[2] + lowest_corner[2]


def lower_torso(body: Body, rest: Pose, depths: np.ndarray) -> np.ndarray:
    """Return joint angles (samples, joints), rad, that keep soles in place while the torso sinks.

    Args:
        body: the spec.
        rest: pose from which it sinks.
        depths: (samples,) m.
    """
    poses = lower_poses(np.zeros((len(depths), 6)), depths / body.torso.standing_height)
    joints, _ = keep_feet_in_place(body, rest, poses)
    return joints


def lower_poses(poses: np.ndarray, depths: np.ndarray | float) -> np.ndarray:
    """Return poses (samples, 6) of the torso that are lower by depths (samples,) or by one depth, standing heights."""
    lower = poses.copy()
    lower[:, HEIGHT] -= depths
    return lower


def keep_feet_in_place(body: Body, rest: Pose, poses: np.ndarray, lifts: np.ndarray | float = 0.0) -> LegMotion:
    """Return joint angles that hold feet in place under a torso that moves; misses are along the root's axes.

    Args:
        body: the spec.
        rest: pose from which the torso moves.
        poses: (samples, 6) poses of the torso from there; see `posture`.
        lifts: (samples, legs, 3) displacements by which feet leave their positions, standing
            heights; 0 for feet that stay.
    """
    joints = np.tile(rest.joints, (len(poses), 1))
    attitude = rotations.matrix(rest.quaternion)
    leg_motion = move_legs_in_stages(body, joints, attitude, poses, lifts, _STAGES, _ITERATIONS_PER_STAGE)
    turns = posture.rotation_of(poses[:, 3:])
    return leg_motion._replace(misses=leg_motion.misses @ attitude.T @ turns.swapaxes(-1, -2))


def move_legs_in_stages(
    body: Body,
    joints: np.ndarray,
    attitudes: np.ndarray,
    poses: np.ndarray,
    lifts: np.ndarray | float,
    stages: int,
    iterations: int,
) -> LegMotion:
    """Return joint angles that hold feet in place under a torso that moves; misses are along the moved torso's axes.

    The movement grows in stages, so that no leg folds the other way.

    Args:
        body: the spec.
        joints: (samples, joints) angles before the torso moves, rad.
        attitudes: (samples, 3, 3) or (3, 3) rotations of the torso before it moves.
        poses: (samples, 6) movements of the torso; see `posture`.
        lifts: (samples, legs, 3) displacements by which feet leave their positions, standing
            heights; 0 for feet that stay.
        stages: number of stages.
        iterations: iterations of inverse kinematics in a stage.
    """
    standing_height = body.torso.standing_height
    legs = Legs.of(body, used=1.0).to_foot_centers()
    angles = legs.by_leg(joints)
    legs = legs.widen_ranges(angles)
    feet = legs.foot_centers(angles) @ attitudes.swapaxes(-1, -2)  # m, from the torso, along the root's axes
    displacements = standing_height * lifts
    for share in np.linspace(0.0, 1.0, stages + 1)[1:]:
        moved_feet = posture.move_ground_points(feet + share * displacements, share * poses, standing_height)
        goals = moved_feet @ attitudes
        angles = legs.solve_joint_angles(angles, goals, FOOT_WEIGHTS, posture.IK_DAMPING * standing_height, iterations)
    return LegMotion(joints=legs.by_joint(angles), misses=legs.foot_centers(angles) - goals)


def follow_at_largest_size(
    body: Body, rest: Pose, poses: np.ndarray, action: str, lifts: np.ndarray | None = None
) -> tuple[ClipMotion, float]:
    """Return a motion of the torso over its feet that is as large as standing legs can follow, and its size, up to 1.

    Args:
        body: the spec.
        rest: pose from which the torso moves.
        poses: (samples, 6) poses of the torso at full size.
        action: what an error says that the body has no room to do.
        lifts: (samples, legs, 3) lifts of the feet at full size, standing heights; None for feet that stay.

    Raises:
        ValueError: the legs cannot follow the smallest size.
    """
    if lifts is None:
        lifts = np.zeros((len(poses), len(body.legs), 3))
    sink_factors = _SINK_FACTORS if poses[:, HEIGHT].any() else (1.0,)
    for size, sink_factor in itertools.product(TRIED_SHARES, sink_factors):
        sized_poses = size * poses
        sized_poses[:, HEIGHT] *= sink_factor
        motion = follow_exactly(body, rest, sized_poses, size * lifts)
        if motion is not None:
            return motion, size
    raise ValueError(f"the legs leave the torso no room to {action}")


def follow_foot(body: Body, rest: Pose, poses: np.ndarray, lifts: np.ndarray, action: str) -> ClipMotion:
    """Return a motion of the torso over its feet in which the way of lifted feet is as large as legs can follow.

    The torso moves less than its feet, or sinks, where standing legs ask for it.

    Args:
        body: the spec.
        rest: pose from which the torso moves.
        poses: see `follow_at_largest_size`.
        lifts: see `follow_at_largest_size`.
        action: see `follow_at_largest_size`.

    Raises:
        ValueError: the legs cannot follow the smallest size.
    """
    motion = follow_exactly(body, rest, poses, lifts)
    if motion is not None:
        return motion
    dip = share_of_largest(np.linalg.norm(poses[:, HEIGHT + 1 :], axis=-1))
    smallest_lifts = TRIED_SHARES[-1] * lifts
    possible_poses = []
    for size, depth in itertools.product(TRIED_SHARES, _DIPS):
        lower = lower_poses(size * poses, depth * dip)
        if follow_exactly(body, rest, lower, smallest_lifts) is not None:
            possible_poses.append(lower)
    for lift_size, sized_poses in itertools.product(TRIED_SHARES, possible_poses):
        motion = follow_exactly(body, rest, sized_poses, lift_size * lifts)
        if motion is not None:
            return motion
    raise ValueError(f"the legs leave the torso no room to {action}")


def follow_exactly(
    body: Body, rest: Pose, poses: np.ndarray, lifts: np.ndarray, smoothing_rounds: int = _SMOOTHING_ROUNDS
) -> ClipMotion | None:
    """Return a motion of torso (samples, 6) and feet (samples, legs, 3) from rest; None if legs cannot follow it."""
    probe = slice(None, None, _PROBE_STRIDE)
    _, misses = keep_feet_in_place(body, rest, poses[probe], lifts[probe])
    if not _feet_stay(body, misses, lifts[probe]):
        return None
    standing_height = body.torso.standing_height
    joints, misses = keep_feet_in_place(body, rest, poses, lifts)
    joints = _smooth(joints, smoothing_rounds)
    max_joint_step = _MAX_JOINT_SPEED * rate_unit(body.torso.standing_height) * time_step(body)
    if abs(np.diff(joints, axis=0)).max() > max_joint_step or not _feet_stay(body, misses, lifts):
        return None
    motion = pose_motion(body, rest, poses, joints)
    if _measure_depth(body, motion) > _MAX_SMOOTH_SINK * standing_height:
        return None
    return motion


def _feet_stay(body: Body, misses: np.ndarray, lifts: np.ndarray) -> bool:
    """Return whether feet with misses (samples, legs, 3), m, stay where they stand; see `keep_feet_in_place`."""
    max_slide = _MAX_SLIDE if has_free_feet(body) else _MAX_SLIDE_OF_FEW_JOINTS
    standing_misses = np.where(lifts[..., 2:] > _MAX_SINK, 0.0, misses / body.torso.standing_height)
    slides = np.linalg.norm(np.ptp(standing_misses[..., :2], axis=0), axis=-1)
    sinks = abs(standing_misses[..., 2])
    return bool(slides.max() <= max_slide and sinks.max() <= _MAX_SINK)


def _measure_depth(body: Body, motion: ClipMotion) -> float:
    """Return how deep a foot sinks below its height in the first sample, m."""
    legs = Legs.of(body, used=1.0)
    feet = legs.foot_centers(legs.by_leg(motion.joints))  # in the torso's frame
    up = rotations.matrix(motion.quaternions)[:, 2]  # (samples, 3) the vertical in this frame
    heights = motion.positions[:, [2]] + (feet @ up[..., None])[..., 0]  # (samples, legs)
    return float((heights[0] - heights).max())


def pose_motion(body: Body, rest: Pose, poses: np.ndarray, joints: np.ndarray) -> ClipMotion:
    """Return a motion of the torso (samples, 6) from rest, and of joints (samples, joints), rad."""
    motion = hold_pose(rest, len(poses) - 1, time_step(body))
    return move_torso(body, motion, poses)._replace(joints=joints)


def move_torso(body: Body, motion: ClipMotion, poses: np.ndarray) -> ClipMotion:
    """Return a motion whose torso is moved by poses (samples, 6) from where it is; its joints stay as they are."""
    return motion._replace(
        positions=motion.positions + body.torso.standing_height * poses[:, _FORWARD_LEFT_UP],
        quaternions=tilt(motion.quaternions, poses[:, 3:]),
    )


def tilt(quaternions: np.ndarray, roll_pitch_yaw: np.ndarray) -> np.ndarray:
    """Return quaternions (samples, 4) turned by roll, pitch and yaw (samples, 3), rad, about fixed axes."""
    half_angles = 0.5 * roll_pitch_yaw
    for axis in range(3):
        half_angle = half_angles[:, [axis]]
        turns = np.concatenate([np.cos(half_angle), np.sin(half_angle) * np.eye(3)[axis]], axis=-1)
        quaternions = rotations.product(turns, quaternions)
    return quaternions


def poses_of_motion(body: Body, rest: Pose, motion: ClipMotion) -> np.ndarray:
    """Return the poses (samples, 6) of the torso of a motion from rest; see `pose_motion`."""
    forward, left, up = ((motion.positions - rest.position) / body.torso.standing_height).T
    turns = rotations.matrix(motion.quaternions) @ rotations.matrix(rest.quaternion).T
    roll = np.arctan2(turns[:, 2, 1], turns[:, 2, 2])
    pitch = -np.arcsin(turns[:, 2, 0].clip(-1.0, 1.0))
    yaw = np.arctan2(turns[:, 1, 0], turns[:, 0, 0])
    return np.stack([up, forward, left, roll, pitch, yaw], axis=-1)


def hold_pose(pose: Pose, samples: int, time_step: float) -> ClipMotion:
    """Return a pose that stays for a number of samples after the first one, with a root that stays."""
    return ClipMotion(
        time_step=time_step,
        root=np.zeros((samples + 1, 3)),
        positions=np.tile(pose.position, (samples + 1, 1)),
        quaternions=np.tile(pose.quaternion, (samples + 1, 1)),
        joints=np.tile(pose.joints, (samples + 1, 1)),
        twist=np.zeros(3),
    )


def feet_from_torso(body: Body, rest: Pose) -> np.ndarray:
    """Return the positions (legs, 3) of the feet from the torso, in the root's axes, m."""
    legs = Legs.of(body, used=1.0)
    return legs.foot_centers(legs.by_leg(rest.joints)) @ rotations.matrix(rest.quaternion).T


def time_step(body: Body) -> float:
    """Return the time between two samples, s."""
    return sizing.control_timestep(body) / _SAMPLES_PER_CONTROL_STEP


def sample_times(body: Body, duration: float) -> np.ndarray:
    """Return the times (samples,) of a duration, both in sqrt(h / g), both ends included."""
    step = time_step(body) * rate_unit(body.torso.standing_height)
    return np.linspace(0.0, duration, 1 + max(2, round(duration / step)))


def _smooth(joints: np.ndarray, rounds: int) -> np.ndarray:
    """Return joint angles (samples, joints) without jerks, such as of a leg that stretches; both ends stay."""
    for _ in range(rounds):
        joints[1:-1] = 0.25 * (joints[:-2] + 2.0 * joints[1:-1] + joints[2:])
    return joints
