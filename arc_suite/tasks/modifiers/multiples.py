"""Multiples of fields of a model: numbers that a user has set, divided by the numbers of the compiled model."""

from collections.abc import Mapping
from typing import Any

from arc_suite.tasks.scene import Scene


def find_multiples(scene: Scene, fields: Mapping[str, Any], name: str, part: Any):
    """Return the multiples (n,) of a field, 1 where the compiled number is 0; None for a field that is not changed.

    Args:
        scene: scene of the task.
        fields: the fields that a user has set, by name.
        name: name of the field.
        part: index of the numbers of the field whose multiples are returned.
    """
    if name not in fields:
        return None
    compiled = scene.model[name][part]
    changed = fields[name][part]
    is_zero = compiled == 0.0
    # Booleans count as 0 and 1: where the compiled number is 0, the multiple is 1 / 1.
    return (changed * ~is_zero + is_zero) / (compiled + is_zero)
