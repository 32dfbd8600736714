"""Settings of tasks as tables: defaults, bounds and meanings."""

from collections.abc import Mapping
from typing import Any

from arc_suite.arenas import ARENAS, terrain
from arc_suite.envs.setup import Setup
from arc_suite.learning.studies.text_tables import table
from arc_suite.robots import ROBOTS, gaits
from arc_suite.tasks import modifiers, parameters, walk
from arc_suite.tasks.command import Schedule
from arc_suite.tasks.contract import STEPS, Task
from arc_suite.tasks.gait_and_pose import GaitAndPose
from arc_suite.tasks.ground import LEVELS, Lanes, Level
from arc_suite.tasks.modifiers import SUITE_MODIFIERS
from arc_suite.tasks.parameters import Noise, Parameters
from website import markdown

HEADS = ("setting", "default", "bounds", "meaning")

# Settings without a field of their own.
_MEANINGS = {
    "gait": f"a gait by name, in place of duty_factor and phase_offsets: {', '.join(gaits.NAMES)}",
    "base_noise": f"one number for {', '.join(parameters.SHARED_NOISE['base_noise'])}",
    "joint_noise": f"one number for {', '.join(parameters.SHARED_NOISE['joint_noise'])}",
    "cost_limit": "bound of the weighted sum of the costs of a step",
    "time_limit": f"of an episode, s; {STEPS} control steps without it",
    "arena": f"another ground: {', '.join(ARENAS)}",
    "on_divergence": "raise, or terminate: what a step does whose physics diverges; terminate in vector environments",
    "random": "seed of the episodes, for `load`; Gymnasium takes it in `reset`",
}
MEANINGS = {
    **{
        name: text
        for kind in (Parameters, Noise, walk.WalkSettings, Schedule, GaitAndPose, Level, Lanes)
        for name, text in markdown.fields(kind).items()
    },
    **{name: markdown.fields(kind)[name] for kind in SUITE_MODIFIERS for name in kind.defaults},
    **_MEANINGS,
}
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


def of_task(kind: type[Task]) -> str:
    """Return the table of the settings that a task has in addition to those of all tasks."""
    defaults = {robot: _defaults(Setup.of(robot, kind.name).definition) for robot in ROBOTS}
    return table(HEADS, ([f"`{name}`", *_cells(name, defaults)] for name in kind.names()))


def of_all_tasks() -> str:
    """Return the table of the settings that every task has."""
    defaults = {"": {name: default for kind in SUITE_MODIFIERS for name, default in kind.defaults.items()}}
    names = ("random", "time_limit", "arena", "on_divergence", *defaults[""])
    return table(HEADS, ([f"`{name}`", *_cells(name, defaults)] for name in names))


def _cells(name: str, defaults: Mapping[str, Mapping[str, Any]]) -> tuple[str, str, str]:
    values = {robot: markdown.number(each[name]) if name in each else "-" for robot, each in defaults.items()}
    same = len(set(values.values())) == 1
    default = next(iter(values.values())) if same else ", ".join(f"{robot} {value}" for robot, value in values.items())
    return default, bounds(name), MEANINGS[name]


def bounds(name: str) -> str:
    """Return the bounds of a setting as text; "-" where it is no number or has none."""
    low, high = _BOUNDS.get(name, (-parameters.LARGEST, parameters.LARGEST))
    if high >= parameters.LARGEST:
        return f"from {low:g}" if low > -parameters.LARGEST else "-"
    return f"{low:g} to {high:g}"


def _defaults(task: Task) -> dict[str, Any]:
    given = task.settings
    found = {**given.parameters._asdict(), **given.noise._asdict(), **given._asdict()}
    parts = (vars(found[name]) for name in ("ground", "command", "gait_and_pose") if found.get(name))
    return {**found, **{name: value for part in parts for name, value in part.items()}, "weights": "see Reward"}
