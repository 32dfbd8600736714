"""Multiples of fields of a model: what users have set, as shares of what was compiled."""

from collections.abc import Mapping
from typing import Any

from arc_suite.tasks.scene import Scene


def find_multiples(scene: Scene, fields: Mapping[str, Any], name: str, part: Any):
    """Return a changed field's numbers by those as compiled (n,), 1 where these are 0; None for a field as compiled.

    Args:
        scene: of the task.
        fields: changed fields by name.
        name: of the field.
        part: index of the numbers that count.
    """
    if name not in fields:
        return None
    compiled = scene.model[name][part]
    is_zero = compiled == 0.0
    return (fields[name][part] * ~is_zero + is_zero) / (compiled + is_zero)
