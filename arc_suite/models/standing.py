"""The standing pose of a body, all joints at zero; proportions, motors and gait derive from it."""

import functools
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite.models import builder, direct, source
from arc_suite.robots.spec import Body

GRAVITY = 9.81  # m/s^2

_MIN_FORCE_SHARE = 0.25  # of its equal share of the weight, that every foot carries
_MIN_LINE_LENGTH = 1e-12  # m, between two soles that are not the same


class PoseMechanics(NamedTuple):
    """Mechanics of a pose, such as the standing one, in the torso's frame and SI units; joints are the actuated ones.

    Attributes:
        height: height of the torso's origin above the floor.
        mass: mass of the whole body.
        center: (3,) center of mass.
        soles: (legs, 3) the lowest points of the feet.
        jacobians: for each leg (3, joints of the leg): velocity of the sole per joint velocity.
        inertias: (joints,) diagonal of the mass matrix without armature.
        loads: (joints,) torques that hold the pose while feet carry the weight.
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
        """Static stability: distance of the center of mass from the edge of the polygon of the soles, m.

        Both are seen from above. It is negative outside of the polygon.
        """
        return stability_margin(self.center, self.soles)


@functools.lru_cache(maxsize=256)
def measure_standing(body: Body) -> PoseMechanics:
    """Return the mechanics of a body's standing pose; armature, damping, motors and constants do not matter."""
    return pose_mechanics(body)


def time_unit(body: Body) -> float:
    """Return the time in which gravity moves a body by about its height, sqrt(h / g), s."""
    return math.sqrt(body.torso.standing_height / GRAVITY)


def speed_unit(height: float) -> float:
    """Return sqrt(g h), m/s, for a standing height, m."""
    return math.sqrt(GRAVITY * height)


def rate_unit(height: float) -> float:
    """Return sqrt(g / h), 1/s, for a standing height, m."""
    return math.sqrt(GRAVITY / height)


def pose_mechanics(
    body: Body, angles: np.ndarray | Sequence[float] | None = None, feet: np.ndarray | None = None
) -> PoseMechanics:
    """Return the mechanics of a pose, as of the standing one.

    Args:
        body: the spec.
        angles: (joints,) rad, in place of zero for all of them; the torso stays where it is.
        feet: (legs,) whether each foot carries; None for all of them.
    """
    (mechanics,) = mechanics_of_poses(body, [(angles, feet)])
    return mechanics


def mechanics_of_poses(
    body: Body, poses: Iterable[tuple[np.ndarray | Sequence[float] | None, np.ndarray | None]]
) -> Iterator[PoseMechanics]:
    """Yield the mechanics of several poses; MuJoCo's data, which take longer than a pose, are made once.

    Args:
        body: the spec.
        poses: pairs of angles and feet; see `pose_mechanics`.
    """
    model = compile_body(body)
    indices = _find_indices(body)
    data = mujoco.MjData(model)
    for angles, feet in poses:
        data.qpos[:] = standing_qpos(model)
        if angles is not None:
            data.qpos[indices.angles] += angles
        mujoco.mj_forward(model, data)
        yield _measure(body, model, data, indices, feet)


def _measure(
    body: Body, model: mujoco.MjModel, data: mujoco.MjData, indices: "_Indices", feet: np.ndarray | None
) -> PoseMechanics:
    """Return the mechanics of the pose of the data."""
    torso = 1  # its index
    origin = data.xpos[torso] + source.torso_place(body)  # the torso is level
    soles = []
    jacobians = []
    for leg, foot, dofs in zip(body.legs, indices.feet, indices.dofs_by_leg, strict=True):
        sole = data.xpos[foot] - (0.0, 0.0, leg.foot.radius)
        jacobian = np.empty((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, sole, foot)
        soles.append(sole - origin)
        jacobians.append(jacobian[:, dofs])
    soles = np.array(soles)  # (legs, 3)
    center_of_mass = data.subtree_com[torso] - origin
    mass = float(model.body_mass.sum())
    mass_matrix = np.empty((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass_matrix)
    carries = np.ones(len(soles), bool) if feet is None else feet
    forces = np.zeros(len(soles))  # N, vertical
    if carries.any():
        weight = mass * -model.opt.gravity[2]
        forces[carries] = foot_loads(weight, soles[carries, :2] - center_of_mass[:2])
    torques_of_feet = [force * jacobian[2] for force, jacobian in zip(forces, jacobians, strict=True)]
    torques_of_weight = (data.qfrc_bias - data.qfrc_passive)[indices.dofs]
    return PoseMechanics(
        height=body.torso.standing_height,
        mass=mass,
        center=center_of_mass,
        soles=soles,
        jacobians=tuple(jacobians),
        inertias=np.diag(mass_matrix)[indices.dofs],
        loads=torques_of_weight - np.concatenate(torques_of_feet),
    )


def standing_qpos(model: mujoco.MjModel) -> np.ndarray:
    """Return qpos (nq,) of a standing body: the keyframe of an imported one, which its source has."""
    if model.nkey:
        return model.key_qpos[0].copy()
    return model.qpos0.copy()


class _Indices(NamedTuple):
    """Indices of the joints and feet of a body in its compiled model.

    Attributes:
        angles: (joints,) indices into qpos.
        dofs: (joints,) indices into qvel.
        dofs_by_leg: the same of each leg. Adjacent ones are a slice, since matrix products round by how an array
            lies in memory.
        feet: (legs,) indices of rigid parts.
    """

    angles: np.ndarray
    dofs: np.ndarray
    dofs_by_leg: tuple[slice | np.ndarray, ...]
    feet: tuple[int, ...]


@functools.lru_cache(maxsize=256)
def _find_indices(body: Body) -> _Indices:
    model = compile_body(body)
    joints = [model.joint(name) for name in body.joint_names]
    dofs = np.array([joint.dofadr[0] for joint in joints])
    dofs_by_leg = []
    for dofs_of_leg in by_leg(body, dofs):
        first = int(dofs_of_leg[0])
        stop = int(dofs_of_leg[-1]) + 1
        is_adjacent = stop - first == len(dofs_of_leg)
        dofs_by_leg.append(slice(first, stop) if is_adjacent else dofs_of_leg)
    return _Indices(
        angles=np.array([joint.qposadr[0] for joint in joints]),
        dofs=dofs,
        dofs_by_leg=tuple(dofs_by_leg),
        feet=tuple([model.body(name).id for name in body.foot_names]),
    )


def by_leg(body: Body, values: np.ndarray) -> list[np.ndarray]:
    """Return values of joints (joints,) as those of each leg (joints of the leg,)."""
    joint_counts = [len(leg.joints) for leg in body.legs]
    return np.split(values, np.cumsum(joint_counts)[:-1])


@functools.lru_cache(maxsize=256)
def compile_body(body: Body) -> mujoco.MjModel:
    """Return the body of `builder.build` without motors, contacts and constants; geoms are ordered as in the spec.

    MuJoCo's own `MjSpec` is fast here; PyMJCF would double the time of building the model. The model of an imported
    body is that of its source.
    """
    if body.source:
        return source.compile_source(body)
    return direct.write(builder.parts(body)).compile()


def foot_loads(weight: float, soles: np.ndarray) -> np.ndarray:
    """Return vertical forces (legs,) that carry a weight over the soles (legs, 2) relative to the center of mass.

    They are the least-norm solution of the balance of force and moments. Every foot carries a least share, since in
    walking every foot carries in turn.
    """
    x, y = soles.T
    balance = np.stack([np.ones(len(soles)), x, y])  # rows: force, moments about y and x
    total = np.array([weight, 0.0, 0.0])
    forces = np.linalg.lstsq(balance, total, rcond=None)[0]
    return forces.clip(min=_MIN_FORCE_SHARE * weight / len(soles))


def stability_margin(center, soles) -> float:
    """Return the distance of a center to the edge of the convex hull of soles, seen from above; negative outside.

    Args:
        center: (2,) or more, the point, m.
        soles: (n, 2) or more, m.

    Returns:
        Inside, the distance to the nearest edge, m. Outside, the negative of a distance that is no larger than the
        distance to the hull. -inf if there are no soles.
    """
    points = np.asarray(soles)[:, :2] - np.asarray(center)[:2]
    if not len(points):
        return -np.inf
    # The margin is the least, over all directions, of how far the hull reaches from the center. That direction is
    # normal to an edge, and so to a line through two points.
    first, second = np.triu_indices(len(points), k=1)
    lines = points[second] - points[first]
    lengths = np.hypot(*lines.T)
    is_line = lengths > _MIN_LINE_LENGTH
    directions = lines[is_line] / lengths[is_line, None]
    normals = np.concatenate([directions @ [[0.0, 1.0], [-1.0, 0.0]], directions @ [[0.0, -1.0], [1.0, 0.0]]])
    if not len(normals):  # all soles lie in one point
        return -float(np.hypot(*points.T).min())
    return float((points @ normals.T).max(axis=0).min())
