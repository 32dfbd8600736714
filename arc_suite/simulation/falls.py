"""Falls: poses in which a body lies after it was dropped with limp motors."""

import functools

import mujoco
import numpy as np

from arc_suite import rotations
from arc_suite.models.standing import GRAVITY, standing_qpos
from arc_suite.robots.spec import Body
from arc_suite.simulation.batch import Batch
from arc_suite.simulation.model import compile_model

DROPS = 256
_DURATION = 6.0  # sqrt(h / g), of a standing height h; 1.7 s of Queen
_MAX_CLEARANCE = 1.0  # of the lowest point over the floor at the start of a drop, h


@functools.lru_cache(maxsize=64)
def drop_body(body: Body, seed: int, drops: int) -> np.ndarray:
    """Return poses (drops, nq) of a body on level ground, after drops from any attitude with any joint angles.

    Motors are limp. A drop lasts 6 sqrt(h / g), after which most bodies have come to rest. The velocity that others
    still have is left out. The torso's position is that of the root body, above the origin.

    Args:
        body: the body.
        seed: seed of the drops.
        drops: number of drops, which are simulated in one batch.

    Returns:
        An array to which nobody may write.
    """
    model = compile_model(body)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    height = body.torso.standing_height
    random = np.random.RandomState(seed)
    poses = np.tile(standing_qpos(model), (drops, 1))
    poses[:, 3:7] = random.standard_normal((drops, 4))
    poses[:, 3:7] /= np.linalg.norm(poses[:, 3:7], axis=-1, keepdims=True)
    for name in body.joint_names:
        joint = model.joint(name)
        low, high = joint.range
        poses[:, joint.qposadr[0]] = random.uniform(low, high, drops)
    clearances = height * random.uniform(0.0, _MAX_CLEARANCE, drops)

    simulations = Batch(model, drops, fields=("geom_xpos",))
    all_drops = np.ones(drops, bool)
    no_velocity = np.zeros((drops, model.nv))
    simulations.reset(all_drops, poses, no_velocity)
    moves = model.geom_bodyid > 0
    lowest_points = (simulations.data.geom_xpos[:, moves, 2] - model.geom_rbound[moves]).min(axis=-1)
    poses[:, 2] += clearances - lowest_points
    simulations.reset(all_drops, poses, no_velocity)
    substeps = round(_DURATION * np.sqrt(height / GRAVITY) / model.opt.timestep)
    has_diverged = simulations.step(substeps, all_drops)
    poses = simulations.data.qpos[~has_diverged]
    poses[:, :2] = 0.0
    poses[:, 3:7] = rotations.turn_about_z(poses[:, 3:7], -rotations.yaw(poses[:, 3:7]))
    poses.setflags(write=False)
    return poses
