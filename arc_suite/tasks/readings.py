"""Readings of a simulation as named arrays, in the same way for one simulation and for a batch.

`mujoco.MjData`, dm_control's `physics.data` and `mujoco.batch.Batch` share their field names. Fields of a batch have
a leading axis. Every array here keeps such leading axes, written `...`.
"""

from typing import NamedTuple

import numpy as np

from arc_suite.arenas import Arena
from arc_suite.robots.spec import Body

FIELDS = ("qpos", "qvel", "cfrc_ext", "xpos")  # fields of the simulation that `read` takes
FIELDS_OF_SERVOS = (*FIELDS, "qfrc_actuator")


class Layout(NamedTuple):
    """Indices of a body's quantities in the simulation's arrays."""

    joint_angles: slice | np.ndarray  # in qpos
    joint_velocities: slice | np.ndarray  # in qvel
    velocities: slice | np.ndarray  # in qvel: torso linear and angular, joints
    torso: int  # in xpos
    parts: slice | np.ndarray  # in cfrc_ext; the first is the torso
    feet: slice | np.ndarray  # in xpos
    home: np.ndarray | None = None  # angles of the joints in the standing pose; None where they are 0
    limits: np.ndarray | None = None  # of the joints' torques, for servos; None for motors


class Readings(NamedTuple):
    """Readings of a body at one moment, in SI units.

    Contact forces, foot heights and the frame's position are those of the start of MuJoCo's last substep, one substep
    behind the other readings, as in the published benchmark.

    Attributes:
        qpos: (..., nq) qpos of the simulation.
        posture: (..., 5 + joints): torso height over the ground, torso quaternion, joint angles.
        torso_position: (..., 3) in the world.
        torso_quaternion: (..., 4), w first.
        joint_angles: (..., joints) from the standing pose.
        velocities: (..., 6 + joints): torso linear (world) and angular (body), joint velocities.
        contact_forces: (..., 6 * parts), torque and force on each part, clipped to [-1, 1].
        frame_position: (..., 3) position of the torso's frame, world.
        foot_heights: (..., feet) over the ground.
        efforts: (..., joints) torques of servos, shares of the largest; None for motors, whose actions are the torques.
        foot_positions: (..., feet, 3) in the world.
    """

    qpos: np.ndarray
    posture: np.ndarray
    torso_position: np.ndarray
    torso_quaternion: np.ndarray
    joint_angles: np.ndarray
    velocities: np.ndarray
    contact_forces: np.ndarray
    frame_position: np.ndarray
    foot_heights: np.ndarray
    efforts: np.ndarray | None = None
    foot_positions: np.ndarray | None = None

    @property
    def torso_height(self):
        """The height (...) of the torso over the ground, m."""
        return component(self.posture, 0)

    def effort(self, action):
        """Return the torques (..., joints) of a step as shares of the largest, given its action (..., joints).

        The torques of servos are those of the last substep.
        """
        return action if self.efforts is None else self.efforts


def layout(model, body: Body) -> Layout:
    """Return the layout of a body in a compiled model.

    Args:
        model: `mujoco.MjModel` whose first joint is the torso's free joint.
        body: a body with the joints and parts of the model, in its order.

    Raises:
        KeyError: a name is not in the model.
        ValueError: joints or parts of a body that was not imported are not adjacent, in order, the joints after the
            torso's.
    """
    feet = [model.body(name).id for name in body.foot_names]
    is_imported = model.nkey > 0  # a keyframe holds its standing pose
    if is_imported:
        return _imported_layout(model, body, feet)
    angles = _span([model.joint(name).qposadr[0] for name in body.joint_names])
    velocities = _span([model.joint(name).dofadr[0] for name in body.joint_names])
    if (angles.start, velocities.start) != (7, 6):
        raise ValueError(f"expected the joints next to the torso's, at 7 in qpos, got {angles.start}")
    parts = _span([model.body(name).id for name in body.part_names])
    return Layout(
        joint_angles=angles,
        joint_velocities=velocities,
        velocities=slice(0, velocities.stop),
        torso=parts.start,
        parts=parts,
        feet=_as_slice(feet),
    )


def _imported_layout(model, body: Body, feet: list[int]) -> Layout:
    """Return the layout of an imported body, whose model may have further joints and parts between those of the body.

    A foot has no collider; the forces on it are those on the part above, which has the collider.
    """
    joints = [model.joint(name) for name in body.joint_names]
    angles = [int(joint.qposadr[0]) for joint in joints]
    velocities = [int(joint.dofadr[0]) for joint in joints]
    parts = []
    for name in body.part_names:
        part = model.body(name).id
        parts.append(int(model.body_parentid[part]) if part in feet else part)
    return Layout(
        joint_angles=_as_slice(angles),
        joint_velocities=_as_slice(velocities),
        velocities=_as_slice([*range(6), *velocities]),
        torso=parts[0],
        parts=np.array(parts),
        feet=_as_slice(feet),
        home=model.key_qpos[0][angles],
        limits=model.jnt_actfrcrange[[joint.id for joint in joints], 1],
    )


def _span(indices) -> slice:
    """Return adjacent indices as a slice.

    Raises:
        ValueError: they are not adjacent, or not in ascending order.
    """
    start = int(indices[0])
    stop = int(indices[-1]) + 1
    if list(indices) != list(range(start, stop)):
        raise ValueError(f"expected adjacent entries in ascending order, got {list(map(int, indices))}")
    return slice(start, stop)


def _as_slice(indices) -> slice | np.ndarray:
    """Return the indices as a slice if they are evenly spaced, as a view is several times faster than a selection."""
    steps = set(np.diff(indices))
    if len(steps) == 1 and min(steps) > 0:
        return slice(int(indices[0]), int(indices[-1]) + 1, int(steps.pop()))
    return np.array(indices)


def pose(qpos, layout: Layout):
    """Return poses (..., 7 + joints) of positions (..., nq): the torso's position and quaternion, and joint angles.

    Angles are relative to the standing pose, rad.
    """
    if layout.home is None:
        return qpos
    xp = qpos.__array_namespace__()
    return xp.concatenate([qpos[..., :7], qpos[..., layout.joint_angles] - layout.home], axis=-1)


def positions(poses, layout: Layout, standing):
    """Return the positions (..., nq) of poses (..., 7 + joints); other joints are as in `standing` (nq,)."""
    if layout.home is None:
        return poses
    qpos = np.tile(standing, (*poses.shape[:-1], 1))
    qpos[..., :7] = poses[..., :7]
    qpos[..., layout.joint_angles] = poses[..., 7:] + layout.home
    return qpos


def component(vectors, index: int):
    """Return one component (...) of vectors (..., n).

    A single vector gives a scalar, with which NumPy computes ten times faster than with an array without axes.
    """
    return vectors[..., index][()]


def read(data, layout: Layout, arena: Arena, forces=None) -> Readings:
    """Return the readings of a simulation; arrays may be views of `data`.

    Args:
        data: `MjData`, or an object that has its fields, with any leading axes.
        layout: layout of the body in the model.
        arena: the ground over which heights are measured.
        forces: (..., parts, 6) torque and force on each part in other units or another frame; None
            for those of the simulation, N m and N in the world.
    """
    qpos = data.qpos
    xpos = data.xpos
    torso_position = qpos[..., 0:3]
    feet = xpos[..., layout.feet, :]
    posture = pose(qpos, layout)[..., 2:]
    foot_heights = feet[..., 2]
    if not arena.is_level:  # on level ground, heights are z
        xp = qpos.__array_namespace__()
        posture = xp.concatenate([arena.torso_clearance(torso_position)[..., None], posture[..., 1:]], axis=-1)
        foot_heights = foot_heights - arena.height(feet[..., 0], feet[..., 1])
    if forces is None:
        forces = data.cfrc_ext[..., layout.parts, :]
    efforts = None
    if layout.limits is not None:
        efforts = data.qfrc_actuator[..., layout.joint_velocities] / layout.limits
    return Readings(
        qpos=qpos,
        posture=posture,
        torso_position=torso_position,
        torso_quaternion=posture[..., 1:5],
        joint_angles=posture[..., 5:],
        velocities=data.qvel[..., layout.velocities],
        contact_forces=forces.reshape(forces.shape[:-2] + (-1,)).clip(-1.0, 1.0),
        frame_position=xpos[..., layout.torso, :],
        foot_heights=foot_heights,
        efforts=efforts,
        foot_positions=feet,
    )
