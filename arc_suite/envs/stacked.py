"""One task for a batch of different bodies or settings: numbers that differ get a leading axis.

The functions of a task stay as they are, as its arrays may have any leading axes. Bodies of one batch have
the same legs, joints and parts; see `kind`.
"""

import dataclasses
from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from arc_suite.envs import trees
from arc_suite.tasks.clock import Clock, Clocks
from arc_suite.tasks.contract import Task

_AGAINST_FEET = ("stance_threshold",)  # numbers that are compared with those of every foot


def kind(task: Task) -> Hashable | None:
    """Return what tasks have in common that can be stacked; None for a task that cannot."""
    inner = task.unwrapped
    if not all(vars(type(each)).get("from_body") for each in (task, inner)):  # of the class itself
        return None
    scene = task.scene
    same = repr(scene.layout), scene.substeps, scene.arena
    return type(task), type(inner), *same, tuple(task.settings.weights), task.structure


def stack_tasks(tasks: Sequence[Task]) -> Task:
    """Return one task for a batch whose environment i does the i-th task.

    It is for the functions that drivers call in steps and resets. `start`, `stream_state` and `markers`, which have
    no leading axes, are those of each task.

    Args:
        tasks: of one kind.
    """
    return _with_values(tasks[0], {name: _stacked([_value(t, name) for t in tasks]) for name in _names(tasks[0])})


def _names(task: Task) -> tuple[str, ...]:
    own = ("settings", "step_limit", "standing", "control_timestep") if task.unwrapped is task else ("task",)
    return (*own, *task.from_body)


def _value(task: Task, name: str) -> Any:
    return getattr(task.scene if name in task.scene._fields else task, name)


def _with_values(task: Task, values: dict[str, Any]) -> Task:
    fields = {field.name for field in dataclasses.fields(task)}
    changed = {name: values[name] for name in values if name in fields}
    if "scene" in fields:
        scene = {name: value for name, value in values.items() if name in task.scene._fields}
        changed["scene"] = task.scene._replace(**scene)
    made = dataclasses.replace(task, **changed)
    # In the places of cached properties, which would follow from one body.
    made.__dict__.update({name: values[name] for name in task.from_body})
    return made


def _stacked(values: Sequence[Any], name: str = "") -> Any:
    first = values[0]
    if isinstance(first, Task):
        return stack_tasks(values)
    if isinstance(first, Clock):
        return first if all(value is first for value in values) else Clocks.of(values)
    if isinstance(first, dict):
        return {key: _stacked([value[key] for value in values]) for key in first}
    if isinstance(first, tuple):
        names = getattr(first, "_fields", ("",) * len(first))
        return trees.rebuild(first, [_stacked(items, field) for field, *items in zip(names, *values, strict=True)])
    if isinstance(first, (np.ndarray, float, int)):
        if all(np.array_equal(value, first) for value in values):
            return first
        numbers = np.stack(values)
        return numbers[:, None] if name in _AGAINST_FEET else numbers
    return first
