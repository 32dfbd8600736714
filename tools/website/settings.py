"""Settings of tasks as tables: defaults, bounds and meanings."""

from collections.abc import Mapping
from typing import Any

from arc_suite.arenas import ARENAS, terrain
from arc_suite.envs.setup import Setup
from arc_suite.learning.studies.text_tables import table
from arc_suite.robots import ROBOTS, gaits
from arc_suite.tasks import mimic, modifiers, parameters, recover, walk
from arc_suite.tasks.command import Schedule
from arc_suite.tasks.contract import STEPS, Task
from arc_suite.tasks.gait_and_pose import GaitAndPose
from arc_suite.tasks.ground import LEVELS, Lanes, Level
from arc_suite.tasks.modifiers import SUITE_MODIFIERS
from arc_suite.tasks.parameters import Noise, Parameters
from website import markdown

HEADS = ("setting", "default", "bounds", "meaning")

# Meanings of settings that are no field of a class below.
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


def _collect_meanings() -> dict[str, str]:
    """Return the meanings of all settings by name, from the docstrings of the classes that have them as fields."""
    meanings = {}
    for settings_class in (
        Parameters,
        Noise,
        walk.WalkSettings,
        mimic.MimicSettings,
        recover.RecoverSettings,
        Schedule,
        GaitAndPose,
        Level,
        Lanes,
    ):
        meanings |= markdown.attribute_meanings(settings_class)
    for modifier in SUITE_MODIFIERS:
        modifier_meanings = markdown.attribute_meanings(modifier)
        for name in modifier.defaults:
            meanings[name] = modifier_meanings[name]
    return meanings | _MEANINGS_WITHOUT_FIELD


MEANINGS = _collect_meanings()

# Lowest and highest values of settings by name.
_BOUNDS = {
    **parameters.BOUNDS,
    **modifiers.bounds(),
    **terrain.SIZES,
    "poses": (0.0, 1.0),
    "difficulty": (0.0, 1.0),
    "level": (0, LEVELS - 1),
    "terrain_seed": (0, 2**32 - 1),
    "cost_limit": (0.0, parameters.LARGEST),
    "velocity_band": (0.0, parameters.LARGEST),
}  # fmt: skip


def table_of_task(task_class: type[Task]) -> str:
    """Return the table of the settings that a task has in addition to those of all tasks."""
    defaults = {robot: _defaults(Setup.of(robot, task_class.name).definition) for robot in ROBOTS}
    return table(HEADS, [_cells(name, defaults) for name in task_class.names()])


def table_of_all_tasks() -> str:
    """Return the table of the settings that every task has."""
    defaults = {}
    for modifier in SUITE_MODIFIERS:
        defaults |= modifier.defaults
    names = ("random", "time_limit", "arena", "on_divergence", *defaults)
    return table(HEADS, [_cells(name, {"all robots": defaults}) for name in names])


def _cells(name: str, defaults: Mapping[str, Mapping[str, Any]]) -> tuple[str, str, str, str]:
    """Return the cells of a setting's line, given the defaults of each robot by the settings' names."""
    texts = {}  # the default by robot
    for robot, robot_defaults in defaults.items():
        texts[robot] = markdown.format_value(robot_defaults[name]) if name in robot_defaults else "-"
    if len(set(texts.values())) == 1:
        default = next(iter(texts.values()))
    else:
        default = ", ".join(f"{robot} {text}" for robot, text in texts.items())
    return f"`{name}`", default, bounds(name), MEANINGS[name]


def bounds(name: str) -> str:
    """Return the bounds of a setting as text; "-" if it has none, or is no number."""
    low, high = _BOUNDS.get(name, (-parameters.LARGEST, parameters.LARGEST))
    if high < parameters.LARGEST:
        return f"{low:g} to {high:g}"
    return f"from {low:g}" if low > -parameters.LARGEST else "-"


def _defaults(task: Task) -> dict[str, Any]:
    """Return the default values of a task's settings by name."""
    settings = task.settings
    defaults = dict(settings._asdict())
    for numbers in (defaults.get("parameters"), defaults.get("noise")):
        if numbers:
            defaults |= numbers._asdict()
    for part_name in ("ground", "command", "gait_and_pose"):
        part = settings._asdict().get(part_name)
        if part:
            defaults |= vars(part)
    defaults |= {"weights": "see Reward", "motion": "walk"}
    return defaults
