"""The paper's reward (Section 4): ten unweighted terms and their weighted sum.

Each term is a plain function of readings, of what the task remembers of the step, and of the
task's parameters. Arrays may carry any leading axes: one text serves one environment and a batch.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.tasks.readings import Readings, component

TWO_PI = 2.0 * np.pi


class Step(NamedTuple):
    """What the task knows of a control step beside the readings.

    Attributes:
        phase: (...) of the gait clock, rad in [0, 2 pi).
        forward_velocity: (...) mean of the torso's world x velocity over the step, m/s.
        action: (..., joints)
        previous_action: (..., joints)
    """

    phase: np.ndarray
    forward_velocity: np.ndarray
    action: np.ndarray
    previous_action: np.ndarray


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


def stance_targets(phase, parameters: Parameters):
    """Which feet the gait wants on the ground: (..., feet) booleans for a phase (...)."""
    return (phase[..., None] + parameters.phase_offsets) % TWO_PI < TWO_PI * parameters.duty_factor


def stance_errors(readings: Readings, step: Step, parameters: Parameters):
    """Which feet are on the ground and should not be, or the reverse: (..., feet) booleans."""
    stance = readings.foot_heights < parameters.stance_threshold
    return stance != stance_targets(step.phase, parameters)


def healthy(torso_height, parameters: Parameters):
    """Whether a torso's height (...) m lies in its healthy range: (...) booleans."""
    low, high = parameters.healthy_range
    return (low <= torso_height) & (torso_height <= high)


def terms(readings: Readings, step: Step, parameters: Parameters) -> dict:
    """All ten terms, unweighted.

    Args:
        readings: after the control step.
        step: the control step.
        parameters: of the task.

    Returns:
        The terms by name, each (...), costs as positive numbers. The names are the keys of the
        table of weights.
    """
    p = parameters
    errors = stance_errors(readings, step, p)
    wrong_feet = errors.sum(axis=-1, dtype=float)
    roll, pitch = component(readings.angular_velocity, 0), component(readings.angular_velocity, 1)
    vertical = component(readings.linear_velocity, 2)  # numpy's `vertical**2` rounds otherwise for scalars
    return {
        "forward": _positive(1.0 - abs(step.forward_velocity - p.target_velocity) / p.velocity_band),
        "healthy": healthy(readings.torso_height, p).astype(float),
        "gait_bonus": 1.0 - wrong_feet / errors.shape[-1],
        "gait_cost": wrong_feet,
        "control": (step.action**2).sum(axis=-1),
        "smoothness": ((step.action - step.previous_action) ** 2).sum(axis=-1),
        "contact": (readings.contact_forces**2).sum(axis=-1),
        "angular_velocity": roll * roll + pitch * pitch,
        "vertical_velocity": vertical * vertical,
        "posture": ((readings.joint_angles - p.default_angles) ** 2).sum(axis=-1),
    }


def _positive(x):
    """`x.clip(0.0)`, several times faster where x is a scalar."""
    return abs(x) * (x > 0.0)


def total(terms: Mapping, weights: Mapping):
    """The reward: the sum of the terms times their signed weights, in the order of the weights."""
    return sum(weight * terms[name] for name, weight in weights.items())


def greatest(weights: Mapping) -> float:
    """The most that a step can earn: bonuses, whose weights are positive, are at most 1, costs at least 0."""
    return sum(weight for weight in weights.values() if weight > 0.0)
