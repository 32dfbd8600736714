"""Terms of rewards, and the reward that follows from them.

Arrays may carry any leading axes `...`: the same text serves one environment, a batch and JAX.
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
        action: (..., joints) of the step.
        previous_action: (..., joints) of the step before.
        schedule_errors: (...) number of contact schedule errors.
        default_angles: (joints,) rad, from which the posture is measured.
    """
    # Products, since numpy's `x**2` rounds otherwise for scalars.
    velocities = readings.velocities
    vertical = component(velocities, 2)
    roll = component(velocities, 3)
    pitch = component(velocities, 4)
    return {
        "gait_cost": schedule_errors,
        "control": (action**2).sum(axis=-1),
        "smoothness": ((action - previous_action) ** 2).sum(axis=-1),
        "contact": (readings.contact_forces**2).sum(axis=-1),
        "angular_velocity": roll * roll + pitch * pitch,
        "vertical_velocity": vertical * vertical,
        "posture": ((readings.joint_angles - default_angles) ** 2).sum(axis=-1),
    }


def triangle(error, width):
    """Return the triangular kernel (...) of errors (...): 1 at 0, 0 at the half-width and beyond."""
    share = 1.0 - abs(error) / width
    return share.__array_namespace__().maximum(share, 0.0)


def reward(terms: Mapping, weights: Mapping, cost_limit=None) -> tuple[dict, Any]:
    """Return the terms with limited costs, and the reward (...): their sum, each times its signed weight.

    Every driver calls it after `Task.terms`. Terms are added up in the order of the weights.

    Args:
        terms: raw terms (...) by name.
        weights: the weight of each, or weights (...) of environments that have different ones.
        cost_limit: bound of the weighted sum of the costs, the terms whose weights are negative; None for no bound.

    Raises:
        ValueError: a weight of a term that there is not, or a term that has no weight.
    """
    if terms.keys() != weights.keys():
        _refuse(terms, weights)
    found = {name: terms[name] for name in weights}
    if cost_limit is not None:
        found |= _limited(terms, weights, cost_limit)
    return found, _total(found, weights, weights)


def _refuse(terms: Mapping, weights: Mapping) -> None:
    for name in weights:
        checks.name(name, terms, "weight")
    without = next(name for name in terms if name not in weights)
    near = checks.hint(without, weights)
    raise ValueError(f"term {checks.preview(without)} has no weight{near} (there are: {', '.join(weights)})")


def _limited(terms: Mapping, weights: Mapping, limit) -> dict:
    """Return the costs, scaled down together so that their weighted sum s becomes s / sqrt(1 + (s / limit)^2).

    Small costs count in full, and more always costs more. Random actions cost the most; within a limit it pays to
    stay alive while a learner explores.
    """
    if np.ndarray in map(type, weights.values()):
        return _limited_each(terms, weights, limit)
    costs = [name for name, weight in weights.items() if weight < 0.0]
    if not costs:
        return {}
    excess = _total(terms, weights, costs) / limit
    share = 1.0 / excess.__array_namespace__().sqrt(1.0 + excess * excess)
    return {name: terms[name] * share for name in costs}


def _limited_each(terms: Mapping, weights: Mapping, limit) -> dict:
    """Return the costs limited where environments have different weights, a term's of either sign."""
    parts = {name: np.minimum(weight, 0.0) for name, weight in weights.items() if np.any(np.less(weight, 0.0))}
    if not parts:
        return {}
    excess = _total(terms, parts, parts) / limit
    share = 1.0 / np.sqrt(1.0 + excess * excess)
    return {name: terms[name] * np.where(part < 0.0, share, 1.0) for name, part in parts.items()}


def _total(terms: Mapping, weights: Mapping, names: Iterable[str]):
    total = 0
    for name in names:
        total = total + weights[name] * terms[name]
    return total


def greatest(weights: Mapping) -> float:
    """Return the highest reward of a step: bonuses, whose weights are positive, are at most 1, costs at least 0."""
    return sum(weight for weight in weights.values() if weight > 0.0)
