"""What a robot without legs is: an arm, a drone, a vehicle."""

import os.path
from collections.abc import Iterator

import mujoco
import numpy as np

from arc_suite.importing import tree

EXPECTED = "expected a robot with two or more legs"

_MIN_ARM = 3  # joints; a shorter chain may be a pendulum
_MAX_FINGER = 2  # joints, of a gripper at the end of an arm
_MIN_ROTORS = 3
_MIN_WHEELS = 2
_MAX_WHEEL_CHAIN = 2  # joints, with one that steers or springs
_MIN_TURN = 6.0  # rad; a joint that turns farther may turn a wheel or a rotor
_MAX_ARMS = 2  # of a vehicle
_UPRIGHT = 0.7  # vertical part of an axis, a unit vector
_MAX_HUB_OFFSET = 0.2  # of a wheel's radius, between its axis and its middle

Branch = list[tuple[int, ...]]  # chains of joints with the same first joint


def describe_kind(model: mujoco.MjModel, root: int) -> str:
    """Return what a robot without legs is; empty for one that may have legs.

    Args:
        model: model of the file.
        root: body from which its joints are counted.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    branches = _list_branches(model, root)
    rotors = [branch for branch in branches if _is_rotor(model, data, branch)]
    wheels = [branch for branch in branches if _has_wheels(model, data, branch)]
    limbs = [branch for branch in branches if branch not in wheels and max(map(len, branch)) > 1]
    if not branches:
        return "one rigid body: it has no joints"
    if len(rotors) >= _MIN_ROTORS and len(rotors) == len(branches) - len(limbs) and len(limbs) <= 1:
        return f"a drone: {len(rotors)} rotors{' and an arm' if limbs else ''}"
    wheel_count = sum(len(branch) for branch in wheels)
    if wheel_count >= _MIN_WHEELS and len(limbs) <= _MAX_ARMS:
        return f"a vehicle: {wheel_count} wheels{_describe_arms(len(limbs))}"
    if len(branches) == 1:
        return _describe_arm(branches[0])
    return ""


def _describe_arm(branch: Branch) -> str:
    """Return what a robot of one branch is: a chain of joints, with or without fingers; empty for a spine with legs."""
    shared_count = len(os.path.commonprefix(branch))
    if shared_count >= _MIN_ARM and len(branch) > 1 and max(map(len, branch)) <= shared_count + _MAX_FINGER:
        return f"an arm: one chain of {shared_count} joints with {len(branch)} fingers"
    if len(branch) > 1:
        return ""
    chain = f"one chain of {shared_count} joint{'s' if shared_count > 1 else ''}"
    return f"an arm: {chain}" if shared_count >= _MIN_ARM else chain


def describe_chains(model: mujoco.MjModel, root: int) -> str:
    """Return how many chains of joints a robot has, and of how many joints."""
    chains = [chain for branch in _list_branches(model, root) for chain in branch]
    low, high = (function(map(len, chains), default=0) for function in (min, max))
    return f"{len(chains)} chain{'s' if len(chains) > 1 else ''} of {low if low == high else f'{low} to {high}'} joints"


def _describe_arms(count: int) -> str:
    return ("", " and an arm", " and 2 arms")[count]


def _list_branches(model: mujoco.MjModel, root: int) -> list[Branch]:
    """Return the chains of joints from a body outwards that are not the beginning of another one, by first joint."""
    chains = {root: _hinges_and_slides(model, root)}
    for body in range(root + 1, model.nbody):
        parent = int(model.body_parentid[body])
        if parent in chains:
            chains[body] = chains[parent] + _hinges_and_slides(model, body)
    branches: dict[int, Branch] = {}
    for chain in tree.whole_chains(dict.fromkeys(chains.values())):
        if chain:
            branches.setdefault(chain[0], []).append(chain)
    return list(branches.values())


def _hinges_and_slides(model: mujoco.MjModel, body: int) -> tuple[int, ...]:
    first = int(model.body_jntadr[body])
    joints = range(first, first + int(model.body_jntnum[body]))
    return tuple(joint for joint in joints if model.jnt_type[joint] != tree.FREE)


def _is_rotor(model: mujoco.MjModel, data: mujoco.MjData, branch: Branch) -> bool:
    """Return whether a branch is one joint that turns without end about an upright axis."""
    joints = branch[0]
    is_single = len(branch) == 1 and len(joints) == 1
    return is_single and _turns_without_end(model, joints[0]) and abs(data.xaxis[joints[0]][2]) > _UPRIGHT


def _has_wheels(model: mujoco.MjModel, data: mujoco.MjData, branch: Branch) -> bool:
    """Return whether all chains of a branch are short and end in a wheel."""
    return all(len(chain) <= _MAX_WHEEL_CHAIN and _is_wheel(model, data, chain[-1]) for chain in branch)


def _is_wheel(model: mujoco.MjModel, data: mujoco.MjData, joint: int) -> bool:
    """Return whether a joint turns without end about a level axis through the middle of its link."""
    axis = data.xaxis[joint]
    if not _turns_without_end(model, joint) or abs(axis[2]) > _UPRIGHT:
        return False
    radii = list(_hub_offsets(model, data, joint, axis))
    return all(offset <= _MAX_HUB_OFFSET * radius for offset, radius in radii)


def _hub_offsets(
    model: mujoco.MjModel, data: mujoco.MjData, joint: int, axis: np.ndarray
) -> Iterator[tuple[float, float]]:
    """Yield the distance of each collider of a link from the axis of its joint, and the collider's radius, m."""
    body = int(model.jnt_bodyid[joint])
    for geom in tree.colliding_geoms(model):
        if model.geom_bodyid[geom] == body:
            offset = np.linalg.norm(np.cross(axis, data.geom_xpos[geom] - data.xanchor[joint]))
            yield float(offset), float(model.geom_rbound[geom])


def _turns_without_end(model: mujoco.MjModel, joint: int) -> bool:
    low, high = model.jnt_range[joint]
    is_hinge = model.jnt_type[joint] == tree.HINGE
    return bool(is_hinge and (not model.jnt_limited[joint] or high - low > _MIN_TURN))
