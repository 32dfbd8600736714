"""Settings of tasks as texts: value, bounds and meaning of each."""

import inspect
import numbers
import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite.arenas import ARENAS, terrain
from arc_suite.robots import gaits
from arc_suite.tasks import parameters
from arc_suite.tasks.command_task import CommandTask
from arc_suite.tasks.contract import STEPS, Task
from arc_suite.tasks.ground import LEVELS
from arc_suite.tasks.modifiers import MODIFIERS, bounds

# An entry of a docstring's section `Attributes`: names with commas between, a colon, and a text of one or more lines.
_ATTRIBUTES_ENTRY = re.compile(r"^    (?P<names>\w+(?:, \w+)*): (?P<text>.*(?:\n {8,}.*)*)", re.MULTILINE)

# Fields of a task's settings that are values with settings of their own.
_PARTS = ("parameters", "noise", "ground", "command", "gait_and_pose")

# Meanings of settings that are no field of a documented class.
_MEANINGS_WITHOUT_FIELD = {
    "gait": f"a gait by name, in place of duty_factor and phase_offsets: {', '.join(gaits.NAMES)}",
    "base_noise": f"one number for {', '.join(parameters.SHARED_NOISE['base_noise'])}",
    "joint_noise": f"one number for {', '.join(parameters.SHARED_NOISE['joint_noise'])}",
    "motion": "motions to follow: walk, the path of a file .npz, or a list",
    "cost_limit": "bound of the weighted sum of the costs of a step",
    "time_limit": f"of an episode, s; {STEPS} control steps without it",
    "arena": f"another ground: {', '.join(ARENAS)}, or a file .png, .obj, .stl or .xml",
    "on_divergence": "raise, or truncate: what a step does whose physics diverges; truncate in vector environments",
    "random": "seed of the episodes, for `load`; Gymnasium takes it in `reset`",
}

# Lowest and highest values of settings by name; modifiers have their own.
_BOUNDS = {
    **parameters.BOUNDS,
    **terrain.SIZES,
    "poses": (0.0, 1.0),
    "difficulty": (0.0, 1.0),
    "level": (0, LEVELS - 1),
    "terrain_seed": (0, 2**32 - 1),
    "cost_limit": parameters.POSITIVE,
    "velocity_band": parameters.POSITIVE,
    "time_limit": parameters.POSITIVE,
    "fall_seed": (0, 2**32 - 1),
}
_UNBOUNDED = (-parameters.LARGEST, parameters.LARGEST)


class Setting(NamedTuple):
    """A setting as texts.

    Attributes:
        name: its name in `task_kwargs`.
        value: its value; "-" where it has none.
        bounds: its lowest and highest number, such as "0 to 1" or "above 0"; "-" where it has none, or is no number.
        meaning: what it is, with its unit.
    """

    name: str
    value: str
    bounds: str
    meaning: str


def own_settings(task: Task, task_kwargs: Mapping[str, Any] = {}) -> list[Setting]:
    """Return the settings that a task has in addition to those of all tasks, with the values of this task.

    They are those of the task's `names`, and the fields of its `settings` that hold numbers or texts.

    Args:
        task: the task.
        task_kwargs: settings with which it was made; for those that it does not keep, such as `gait`.
    """
    task = task.unwrapped
    values = {"motion": "walk"} | dict(task_kwargs) | _read_values(task)
    meanings = _read_meanings(task)
    names = list(task.names())
    for name, value in _fields(task.settings).items():
        if name not in (*names, *_PARTS) and _is_plain(value):
            names.append(name)
    limits = _BOUNDS | _bounds_of_task(task)
    return [_describe(name, values, meanings, limits) for name in names]


def shared_settings(task_kwargs: Mapping[str, Any] = {}) -> list[Setting]:
    """Return the settings that every task has: those without a modifier, then those of modifiers.

    Args:
        task_kwargs: values of some of them, in place of the defaults; other settings among them are ignored.
    """
    values: dict[str, Any] = {}
    for modifier in MODIFIERS.values():
        values |= modifier.defaults
    names = ["random", "time_limit", "arena", "on_divergence", *values]
    values |= task_kwargs
    meanings = modifier_meanings() | _MEANINGS_WITHOUT_FIELD
    limits = _BOUNDS | bounds()
    return [_describe(name, values, meanings, limits) for name in names]


def modifier_meanings() -> dict[str, str]:
    """Return the meanings of the settings of all modifiers by name."""
    meanings = {}
    for name, modifier in MODIFIERS.items():
        meanings[name] = attribute_meanings(modifier).get(name, "")
    return meanings


def format_bounds(low: float, high: float) -> str:
    """Return the lowest and the highest number of a setting as text; "-" if it has no bounds."""
    if (low, high) == parameters.POSITIVE:
        return "above 0"
    if high < parameters.LARGEST:
        return f"{low:g} to {high:g}"
    return f"from {low:g}" if low > -parameters.LARGEST else "-"


def format_value(value: Any) -> str:
    """Return the text of a value: a number, a text, None, or a collection of these.

    More than two equal numbers are written as one.
    """
    if isinstance(value, tuple | list | np.ndarray):
        values = np.asarray(value).tolist()
        if len(values) > 2 and all(item == values[0] for item in values):
            return format_value(values[0])
        return f"({', '.join(map(format_value, values))})"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {format_value(item)}" for name, item in value.items()) or "none"
    if value is None:
        return "none"
    if isinstance(value, bool | np.bool_):
        return str(bool(value)).lower()
    if isinstance(value, str):
        return {"None": "none", "True": "true", "False": "false"}.get(value, value)
    return f"{float(value):.4g}"


def attribute_meanings(documented: type) -> dict[str, str]:
    """Return the meanings of a class's attributes by name, from the sections `Attributes` of it and its bases."""
    meanings = {}
    for base in reversed(documented.__mro__):
        docstring = inspect.cleandoc(vars(base).get("__doc__") or "")  # Python may have dropped it
        _, _, section = docstring.partition("Attributes:\n")
        for entry in _ATTRIBUTES_ENTRY.finditer(section):
            for name in entry["names"].split(", "):
                meanings[name] = " ".join(entry["text"].split()).removesuffix(".")
    return meanings


def _is_plain(value: Any) -> bool:
    """Return whether a value is a number, a text, None, or a collection of these."""
    if isinstance(value, Mapping):
        return all(map(_is_plain, value.values()))
    if isinstance(value, tuple | list):
        return not hasattr(value, "_fields") and all(map(_is_plain, value))
    return value is None or isinstance(value, str | numbers.Number)


def _bounds_of_task(task: Task) -> dict[str, tuple[float, float]]:
    """Return the bounds that follow from a task and its body, by name of the setting."""
    _, highest_width = terrain.SIZES["width"]
    limits = {"width": (terrain.min_width(task.scene.body), highest_width)}
    if isinstance(task, CommandTask):  # commands give the direction
        _, highest_speed = parameters.BOUNDS["target_velocity"]
        limits["target_velocity"] = (parameters.MIN_SPEED, highest_speed)
    return limits


def _describe(
    name: str, values: Mapping[str, Any], meanings: Mapping[str, str], limits: Mapping[str, tuple[float, float]]
) -> Setting:
    value = format_value(values[name]) if name in values else "-"
    low, high = limits.get(name, _UNBOUNDED)
    return Setting(name, value, format_bounds(low, high), meanings.get(name, ""))


def _read_meanings(task: Task) -> dict[str, str]:
    """Return the meanings of a task's settings by name, from the docstrings of the classes that have them."""
    meanings = {}
    for part in _parts(task.settings):
        meanings |= attribute_meanings(type(part))
    return meanings | _MEANINGS_WITHOUT_FIELD


def _read_values(task: Task) -> dict[str, Any]:
    """Return the values of a task's settings by name."""
    values: dict[str, Any] = {}
    for part in _parts(task.settings):
        values |= _fields(part)
    return values


def _parts(settings: Any) -> Iterator[Any]:
    """Yield the settings of a task, then their parts, which prevail."""
    yield settings
    fields = _fields(settings)
    for name in _PARTS:
        part = fields.get(name)
        if part is not None:
            yield part


def _fields(value: Any) -> Mapping[str, Any]:
    """Return the fields of a NamedTuple or of an object by name."""
    return value._asdict() if hasattr(value, "_asdict") else vars(value)
