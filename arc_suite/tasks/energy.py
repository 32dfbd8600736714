"""Energy: the positive work of the motors and the heat of their windings, from which the cost of transport follows.

Work is divided by the body's weight, so its unit is m. Negative work does not count, as in
`style.metrics.cost_of_transport`.
"""

from typing import NamedTuple

import numpy as np

from arc_suite.models.sizing import control_timestep, size_body
from arc_suite.models.standing import GRAVITY, measure_standing
from arc_suite.robots.spec import Body

MIN_PATH = 0.05  # share of the path at the target velocity; shorter paths count as so long


class Energy(NamedTuple):
    """Memory of the motors' work.

    Attributes:
        angles: (..., joints) at the latest reading, rad.
        step: (...) work and heat of the latest step by weight, m.
        total: (...) sum of `step` over the steps, m.
    """

    angles: np.ndarray
    step: np.ndarray
    total: np.ndarray


def start(joints: int) -> Energy:
    """Return the memory at the start of an episode."""
    return Energy(np.zeros(joints), np.float64(0.0), np.float64(0.0))


def begin(memory: Energy, angles) -> Energy:
    """Return the memory from which the first step starts, given the joint angles (..., joints), rad."""
    return memory._replace(angles=angles + 0.0)  # a copy, as readings are views of the simulation


def after(memory: Energy, torques: np.ndarray, heat: np.ndarray, action, angles) -> Energy:
    """Return the memory after a control step, over which torques are constant.

    Args:
        memory: before it.
        torques: (joints,) torques of the body; see `torques`.
        heat: (joints,) heat of a step at the largest torques; see `heat`.
        action: (..., joints) action of the step, or the torques of servos as shares of the largest.
        angles: (..., joints) angles of the joints after it, rad.
    """
    step = (torques * action * (angles - memory.angles)).clip(0.0).sum(axis=-1)
    if heat.any():
        step = step + (heat * action * action).sum(axis=-1)
    return Energy(angles + 0.0, step, memory.total + step)


def cost_of_transport(memory: Energy, path, target_path):
    """Return the cost of transport (...): work over weight and path.

    Args:
        memory: memory of the episode.
        path: (...) length of the path so far, m.
        target_path: (...) length at the target velocity, m; see `MIN_PATH`.
    """
    xp = memory.total.__array_namespace__()
    return memory.total / xp.maximum(path, MIN_PATH * target_path)


def torques(body: Body) -> np.ndarray:
    """Return the greatest torques (joints,) of a body's motors over its weight, m."""
    gears = np.array([joint.torque for joint in size_body(body).joints])
    return gears / (measure_standing(body).mass * GRAVITY)


def heat(body: Body) -> np.ndarray:
    """Return the heat (joints,) of a control step at the greatest torques over the weight, m."""
    sized_body = size_body(body)
    losses = np.array([joint.drive.winding_loss for joint in sized_body.joints])  # W/(N m)^2
    gears = np.array([joint.torque for joint in sized_body.joints])
    return losses * gears * gears * control_timestep(body) / (measure_standing(body).mass * GRAVITY)
