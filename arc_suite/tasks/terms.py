"""Terms of rewards, unweighted, and their weighted sum.

Arrays may carry any leading axes `...`: the same text serves one environment, a batch and JAX.
"""

from collections.abc import Mapping

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
    vertical, roll, pitch = (component(readings.velocities, i) for i in (2, 3, 4))
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


def limited(terms: Mapping, weights: Mapping, limit: float) -> dict:
    """Return the weighted terms, costs scaled down together so that their weighted sum stays below a limit.

    A sum s becomes s / sqrt(1 + (s / limit)^2): small costs count in full, and more always costs more. Random
    actions cost the most; within a limit it pays to stay alive while a learner explores.
    """
    costs = {name: weight for name, weight in weights.items() if weight < 0.0}
    if not costs:
        return {name: terms[name] for name in weights}
    excess = total(terms, costs) / limit
    share = 1.0 / excess.__array_namespace__().sqrt(1.0 + excess * excess)
    return {name: terms[name] * share if name in costs else terms[name] for name in weights}


def total(terms: Mapping, weights: Mapping):
    """Return the reward: the sum of the terms times their signed weights, in the order of the weights.

    Raises:
        ValueError: a weight of a term that there is not.
    """
    reward = 0
    for name, weight in weights.items():
        if name not in terms:
            checks.name(name, terms, "weight")
        reward = reward + weight * terms[name]
    return reward


def greatest(weights: Mapping) -> float:
    """Return the highest reward of a step: bonuses, whose weights are positive, are at most 1, costs at least 0."""
    return sum(weight for weight in weights.values() if weight > 0.0)
