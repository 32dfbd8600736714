"""How still a body stands while its servos hold it: joints of light links buzz where time steps are too long."""

import math
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite import rotations
from arc_suite.models.standing import standing_qpos
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compile_model

_DURATION = 6.0  # sqrt(h / g), of a standing height h; 1 s of a robot 0.27 m high
_MAX_STEPS = 20_000
_MIN_UPRIGHTNESS = 0.5  # cosine of the torso's tilt
# Root mean square of the joints' speeds, rad in a time of sqrt(h / g). Of 40 robots of others 26 stay below 0.004;
# the joints of the others shake at 0.014 and more.
_MAX_JOINT_SPEED = 0.01
_MAX_EFFORT = 0.9  # mean torque that a motor can hold, as a share of its limit; one that swings has a mean near 0
# Armature that calms joints, as a share of stiffness times the square of the time step: a joint that swings by its
# servo alone then advances by 0.45 rad of its phase in a step. Shares of 2 calm nine of eleven robots, of 1 three.
_ARMATURE_SHARE = 5.0


class Stillness(NamedTuple):
    """How still a body stands.

    Attributes:
        joint_speed: root mean square over the joints, rad/s.
        buzzes: whether the joints shake although the torso stays upright and the motors could hold it.
        falls: whether the torso tilts too far, or the simulation diverges.
        overloaded: (joints,) whether a motor gives its limit one way all the time.
    """

    joint_speed: float
    buzzes: bool
    falls: bool
    overloaded: np.ndarray


def measure_stillness(body: Body) -> Stillness:
    """Let a body with servos stand for about a second, and return how still it is in the second half of that time."""
    model = compile_model(body)
    data = mujoco.MjData(model)
    data.qpos[:] = standing_qpos(model)
    time_unit = math.sqrt(body.torso.standing_height / np.linalg.norm(model.opt.gravity))  # s
    steps = min(math.ceil(_DURATION * time_unit / model.opt.timestep), _MAX_STEPS)
    motor_dofs = [model.joint(name).dofadr[0] for name in body.joint_names]
    limits = np.array([joint.servo.limit for joint in body.joints])
    speeds = []
    efforts = []  # torques as shares of the limits
    for _ in range(steps):
        mujoco.mj_step(model, data)
        speeds.append(data.qvel[6:].copy())
        efforts.append(data.qfrc_actuator[motor_dofs] / limits)
    joint_speed = float(np.sqrt(np.square(speeds[steps // 2 :]).mean()))
    has_diverged = bool(data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number)
    falls = has_diverged or not rotations.upright(data.qpos[3:7]) >= _MIN_UPRIGHTNESS
    overloaded = np.abs(np.mean(efforts[steps // 2 :], axis=0)) > _MAX_EFFORT
    shakes = joint_speed * time_unit > _MAX_JOINT_SPEED
    return Stillness(joint_speed, shakes and not falls and not overloaded.any(), falls, overloaded)


def calming_armature(stiffness: float, timestep: float) -> float:
    """Return the armature, kg m^2, with which a joint does not buzz.

    Args:
        stiffness: of its servo, N m/rad.
        timestep: of the simulation, s.
    """
    return _ARMATURE_SHARE * stiffness * timestep**2
