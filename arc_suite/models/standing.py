"""The standing pose of a body, all joints at zero; proportions, motors and gait derive from it."""

import functools
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite.models import builder, direct, source
from arc_suite.robots.spec import Body

GRAVITY = 9.81  # m/s^2


class PoseMechanics(NamedTuple):
    """Mechanics of the standing pose, in the torso's frame and SI units; joints are the actuated ones.

    Attributes:
        height: of the torso's origin above the floor.
        mass: of the whole body.
        center: (3,) of mass.
        soles: (legs, 3) the lowest points of the feet.
        jacobians: for each leg (3, joints of the leg): velocity of the sole per joint velocity.
        inertias: (joints,) diagonal of the mass matrix without armature.
        loads: (joints,) torques of the joints that hold the pose while the feet that carry do so.
    """

    height: float
    mass: float
    center: np.ndarray
    soles: np.ndarray
    jacobians: tuple[np.ndarray, ...]
    inertias: np.ndarray
    loads: np.ndarray

    @property
    def margin(self) -> float:
        """Static stability: distance of the center of mass, on the floor, from the nearest edge of the polygon of the
        soles, m; negative outside."""
        return stability_margin(self.center, self.soles)


@functools.lru_cache(maxsize=256)
def measure_standing(body: Body) -> PoseMechanics:
    """Return the mechanics of a body's standing pose; armature, damping, motors and constants do not matter."""
    return pose_mechanics(body)


standing = measure_standing  # the former name, which other packages import


def pose_mechanics(body: Body, angles: np.ndarray | None = None, feet: np.ndarray | None = None) -> PoseMechanics:
    """Return the mechanics of a pose, as of the standing one.

    Args:
        body: the spec.
        angles: (joints,) rad, in place of zero for all of them; the torso stays where it is.
        feet: (legs,) whether each foot carries; None for all of them.
    """
    (pose,) = mechanics_of_poses(body, [(angles, feet)])
    return pose


def mechanics_of_poses(
    body: Body, poses: Iterable[tuple[np.ndarray | None, np.ndarray | None]]
) -> Iterator[PoseMechanics]:
    """Yield the mechanics of poses, for which MuJoCo's data are made once: that takes longer than a pose.

    Args:
        body: the spec.
        poses: angles and feet of each; see `posed`.
    """
    model = compile_body(body)
    places = _places(body)
    data = mujoco.MjData(model)
    for angles, feet in poses:
        data.qpos[:] = standing_qpos(model)
        if angles is not None:
            data.qpos[places.angles] += angles
        mujoco.mj_forward(model, data)
        yield _measure(body, model, data, places, feet)


def _measure(
    body: Body, model: mujoco.MjModel, data: mujoco.MjData, places: "_Places", feet: np.ndarray | None
) -> PoseMechanics:
    """Return the mechanics of the pose in which the data are."""
    origin = data.xpos[1]
    soles, jacobians = [], []
    for leg, foot, dofs in zip(body.legs, places.feet, places.dofs_by_leg, strict=True):
        sole = data.xpos[foot] - (0.0, 0.0, leg.foot.radius)
        jacobian = np.empty((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, sole, foot)
        soles.append(sole - origin)
        jacobians.append(jacobian[:, dofs])
    soles = np.array(soles)
    center = data.subtree_com[1] - origin
    mass = float(model.body_mass.sum())
    matrix = np.empty((model.nv, model.nv))
    mujoco.mj_fullM(model, data, matrix)
    loads = np.zeros(len(soles))
    carrying = np.ones(len(soles), bool) if feet is None else feet
    if carrying.any():
        loads[carrying] = foot_loads(mass * -model.opt.gravity[2], soles[carrying, :2] - center[:2])
    torques_of_feet = np.concatenate([load * jacobian[2] for load, jacobian in zip(loads, jacobians, strict=True)])
    return PoseMechanics(
        height=body.torso.standing_height,
        mass=mass,
        center=center,
        soles=soles,
        jacobians=tuple(jacobians),
        inertias=np.diag(matrix)[places.dofs],
        loads=(data.qfrc_bias - data.qfrc_passive)[places.dofs] - torques_of_feet,
    )


def standing_qpos(model: mujoco.MjModel) -> np.ndarray:
    """Return the positions (nq,) in which a body stands: of an imported one the keyframe of its source."""
    return model.key_qpos[0].copy() if model.nkey else model.qpos0.copy()


class _Places(NamedTuple):
    """Where the joints and feet of a body are in its compiled model.

    Attributes:
        angles: (joints,) indices into qpos.
        dofs: (joints,) indices into qvel.
        dofs_by_leg: the same of each leg; a slice where they are adjacent, as matrix products round by how an array
            lies in memory.
        feet: (legs,) indices of rigid parts.
    """

    angles: np.ndarray
    dofs: np.ndarray
    dofs_by_leg: tuple[slice | np.ndarray, ...]
    feet: tuple[int, ...]


@functools.lru_cache(maxsize=256)
def _places(body: Body) -> _Places:
    model = compile_body(body)
    joints = [model.joint(name) for name in body.joint_names]
    dofs = np.array([joint.dofadr[0] for joint in joints])
    dofs_by_leg = []
    for indices in by_leg(body, dofs):
        adjacent = slice(int(indices[0]), int(indices[-1]) + 1)
        dofs_by_leg.append(adjacent if adjacent.stop - adjacent.start == len(indices) else indices)
    feet = tuple([model.body(name).id for name in body.foot_names])
    return _Places(np.array([joint.qposadr[0] for joint in joints]), dofs, tuple(dofs_by_leg), feet)


def by_leg(body: Body, values: np.ndarray) -> list[np.ndarray]:
    """Return values of joints (joints,) as those of each leg (joints of the leg,)."""
    return np.split(values, np.cumsum([len(leg.joints) for leg in body.legs])[:-1])


@functools.lru_cache(maxsize=256)
def compile_body(body: Body) -> mujoco.MjModel:
    """Return the body of `builder.build` without motors, contacts and constants; geoms are ordered as in the spec.

    MuJoCo's own `MjSpec` is fast here; PyMJCF would double the time of building the model. An imported body's is that
    of its source.
    """
    if body.source:
        return source.compile_source(body)
    return direct.write(builder.parts(body)).compile()


def foot_loads(weight: float, soles: np.ndarray) -> np.ndarray:
    """Return vertical forces (legs,) that carry a weight over the soles (legs, 2) relative to the center of mass.

    The least-norm solution of the balance of force and moments. Every foot carries at least a quarter
    of its equal share, since in walking every foot carries in turn.
    """
    balance = np.stack([np.ones(len(soles)), *soles.T])
    forces = np.linalg.lstsq(balance, np.array([weight, 0.0, 0.0]), rcond=None)[0]
    return forces.clip(min=0.25 * weight / len(soles))


def stability_margin(center, soles) -> float:
    """Return the distance of a point to the edge of the convex hull of others, seen from above; negative outside.

    Args:
        center: (2,) or more, the point.
        soles: (n, 2) or more.

    Returns:
        Inside, the distance to the nearest edge; outside, minus one no larger than that to the hull;
        -inf if there are no others.
    """
    points = np.asarray(soles)[:, :2] - np.asarray(center)[:2]
    # It is the least, over all directions, of how far the hull reaches beyond the point. That
    # direction is normal to an edge, and so to a line through two points.
    first, second = np.triu_indices(len(points), k=1)
    along = points[second] - points[first]
    length = np.hypot(*along.T)
    along = along[length > 1e-12] / length[length > 1e-12, None]
    normals = np.concatenate([along @ [[0.0, 1.0], [-1.0, 0.0]], along @ [[0.0, -1.0], [1.0, 0.0]]])
    if not len(normals):
        return -float(np.hypot(*points.T).min(initial=np.inf)) if len(points) else -np.inf
    return float((points @ normals.T).max(axis=0).min())
