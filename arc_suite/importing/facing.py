"""Which axes of a file's torso point ahead and up, and a torso turned so that these are x and z, as in the suite."""

from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite import rotations

# Directions of the torso's frame, by name.
AXES = {
    "x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}


class Facing(NamedTuple):
    """The axes of a file's torso that point ahead and up; neither is the other or its opposite."""

    forward: str = "x"
    up: str = "z"

    @property
    def rotation(self) -> np.ndarray:
        """Return the matrix (3, 3) from the file's torso to the suite's torso."""
        forward = np.array(AXES[self.forward])
        up = np.array(AXES[self.up])
        return np.stack((forward, np.cross(up, forward), up))

    @property
    def quaternion(self) -> np.ndarray:
        """Return the same rotation as a quaternion (4,), w first."""
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, self.rotation.ravel())
        return quaternion

    def turn(self, axis: str) -> "Facing":
        """Return the facing with another axis ahead, which is named in the frame of this one, and level there."""
        direction = self.rotation.T @ AXES[axis]
        (forward,) = (name for name, vector in AXES.items() if np.allclose(vector, direction))
        return Facing(forward, self.up)


LEVEL = Facing()
Y_UP = (Facing("z", "y"), Facing("x", "y"))


def turn_torso(spec: mujoco.MjSpec, model: mujoco.MjModel, torso: int, facing: Facing) -> mujoco.MjModel:
    """Return the model with the torso's frame turned; the robot stays where it is.

    Args:
        spec: spec of the file, which is changed.
        model: compiled from it.
        torso: body of the torso.
        facing: axes of the torso that become x and z.
    """
    if facing == LEVEL:
        return model
    quaternion = facing.quaternion
    body = spec.bodies[torso]
    outer_frames = [frame for frame in body.frames if frame.frame is None]
    turned_frame = body.add_frame(quat=quaternion)
    for frame in outer_frames:
        frame.set_frame(turned_frame)
    for children in (body.bodies, body.geoms, body.sites, body.cameras, body.lights):
        for child in children:
            if child.frame is None:
                child.set_frame(turned_frame)
    _turn_equalities(spec, body.name, facing)
    if body.explicitinertial:
        body.fullinertia[0] = np.nan
        body.inertia = model.body_inertia[torso]
        body.ipos = facing.rotation @ model.body_ipos[torso]
        mujoco.mju_mulQuat(body.iquat, quaternion, model.body_iquat[torso])
    return spec.compile()


def _turn_equalities(spec: mujoco.MjSpec, torso: str, facing: Facing) -> None:
    """Turn what connections and welds give in the frame of the torso."""
    for equality in spec.equalities:
        if equality.objtype != mujoco.mjtObj.mjOBJ_BODY or torso not in (equality.name1, equality.name2):
            continue
        data = equality.data
        if equality.type == mujoco.mjtEq.mjEQ_CONNECT and equality.name1 == torso:
            data[:3] = facing.rotation @ data[:3]  # the anchor, in the frame of the first body
        elif equality.type == mujoco.mjtEq.mjEQ_WELD:
            # The anchor is in the frame of the second body, whose pose is in that of the first one.
            if equality.name1 == torso:
                data[3:6] = facing.rotation @ data[3:6]
                data[6:10] = rotations.product(facing.quaternion, data[6:10])
            else:
                data[:3] = facing.rotation @ data[:3]
                data[6:10] = rotations.product(data[6:10], rotations.inverse(facing.quaternion))
