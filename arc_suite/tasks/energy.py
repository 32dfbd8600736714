"""Energy: the positive work of the motors, from which the cost of transport follows.

Work is divided by the body's weight, so its unit is m. The motors do not win back what they brake, as in
`style.metrics.cost_of_transport`.
"""

from typing import NamedTuple

import numpy as np

from arc_suite.models.sizing import sized
from arc_suite.models.standing import GRAVITY, standing
from arc_suite.robots.spec import Body

NOWHERE = 0.05  # share of the path at the target velocity below which a body gets nowhere


class Energy(NamedTuple):
    """Memory of the motors' work.

    Attributes:
        angles: (..., joints) at the latest reading, rad.
        step: (...) work of the latest step by weight, m.
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
    return memory._replace(angles=angles + 0.0)  # not a view


def after(memory: Energy, torques: np.ndarray, action, angles) -> Energy:
    """Return the memory after a control step, over which torques are constant.

    Args:
        memory: before it.
        torques: (joints,) of the body; see `torques`.
        action: (..., joints) of the step, or the torques of servos as shares of the largest.
        angles: (..., joints) of the joints after it, rad.
    """
    step = (torques * action * (angles - memory.angles)).clip(0.0).sum(axis=-1)
    return Energy(angles + 0.0, step, memory.total + step)


def cost_of_transport(memory: Energy, path, target_path):
    """Return the cost of transport (...): work by weight and path.

    Args:
        memory: of the episode.
        path: (...) length of it so far, m.
        target_path: (...) length at the target velocity, m; a shorter path than a twentieth of it counts as that.
    """
    numpy = memory.total.__array_namespace__()
    return memory.total / numpy.maximum(path, NOWHERE * target_path)


def torques(body: Body) -> np.ndarray:
    """Return the greatest torques (joints,) of a body's motors by its weight, m."""
    gears = np.array([joint.torque for joint in sized(body).joints])
    return gears / (standing(body).mass * GRAVITY)
