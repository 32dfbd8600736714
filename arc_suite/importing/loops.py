"""Closed loops of links: equality constraints between parts of a robot, which its physics keep."""

import copy
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite.importing.tree import Robot
from arc_suite.robots.spec import SpecError

_CONNECT = int(mujoco.mjtEq.mjEQ_CONNECT)
_WELD = int(mujoco.mjtEq.mjEQ_WELD)
_JOINT = int(mujoco.mjtEq.mjEQ_JOINT)
_SITE = int(mujoco.mjtObj.mjOBJ_SITE)

_ITERATIONS = 50
_MAX_STEP = 0.2  # rad or m
_MAX_GAP = 1e-3  # extents of the model, of a loop that counts as closed
_DAMPING = 1e-6


class Loop(NamedTuple):
    """An equality constraint that is kept.

    Attributes:
        equality: MuJoCo's index.
        parts: both bodies that it connects or welds, or the joint that follows and the one that leads.
        joints: joints that move one of the parts against the other.
        follower: the joint that follows another one; None for parts that are connected or welded.
    """

    equality: int
    parts: tuple[int, int]
    joints: frozenset[int]
    follower: int | None


def find_loops(robot: Robot, leg_joints: Iterable[int]) -> tuple[Loop, ...]:
    """Return the active constraints between parts of a robot; legs keep those that connect or weld links."""
    loops = []
    for loop in _all_loops(robot):
        follows_in_leg = loop.follower is not None and loop.follower in leg_joints
        if not follows_in_leg:
            loops.append(loop)
    return tuple(loops)


def followers_in_legs(robot: Robot, leg_joints: Iterable[int]) -> set[int]:
    """Return the joints of legs that follow other joints in the file."""
    return {loop.follower for loop in _all_loops(robot) if loop.follower is not None}.intersection(leg_joints)


def find_frames(robot: Robot, loop: Loop) -> list[tuple[int, dict[str, np.ndarray]]]:
    """Return the frames that a constraint keeps together: a body, and position and quaternion in it, of each link."""
    model = robot.model
    if model.eq_objtype[loop.equality] == _SITE:
        sites = int(model.eq_obj1id[loop.equality]), int(model.eq_obj2id[loop.equality])
        poses = [{"pos": model.site_pos[site], "quat": model.site_quat[site]} for site in sites]
        return list(zip(loop.parts, poses, strict=True))
    data = model.eq_data[loop.equality]
    first, second = loop.parts
    if model.eq_type[loop.equality] == _CONNECT:
        return [(first, {"pos": data[:3]}), (second, {"pos": data[3:6]})]
    # A weld has an anchor in the second body, the same point in the first one, and the second's orientation in it.
    return [(first, {"pos": data[3:6], "quat": data[6:10]}), (second, {"pos": data[:3]})]


def name_parts(robot: Robot, loop: Loop) -> str:
    """Return the names of what a constraint ties."""
    if loop.follower is not None:
        return " and ".join(map(robot.joint_name, loop.parts))
    return " and ".join(robot.model.body(body).name or f"body {body}" for body in loop.parts)


def _all_loops(robot: Robot) -> Iterator[Loop]:
    """Yield the active constraints between parts of a robot."""
    model = robot.model
    if model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_EQUALITY:
        return
    for equality in np.flatnonzero(model.eq_active0).tolist():
        kind = model.eq_type[equality]
        parts = int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])
        if kind == _JOINT:
            if set(parts) <= set(robot.joints):
                yield Loop(equality, parts, frozenset(parts), follower=parts[0])
        elif kind in (_CONNECT, _WELD):
            if model.eq_objtype[equality] == _SITE:
                parts = int(model.site_bodyid[parts[0]]), int(model.site_bodyid[parts[1]])
            if set(parts) <= set(robot.bodies):
                joints = frozenset(robot.lineage(parts[0])) ^ frozenset(robot.lineage(parts[1]))
                if joints:
                    yield Loop(equality, parts, joints, follower=None)


def check_legs(robot: Robot, feet: Iterable[int]) -> None:
    """Refuse legs that are moved by closed loops, which a chain of motors cannot stand for.

    Args:
        robot: with its passive joints.
        feet: bodies at the ends of the legs.

    Raises:
        SpecError: the message names the joint and the loop.
    """
    for foot in feet:
        leg_joints = robot.lineage(foot)
        for loop in robot.loops:
            joints = [joint for joint in leg_joints if joint in loop.joints]
            passive_joints = [joint for joint in joints if joint in robot.passive]
            is_all_driven = not loop.joints.intersection(robot.passive)
            if joints and (passive_joints or is_all_driven):
                joint = (passive_joints or joints)[0]
                place = f"joint {robot.joint_name(joint)!r} of a leg is moved by the loop of {name_parts(robot, loop)}"
                raise SpecError(f"{place}: expected a motor at each joint between the torso and a foot")


def close(robot: Robot, qpos: np.ndarray) -> tuple[np.ndarray, bool]:
    """Return a pose (nq,) in which passive joints close the loops, and whether they do."""
    if not robot.loops:
        return qpos, True
    model = copy.copy(robot.model)
    model.opt.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    joints = [joint for joint in robot.passive if any(joint in loop.joints for loop in robot.loops)]
    places = [robot.qpos_index(joint) for joint in joints]
    dofs = model.jnt_dofadr[joints]
    equalities = [loop.equality for loop in robot.loops]
    data = mujoco.MjData(model)
    closed_qpos = robot.forward_kinematics(qpos).qpos.copy()
    for _ in range(_ITERATIONS):
        data.qpos[:] = closed_qpos
        mujoco.mj_fwdPosition(model, data)
        gaps, jacobian = _equality_rows(data, equalities)
        jacobian = jacobian[:, dofs]
        square = jacobian.T @ jacobian + _DAMPING * np.eye(len(dofs))
        closed_qpos[places] -= np.linalg.solve(square, jacobian.T @ gaps).clip(-_MAX_STEP, _MAX_STEP)
    return closed_qpos, bool(abs(gaps).max(initial=0.0) < _MAX_GAP * model.stat.extent)


def _equality_rows(data: mujoco.MjData, equalities: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the errors (rows,) of constraints, and their Jacobian (rows, nv)."""
    is_equality = data.efc_type == mujoco.mjtConstraint.mjCNSTR_EQUALITY
    rows = np.flatnonzero(is_equality & np.isin(data.efc_id, equalities))
    # The buffer has room for constraints that MuJoCo drops, as no joint moves them.
    jacobian = data.efc_J[: data.nefc * data.model.nv].reshape(data.nefc, data.model.nv)
    return data.efc_pos[rows], jacobian[rows]
