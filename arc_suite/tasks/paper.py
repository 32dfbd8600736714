"""Parts of the paper's task that tasks with a command share: the drawn start, the observation."""

from collections.abc import Mapping

import numpy as np

from arc_suite.robots import mirror
from arc_suite.robots.spec import Body
from arc_suite.tasks import mirrors
from arc_suite.tasks.mirrors import AXIAL, POLAR, QUATERNION, SAME, Mirror
from arc_suite.tasks.parameters import Noise, Parameters


def drawn_state(standing: np.ndarray, noise: Noise, random: np.random.RandomState) -> tuple[np.ndarray, np.ndarray]:
    """Draw the state in which an episode starts: the standing pose with noise.

    Args:
        standing: (nq,) torso position and quaternion, then joint angles.
        noise: of the start.
        random: to draw from.

    Returns:
        qpos (nq,) and qvel (nq - 1,).
    """
    joints = len(standing) - 7
    widths = np.repeat((noise.position_noise, noise.orientation_noise, noise.joint_angle_noise), (3, 4, joints))
    qpos = standing + random.uniform(-widths, widths)
    qpos[3:7] /= np.linalg.norm(qpos[3:7])
    deviations = noise.linear_velocity_noise, noise.angular_velocity_noise, noise.joint_velocity_noise
    return qpos, np.repeat(deviations, (3, 3, joints)) * random.standard_normal(6 + joints)


def blocks(body: Body) -> dict[str, int]:
    """Return the sizes of posture, velocities, contact_forces and gait_clock, in the paper's order (Section 3)."""
    joints, parts = len(body.joint_names), len(body.part_names)
    return {"posture": 5 + joints, "velocities": 6 + joints, "contact_forces": 6 * parts, "gait_clock": 2}


def symmetry(body: Body, parameters: Parameters) -> Mapping[str, Mirror]:
    """Return the left-right maps of these blocks by name.

    Where left and right legs take turns, the mirrored clock is half a cycle later: its sine and cosine change sign.

    Raises:
        ValueError: the body, the gait or the default angles are not symmetric.
    """
    image = mirror.image(body)
    joints, default = mirrors.joints(image), parameters.default_angles
    if not np.allclose(joints(default), default):
        raise ValueError("default_angles: expected mirrored poses left and right")
    return {
        "posture": mirrors.joined([SAME, QUATERNION, joints]),
        "velocities": mirrors.joined([POLAR, AXIAL, joints]),
        "contact_forces": mirrors.of_each(image.parts, mirrors.joined([AXIAL, POLAR])),
        "gait_clock": _mirrored_clock(parameters.phase_offsets, image.legs),
    }


def _mirrored_clock(offsets: np.ndarray, across: np.ndarray) -> Mirror:
    for sign in (1, -1):  # of the clock's sine and cosine, whose leads over the legs across are 0 or half a cycle
        if np.allclose(np.exp(1j * offsets[across]), sign * np.exp(1j * offsets)):
            return Mirror.signed(sign, sign)
    raise ValueError("phase_offsets: expected legs across from each other to move together, or half a cycle apart")
