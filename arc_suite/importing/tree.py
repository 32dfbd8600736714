"""The tree of a compiled robot: its joints, its colliders, and which chains of joints end where."""

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite.robots.spec import SpecError

_KIND = mujoco.mjtJoint
FREE, BALL, SLIDE, HINGE = map(int, (_KIND.mjJNT_FREE, _KIND.mjJNT_BALL, _KIND.mjJNT_SLIDE, _KIND.mjJNT_HINGE))

_GEOM = mujoco.mjtGeom
DOWN = np.array((0.0, 0.0, -1.0))


class Robot(NamedTuple):
    """A robot in a compiled file; everything is named by MuJoCo's indices.

    Attributes:
        model: the file, whose torso has a free joint.
        root: body of the torso.
        bodies: of the robot, parents first.
        joints: all but the free one, in the order of the file.
        colliders: geoms that collide with anything.
        chains: by body, the joints between the torso and it, outwards.
    """

    model: mujoco.MjModel
    root: int
    bodies: tuple[int, ...]
    joints: tuple[int, ...]
    colliders: tuple[int, ...]
    chains: dict[int, tuple[int, ...]]

    def name(self, joint: int) -> str:
        """Return the name of a joint in the file, or its number."""
        return self.model.joint(joint).name or f"joint {joint}"

    def range(self, joint: int) -> tuple[float, float]:
        """Return the limits of a joint, rad or m; infinite ones where it has none."""
        low, high = self.model.jnt_range[joint] if self.model.jnt_limited[joint] else (-np.inf, np.inf)
        return float(low), float(high)

    def place(self, joint: int) -> int:
        """Return where a joint's angle stands in qpos."""
        return int(self.model.jnt_qposadr[joint])

    def clipped(self, qpos: np.ndarray) -> np.ndarray:
        """Return a pose (nq,) with all joints within their limits."""
        qpos = qpos.copy()
        for joint in self.joints:
            qpos[self.place(joint)] = np.clip(qpos[self.place(joint)], *self.range(joint))
        return qpos

    def placed(self, qpos: np.ndarray, data: mujoco.MjData | None = None) -> mujoco.MjData:
        """Return the state of a pose (nq,), with the torso's frame as the world's: a new one, or `data`."""
        data = mujoco.MjData(self.model) if data is None else data
        start = self.model.jnt_qposadr[self.model.body_jntadr[self.root]]
        data.qpos[:] = qpos
        data.qpos[start : start + 7] = (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_comPos(self.model, data)
        return data


def robot_of(model: mujoco.MjModel, root: int, notes: Sequence[str] = ()) -> Robot:
    """Return the robot whose torso is a body with a free joint.

    Args:
        model: of the file.
        root: body of the torso.
        notes: what was left out of the file, for an error.

    Raises:
        SpecError: it has ball joints, or nothing that collides.
    """
    chains: dict[int, tuple[int, ...]] = {root: ()}
    for body in range(root + 1, model.nbody):
        parent = int(model.body_parentid[body])
        if parent in chains:
            first = int(model.body_jntadr[body])
            chains[body] = (*chains[parent], *range(first, first + int(model.body_jntnum[body])))
    joints = tuple(sorted({joint for chain in chains.values() for joint in chain}))
    colliders = tuple(geom for geom in colliding_geoms(model) if int(model.geom_bodyid[geom]) in chains)
    robot = Robot(model, root, tuple(chains), joints, colliders, chains)
    balls = [robot.name(joint) for joint in joints if model.jnt_type[joint] == BALL]
    if balls:
        raise SpecError(f"joint {balls[0]!r} is a ball joint; expected hinges")
    if not robot.colliders:
        raise SpecError("; ".join(("no shape collides with anything: a leg needs one at its end", *notes)))
    return robot


def colliding_geoms(model: mujoco.MjModel) -> list[int]:
    """Return the geoms that can touch others: by their masks, or as one of a contact pair."""
    touches = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    touches[[*model.pair_geom1, *model.pair_geom2]] = True
    return np.flatnonzero(touches).tolist()


def support_point(model: mujoco.MjModel, data: mujoco.MjData, geom: int, direction: np.ndarray) -> np.ndarray:
    """Return the farthest point (3,) of a geom along a direction (3,), in the world."""
    turn, size = data.geom_xmat[geom].reshape(3, 3), model.geom_size[geom]
    along = turn.T @ direction
    return data.geom_xpos[geom] + turn @ _farthest(model, geom, size, along)


def _farthest(model: mujoco.MjModel, geom: int, size: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the farthest point (3,) along a unit vector (3,), in the geom's frame."""
    across = np.array((along[0], along[1], 0.0))
    rim = size[0] * across / max(np.hypot(*along[:2]), 1e-9)
    end = np.array((0.0, 0.0, np.sign(along[2]) * size[1]))
    match model.geom_type[geom]:
        case _GEOM.mjGEOM_SPHERE:
            return size[0] * along
        case _GEOM.mjGEOM_CAPSULE:
            return size[0] * along + end
        case _GEOM.mjGEOM_CYLINDER:
            return rim + end
        case _GEOM.mjGEOM_ELLIPSOID:
            return size**2 * along / np.linalg.norm(size * along)
        case _GEOM.mjGEOM_BOX:
            return np.sign(along) * size
        case _GEOM.mjGEOM_MESH:
            points = vertices(model, int(model.geom_dataid[geom]))
            return points[(points @ along).argmax()].astype(float)
    return np.zeros(3)


def vertices(model: mujoco.MjModel, mesh: int) -> np.ndarray:
    """Return the vertices (n, 3) of a mesh in its own frame, float32."""
    start = model.mesh_vertadr[mesh]
    return model.mesh_vert[start : start + model.mesh_vertnum[mesh]]


def lowest_point(robot: Robot, data: mujoco.MjData, geoms: Sequence[int]) -> tuple[np.ndarray, int]:
    """Return the lowest point (3,) of geoms, and the one that has it."""
    points = [(support_point(robot.model, data, geom, DOWN), geom) for geom in geoms]
    return min(points, key=lambda point: point[0][2])
