"""Paths of feet in a cycle of a gait, as of demonstrators that step, and the joint angles by which legs follow them."""

import math

import numpy as np

from arc_suite.models.kinematics import path_weights
from arc_suite.models.posture import RestPose

IK_ITERATIONS = 3  # of inverse kinematics in a control step
# Standing heights. With less of it, legs that are stretched out jump, neighbors of many legs press against each other,
# and feet push against uneven ground in place of yielding.
IK_DAMPING = 0.5
RELAXING_SHARE = 0.2  # of the way to rest, in a control step, of joints that the place of a foot leaves free
SLIP_WEIGHT = 0.3  # of a foot's slip across its path against its motion along it
FOOT_CLEARANCE = 0.3  # standing heights, of a foot in mid-swing

_STEPS_PER_CYCLE = 13  # about as many control steps as a cycle has


def find_path_position(leg_phases, duty_factor) -> tuple:
    """Return where feet are along their paths, from 1 in front to -1 at the end, and their progress in swing.

    Args:
        leg_phases: (..., legs) cycles.
        duty_factor: a number, or an array that broadcasts to the phases.

    Returns:
        Two arrays like the phases; progress is 0 in stance and goes to 1 in swing.
    """
    xp = leg_phases.__array_namespace__()
    is_stance = leg_phases < duty_factor
    swing_progress = ((leg_phases - duty_factor) / (1.0 - duty_factor)).clip(0.0)
    stance_position = 1.0 - 2.0 * leg_phases / duty_factor
    swing_position = 2.0 * swing_progress - 1.0
    return xp.where(is_stance, stance_position, swing_position), swing_progress


def cycle_angles(
    rest_pose: RestPose,
    offsets: np.ndarray,
    duty_factor: float,
    half_path: float | np.ndarray,
    foot_clearance: float,
    damping: float,
) -> np.ndarray:
    """Return joint angles (steps, ..., joints), rad, in a cycle of steps.

    Args:
        rest_pose: pose of the torso over the feet.
        offsets: (legs,) phases of the legs, cycles.
        duty_factor: share of a cycle that a foot stands.
        half_path: how far ahead of its position at rest a foot touches down, m; or (..., legs, 2), how far ahead and to
            the left of it.
        foot_clearance: height of a foot in mid-swing, m.
        damping: of inverse kinematics, m.
    """
    legs = rest_pose.legs
    joint_angles = rest_pose.joint_angles
    half_paths = half_path if np.ndim(half_path) else np.tile(np.array((half_path, 0.0)), (len(offsets), 1))
    weights = path_weights(half_paths, SLIP_WEIGHT)
    angles_of_steps = []
    for step in range(2 * _STEPS_PER_CYCLE):
        leg_phases = (step / _STEPS_PER_CYCLE + offsets) % 1.0
        path_position, swing_progress = find_path_position(leg_phases, duty_factor)
        heights = foot_clearance * np.sin(math.pi * swing_progress)
        ground = half_paths * path_position[:, None]
        displacements = np.concatenate([ground, np.broadcast_to(heights[:, None], (*ground.shape[:-1], 1))], axis=-1)
        goals = rest_pose.sole_positions + displacements
        joint_angles = legs.solve_joint_angles(joint_angles, goals, weights, damping, IK_ITERATIONS)
        angles_of_steps.append(legs.by_joint(joint_angles))
    return np.stack(angles_of_steps[_STEPS_PER_CYCLE:])  # the first cycle begins at rest
