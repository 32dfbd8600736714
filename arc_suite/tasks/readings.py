"""Readings of a simulation as named arrays, in the same way for one simulation and for a batch.

`mujoco.MjData`, dm_control's `physics.data` and `mujoco.batch.Batch` share their field names. Fields of a batch have
a leading axis. Every array here keeps such leading axes, written `...`.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.arenas import Arena
from arc_suite.robots.spec import Body

FIELDS = ("qpos", "qvel", "cfrc_ext", "xpos")  # fields of the simulation that `read` takes
FIELDS_OF_SERVOS = (*FIELDS, "qfrc_actuator")
FIELDS_OF_PLACED_TORSOS = (*FIELDS_OF_SERVOS, "xquat")  # see `TorsoPlace`


class TorsoPlace(NamedTuple):
    """The place of an imported torso whose root body has its frame elsewhere, as on the floor below the trunk.

    The simulation has the root body's position and velocity, everything else of the suite has those of the torso.

    Attributes:
        root: index of the root body.
        in_root: (3,) the place in the root body's frame, m; the axes are the same.
        in_torso: (3,) the place in the frame of the body `Layout.torso`, m.
    """

    root: int
    in_root: np.ndarray
    in_torso: np.ndarray


class Layout(NamedTuple):
    """Indices of a body's quantities in the simulation's arrays."""

    joint_angles: slice | np.ndarray  # in qpos
    joint_velocities: slice | np.ndarray  # in qvel
    velocities: slice | np.ndarray  # in qvel: torso linear and angular, joints
    torso: int  # in xpos; of the bodies that the torso consists of, the heaviest
    parts: slice | np.ndarray  # in cfrc_ext; the first is the torso
    feet: slice | np.ndarray  # in xpos
    home: np.ndarray | None = None  # angles of the joints in the standing pose; None where they are 0
    limits: np.ndarray | None = None  # largest torques of joints; None for motors that give them at any speed
    torso_place: TorsoPlace | None = None  # None where the torso is at the origin of its body

    @property
    def place_in_torso(self) -> np.ndarray:
        """Return the torso's place (3,) in the frame of the body `torso`, m."""
        return np.zeros(3) if self.torso_place is None else self.torso_place.in_torso


class Readings(NamedTuple):
    """Readings of a body at one moment, in SI units.

    Contact forces, foot heights and the frame's position are those of the start of MuJoCo's last substep, one substep
    behind the other readings, as in the published benchmark.

    Attributes:
        qpos: (..., nq) qpos of the simulation, as `torso_qpos` returns it.
        posture: (..., 5 + joints): torso height over the ground, torso quaternion, joint angles.
        torso_position: (..., 3) in the world.
        torso_quaternion: (..., 4), w first.
        joint_angles: (..., joints) from the standing pose.
        velocities: (..., 6 + joints): torso linear (world) and angular (body), joint velocities.
        contact_forces: (..., 6 * parts), torque and force on each part, clipped to [-1, 1].
        frame_position: (..., 3) position of the torso's frame, world.
        foot_heights: (..., feet) over the ground.
        efforts: (..., joints) torques, shares of the largest; None for motors whose actions are the torques.
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
    limits = None
    if model.jnt_actfrclimited.any():  # motors whose torques fall with speed
        limits = np.array([model.actuator(name).gear[0] for name in body.joint_names])
    return Layout(
        joint_angles=angles,
        joint_velocities=velocities,
        velocities=slice(0, velocities.stop),
        torso=parts.start,
        parts=parts,
        feet=_as_slice(feet),
        limits=limits,
    )


def _imported_layout(model, body: Body, feet: list[int]) -> Layout:
    """Return the layout of an imported body, whose model may have further joints and parts between those of the body.

    A foot has no collider; the forces on it are those on the part above, which has the collider.
    """
    joints = [model.joint(name) for name in body.joint_names]
    angles = [int(joint.qposadr[0]) for joint in joints]
    velocities = [int(joint.dofadr[0]) for joint in joints]
    torso = _heaviest_torso_body(model)
    parts = [torso]
    for name in body.part_names[1:]:
        part = model.body(name).id
        parts.append(int(model.body_parentid[part]) if part in feet else part)
    return Layout(
        joint_angles=_as_slice(angles),
        joint_velocities=_as_slice(velocities),
        velocities=_as_slice([*range(6), *velocities]),
        torso=torso,
        parts=np.array(parts),
        feet=_as_slice(feet),
        home=model.key_qpos[0][angles],
        limits=model.jnt_actfrcrange[[joint.id for joint in joints], 1],
        torso_place=_torso_place(model, torso),
    )


def _heaviest_torso_body(model) -> int:
    """Return the heaviest of the root body and of the bodies that are fixed to it."""
    root = model.body("torso").id
    torso_bodies = np.flatnonzero(model.body_weldid == root)
    return int(torso_bodies[model.body_mass[torso_bodies].argmax()])


def _torso_place(model, torso: int) -> TorsoPlace | None:
    """Return the place of the torso, which a site has; None where it is the origin of the torso's body."""
    root = int(model.body("torso").id)
    in_root = model.site("torso").pos.copy()
    if torso == root and not in_root.any():
        return None
    in_torso = in_root
    for body in _bodies_below(model, root, torso):
        in_torso = rotations.matrix(model.body_quat[body]).T @ (in_torso - model.body_pos[body])
    return TorsoPlace(root, in_root, in_torso)


def _bodies_below(model, root: int, body: int) -> list[int]:
    """Return the bodies between a root and a body, outwards, with the body and without the root."""
    bodies = []
    while body != root:
        bodies.append(body)
        body = int(model.body_parentid[body])
    return bodies[::-1]


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
    """Return poses (..., 7 + joints) of the simulation's qpos (..., nq): position and quaternion of the torso, angles.

    Angles are relative to the standing pose, rad.
    """
    return _relative_pose(torso_qpos(qpos, layout), layout)


def _relative_pose(qpos, layout: Layout):
    """Return the poses of `pose`, given qpos (..., nq) as `torso_qpos` returns it."""
    if layout.home is None:
        return qpos
    xp = qpos.__array_namespace__()
    return xp.concatenate([qpos[..., :7], qpos[..., layout.joint_angles] - layout.home], axis=-1)


def positions(poses, layout: Layout, standing):
    """Return the simulation's qpos (..., nq) of poses (..., 7 + joints); other joints are as in `standing` (nq,)."""
    if layout.home is None:
        return poses
    qpos = np.tile(standing, (*poses.shape[:-1], 1))
    qpos[..., :7] = poses[..., :7]
    qpos[..., layout.joint_angles] = poses[..., 7:] + layout.home
    return root_qpos(qpos, layout)


def torso_qpos(qpos, layout: Layout):
    """Return the simulation's qpos (..., nq) with the position of the torso in place of that of the root body."""
    return qpos if layout.torso_place is None else _move_qpos(qpos, layout.torso_place.in_root)


def root_qpos(qpos, layout: Layout):
    """Return what `torso_qpos` takes: with the position of the root body in place of that of the torso."""
    return qpos if layout.torso_place is None else _move_qpos(qpos, -layout.torso_place.in_root)


def torso_qvel(qvel, qpos, layout: Layout):
    """Return the simulation's qvel (..., nv) with the velocity of the torso in place of that of the root body."""
    return qvel if layout.torso_place is None else _move_qvel(qvel, qpos, layout.torso_place.in_root)


def root_qvel(qvel, qpos, layout: Layout):
    """Return what `torso_qvel` takes: with the velocity of the root body in place of that of the torso."""
    return qvel if layout.torso_place is None else _move_qvel(qvel, qpos, -layout.torso_place.in_root)


def _move_qpos(qpos, shift: np.ndarray):
    """Return qpos (..., nq) of a point that lies a shift (3,) away in the torso's frame."""
    xp = qpos.__array_namespace__()
    position = qpos[..., :3] + rotations.matrix(qpos[..., 3:7]) @ shift
    return xp.concatenate([position, qpos[..., 3:]], axis=-1)


def _move_qvel(qvel, qpos, shift: np.ndarray):
    """Return qvel (..., nv) of a point that lies a shift (3,) away in the torso's frame."""
    xp = qvel.__array_namespace__()
    swing = xp.cross(qvel[..., 3:6], xp.asarray(shift))  # in the torso's frame
    velocity = qvel[..., :3] + (rotations.matrix(qpos[..., 3:7]) @ swing[..., None])[..., 0]
    return xp.concatenate([velocity, qvel[..., 3:]], axis=-1)


def frame_position(data, layout: Layout):
    """Return the position (..., 3) of the torso's frame at the start of the last substep, in the world."""
    place = layout.torso_place
    if place is None:
        return data.xpos[..., layout.torso, :]
    turn = rotations.matrix(data.xquat[..., place.root, :])
    return data.xpos[..., place.root, :] + turn @ place.in_root


def headed_forces(data, layout: Layout, unit: np.ndarray, heading):
    """Return the torque and force (..., parts, 6) on each part in a unit (1, 6), relative to a heading (...), rad."""
    wrenches = data.cfrc_ext[..., layout.parts, :] / unit  # torque (3,), then force (3,), world
    xp = wrenches.__array_namespace__()
    heading_of_parts = heading[..., None]
    horizontal_torque = rotations.to_heading_frame(wrenches[..., 0:2], heading_of_parts)
    horizontal_force = rotations.to_heading_frame(wrenches[..., 3:5], heading_of_parts)
    return xp.concatenate([horizontal_torque, wrenches[..., 2:3], horizontal_force, wrenches[..., 5:6]], axis=-1)


def observe_by_heading(readings: Readings, heading) -> dict:
    """Return the blocks `posture` and `velocities` with the torso's directions relative to a heading (...), rad."""
    posture = readings.posture
    velocities = readings.velocities
    xp = posture.__array_namespace__()
    quaternion = rotations.turn_about_z(readings.torso_quaternion, -heading)
    horizontal_velocity = rotations.to_heading_frame(velocities[..., :2], heading)
    return {
        "posture": xp.concatenate([posture[..., :1], quaternion, posture[..., 5:]], axis=-1),
        "velocities": xp.concatenate([horizontal_velocity, velocities[..., 2:]], axis=-1),
    }


def remove_negative_zeros(blocks: Mapping) -> dict:
    """Return blocks by name with 0 in place of -0, which turns and reflections may give."""
    return {name: block + 0.0 for name, block in blocks.items()}


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
    qpos = torso_qpos(data.qpos, layout)
    qvel = torso_qvel(data.qvel, data.qpos, layout)
    torso_position = qpos[..., 0:3]
    feet = data.xpos[..., layout.feet, :]
    posture = _relative_pose(qpos, layout)[..., 2:]
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
        velocities=qvel[..., layout.velocities],
        contact_forces=forces.reshape(forces.shape[:-2] + (-1,)).clip(-1.0, 1.0),
        frame_position=frame_position(data, layout),
        foot_heights=foot_heights,
        efforts=efforts,
        foot_positions=feet,
    )
