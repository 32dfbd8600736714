"""Parameters of the task walk for a body without published ones, from its standing pose.

Speeds are multiples of sqrt(g h) (a Froude number of speed / sqrt(g h)), frequencies of
sqrt(g / h) and lengths of h, the height at which the torso stands, so that bodies of one shape and
different size get the same task. The multiples lie among those of the published robots.
"""

import math

import numpy as np

from arc_suite.models.standing import measure_standing, rate_unit, speed_unit
from arc_suite.models.stride import TARGET_FROUDE, fitted_gait, gait_frequency
from arc_suite.robots.spec import Body

BAND = 0.75  # share of the target velocity; published: 0.6 to 1
STANCE_HEIGHT = 0.04  # h; a foot in stance is at most so far off the ground
HEALTHY_RANGE = (0.4, 1.8)  # h; published: 0.3 to 0.44, and 1.6 to 2

# Noise of the start.
POSITION_NOISE = 0.05  # h; published: 0.03 to 0.2
ORIENTATION_NOISE = 0.02  # components of the quaternion; published: 0.02 to 0.1
LINEAR_VELOCITY_NOISE = 0.01  # sqrt(g h); published: 0.007 to 0.05
ANGULAR_VELOCITY_NOISE = 0.004  # sqrt(g / h); published: 0.003 to 0.02
JOINT_ANGLE_NOISE = 0.1  # rad, as published
JOINT_VELOCITY_NOISE = 0.02  # sqrt(g / h); published: 0.014 to 0.03


def fitted_parameters(body: Body) -> dict:
    """Return parameters of walk for any body: units as in `parameters.Parameters`, a number for each noise."""
    height = body.torso.standing_height
    speed = TARGET_FROUDE * speed_unit(height)
    gait = fitted_gait(body)
    return {
        "target_velocity": speed,
        "velocity_band": BAND * speed,
        "gait_frequency": gait_frequency(body) * rate_unit(height),
        "duty_factor": gait.duty_factor,
        "phase_offsets": tuple(2.0 * math.pi * offset for offset in gait.offsets),
        "stance_threshold": max(leg.foot.radius for leg in body.legs) + STANCE_HEIGHT * height,
        "healthy_range": tuple(share * height for share in HEALTHY_RANGE),
        "weights": {},
        **fitted_noise(body),
    }


def fitted_noise(body: Body) -> dict[str, float]:
    """Return every noise of a start that suits any body: names and units as in `parameters.Noise`."""
    height = body.torso.standing_height
    return {
        "position_noise": POSITION_NOISE * height,
        "orientation_noise": ORIENTATION_NOISE,
        "linear_velocity_noise": LINEAR_VELOCITY_NOISE * speed_unit(height),
        "angular_velocity_noise": ANGULAR_VELOCITY_NOISE * rate_unit(height),
        "joint_angle_noise": JOINT_ANGLE_NOISE,
        "joint_velocity_noise": JOINT_VELOCITY_NOISE * rate_unit(height),
    }


def velocity_units(body: Body, target_velocity: float) -> np.ndarray:
    """Return the units (3,) of commands: the target velocity forward and left, m/s, and a turning velocity, rad/s.

    At the unit of turning on the spot, feet on a circle of radius R move at the target velocity.
    """
    speed = abs(target_velocity)
    return np.array((speed, speed, speed / reach(body)))


def reach(body: Body) -> float:
    """Return R, the mean horizontal distance of the feet from the center of mass in the standing pose, m."""
    pose = measure_standing(body)
    x, y = (pose.soles - pose.center)[:, :2].T
    return float(np.hypot(x, y).mean())
