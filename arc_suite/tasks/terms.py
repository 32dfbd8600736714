"""Terms of rewards, and the reward that follows from them.

Arrays may have any leading axes `...`: one environment, a batch and JAX call the same functions.
"""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from arc_suite import checks
from arc_suite.tasks.readings import Readings, component


def costs(readings: Readings, action, previous_action, schedule_errors, default_angles) -> dict:
    """Return the paper's seven costs by name (Section 4), each (...) and at least 0.

    Args:
        readings: after the control step.
        action: (..., joints) action of the step.
        previous_action: (..., joints) action of the step before.
        schedule_errors: (...) number of contact schedule errors.
        default_angles: (joints,) rad, from which the posture is measured.
    """
    velocities = readings.velocities
    vertical_velocity = component(velocities, 2)
    roll_rate = component(velocities, 3)
    pitch_rate = component(velocities, 4)
    # Products, as NumPy rounds the square of a scalar and of an array differently.
    return {
        "gait_cost": schedule_errors,
        "control": (action**2).sum(axis=-1),
        "smoothness": ((action - previous_action) ** 2).sum(axis=-1),
        "contact": (readings.contact_forces**2).sum(axis=-1),
        "angular_velocity": roll_rate * roll_rate + pitch_rate * pitch_rate,
        "vertical_velocity": vertical_velocity * vertical_velocity,
        "posture": ((readings.joint_angles - default_angles) ** 2).sum(axis=-1),
    }


def triangle(error, width):
    """Return the triangular kernel (...) of errors (...): 1 at 0, 0 at the half-width and beyond."""
    kernel = 1.0 - abs(error) / width
    return kernel.__array_namespace__().maximum(kernel, 0.0)


def reward(terms: Mapping, weights: Mapping, cost_limit=None) -> tuple[dict, Any]:
    """Return the terms with limited costs, and the reward (...), their weighted sum.

    Every driver calls it after `Task.terms`. Terms are summed up in the order of the weights.

    Args:
        terms: raw terms (...) by name.
        weights: the weight of each, or weights (...) of environments that have different ones.
        cost_limit: bound of the weighted sum of the costs, the terms whose weights are negative; None for no bound.

    Raises:
        ValueError: a weight without a term, or a term without a weight.
    """
    if terms.keys() != weights.keys():
        _raise_mismatch(terms, weights)
    limited_terms = {name: terms[name] for name in weights}
    if cost_limit is not None:
        limited_terms |= _limit_costs(terms, weights, cost_limit)
    return limited_terms, _weighted_sum(limited_terms, weights, weights)


def _raise_mismatch(terms: Mapping, weights: Mapping) -> None:
    """Raise the error of a weight without a term, or of a term without a weight."""
    for name in weights:
        checks.name(name, terms, "term of weights")
    unknown_term = next(name for name in terms if name not in weights)
    hint = checks.hint(unknown_term, weights)
    raise ValueError(f"term {checks.preview(unknown_term)} has no weight{hint} {checks.list_choices(weights)}")


def _limit_costs(terms: Mapping, weights: Mapping, limit) -> dict:
    """Return the costs, scaled down together so that their weighted sum s becomes s / sqrt(1 + (s / limit)^2).

    Small costs hardly change, and a larger sum stays larger. Random actions have the largest costs; with the limit, a
    learner that explores is rewarded for staying alive.
    """
    environments_differ = any(isinstance(weight, np.ndarray) for weight in weights.values())
    if environments_differ:
        return _limit_costs_by_environment(terms, weights, limit)
    cost_names = [name for name, weight in weights.items() if weight < 0.0]
    if not cost_names:
        return {}
    ratio = _weighted_sum(terms, weights, cost_names) / limit
    scale = 1.0 / ratio.__array_namespace__().sqrt(1.0 + ratio * ratio)
    return {name: terms[name] * scale for name in cost_names}


def _limit_costs_by_environment(terms: Mapping, weights: Mapping, limit) -> dict:
    """Return the limited costs of environments with different weights; a term may be a cost in some of them."""
    cost_weights = {name: np.minimum(weight, 0.0) for name, weight in weights.items() if np.any(np.less(weight, 0.0))}
    if not cost_weights:
        return {}
    ratio = _weighted_sum(terms, cost_weights, cost_weights) / limit
    scale = 1.0 / np.sqrt(1.0 + ratio * ratio)
    return {name: terms[name] * np.where(weight < 0.0, scale, 1.0) for name, weight in cost_weights.items()}


def _weighted_sum(terms: Mapping, weights: Mapping, names: Iterable[str]):
    total = 0
    for name in names:
        total = total + weights[name] * terms[name]
    return total


def greatest(weights: Mapping) -> float:
    """Return the highest reward of a step: bonuses, whose weights are positive, are at most 1, costs at least 0."""
    return sum(weight for weight in weights.values() if weight > 0.0)
