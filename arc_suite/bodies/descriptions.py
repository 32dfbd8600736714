"""Descriptions of bodies for one policy of all: lengths, ranges and gains of legs and torso, without dimension."""

import math
from typing import NamedTuple

import numpy as np

from arc_suite.bodies.padding import MAX_JOINTS, MAX_LEGS, pad_joints
from arc_suite.models.outline import level_extents
from arc_suite.models.sizing import position_gains, size_body
from arc_suite.models.standing import GRAVITY, PoseMechanics, measure_standing
from arc_suite.robots.spec import Body
from arc_suite.tasks.contract import Task
from arc_suite.tasks.fitting import reach

# Sizes of the description: of a leg and of the torso.
LEG_DESCRIPTION_SIZE = 9 + 8 * MAX_JOINTS
TORSO_DESCRIPTION_SIZE = 10

_MIN_LENGTH = 1e-9  # m, of vectors in divisions


class Description(NamedTuple):
    """Properties of bodies that stay the same: lengths in h, rates in sqrt(g / h), torques in those of the motors.

    Attributes:
        legs: (..., 12, 41) foot and mount from the torso's origin (6), direction of the foot (2), number of joints as
            one of four (4), Jacobian of the sole (3 x 4), joint ranges, rad (4 x 2), stiffness, action per rad, and
            damping of position control (4 + 4), duty factor. Gains are those at an `agility` of 1, as position control
            exerts the same torques with stronger motors.
        torso: (..., 10) number of legs by 12, half-extents of the first solid along the torso's axes (3), center of
            mass (3), static stability margin, R, duty factor.
        mask: (..., 12, 4) whether a leg has a joint.
        reach: (..., 12, 4) angles that an action of 1 asks for, rad.
    """

    legs: np.ndarray
    torso: np.ndarray
    mask: np.ndarray
    reach: np.ndarray


def body_description(task: Task) -> Description:
    """Return the description of the body of a task, in the gait that the task prescribes; no leading axes.

    Raises:
        ValueError: too many legs or joints, or a task that prescribes no gait.
    """
    if task.parameters is None:
        raise ValueError(f"task {task.name}: expected one that prescribes a gait")
    body = task.scene.body
    duty_factor = task.parameters.duty_factor
    pose = measure_standing(body)
    height = pose.height  # m, of the torso
    leg_count = len(body.legs)
    ranges = np.radians([joint.range_deg for joint in body.joints])

    legs = np.zeros((MAX_LEGS, LEG_DESCRIPTION_SIZE))
    legs[:leg_count] = _describe_legs(body, pose, ranges, duty_factor)
    lengths = np.array((*level_extents(body.torso.solids[0]), *pose.center, pose.margin, reach(body))) / height
    return Description(
        legs=legs.astype(np.float32),
        torso=np.array((leg_count / MAX_LEGS, *lengths, duty_factor), np.float32),
        mask=pad_joints(body, np.ones(len(ranges))).astype(bool),
        reach=pad_joints(body, abs(ranges).max(axis=-1)).astype(np.float32),
    )


def _describe_legs(body: Body, pose: PoseMechanics, ranges: np.ndarray, duty_factor: float) -> np.ndarray:
    """Return the descriptions (legs, 41) of a body's legs; see `Description`.

    Args:
        body: any body.
        pose: the standing one.
        ranges: (joints, 2) ranges of the joints, rad.
        duty_factor: duty factor of the gait.
    """
    leg_count = len(body.legs)
    rate = math.sqrt(GRAVITY / pose.height)  # rad/s
    feet = np.array([leg.foot_position for leg in body.legs])  # (legs, 3) m
    mounts = np.array([leg.mount for leg in body.legs])  # (legs, 3) m
    foot_distances = np.maximum(np.hypot(feet[:, 0], feet[:, 1]), _MIN_LENGTH)  # from the torso, seen from above
    foot_directions = feet[:, :2] / foot_distances[:, None]
    joint_counts = np.eye(MAX_JOINTS)[[len(leg.joints) - 1 for leg in body.legs]]
    jacobians = pad_joints(body, np.concatenate([jacobian.T for jacobian in pose.jacobians]))[:leg_count]
    stiffness, damping = position_gains(size_body(body), pose.inertias)
    parts = [
        feet / pose.height,
        mounts / pose.height,
        foot_directions,
        joint_counts,
        jacobians.swapaxes(1, 2) / pose.height,
        pad_joints(body, ranges)[:leg_count],
        pad_joints(body, body.agility * stiffness)[:leg_count],
        pad_joints(body, body.agility * damping * rate)[:leg_count],
        np.full((leg_count, 1), duty_factor),
    ]
    return np.concatenate([part.reshape(leg_count, -1) for part in parts], axis=-1)
