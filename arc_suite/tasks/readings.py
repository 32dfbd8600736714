"""Reads a simulation into named arrays: the same for one simulation and for a batch of them.

`mujoco.MjData`, dm_control's `physics.data` and `mujoco.batch.Batch` share their field names; a
batch's fields carry a leading axis. Every array here keeps such leading axes, written `...`.
"""

from typing import NamedTuple

import numpy as np


class Layout(NamedTuple):
    """Where a body's quantities lie in the simulation's arrays, looked up by name once."""

    pose: slice  # in qpos: torso height, torso quaternion, joint angles
    joint_angles: slice  # in qpos
    velocities: slice  # in qvel: torso linear and angular, joints
    joint_velocities: slice  # in qvel
    parts: slice  # in cfrc_ext
    feet: slice | np.ndarray  # in xpos


class Readings(NamedTuple):
    """What a body's simulation shows at one moment, in SI units.

    Attributes:
        torso_height: (...)
        torso_quaternion: (..., 4), w first.
        joint_angles: (..., joints)
        linear_velocity: (..., 3) of the torso, world frame.
        angular_velocity: (..., 3) of the torso, body frame.
        joint_velocities: (..., joints)
        contact_forces: (..., 6 * parts), torque and force on each part, clipped to [-1, 1].
        foot_heights: (..., feet)
    """

    torso_height: np.ndarray
    torso_quaternion: np.ndarray
    joint_angles: np.ndarray
    linear_velocity: np.ndarray
    angular_velocity: np.ndarray
    joint_velocities: np.ndarray
    contact_forces: np.ndarray
    foot_heights: np.ndarray


def layout(model, joints, parts, feet) -> Layout:
    """Finds a body in a compiled model.

    Args:
        model: `mujoco.MjModel` whose first joint is the torso's free joint.
        joints: names of the actuated joints, in the order of the model.
        parts: names of the body's rigid parts, likewise.
        feet: names of the feet's bodies.

    Returns:
        The layout.

    Raises:
        KeyError: a name is not in the model.
        ValueError: joints or parts do not lie side by side in the given order, the joints next to
            the torso's.
    """
    angles = _span([model.joint(name).qposadr[0] for name in joints])
    velocities = _span([model.joint(name).dofadr[0] for name in joints])
    if (angles.start, velocities.start) != (7, 6):
        raise ValueError(f"expected the joints next to the torso's, at 7 in qpos, got {angles.start}")
    return Layout(
        pose=slice(2, angles.stop),
        joint_angles=angles,
        velocities=slice(0, velocities.stop),
        joint_velocities=velocities,
        parts=_span([model.body(name).id for name in parts]),
        feet=_evenly_spaced([model.body(name).id for name in feet]),
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


def component(vectors, index: int):
    """One component of vectors (..., n): (...).

    A single vector gives a scalar, with which numpy computes ten times faster than with an array
    of no axes.
    """
    return vectors[..., index][()]


def read(data, layout: Layout) -> Readings:
    """Takes the readings of a simulation.

    Contact forces and foot heights are as MuJoCo's last substep computed them, one substep behind
    positions and velocities, as in the published benchmark.

    Args:
        data: `MjData`, or anything with its fields under any leading axes.
        layout: of the body in the model.

    Returns:
        The readings; arrays may be views of `data`.
    """
    qpos, qvel = data.qpos, data.qvel
    forces = data.cfrc_ext[..., layout.parts, :]
    return Readings(
        torso_height=component(qpos, 2),
        torso_quaternion=qpos[..., 3:7],
        joint_angles=qpos[..., layout.joint_angles],
        linear_velocity=qvel[..., 0:3],
        angular_velocity=qvel[..., 3:6],
        joint_velocities=qvel[..., layout.joint_velocities],
        contact_forces=forces.reshape(forces.shape[:-2] + (-1,)).clip(-1.0, 1.0),
        foot_heights=data.xpos[..., layout.feet, 2],
    )
