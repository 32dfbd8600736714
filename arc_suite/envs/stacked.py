"""One task for a batch of different bodies or settings: values that differ get a leading axis.

The functions of a task stay as they are, as its arrays may have any leading axes. Bodies of one batch have
the same legs, joints and parts; see `kind`.
"""

import dataclasses
import sys
from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np

from arc_suite.envs import trees
from arc_suite.tasks.clock import Clock, Clocks
from arc_suite.tasks.contract import Task
from arc_suite.tasks.readings import Layout

# Names of settings that tasks compare with (..., legs) values: stacked, they need an axis of 1 for the legs.
_COMPARED_WITH_FEET = ("stance_threshold",)


def kind(task: Task) -> Hashable | None:
    """Return a key that is equal for tasks which can be stacked; None for a task that cannot be stacked."""
    unwrapped = task.unwrapped
    for level in (task, unwrapped):
        if not vars(type(level)).get("from_body"):  # the class must declare it itself; inheriting it is not enough
            return None
    return (
        type(task),
        type(unwrapped),
        _write_layout(task.scene.layout),
        task.scene.substeps,
        task.scene.arena,
        tuple(task.settings.weights),
        task.structure,
    )


def _write_layout(layout: Layout) -> str:
    """Return the text of a layout with all digits of its arrays, so that equal texts are equal layouts."""
    with np.printoptions(floatmode="unique", threshold=sys.maxsize):
        return repr(layout)


def stack_tasks(tasks: Sequence[Task]) -> Task:
    """Return one task for a batch whose environment i does the i-th task.

    It is for the functions that drivers call in steps and resets. Drivers call `start`, `stream_state` and `markers`
    of the single tasks, as these have no leading axes.

    Args:
        tasks: tasks of one `kind`.
    """
    values = {}
    for name in _stacked_names(tasks[0]):
        values[name] = _stack_values([_value(task, name) for task in tasks])
    return _replace_values(tasks[0], values)


def _stacked_names(task: Task) -> tuple[str, ...]:
    """Return the names of the values that can differ between tasks of one kind."""
    if task.unwrapped is task:
        return ("settings", "step_limit", "standing", "control_timestep", *task.from_body)
    return ("task", *task.from_body)  # a wrapper: the task in it is stacked as a value


def _value(task: Task, name: str) -> Any:
    """Return a value of a task, or of its scene."""
    if name in task.scene._fields:
        return getattr(task.scene, name)
    return getattr(task, name)


def _replace_values(task: Task, values: dict[str, Any]) -> Task:
    """Return a task with other values by name: of its fields, of its scene, and of its cached properties."""
    task_fields = {field.name for field in dataclasses.fields(task)}
    changes = {name: value for name, value in values.items() if name in task_fields}
    if "scene" in task_fields:
        scene_changes = {name: value for name, value in values.items() if name in task.scene._fields}
        changes["scene"] = task.scene._replace(**scene_changes)
    stacked_task = dataclasses.replace(task, **changes)
    # A cached property lies in the instance's dictionary; it would otherwise be computed from a single body.
    for name in task.from_body:
        stacked_task.__dict__[name] = values[name]
    return stacked_task


def _stack_values(values: Sequence[Any], name: str = "") -> Any:
    """Return the values of all tasks as one value; arrays and numbers that differ get a leading axis.

    Args:
        values: values of each task, of one type.
        name: name of the value, if it is a field of a NamedTuple.
    """
    first = values[0]
    if isinstance(first, Task):
        return stack_tasks(values)
    if isinstance(first, Clock):
        return first if all(value is first for value in values) else Clocks.of(values)
    if isinstance(first, dict):
        return {key: _stack_values([value[key] for value in values]) for key in first}
    if isinstance(first, tuple):
        field_names = getattr(first, "_fields", ("",) * len(first))  # a plain tuple has none
        columns = zip(*values, strict=True)  # the values of each field
        items = [_stack_values(column, field) for field, column in zip(field_names, columns, strict=True)]
        return trees.rebuild(first, items)
    if isinstance(first, (np.ndarray, float, int)):
        if all(np.array_equal(value, first) for value in values):
            return first
        array = np.stack(values)
        return array[:, None] if name in _COMPARED_WITH_FEET else array
    return first
