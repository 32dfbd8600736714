"""Which joints a file drives; the others are passive, with their springs and damping, or follow another joint."""

from collections.abc import Iterator
from typing import NamedTuple

import mujoco

from arc_suite.importing import loops, trunk
from arc_suite.importing.tree import Robot

_MIN_DRIVEN_LEGS = 2  # legs with a motor; a file with fewer does not say which joints have motors
_JOINT_TRANSMISSIONS = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
_TENDON_TRANSMISSION = int(mujoco.mjtTrn.mjTRN_TENDON)


class Drive(NamedTuple):
    """An actuator that drives a joint.

    Attributes:
        actuator: MuJoCo's index.
        joint: MuJoCo's index.
        gear: torque per force of the actuator, of either sign.
    """

    actuator: int
    joint: int
    gear: float


def release_joints(robot: Robot, names_of_driven: frozenset[str]) -> Robot:
    """Return the robot with the joints passive that its file does not drive, and without them in the chains.

    A file that drives no legs says nothing of motors: all joints get some. A joint of a leg that follows another one
    by an equality has a motor of its own, as the sketch of a leg cannot follow.

    Args:
        robot: all of whose joints are in the chains.
        names_of_driven: joints that a URDF drives; none for those of the actuators.
    """
    leg_chains = trunk.find_leg_chains(robot)
    leg_joints = {joint for chain in leg_chains for joint in chain}
    kept_loops = loops.find_loops(robot, leg_joints)
    followers = {loop.follower for loop in kept_loops if loop.follower is not None}
    if names_of_driven:
        driven = {joint for joint in robot.joints if robot.joint_name(joint) in names_of_driven}
    else:
        driven = _joints_of_actuators(robot)
    passive = followers
    if sum(bool(driven.intersection(chain)) for chain in leg_chains) >= _MIN_DRIVEN_LEGS:
        passive |= set(robot.joints) - driven - loops.followers_in_legs(robot, leg_joints)
    chains = {body: tuple(joint for joint in chain if joint not in passive) for body, chain in robot.chains.items()}
    return robot._replace(chains=chains, passive=tuple(sorted(passive)), loops=kept_loops)


def actuated_joints(robot: Robot) -> list[int]:
    """Return the joints that actuators drive, each once, in the order of the actuators."""
    return list(dict.fromkeys(drive.joint for drive in find_drives(robot)))


def count_joint_actuators(robot: Robot) -> int:
    """Return how many actuators drive a joint of the robot."""
    return len(list(find_drives(robot)))


def find_drives(robot: Robot) -> Iterator[Drive]:
    """Yield the actuators that drive a joint of the robot; muscles are none of them."""
    model = robot.model
    for actuator in range(model.nu):
        joint = int(model.actuator_trnid[actuator, 0])
        is_muscle = model.actuator_gaintype[actuator] == mujoco.mjtGain.mjGAIN_MUSCLE
        drives_joint = model.actuator_trntype[actuator] in _JOINT_TRANSMISSIONS and joint in robot.joints
        if drives_joint and not is_muscle:
            yield Drive(actuator, joint, float(model.actuator_gear[actuator, 0]))


def _joints_of_actuators(robot: Robot) -> set[int]:
    """Return the joints that actuators drive, by tendons, too, and those that tendons couple, which are left out."""
    model = robot.model
    joints = {
        int(joint)
        for joint, kind in zip(model.actuator_trnid[:, 0], model.actuator_trntype, strict=True)
        if kind in _JOINT_TRANSMISSIONS
    }
    if not joints and _TENDON_TRANSMISSION not in model.actuator_trntype:
        return set()
    first_wraps = model.tendon_adr
    for tendon in range(model.ntendon):
        for wrap in range(first_wraps[tendon], first_wraps[tendon] + model.tendon_num[tendon]):
            if model.wrap_type[wrap] == mujoco.mjtWrap.mjWRAP_JOINT:
                joints.add(int(model.wrap_objid[wrap]))
    return joints.intersection(robot.joints)
