"""Poses in which a robot may stand: keyframes, zero angles, bent knees, and the middles of the ranges."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite.importing import tree
from arc_suite.importing.tree import Chain, Robot
from arc_suite.models.kinematics import least_changes

MIN_WHEEL_RANGE = 6.0  # rad; a joint that turns farther may turn a wheel, and has no middle position

# The search for a pose with bent knees. Lengths are shares of the leg's length, from the joint before the last down to
# the foot.
_LEG_HEIGHT = 0.65
_FOOT_OFFSET = 0.1  # outwards from the foot of a straight leg: a wide stance is steady
_START_BEND = 0.65  # rad, of the thigh; the knee bends back twice as much
_ITERATIONS = 80
_MAX_STEP = 0.2  # rad
_DAMPING = 0.05
_MAX_MISS = 0.05
_MIN_FOOT_DEPTH = 0.4  # of the deepest foot; chains that end higher are arms and heads


class ChainEnd(NamedTuple):
    """The lowest point at the end of a chain, in the torso's frame.

    Attributes:
        point: (3,) m.
        geom: the collider that has it.
    """

    point: np.ndarray
    geom: int


def list_poses(robot: Robot, named_feet: dict[Chain, list[int]] | None) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the poses (nq,) to try, each with where it comes from: keyframes first, `home` before others."""
    model = robot.model
    for key in sorted(range(model.nkey), key=lambda key: model.key(key).name != "home"):
        yield f"keyframe {model.key(key).name or key}", model.key_qpos[key]
    yield "zero angles", _relax(robot, model.qpos0)
    foot_colliders = robot.end_colliders() if named_feet is None else named_feet
    for front_sign, rear_sign in ((1, 1), (-1, -1), (1, -1), (-1, 1)):
        qpos = _search_bent_knees(robot, foot_colliders, front_sign, rear_sign)
        if qpos is not None:
            yield "search for bent knees", qpos
    yield "middle of the ranges", _middle_pose(robot)
    yield "zero angles within the ranges", zero_pose(robot)


def zero_pose(robot: Robot) -> np.ndarray:
    """Return the pose (nq,) of zero angles, or the nearest ones within the ranges of the joints."""
    return robot.clip_to_limits(_relax(robot, robot.model.qpos0))


def _middle_pose(robot: Robot) -> np.ndarray:
    """Return the pose (nq,) with joints in the middle of their ranges; joints that turn without end stay at zero."""
    qpos = robot.model.qpos0.copy()
    for joint in robot.joints:
        low, high = robot.limits(joint)
        if high - low < MIN_WHEEL_RANGE:
            qpos[robot.qpos_index(joint)] = 0.5 * (low + high)
    return robot.clip_to_limits(_relax(robot, qpos))


def _relax(robot: Robot, qpos: np.ndarray) -> np.ndarray:
    """Return a pose (nq,) in which passive joints are where their springs have no load."""
    relaxed_qpos = qpos.copy()
    for joint in robot.passive:
        index = robot.qpos_index(joint)
        has_spring = robot.model.jnt_stiffness[joint] > 0.0
        relaxed_qpos[index] = (robot.model.qpos_spring if has_spring else robot.model.qpos0)[index]
    return relaxed_qpos


def _search_bent_knees(
    robot: Robot, foot_colliders: Mapping[Chain, list[int]], front_sign: int, rear_sign: int
) -> np.ndarray | None:
    """Return a pose (nq,) with bent knees and each foot below the joint before the last; None if there is none.

    Args:
        robot: robot of the file.
        foot_colliders: by chain.
        front_sign: sign of the bend of legs in front of the torso's origin, 1 or -1.
        rear_sign: sign of the bend of the other legs.
    """
    zero_qpos = robot.clip_to_limits(_relax(robot, robot.model.qpos0 * 0.0))
    data = robot.forward_kinematics(zero_qpos)
    ends = {}
    for chain, geoms in foot_colliders.items():
        if len(chain) > 1:
            ends[chain] = ChainEnd(*tree.lowest_point(robot, data, geoms))
    deepest = min((end.point[2] for end in ends.values()), default=0.0)
    qpos = _middle_pose(robot)
    for chain, end in ends.items():
        if end.point[2] >= _MIN_FOOT_DEPTH * deepest:
            continue
        is_in_front = data.xanchor[chain[-2]][0] > 0.0
        sign = front_sign if is_in_front else rear_sign
        leg_qpos = _bend_leg(robot, zero_qpos, chain, end, sign)
        if leg_qpos is None:
            return None
        for joint in chain:
            qpos[robot.qpos_index(joint)] = leg_qpos[robot.qpos_index(joint)]
    return qpos


def _bend_leg(robot: Robot, zero_qpos: np.ndarray, chain: Chain, end: ChainEnd, sign: int) -> np.ndarray | None:
    """Return a pose (nq,) in which one leg stands with a bent knee, by damped least squares; None if it cannot."""
    model = robot.model
    body = int(model.geom_bodyid[end.geom])
    data = robot.forward_kinematics(zero_qpos)
    foot_in_body = data.xmat[body].reshape(3, 3).T @ (end.point - data.xpos[body])
    hip = data.xanchor[chain[-2]].copy()
    knee = data.xanchor[chain[-1]].copy()
    leg_length = np.linalg.norm(knee - hip) + np.linalg.norm(end.point - knee)
    moved_outwards = end.point[1] + np.sign(end.point[1]) * _FOOT_OFFSET * leg_length
    goal_y = moved_outwards if len(chain) > 2 else hip[1]
    goal = np.array((hip[0], goal_y, hip[2] - _LEG_HEIGHT * leg_length))

    qpos_indices = [robot.qpos_index(joint) for joint in chain]
    dofs = [int(model.jnt_dofadr[joint]) for joint in chain]
    qpos = zero_qpos.copy()
    qpos[qpos_indices[-2]] = _START_BEND * sign
    qpos[qpos_indices[-1]] = -2.0 * _START_BEND * sign
    for _ in range(_ITERATIONS):
        qpos = robot.clip_to_limits(qpos)
        robot.forward_kinematics(qpos, data)
        foot = data.xpos[body] + data.xmat[body].reshape(3, 3) @ foot_in_body
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, foot, body)
        leg_jacobian = jacobian[:, dofs]
        change = least_changes(leg_jacobian, (goal - foot)[:, None], _DAMPING * float(leg_length))
        qpos[qpos_indices] += change.clip(-_MAX_STEP, _MAX_STEP)
    miss = np.linalg.norm((goal - foot)[[0, 2]])  # m, forward and up
    if miss > _MAX_MISS * leg_length:
        return None
    return robot.clip_to_limits(qpos)
