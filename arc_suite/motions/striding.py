"""A motion for any body without a file: a walk straight ahead whose feet follow the paths of a gait."""

import numpy as np

from arc_suite import rotations
from arc_suite.models import foot_paths
from arc_suite.models.posture import find_rest_pose
from arc_suite.motions.motion import Motion, make
from arc_suite.robots.spec import Body

NAME = "walk"
_FOOT_CLEARANCE = 0.2  # standing heights, of a foot in mid-swing


def stride(body: Body, frequency: float, duty_factor: float, offsets: np.ndarray, velocity: float) -> Motion:
    """Return a loop of walking straight ahead under a level torso: kinematics alone, without balance.

    Args:
        body: any body.
        frequency: of the gait's cycle, Hz.
        duty_factor: share of a cycle that a foot stands.
        offsets: (legs,) phases of the legs, cycles.
        velocity: of the torso along +x, m/s.
    """
    rest_pose = find_rest_pose(body)
    height = body.torso.standing_height
    angles = foot_paths.cycle_angles(
        rest_pose,
        offsets=offsets,
        duty_factor=duty_factor,
        half_path=0.5 * velocity * duty_factor / frequency,
        foot_clearance=_FOOT_CLEARANCE * height,
        damping=foot_paths.IK_DAMPING * height,
    )
    steps = len(angles)
    times = np.arange(steps + 1) / (steps * frequency)
    torso_height = -rest_pose.sole_positions[:, 2].mean()
    positions = np.stack([velocity * times, 0.0 * times, np.full(steps + 1, torso_height)], axis=-1)
    quaternions = np.tile(rotations.NO_TURN, (steps + 1, 1))
    phases = np.arange(steps + 1)[:, None] / steps + offsets
    return make(
        body,
        NAME,
        frame_rate=steps * frequency,
        loops=True,
        positions=positions,
        quaternions=quaternions,
        angles=np.concatenate([angles, angles[:1]]),
        planted=phases % 1.0 < duty_factor,
    )
