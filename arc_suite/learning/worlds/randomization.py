"""Domain randomization in the form of MuJoCo Playground: fields of the model that differ from world to world.

Modifiers of tasks draw for each episode, on the host, from streams of seeds. Here a trainer of another package gives
keys of JAX, and all episodes of a world have the same fields. The fields are those of the modifiers; the draws are not.
"""

from collections.abc import Callable

import jax
import numpy as np

from arc_suite import checks
from arc_suite.tasks.modifiers.contacts import FRICTION_FIELDS

# Fields of the model that each range multiplies. Other fields would need constants that MuJoCo derives from them, as
# mass does: mass is a setting of every task.
_FIELDS_OF_RANGE = {
    "friction": FRICTION_FIELDS,
    "motor_strength": ("actuator_gear",),
    "damping": ("dof_damping",),
}

_MAX_FACTOR = 100.0


def randomization_fn(**ranges: tuple[float, float]) -> Callable:
    """Return a `randomization_fn` for the wrappers and trainers of MuJoCo Playground.

    A world has the same factors in all of its episodes. The settings `friction` and `mass` of a task draw other values
    for each episode, which replace those of a field that both change.

    Args:
        **ranges: lowest and highest factor by name; names are friction, motor_strength and damping. Factors are drawn
            uniformly.

    Returns:
        A function of an `mjx.Model` and keys (worlds,). It returns the model, whose randomized fields have a leading
        axis (worlds,), and the axes to map over.

    Raises:
        ValueError: another name, or no range; the function raises it for motors whose torques fall with speed.
    """
    checked_ranges = {}
    for name, bounds in ranges.items():
        checks.name(name, _FIELDS_OF_RANGE, "range")
        checked_ranges[name] = checks.span(name, bounds, 0.0, _MAX_FACTOR)

    def randomize(model, rng):
        if "motor_strength" in checked_ranges and np.any(model.actuator_forcelimited):
            raise ValueError("motor_strength: expected motors whose torques do not fall with speed")
        fields = {}
        for number, (name, (low, high)) in enumerate(checked_ranges.items()):
            factors = _draw_factors(rng, number, low, high)
            for field in _FIELDS_OF_RANGE[name]:
                fields[field] = _scale_for_worlds(getattr(model, field), factors)
        axes = jax.tree.map(lambda _: None, model).replace(**dict.fromkeys(fields, 0))
        return model.replace(**fields), axes

    return randomize


def _draw_factors(keys, number: int, low: float, high: float):
    """Return uniform factors (worlds,) of the range with this number, from the keys (worlds,) of worlds."""

    def draw_factor(key):
        return jax.random.uniform(jax.random.fold_in(key, number), minval=low, maxval=high)

    return jax.vmap(draw_factor)(keys)


def _scale_for_worlds(array, factors):
    """Return an array (worlds, ...), the given one times the factor (worlds,) of each world."""
    return jax.vmap(lambda factor: factor * array)(factors)
