"""Blows: short forces on the torso, from one of four sides."""

import math
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import hard_ground
from arc_suite.models.standing import speed_unit, time_unit
from arc_suite.robots.spec import Body

# By the side that is hit: forward and left components of the blow.
DIRECTIONS = {"front": (-1.0, 0.0), "back": (1.0, 0.0), "left": (0.0, -1.0), "right": (0.0, 1.0)}

_DURATION = 0.1  # sqrt(h / g)


class Blow(NamedTuple):
    """A blow.

    Attributes:
        side: side from which it comes, of `DIRECTIONS`.
        size: its momentum by the mass of the body, sqrt(g h).
        lever: height over the torso's center of mass at which it hits, standing heights; it tilts the torso, too.
        friction: coefficient of friction of the ground, which is hard.
    """

    side: str
    size: float
    lever: float
    friction: float

    def set_ground(self, model: mujoco.MjModel) -> None:
        """Change the ground of a model."""
        hard_ground.harden(model)
        model.pair_friction[:, :2] = self.friction

    def strike(self, body: Body, model: mujoco.MjModel, data: mujoco.MjData) -> np.ndarray:
        """Push the torso for a moment, and return the positions (steps, nq) before each of its steps."""
        height = body.torso.standing_height
        steps = math.ceil(_DURATION * time_unit(body) / model.opt.timestep)
        torso = model.body("torso").id
        direction = rotations.to_heading_frame(np.array(DIRECTIONS[self.side]), -rotations.yaw(data.xquat[torso]))
        momentum = self.size * speed_unit(body.torso.standing_height) * model.body_mass.sum()  # N s
        force = np.append(direction, 0.0) * momentum / (steps * model.opt.timestep)
        torque = np.cross((0.0, 0.0, self.lever * height), force)
        data.xfrc_applied[torso] = np.concatenate([force, torque])
        positions = []
        for _ in range(steps):
            positions.append(data.qpos.copy())
            mujoco.mj_step(model, data)
        data.xfrc_applied[torso] = 0.0
        return np.stack(positions)
