"""Readings of a simulation as named arrays: the same for one simulation and for a batch of them.

`mujoco.MjData`, dm_control's `physics.data` and `mujoco.batch.Batch` share their field names; a
batch's fields carry a leading axis. Every array here keeps such leading axes, written `...`.
"""

from typing import NamedTuple

import numpy as np

from arc_suite.arenas import Arena
from arc_suite.robots.spec import Body

FIELDS = ("qpos", "qvel", "cfrc_ext", "xpos")  # of the simulation, that `read` takes
FIELDS_OF_SERVOS = (*FIELDS, "qfrc_actuator")


class Layout(NamedTuple):
    """Where a body's quantities lie in the simulation's arrays, looked up by name once."""

    joint_angles: slice | np.ndarray  # in qpos
    joint_velocities: slice | np.ndarray  # in qvel
    velocities: slice | np.ndarray  # in qvel: torso linear and angular, joints
    torso: int  # in xpos
    parts: slice | np.ndarray  # in cfrc_ext; the first is the torso
    feet: slice | np.ndarray  # in xpos
    home: np.ndarray | None = None  # angles of the joints in the standing pose; None where they are 0
    limits: np.ndarray | None = None  # of the joints' torques, for servos; None for motors


class Readings(NamedTuple):
    """What a body's simulation shows at one moment, in SI units.

    Contact forces, foot heights and the frame's position are as MuJoCo's last substep computed
    them, one substep behind the rest, as in the published benchmark.

    Attributes:
        qpos: (..., nq) of the simulation.
        posture: (..., 5 + joints): torso height over the ground, torso quaternion, joint angles.
        torso_position: (..., 3) in the world.
        torso_quaternion: (..., 4), w first.
        joint_angles: (..., joints) from the standing pose.
        velocities: (..., 6 + joints): torso linear (world) and angular (body), joint velocities.
        contact_forces: (..., 6 * parts), torque and force on each part, clipped to [-1, 1].
        frame_position: (..., 3) of the torso's frame, world.
        foot_heights: (..., feet) over the ground.
        efforts: (..., joints) torques of servos, shares of the largest; None for motors, whose actions they are.
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

    @property
    def torso_height(self):
        """(...) over the ground."""
        return component(self.posture, 0)

    def effort(self, action):
        """Return the torques (..., joints) of a step as shares of the largest, given its action (..., joints).

        Of servos they are those of the last substep.
        """
        return action if self.efforts is None else self.efforts


def layout(model, body: Body) -> Layout:
    """Find a body in a compiled model.

    Args:
        model: `mujoco.MjModel` whose first joint is the torso's free joint.
        body: whose joints and parts it has, in the order of the model.

    Returns:
        The layout.

    Raises:
        KeyError: a name is not in the model.
        ValueError: joints or parts of a body without a source do not lie side by side in the given order, the joints
            next to the torso's.
    """
    ids = [model.body(name).id for name in body.foot_names]
    if model.nkey:
        return _layout_of_source(model, body, ids)
    angles = _span([model.joint(name).qposadr[0] for name in body.joint_names])
    velocities = _span([model.joint(name).dofadr[0] for name in body.joint_names])
    if (angles.start, velocities.start) != (7, 6):
        raise ValueError(f"expected the joints next to the torso's, at 7 in qpos, got {angles.start}")
    parts = _span([model.body(name).id for name in body.part_names])
    return Layout(angles, velocities, slice(0, velocities.stop), parts.start, parts, _evenly_spaced(ids))


def _layout_of_source(model, body: Body, feet: list[int]) -> Layout:
    """Find an imported body, between whose joints and parts others may lie.

    What pushes on a foot pushes on the part that has its collider, as the foot itself has none.
    """
    found = [model.joint(name) for name in body.joint_names]
    angles, velocities = [int(each.qposadr[0]) for each in found], [int(each.dofadr[0]) for each in found]
    ids = (model.body(name).id for name in body.part_names)
    owners = [int(model.body_parentid[index]) if index in feet else index for index in ids]
    return Layout(
        joint_angles=_evenly_spaced(angles),
        joint_velocities=_evenly_spaced(velocities),
        velocities=_evenly_spaced([*range(6), *velocities]),
        torso=owners[0],
        parts=np.array(owners),
        feet=_evenly_spaced(feet),
        home=model.key_qpos[0][angles],
        limits=model.jnt_actfrcrange[[joint.id for joint in found], 1],
    )


def _span(indices) -> slice:
    start, stop = int(indices[0]), int(indices[-1]) + 1
    if list(indices) != list(range(start, stop)):
        raise ValueError(f"expected adjacent entries in ascending order, got {[int(i) for i in indices]}")
    return slice(start, stop)


def _evenly_spaced(indices) -> slice | np.ndarray:
    """The indices as a slice if they are evenly spaced: a view is several times cheaper than a selection."""
    steps = set(np.diff(indices))
    if len(steps) == 1 and min(steps) > 0:
        return slice(int(indices[0]), int(indices[-1]) + 1, int(steps.pop()))
    return np.array(indices)


def pose(qpos, layout: Layout):
    """Return poses (..., 7 + joints) of positions (..., nq): the torso's place and quaternion, and joint angles.

    Angles are from the standing pose, rad.
    """
    if layout.home is None:
        return qpos
    numpy = qpos.__array_namespace__()
    return numpy.concatenate([qpos[..., :7], qpos[..., layout.joint_angles] - layout.home], axis=-1)


def positions(poses, layout: Layout, standing):
    """Return the positions (..., nq) of poses (..., 7 + joints), in which held joints are as in `standing` (nq,)."""
    if layout.home is None:
        return poses
    qpos = np.tile(standing, (*poses.shape[:-1], 1))
    qpos[..., :7], qpos[..., layout.joint_angles] = poses[..., :7], poses[..., 7:] + layout.home
    return qpos


def component(vectors, index: int):
    """Return one component of vectors (..., n): (...).

    A single vector gives a scalar, with which numpy computes ten times faster than with an array
    of no axes.
    """
    return vectors[..., index][()]


def read(data, layout: Layout, arena: Arena, forces=None) -> Readings:
    """Take the readings of a simulation.

    Args:
        data: `MjData`, or anything with its fields under any leading axes.
        layout: of the body in the model.
        arena: over whose ground heights are.
        forces: (..., parts, 6) torque and force on each part in other units or another frame; None
            for those of the simulation, N m and N in the world.

    Returns:
        The readings; arrays may be views of `data`.
    """
    qpos, xpos = data.qpos, data.xpos
    position, feet, posture = qpos[..., 0:3], xpos[..., layout.feet, :], pose(qpos, layout)[..., 2:]
    efforts = None if layout.limits is None else data.qfrc_actuator[..., layout.joint_velocities] / layout.limits
    foot_heights = feet[..., 2]
    if not arena.is_level:  # a subtraction of 0 would change bits on level ground
        numpy = qpos.__array_namespace__()
        posture = numpy.concatenate([arena.torso_clearance(position)[..., None], posture[..., 1:]], axis=-1)
        foot_heights = foot_heights - arena.height(feet[..., 0], feet[..., 1])
    forces = data.cfrc_ext[..., layout.parts, :] if forces is None else forces
    return Readings(
        qpos=qpos,
        posture=posture,
        torso_position=position,
        torso_quaternion=posture[..., 1:5],
        joint_angles=posture[..., 5:],
        velocities=data.qvel[..., layout.velocities],
        contact_forces=forces.reshape(forces.shape[:-2] + (-1,)).clip(-1.0, 1.0),
        frame_position=xpos[..., layout.torso, :],
        foot_heights=foot_heights,
        efforts=efforts,
    )
