"""Prepares tasks: a body, an arena and their compiled model, for any driver."""

import json
import math
from collections.abc import Mapping
from typing import Any

import mujoco

from arc_suite import checks, registry
from arc_suite.models.sizing import simulation
from arc_suite.models.standing import stood
from arc_suite.simulation.model import compiled
from arc_suite.tasks import modified_task, parameters
from arc_suite.tasks.contract import STEPS, Task
from arc_suite.tasks.mirrors import Symmetry
from arc_suite.tasks.readings import layout
from arc_suite.tasks.scene import CHANGEABLE, Scene


def prepare_task(
    domain_name, task_name: str, task_kwargs: Mapping[str, Any] | None = None
) -> tuple[Task, mujoco.MjModel]:
    """Return a task, and the model of its simulation.

    Args:
        domain_name: a body; see `registry.body_of`.
        task_name: see `registry.task_of`.
        task_kwargs: settings of the task, and for every task `time_limit` (s, may be infinite; 1000
            control steps by default), `arena` (a name, or an `Arena`) and those of `tasks.modifiers`.

    Raises:
        ValueError: an unknown name, or a value that does not fit.
        OSError: a file that cannot be read.
    """
    body, kind = registry.body_of(domain_name), registry.task_of(task_name)
    settings = dict(checks.mapping("task_kwargs", task_kwargs))
    time_limit, arena = settings.pop("time_limit", None), settings.pop("arena", None)
    if arena is not None and kind.own_arena:
        raise ValueError(f"arena: task {kind.name} has a ground of its own, expected none")
    changes = kind.modifiers | _take_modifiers(settings)
    settings = kind.settings_for(body, settings)
    arena = kind.arena(body, settings) if arena is None else registry.arena_of(arena, body)
    model = compiled(body, arena)
    substeps = simulation(body).substeps
    step = substeps * model.opt.timestep
    scene = Scene(
        body=body,
        arena=arena,
        layout=layout(model, body),
        standing=stood(model),
        control_timestep=step,
        substeps=substeps,
        model={name: getattr(model, name).copy() for name in CHANGEABLE},
    )
    task = kind(scene, settings, _step_limit(time_limit, step))
    return modified_task.add_modifiers(task, changes) if changes else task, model


def _take_modifiers(settings: dict[str, Any]) -> dict[str, Any]:
    """Remove the settings of modifiers from others, and return them by name."""
    names = {name: registry.modifier_setting(name) for name in settings}
    return {setting: settings.pop(name) for name, setting in names.items() if setting is not None}


# What an environment keeps from its opening on, and what to do instead.
_KEPT = {
    "arena": "open another environment",
    "time_limit": "open another environment",
    "random": "reset(seed=...) begins a stream",
    "on_divergence": "open another environment",
}

_KEPT_OF_TASKS = {
    "motors, senses or kicks": lambda task: (type(task), task.structure),
    "ground": lambda task: task.scene.arena,
    "observation": lambda task: task.sizes,
}


def checked_changes(task: Task, settings: Mapping[str, Any], before: str, changes: Any) -> tuple[str, Task]:
    """Return changed settings as JSON, and the task with them, for the simulation of a task.

    Args:
        task: as the environment was opened.
        settings: with which it was.
        before: JSON of the settings that have been changed already.
        changes: further settings by name.

    Raises:
        ValueError: an unknown name, a value that does not fit, or a setting that changes more than numbers of the task.
    """
    text = checks.json_text("settings", {**json.loads(before), **checks.mapping("settings", changes)})
    return text, with_changes(task, settings, text)


def with_changes(task: Task, settings: Mapping[str, Any], text: str) -> Task:
    """Return a task with changed settings, JSON of `checked_changes`.

    Raises:
        ValueError: as `checked_changes`.
    """
    changes = checks.mapping("settings", json.loads(text))
    registry.check_stored_settings(changes)  # a snapshot may have come from a file
    for name in changes.keys() & _KEPT.keys():
        raise ValueError(f"setting {name!r}: environments keep it; {_KEPT[name]}")
    if not changes:
        return task
    changed, _ = prepare_task(task.scene.body, task.name, {**settings, **changes})
    for what, kept in _KEPT_OF_TASKS.items():
        if kept(task) != kept(changed):
            raise ValueError(
                f"settings {', '.join(map(repr, changes))}: they would change the {what}, which environments keep; "
                "open another environment with them"
            )
    return changed


def checked_limit(max_episode_steps: Any, task: Task) -> int:
    """Return the step at which Gymnasium truncates episodes, if the task goes on until then.

    Raises:
        ValueError: no integer from 1, or more steps than an episode has and than every id has by default.
    """
    limit = checks.integer("max_episode_steps", max_episode_steps, 1)
    if limit > max(STEPS, task.step_limit):
        seconds = limit * task.scene.control_timestep
        raise ValueError(
            f"max_episode_steps: episodes of this task end after {task.step_limit} steps, got {limit}; "
            f"longer ones need task_kwargs={{'time_limit': {seconds:g}}}, too"
        )
    return limit


def symmetry(domain_name, task_name: str, task_kwargs: Mapping[str, Any] | None = None) -> Symmetry:
    """Return the exact left-right symmetry of a task's observations and actions.

    `symmetry(...).observation` maps observation vectors (..., size), `.action` actions (..., joints); see
    `tasks.contract.Task.symmetry`.

    Args:
        domain_name: as in `load`.
        task_name: as in `load`.
        task_kwargs: as in `load`.

    Raises:
        ValueError: the body, the gait or the task is not symmetric, or see `load`.
        OSError: a file that cannot be read.
    """
    return prepare_task(domain_name, task_name, task_kwargs)[0].symmetry


def _step_limit(time_limit, step: float) -> float:
    """Control steps that fill a time limit, s; a step that rounding alone would add is not taken."""
    if time_limit is None:
        return STEPS
    if time_limit == math.inf:
        return math.inf
    return max(1, math.ceil(parameters.positive("time_limit", time_limit) / step - 1e-6))
