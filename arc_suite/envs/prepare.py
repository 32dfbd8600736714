"""Preparation of tasks for environments: the task with its body and arena, and the compiled model of both."""

import copy
import inspect
import json
import math
import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import mujoco
import numpy as np

from arc_suite import checks, registry
from arc_suite.envs import gymnasium_arguments
from arc_suite.models.sizing import simulation
from arc_suite.models.standing import standing_qpos
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compile_model
from arc_suite.tasks import modified_task, parameters, readings
from arc_suite.tasks.contract import STEPS, Task
from arc_suite.tasks.mirrors import Symmetry
from arc_suite.tasks.scene import CHANGEABLE, Scene

_ROUNDING = 1e-6  # control steps, by which a time limit may exceed a number of steps without another one


def prepare_task(
    domain_name: str | os.PathLike[str] | Body, task_name: str, task_kwargs: Mapping[str, Any] | None = None
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
    body = registry.body_of(domain_name)
    task_class = registry.task_of(task_name)
    task_settings = dict(checks.mapping("task_kwargs", task_kwargs))
    time_limit = task_settings.pop("time_limit", None)
    chosen_arena = task_settings.pop("arena", None)
    if chosen_arena is not None and task_class.own_arena:
        raise ValueError(f"arena: task {task_class.name} has a ground of its own, expected none")
    modifier_settings = {**task_class.modifiers, **_take_modifier_settings(task_settings)}
    gymnasium_arguments.refuse_settings(task_settings, task_class)
    registry.refuse_settings_of_others(task_class, task_settings)
    settings = task_class.settings_for(body, task_settings)
    arena = task_class.arena(body, settings) if chosen_arena is None else registry.arena_of(chosen_arena, body)

    model = compile_model(body, arena)
    substeps = simulation(body).substeps
    control_timestep = substeps * model.opt.timestep
    layout = readings.layout(model, body)
    scene = Scene(
        body=body,
        arena=arena,
        layout=layout,
        standing=readings.torso_qpos(standing_qpos(model), layout),
        control_timestep=control_timestep,
        substeps=substeps,
        model={name: getattr(model, name).copy() for name in CHANGEABLE},
    )
    task = task_class(scene, settings, _step_limit(time_limit, control_timestep))
    if modifier_settings:
        task = modified_task.add_modifiers(task, modifier_settings)
    return task, model


def stored_settings(task: Task, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings with which a task was made, as an environment keeps them to make it again with changes.

    The caller may change its values and its files. So values are copied, and texts stand for files.
    """
    copied_settings = {name: copy.deepcopy(value) for name, value in settings.items() if name != "arena"}
    if "arena" in settings:
        copied_settings["arena"] = registry.arena_word(settings["arena"])
    for name, file_setting in task.unwrapped.file_settings.items():
        if name in copied_settings:
            copied_settings[name] = file_setting.embed(copied_settings[name])
    return copied_settings


# Argument that only some of the functions which open environments have -> hint for the others, in their errors.
_HINTS = {
    "num_envs": "gymnasium.make_vec makes several environments",
    "num_threads": "gymnasium.make_vec makes environments that threads simulate",
    "autoreset_mode": "gymnasium.make_vec makes environments that reset themselves",
    "bodies": "gymnasium.make_vec of arc_suite/bodies-<task>-v0 makes environments of different bodies",
    "flat": "gymnasium.make_vec of arc_suite/bodies-<task>-v0 has it; other observations of Gymnasium are flat",
    "environment_kwargs": "arc_suite.load has it; task.split names the blocks of Gymnasium's flat observations",
    "flat_observation": "arc_suite.load has it in environment_kwargs; observations of Gymnasium are flat",
    "max_episode_steps": "task_kwargs={'time_limit': seconds} limits episodes",
    "seed": "reset(seed=...) begins a stream",
    "render_mode": "physics.render of a dm_env draws a picture",
    "width": "physics.render of a dm_env draws a picture; the width of stairs is a setting in task_kwargs",
    "height": "physics.render of a dm_env draws a picture",
    "camera_id": "physics.render of a dm_env draws a picture",
    "visualize_reward": "arc_suite.load and gymnasium.make have it",
    "privileged": "task.privileged of a dm_env has the blocks",
    "robot": "the body is domain_name",
    "body": "the body is domain_name",
    "task": "the task is task_name",
}


def refuse_arguments(arguments: Mapping[str, Any], function: Callable, task_name: str | None = None) -> None:
    """Raise ValueError for arguments that a function does not have; the error names what takes the first one's place.

    Args:
        arguments: arguments that no parameter of the function takes, by name.
        function: function that opens an environment.
        task_name: task of the environment, one.
    """
    for name, value in arguments.items():
        cures = None
        if task_name is not None:
            cures = gymnasium_arguments.find_settings(name, value, registry.task_of(task_name))
        if cures:
            raise ValueError(f"argument {name!r}: write task_kwargs={checks.preview(cures)} in its place")
        valid_names = [key for key in inspect.signature(function).parameters if key not in ("self", "others")]
        raise ValueError(_explain_argument(name, value, valid_names))


def _explain_argument(name: str, value: Any, valid_names: Sequence[str]) -> str:
    """Return the error about an argument that a function with parameters of valid names does not have."""
    hints = gymnasium_arguments.HINTS | _HINTS
    if name in hints:
        return f"argument {name!r}: {hints[name]}"
    setting_names = registry.setting_names()
    if name in setting_names:
        setting = f"{{{name!r}: {checks.preview(value)}}}"
        return f"argument {name!r}: it is a setting of the task; write task_kwargs={setting}"
    meanings = checks.meanings(name)
    settings_meant = [word for word in meanings if word in setting_names and word not in hints]
    if settings_meant and not any(meaning in valid_names for meaning in meanings):
        setting = f"{{{settings_meant[0]!r}: {checks.preview(value)}}}"
        return f"unknown argument {name!r}; did you mean task_kwargs={setting}?"
    hint = checks.hint(name, [*valid_names, *setting_names])
    return f"unknown argument {name!r}{hint} (there are: {', '.join(valid_names)}; task_kwargs has the settings)"


def _take_modifier_settings(settings: dict[str, Any]) -> dict[str, Any]:
    """Remove the settings of modifiers from the settings of a task, and return them by their bare names."""
    modifier_settings = {}
    for name in list(settings):
        bare_name = registry.modifier_setting(name)
        if bare_name is not None:
            modifier_settings[bare_name] = settings.pop(name)
    return modifier_settings


def _step_limit(time_limit, control_timestep: float) -> float:
    """Return how many control steps fill a time limit, s: at least 1; without a limit `STEPS`."""
    if time_limit is None:
        return STEPS
    if isinstance(time_limit, float | np.floating) and time_limit == math.inf:
        return math.inf
    steps = parameters.positive("time_limit", time_limit) / control_timestep
    return max(1, math.ceil(steps - _ROUNDING))


# Setting that an environment never changes -> what to do in place of a change.
_CONSTANT_SETTINGS = {
    "arena": "open another environment",
    "time_limit": "open another environment",
    "random": "reset(seed=...) begins a stream",
    "on_divergence": "open another environment",
}

# Name in errors -> function that reads a property of a task which changes of settings must keep.
_CONSTANT_PROPERTIES = {
    "motors, senses or kicks": lambda task: (type(task), task.structure),
    "ground": lambda task: task.scene.arena,
    "observation": lambda task: task.sizes,
    "curriculum": lambda task: task.adapts,
}


def checked_changes(task: Task, settings: Mapping[str, Any], earlier_changes: str, changes: Any) -> tuple[str, Task]:
    """Return all changed settings of an environment as JSON, and the task with them.

    Args:
        task: the task with the settings with which the environment was opened.
        settings: these settings.
        earlier_changes: JSON of the settings that have been changed already.
        changes: further settings by name.

    Raises:
        ValueError: an unknown name, a value that does not fit, or a setting that would change modifiers, ground or
            observation.
    """
    all_changes = {**json.loads(earlier_changes), **checks.mapping("settings", changes)}
    text = checks.json_text("settings", all_changes)
    return text, with_changes(task, settings, text)


def with_changes(task: Task, settings: Mapping[str, Any], text: str) -> Task:
    """Return a task with changed settings.

    Args:
        task: as in `checked_changes`.
        settings: as in `checked_changes`.
        text: JSON of all changed settings.

    Raises:
        ValueError: as `checked_changes`.
    """
    changes = checks.mapping("settings", json.loads(text))
    registry.check_stored_settings(changes)  # a snapshot may have come from a file
    refused_names = sorted(changes.keys() & _CONSTANT_SETTINGS.keys())
    if refused_names:
        name = refused_names[0]
        raise ValueError(f"setting {name!r}: environments keep it; {_CONSTANT_SETTINGS[name]}")
    if not changes:
        return task
    changed_task, _ = prepare_task(task.scene.body, task.name, {**settings, **changes})
    for property_name, read_property in _CONSTANT_PROPERTIES.items():
        if read_property(task) != read_property(changed_task):
            raise ValueError(
                f"settings {', '.join(map(repr, changes))}: they would change the {property_name}, "
                "which environments keep; open another environment with them"
            )
    return changed_task


def checked_limit(max_episode_steps: Any, task: Task) -> int:
    """Return the control step at which Gymnasium truncates episodes.

    Args:
        max_episode_steps: any value, which is checked.
        task: task of the environment. Its episodes must last until that step; a limit up to 1000 is valid in any case,
            as it is the default of datasets.

    Raises:
        ValueError: no integer from 1, or a step after the end of the task's episodes.
    """
    limit = checks.integer("max_episode_steps", max_episode_steps, 1)
    if limit > max(STEPS, task.step_limit):
        seconds = limit * task.scene.control_timestep
        raise ValueError(
            f"max_episode_steps: episodes of this task end after {task.step_limit} steps, got {limit}; "
            f"longer ones need task_kwargs={{'time_limit': {seconds:g}}}, too"
        )
    return limit


def symmetry(
    domain_name: str | os.PathLike[str] | Body, task_name: str, task_kwargs: Mapping[str, Any] | None = None
) -> Symmetry:
    """Return the exact left-right symmetry of a task's observations and actions.

    `symmetry(...).observation` maps observation vectors (..., size), `.action` actions (..., joints); see
    `tasks.contract.Task.symmetry`.

    Args:
        domain_name: as in `load`.
        task_name: as in `load`.
        task_kwargs: as in `load`.

    Raises:
        ValueError: the body, the gait or the task is not symmetric, or as `load`.
        OSError: as `load`.
    """
    task, _ = prepare_task(domain_name, task_name, task_kwargs)
    return task.symmetry
