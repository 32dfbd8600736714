"""The servos of an imported robot: gains and torque limits of the file where it has them, else by rule."""

from collections import Counter
from collections.abc import Iterator
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite.importing.poses import Leg, Stance
from arc_suite.importing.tree import Robot
from arc_suite.models.standing import foot_loads
from arc_suite.robots.spec import Servo

# The rule for gains: this error calls for so many times the torque that holds the standing pose.
_ERROR = 0.1  # rad
_TIMES = 10.0
_LEAST_SHARE = 0.5  # of the leg's strongest load, by which a joint with a smaller one counts
_LEAST_FREQUENCY = 17.0  # rad/s, of a joint with what it moves
_DAMPING_RATIO = 0.7
_CARRYING = 40.0  # rad/s, of a joint at most: a leg on the floor moves the torso, and not its links alone

_STRENGTH = 30.0  # times the load, of a motor whose limit the file does not have
_UNKNOWN = 1000.0  # N m; files have it, and larger ones, where nobody knew the motor
_IMPLAUSIBLE = 200.0  # times the leg's strongest load

_SIZED, _PLACEHOLDER = "sized", "placeholder"  # where a limit comes from, in place of an attribute

_OF_JOINTS = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))


class Motors(NamedTuple):
    """The servos of all joints, and notes on where their limits come from.

    Attributes:
        servos: by joint.
        notes: a line for each kind of limit.
    """

    servos: dict[int, Servo]
    notes: tuple[str, ...]


def find_motors(robot: Robot, stance: Stance) -> Motors:
    """Return the servos of a robot's joints."""
    inertias, loads = _mechanics(robot, stance)
    given, limits = dict(_gains(robot)), _limits(robot)
    groups = [leg.joints for leg in stance.legs]
    groups += [(joint,) for joint in robot.joints if not any(joint in group for group in groups)]
    servos, origins = {}, {}
    for group in groups:
        strongest = max(loads[joint] for joint in group)
        for joint in group:
            load, inertia = max(loads[joint], _LEAST_SHARE * strongest), inertias[joint]
            limit, origins[joint] = limits.get(joint) or (_sized(load, inertia), _SIZED)
            if limit >= _UNKNOWN or (strongest and limit > _IMPLAUSIBLE * strongest):
                origins[joint] = _PLACEHOLDER
            damping = float(robot.model.dof_damping[robot.model.jnt_dofadr[joint]])
            stiffness, resistance = given.get(joint) or _rule(load, inertia, limit, damping)
            servos[joint] = Servo(stiffness=stiffness, damping=resistance, limit=limit)
    return Motors(servos, tuple(_notes(stance.joints, servos, origins, given)))


def _sized(load: float, inertia: float) -> float:
    """Return the limit of a motor that the file tells nothing of; one that bears nothing moves its link."""
    return _STRENGTH * max(load, inertia * _LEAST_FREQUENCY**2 * _ERROR / _TIMES)


def _rule(load: float, inertia: float, limit: float, damping: float) -> tuple[float, float]:
    """Return stiffness and damping of a servo."""
    wanted = max(_TIMES * load / _ERROR, inertia * _LEAST_FREQUENCY**2)
    stiffness = min(wanted, limit / _ERROR)
    moved = max(inertia, stiffness / _CARRYING**2)
    return stiffness, max(2.0 * _DAMPING_RATIO * np.sqrt(stiffness * moved) - damping, 0.0)


def _mechanics(robot: Robot, stance: Stance) -> tuple[dict[int, float], dict[int, float]]:
    """Return the inertia with armature that each joint moves, and the torque that it holds with all feet carrying."""
    model = robot.model
    data = robot.placed(stance.qpos)
    mujoco.mj_forward(model, data)
    matrix = np.empty((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    mass = float(model.body_subtreemass[robot.root])
    center = data.subtree_com[robot.root]
    soles = np.array([leg.sole for leg in stance.legs])
    weight = mass * float(np.linalg.norm(model.opt.gravity))
    bias = data.qfrc_bias.copy()
    for leg, force in zip(stance.legs, foot_loads(weight, soles[:, :2] - center[:2]), strict=True):
        bias -= force * _lever(model, data, leg)
    dofs = {joint: int(model.jnt_dofadr[joint]) for joint in robot.joints}
    inertias = {joint: float(matrix[dof, dof]) for joint, dof in dofs.items()}
    return inertias, {joint: float(abs(bias[dof])) for joint, dof in dofs.items()}


def _lever(model: mujoco.MjModel, data: mujoco.MjData, leg: Leg) -> np.ndarray:
    """Return the vertical velocity of a sole per velocity of each degree of freedom (nv,)."""
    jacobian = np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, jacobian, None, leg.sole, leg.body)
    return jacobian[2]


def _driven(robot: Robot) -> Iterator[tuple[int, int, float]]:
    """Yield the actuators of joints: actuator, joint and gear."""
    model = robot.model
    for actuator in range(model.nu):
        joint = int(model.actuator_trnid[actuator, 0])
        muscle = model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_MUSCLE
        if model.actuator_trntype[actuator] in _OF_JOINTS and joint in robot.joints and not muscle:
            yield actuator, joint, abs(float(model.actuator_gear[actuator, 0]))


def actuated_joints(robot: Robot) -> list[int]:
    """Return the joints that actuators drive, in their order."""
    return list(dict.fromkeys(joint for _, joint, _ in _driven(robot)))


def count_joint_actuators(robot: Robot) -> int:
    """Return how many actuators drive a joint of the robot."""
    return sum(1 for _ in _driven(robot))


def _gains(robot: Robot) -> Iterator[tuple[int, tuple[float, float]]]:
    """Yield stiffness and damping of joints that a position actuator drives."""
    model = robot.model
    for actuator, joint, gear in _driven(robot):
        gain, (_, position, velocity) = float(model.actuator_gainprm[actuator, 0]), model.actuator_biasprm[actuator, :3]
        affine = model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_AFFINE
        if affine and gain > 0.0 and gain == -position and gear > 0.0:
            yield joint, (gain * gear**2, max(float(-velocity), 0.0) * gear**2)


def _limits(robot: Robot) -> dict[int, tuple[float, str]]:
    """Return the least torque limit of each joint that has one, and the attribute that says so."""
    model, found = robot.model, {}
    for actuator, joint, gear in _driven(robot):
        force = abs(model.actuator_forcerange[actuator]).max()
        control = abs(model.actuator_ctrlrange[actuator]).max()
        motor = model.actuator_biastype[actuator] == mujoco.mjtBias.mjBIAS_NONE
        if model.actuator_forcelimited[actuator]:
            found.setdefault(joint, []).append((gear * float(force), "forcerange"))
        if motor and model.actuator_ctrllimited[actuator]:
            gain = abs(float(model.actuator_gainprm[actuator, 0]))
            found.setdefault(joint, []).append((gear * gain * float(control), "ctrlrange"))
    for joint in robot.joints:
        if model.jnt_actfrclimited[joint]:
            effort = float(abs(model.jnt_actfrcrange[joint]).max())
            found.setdefault(joint, []).append((effort, "actuatorfrcrange or effort"))
    positive = {joint: [limit for limit in limits if limit[0] > 0.0] for joint, limits in found.items()}
    return {joint: min(limits) for joint, limits in positive.items() if limits}


def _notes(legs: list[int], servos: dict, origins: dict, given: dict) -> Iterator[str]:
    """Yield a line for each origin of limits of the legs' motors, and one for the gains."""
    for origin, count in Counter(origins[joint] for joint in legs).items():
        torques = [servos[joint].limit for joint in legs if origins[joint] == origin]
        span = " to ".join(dict.fromkeys(f"{torque:.4g}" for torque in (min(torques), max(torques))))
        said = {
            _SIZED: f"none in the file for {count} motors, sized to {span} N m, {_STRENGTH:g} times their load",
            _PLACEHOLDER: f"{span} N m of {count} motors is a placeholder, far above their load",
        }
        yield f"limits: {said.get(origin, f'{span} N m of {count} motors, from {origin}')}"
    own = sum(joint in given for joint in legs)
    yield f"gains: {own} of {len(legs)} servos have those of the file's position actuators, the others are sized"
