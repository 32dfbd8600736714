"""A body that stands and breathes: the standing pose, with soles that stay where they are."""

import math

import mujoco
import numpy as np

from arc_suite import rotations
from arc_suite.export.motions import Motion
from arc_suite.models.sizing import GRAVITY, SUBSTEPS
from arc_suite.robots.spec import Body

_BREATH = 0.012  # of the standing height, by which the torso sinks and rises
_ASTRAY = 0.01  # of the standing height: a breath is shallower where a sole would be further from its place
_PERIOD = 12.0  # sqrt(h / g): about a breath, which takes longer the larger the animal
_BENT = 0.05  # of the way to the middle of a joint's range
_ROUNDS = 50  # of the search for joint angles, steps of damped least squares
_WEIGHTS = np.array((1.0, 1.0, 8.0))  # of a sole's place: legs of two joints slide rather than sink
_DAMPING = 0.02  # of the leg's largest Jacobian entry


def idle(model: mujoco.MjModel, body: Body) -> Motion:
    """Return a breath of a standing body, as a loop.

    It is the standing pose, all joints at zero, with every sole on the ground, lowered a little so that straight legs
    can bend. The torso sinks and rises like a sine, while joints bend so that the soles stay where they are; less
    where legs have too few joints for that.

    Args:
        model: of the body.
        body: its spec.
    """
    height, step = body.torso.standing_height, SUBSTEPS * model.opt.timestep
    samples = max(2, round(_PERIOD * math.sqrt(height / GRAVITY) / step))
    legs = _legs(model, body)
    soles = _soles(model, model.qpos0, legs)
    top = model.qpos0[2] - np.median(soles[:, 2])
    soles[:, 2] = 0.0
    depth = _BREATH * height
    breath = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(samples) / samples)
    for _ in range(2):
        qpos = _breathing(model, top - depth * (0.5 + breath), legs, soles)
        places = np.stack([_soles(model, pose, legs) for pose in qpos])
        depth *= min(1.0, _ASTRAY * height / abs(places - soles).max())
    qpos = np.concatenate([qpos, qpos[:1]])
    return Motion(
        step=step,
        root=np.zeros(qpos[:, :3].shape),
        positions=qpos[:, :3] * (0.0, 0.0, 1.0),
        quaternions=rotations.turned(qpos[:, 3:7], -rotations.yaw(qpos[:, 3:7])),
        joints=qpos[:, 7:],
        twist=np.zeros(3),
    )


def _legs(model: mujoco.MjModel, body: Body) -> list[tuple[int, np.ndarray, np.ndarray, float]]:
    """Return for each leg the foot's body, the joints' places in qpos and in qvel, and the foot's radius."""
    legs = []
    for leg, foot in zip(body.legs, body.foot_names, strict=True):
        joints = [model.joint(leg.full_name(joint)).id for joint in leg.joints]
        legs.append((model.body(foot).id, model.jnt_qposadr[joints], model.jnt_dofadr[joints], leg.foot.radius))
    return legs


def _soles(model, pose, legs) -> np.ndarray:
    """Return the lowest points (legs, 3) of the feet in a pose, m."""
    data = mujoco.MjData(model)
    data.qpos[:] = pose
    mujoco.mj_kinematics(model, data)
    return np.stack([data.xpos[foot] - (0.0, 0.0, radius) for foot, _, _, radius in legs])


def _breathing(model, heights, legs, soles) -> np.ndarray:
    """Return poses (samples, nq) with the torso at heights (samples,), whose soles are where they are wanted."""
    low, high = model.jnt_range[1:].T
    pose = model.qpos0.copy()
    pose[7:] += _BENT * (0.5 * (low + high) - pose[7:])  # a straight leg does not know which way to bend
    pose[2] = heights[0]
    data, poses = mujoco.MjData(model), []
    for _ in range(_ROUNDS):
        _reach(model, data, pose, legs, soles)
    for height in heights:
        pose[2] = height
        for _ in range(_ROUNDS // 10):
            _reach(model, data, pose, legs, soles)
        poses.append(pose.copy())
    return np.stack(poses)


def _reach(model, data, pose, legs, soles) -> None:
    """Bend the joints of a pose towards where its soles are wanted, within their ranges; in place."""
    data.qpos[:] = pose
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    low, high = model.jnt_range[1:].T
    jacobian = np.empty((3, model.nv))
    for (foot, places, dofs, radius), sole in zip(legs, soles, strict=True):
        mujoco.mj_jac(model, data, jacobian, None, data.xpos[foot], foot)
        missing = _WEIGHTS * (sole + (0.0, 0.0, radius) - data.xpos[foot])
        room = low[places - 7] - pose[places], high[places - 7] - pose[places]
        pose[places] += _bounded(_WEIGHTS[:, None] * jacobian[:, dofs], missing, *room)


def _bounded(matrix, wanted, low, high) -> np.ndarray:
    """Return the damped least-squares solution (n,) within bounds; what reaches one stays there for the others."""
    damping = (_DAMPING * abs(matrix).max()) ** 2
    free, solution = np.ones(len(low), bool), np.zeros(len(low))
    while free.any():
        own = matrix[:, free]
        rest = wanted - matrix[:, ~free] @ solution[~free]
        solution[free] = np.linalg.solve(own.T @ own + damping * np.eye(free.sum()), own.T @ rest)
        out = free & ((solution < low) | (solution > high))
        solution = solution.clip(low, high)
        if not out.any():
            break
        free &= ~out
    return solution
