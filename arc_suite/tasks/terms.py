"""The paper's reward (Section 4): ten unweighted terms and their weighted sum.

Each term is a plain function of readings, of what the task remembers of the step, and of the
task's parameters. Arrays may carry any leading axes: one text serves one environment, a batch, and
JAX.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.tasks.readings import Readings, component


class Parameters(NamedTuple):
    """The numbers of task x robot that terms read.

    Attributes:
        target_velocity: m/s, peak of the velocity tent.
        velocity_band: m/s, half-width of the tent.
        gait_frequency: Hz of the gait clock.
        duty_factor: share of a cycle that a foot spends in stance.
        phase_offsets: (feet,) rad, added to the clock's phase.
        stance_threshold: m, a foot below it is in stance.
        healthy_range: (2,) m, lowest and highest torso height.
        default_angles: rad, (joints,) or a number for all of them.
    """

    target_velocity: float
    velocity_band: float
    gait_frequency: float
    duty_factor: float
    phase_offsets: np.ndarray
    stance_threshold: float
    healthy_range: tuple[float, float]
    default_angles: np.ndarray | float


def healthy(torso_height, parameters: Parameters):
    """Return whether torso heights (...), m, lie in their healthy range: (...) booleans."""
    low, high = parameters.healthy_range
    return (low <= torso_height) & (torso_height <= high)


def terms(readings: Readings, step, parameters: Parameters) -> dict:
    """Return all ten terms, unweighted.

    Args:
        readings: after the control step.
        step: what the task remembers of it: `forward_velocity` (...), m/s; `wrong_feet` (...), how
            many are on the ground and should not be, or the reverse; `action` and `previous_action`
            (..., joints).
        parameters: of the task.

    Returns:
        The terms by name, each (...), costs as positive numbers. The names are the keys of the
        table of weights.
    """
    p = parameters
    # Products, since numpy's `x**2` rounds otherwise for scalars.
    vertical, roll, pitch = (component(readings.velocities, i) for i in (2, 3, 4))
    return {
        "forward": tent(step.forward_velocity - p.target_velocity, p.velocity_band),
        "healthy": healthy(readings.torso_height, p).astype(float),
        "gait_bonus": 1.0 - step.wrong_feet / len(p.phase_offsets),
        "gait_cost": step.wrong_feet,
        "control": (step.action**2).sum(axis=-1),
        "smoothness": ((step.action - step.previous_action) ** 2).sum(axis=-1),
        "contact": (readings.contact_forces**2).sum(axis=-1),
        "angular_velocity": roll * roll + pitch * pitch,
        "vertical_velocity": vertical * vertical,
        "posture": ((readings.joint_angles - p.default_angles) ** 2).sum(axis=-1),
    }


def tent(error, band):
    """Return 1 where an error (...) is 0, falling to 0 where it reaches the band; of any error, infinite ones too."""
    share = 1.0 - abs(error) / band
    return share.__array_namespace__().maximum(share, 0.0)


def total(terms: Mapping, weights: Mapping):
    """Return the reward: the sum of the terms times their signed weights, in the order of the weights."""
    return sum(weight * terms[name] for name, weight in weights.items())


def greatest(weights: Mapping) -> float:
    """Return the most that a step can earn: bonuses, whose weights are positive, are at most 1, costs at least 0."""
    return sum(weight for weight in weights.values() if weight > 0.0)
