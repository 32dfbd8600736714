"""Domain randomization in the form of MuJoCo Playground: fields of the model that differ from world to world.

Modifiers draw for each episode, on the host, from streams of seeds. Here a trainer of another package gives keys of
JAX, and keeps what is drawn for all episodes. So the fields are shared with the modifiers, and the draws are not.
"""

from collections.abc import Callable

import jax

from arc_suite import checks
from arc_suite.tasks.modifiers.contacts import FRICTION_FIELDS

# Fields of the model that each range multiplies. Others would need constants that MuJoCo derives from them, as mass
# does: that is a setting of every task.
_FIELDS = {
    "friction": FRICTION_FIELDS,
    "motor_strength": ("actuator_gear",),
    "damping": ("dof_damping",),
}


def randomization_fn(**ranges: tuple[float, float]) -> Callable:
    """Return a `randomization_fn` for the wrappers and trainers of MuJoCo Playground.

    A world has the same multiples in all of its episodes. The settings `friction` and `mass` of a task draw others
    for each episode, and take the place of a field that both change.

    Args:
        **ranges: of multiples, which are drawn uniformly, by the names friction, motor_strength and damping.

    Returns:
        A function of an `mjx.Model` and keys (worlds,) that returns the model and the axes to map over.

    Raises:
        ValueError: another name, or no range.
    """
    spans = {checks.name(name, _FIELDS, "range"): checks.span(name, span, 0.0, 100.0) for name, span in ranges.items()}

    def randomize(model, rng):
        fields = {}
        for number, (name, (low, high)) in enumerate(spans.items()):

            def multiple(key, number=number, low=low, high=high):
                return jax.random.uniform(jax.random.fold_in(key, number), minval=low, maxval=high)

            multiples = jax.vmap(multiple)(rng)
            for field in _FIELDS[name]:
                fields[field] = jax.vmap(lambda factor, field=field: factor * getattr(model, field))(multiples)
        axes = jax.tree.map(lambda _: None, model).replace(**dict.fromkeys(fields, 0))
        return model.replace(**fields), axes

    return randomize
