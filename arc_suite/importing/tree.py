"""The tree of a compiled robot: its joints, its colliders, and which chains of joints end where."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np

from arc_suite import rotations
from arc_suite.robots.spec import SpecError

FREE = int(mujoco.mjtJoint.mjJNT_FREE)
BALL = int(mujoco.mjtJoint.mjJNT_BALL)
HINGE = int(mujoco.mjtJoint.mjJNT_HINGE)

DOWN = np.array((0.0, 0.0, -1.0))

# Joints between the torso and a part, outwards.
Chain = tuple[int, ...]

_GEOM = mujoco.mjtGeom


class Robot(NamedTuple):
    """A robot in a compiled file; everything is named by MuJoCo's indices.

    Attributes:
        model: the file, whose torso has a free joint.
        root: body of the torso.
        bodies: bodies of the robot, parents first.
        joints: all except the free one, in the order of the file.
        colliders: geoms that collide with anything.
        chains: by body, the joints between the torso and it, outwards.
        torso_place: (3,) origin of the torso's frame in that of its body, m; both have the same axes.
        passive: joints without a motor, which are in no chain.
        loops: constraints between parts of the robot; see `loops.Loop`.
    """

    model: mujoco.MjModel
    root: int
    bodies: tuple[int, ...]
    joints: tuple[int, ...]
    colliders: tuple[int, ...]
    chains: dict[int, Chain]
    torso_place: np.ndarray = np.zeros(3)
    passive: tuple[int, ...] = ()
    loops: tuple[Any, ...] = ()

    def joint_name(self, joint: int) -> str:
        """Return the name of a joint in the file, or its number."""
        return self.model.joint(joint).name or f"joint {joint}"

    def limits(self, joint: int) -> tuple[float, float]:
        """Return the lower and upper limit of a joint, rad or m; infinite if it has none."""
        if not self.model.jnt_limited[joint]:
            return -np.inf, np.inf
        low, high = self.model.jnt_range[joint]
        return float(low), float(high)

    def qpos_index(self, joint: int) -> int:
        """Return the index of a joint's angle in qpos."""
        return int(self.model.jnt_qposadr[joint])

    def chain_of_geom(self, geom: int) -> Chain:
        """Return the joints between the torso and a geom, outwards."""
        return self.chains[int(self.model.geom_bodyid[geom])]

    def lineage(self, body: int) -> Chain:
        """Return all joints between the torso and a body, outwards, passive ones, too."""
        joints: Chain = ()
        while body != self.root:
            first_joint = int(self.model.body_jntadr[body])
            joints = (*range(first_joint, first_joint + int(self.model.body_jntnum[body])), *joints)
            body = int(self.model.body_parentid[body])
        return joints

    def end_colliders(self) -> dict[Chain, list[int]]:
        """Return the colliders at the end of every chain of joints that is not the beginning of another chain."""
        colliders = {}
        for geom in self.colliders:
            colliders.setdefault(self.chain_of_geom(geom), []).append(geom)
        return {chain: colliders[chain] for chain in whole_chains(colliders)}

    def clip_to_limits(self, qpos: np.ndarray) -> np.ndarray:
        """Return a pose (nq,) with all joints within their limits."""
        clipped_qpos = qpos.copy()
        for joint in self.joints:
            index = self.qpos_index(joint)
            low, high = self.limits(joint)
            clipped_qpos[index] = np.clip(qpos[index], low, high)
        return clipped_qpos

    def forward_kinematics(self, qpos: np.ndarray, data: mujoco.MjData | None = None) -> mujoco.MjData:
        """Return the state of a pose (nq,), with the torso's frame as the world's: a new one, or `data`."""
        if data is None:
            data = mujoco.MjData(self.model)
        start = self.model.jnt_qposadr[self.model.body_jntadr[self.root]]  # of the torso's pose in qpos
        data.qpos[:] = qpos
        data.qpos[start : start + 7] = (*(0.0 - self.torso_place), *rotations.NO_TURN)
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_comPos(self.model, data)
        return data


def whole_chains(chains: Iterable[Chain]) -> list[Chain]:
    """Return the chains that are not the beginning of another one."""
    chains = list(chains)
    beginnings = {chain[:size] for chain in chains for size in range(len(chain))}
    return [chain for chain in chains if chain not in beginnings]


def robot_of(model: mujoco.MjModel, root: int, notes: Sequence[str] = ()) -> Robot:
    """Return the robot whose torso is a body with a free joint.

    Args:
        model: model of the file.
        root: body of the torso.
        notes: what was left out of the file, for an error.

    Raises:
        SpecError: the robot has ball joints, or nothing that collides.
    """
    chains: dict[int, Chain] = {root: ()}
    for body in range(root + 1, model.nbody):
        parent = int(model.body_parentid[body])
        if parent in chains:
            first_joint = int(model.body_jntadr[body])
            last_joint = first_joint + int(model.body_jntnum[body])
            chains[body] = (*chains[parent], *range(first_joint, last_joint))
    joints = tuple(sorted({joint for chain in chains.values() for joint in chain}))
    colliders = tuple(geom for geom in colliding_geoms(model) if int(model.geom_bodyid[geom]) in chains)
    robot = Robot(model, root, tuple(chains), joints, colliders, chains)

    ball_joints = [robot.joint_name(joint) for joint in joints if model.jnt_type[joint] == BALL]
    if ball_joints:
        raise SpecError(f"joint {ball_joints[0]!r} is a ball joint; expected hinges")
    if not robot.colliders:
        raise SpecError("; ".join(("no shape collides with anything: a leg needs one at its end", *notes)))
    return robot


def colliding_geoms(model: mujoco.MjModel) -> list[int]:
    """Return the geoms that can touch others: by their masks, or as one of a contact pair."""
    can_touch = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    can_touch[[*model.pair_geom1, *model.pair_geom2]] = True
    return np.flatnonzero(can_touch).tolist()


def support_point(model: mujoco.MjModel, data: mujoco.MjData, geom: int, direction: np.ndarray) -> np.ndarray:
    """Return the farthest point (3,) of a geom along a unit vector (3,), in the world."""
    rotation = data.geom_xmat[geom].reshape(3, 3)
    local_direction = rotation.T @ direction
    return data.geom_xpos[geom] + rotation @ _local_support_point(model, geom, local_direction)


def _local_support_point(model: mujoco.MjModel, geom: int, direction: np.ndarray) -> np.ndarray:
    """Return the farthest point (3,) of a geom along a unit vector (3,), in the geom's frame."""
    size = model.geom_size[geom]
    horizontal = np.array((direction[0], direction[1], 0.0))
    rim_point = size[0] * horizontal / max(np.hypot(*direction[:2]), 1e-9)  # of a circle about the z axis
    axis_end = np.array((0.0, 0.0, np.sign(direction[2]) * size[1]))  # of a capsule or cylinder
    match model.geom_type[geom]:
        case _GEOM.mjGEOM_SPHERE:
            return size[0] * direction
        case _GEOM.mjGEOM_CAPSULE:
            return size[0] * direction + axis_end
        case _GEOM.mjGEOM_CYLINDER:
            return rim_point + axis_end
        case _GEOM.mjGEOM_ELLIPSOID:
            return size**2 * direction / np.linalg.norm(size * direction)
        case _GEOM.mjGEOM_BOX:
            return np.sign(direction) * size
        case _GEOM.mjGEOM_MESH:
            points = vertices(model, int(model.geom_dataid[geom]))
            return points[(points @ direction).argmax()].astype(float)
    return np.zeros(3)


def vertices(model: mujoco.MjModel, mesh: int) -> np.ndarray:
    """Return the vertices (n, 3) of a mesh in its own frame, float32."""
    start = model.mesh_vertadr[mesh]
    return model.mesh_vert[start : start + model.mesh_vertnum[mesh]]


def lowest_point(robot: Robot, data: mujoco.MjData, geoms: Sequence[int]) -> tuple[np.ndarray, int]:
    """Return the lowest point (3,) of geoms, and the geom that has it."""
    points = [support_point(robot.model, data, geom, DOWN) for geom in geoms]
    lowest = int(np.argmin([point[2] for point in points]))
    return points[lowest], geoms[lowest]
