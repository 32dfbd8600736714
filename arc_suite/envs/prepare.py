"""Prepares tasks: a body, an arena and their compiled model, for any driver."""

import math
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from arc_suite import checks, registry
from arc_suite.models.sizing import SUBSTEPS
from arc_suite.simulation.model import compiled
from arc_suite.tasks import modified, modifiers
from arc_suite.tasks.contract import CHANGEABLE, STEPS, Scene, Task
from arc_suite.tasks.mirrors import Symmetry
from arc_suite.tasks.readings import layout

_NOT_REAL = "cOSUMmT"  # kinds of arrays that NumPy would make floats of: complex, objects, text, dates


def prepared(domain_name, task_name: str, task_kwargs: Mapping[str, Any] | None = None) -> tuple[Task, mujoco.MjModel]:
    """Return a task, and the model of its simulation.

    Args:
        domain_name: a body; see `registry.body_of`.
        task_name: see `registry.task_of`.
        task_kwargs: settings of the task, and for every task `time_limit` (s, may be infinite; 1000
            control steps by default), `arena` (a name, or an `Arena`) and those of `tasks.modifiers`.

    Raises:
        ValueError: an unknown name, or a value that does not fit; one line that names it.
        OSError: a file that cannot be read.
    """
    body, kind = registry.body_of(domain_name), registry.task_of(task_name)
    settings = dict(checks.mapping("task_kwargs", task_kwargs))
    time_limit, arena = settings.pop("time_limit", None), settings.pop("arena", None)
    if arena is not None and kind.own_arena:
        raise ValueError(f"arena: task {kind.name} has a ground of its own, expected none")
    changes = {**kind.modifiers, **{name: settings.pop(name) for name in modifiers.NAMES if name in settings}}
    settings = kind.fitted(body, settings)
    arena = kind.arena(body, settings) if arena is None else registry.arena_of(arena, body)
    model = compiled(body, arena)
    step = SUBSTEPS * model.opt.timestep
    scene = Scene(
        body=body,
        arena=arena,
        layout=layout(model, body.joint_names, body.part_names, body.foot_names),
        standing=model.qpos0.copy(),
        control_timestep=step,
        model={name: getattr(model, name).copy() for name in CHANGEABLE},
    )
    task = kind(scene, settings, _step_limit(time_limit, step))
    return modified.modified(task, changes) if changes else task, model


def symmetry(domain_name, task_name: str, task_kwargs: Mapping[str, Any] | None = None) -> Symmetry:
    """Return the exact left-right symmetry of a task's observations and actions.

    `symmetry(...).observation` maps observation vectors (..., size), `.action` actions (..., joints); see
    `tasks.contract.Task.symmetry`.

    Args:
        domain_name: as in `load`.
        task_name: as in `load`.
        task_kwargs: as in `load`.

    Raises:
        ValueError: the body, the gait or the task is not symmetric, or see `load`; one line.
        OSError: a file that cannot be read.
    """
    return prepared(domain_name, task_name, task_kwargs)[0].symmetry


def _step_limit(time_limit, step: float) -> float:
    """Control steps that fill a time limit, s; a step that rounding alone would add is not taken."""
    if time_limit is None:
        return STEPS
    if time_limit == math.inf:
        return math.inf
    return max(1, math.ceil(checks.number("time_limit", time_limit, 1e-9) / step - 1e-6))


def checked_action(action, shape: tuple[int, ...]) -> np.ndarray:
    """Return the action as float64, clipped to [-1, 1].

    Args:
        action: of the shape.
        shape: (..., motors)

    Raises:
        ValueError: another shape, not numbers, or NaN; one line that names the index.
    """
    array = _real(action)
    if array is None:
        numbers, kind = " x ".join(map(str, shape)), type(action).__name__
        kind += f" of {action.dtype}" if isinstance(action, np.ndarray) else ""
        raise ValueError(f"action: expected {numbers} numbers, got {kind}")
    if array.shape != shape:
        raise ValueError(f"action: expected shape {shape}, got {array.shape}")
    invalid = np.isnan(array)
    if np.count_nonzero(invalid):
        index = np.argwhere(invalid)[0]
        raise ValueError(f"action[{', '.join(map(str, index))}]: expected a number from -1 to 1, got nan")
    return array.clip(-1.0, 1.0)


def checked_command(task: Task, name: str, value, rows: tuple[int, ...] = ()) -> np.ndarray:
    """Return the value of a live command as floats, (*rows, size); None stands for what the task itself would do.

    Raises:
        ValueError: the task has no such command, or the value has another size; one line.
    """
    if not task.commands:
        raise ValueError(f"command {name!r}: task {task.name} has no commands")
    size = task.commands[checks.name(name, task.commands, "command")]
    numbers = np.full(size, np.nan) if value is None else _real(value)
    if numbers is None or numbers.shape not in ((size,), (*rows, size)) or np.isinf(numbers).any():
        raise ValueError(f"command {name!r}: expected {size} finite numbers, got {value!r}")
    return np.broadcast_to(numbers, (*rows, size)).copy()


def _real(value) -> np.ndarray | None:
    """The value as floats; None where it holds anything but real numbers, or hides some of them."""
    try:
        array = np.asarray(value)
        if array.dtype.kind in _NOT_REAL or (array is not value and isinstance(value, np.ma.MaskedArray)):
            return None
        return array.astype(float, copy=False)
    except (TypeError, ValueError, OverflowError):
        return None
