"""Presets of a body, the law of each, and the preset that suits a task."""

from collections.abc import Mapping
from numbers import Real
from typing import Any

import numpy as np

from arc_suite import checks, registry, robots
from arc_suite.cpg.climbing import Climbing, ClimbingParameters
from arc_suite.cpg.leaping import Leaping, LeapingParameters
from arc_suite.cpg.limping import Limping, LimpingParameters
from arc_suite.cpg.planner import Planned, PlanningParameters
from arc_suite.cpg.prescribed import PrescribedLaw, Preset
from arc_suite.cpg.presets import (
    DEFAULTS,
    DEFAULTS_OF_FOUR_LEGS,
    DEFAULTS_OF_FOUR_LEGS_WITH_LOADED_SERVOS,
    DEFAULTS_OF_FOUR_LEGS_WITH_SERVOS,
    DEFAULTS_OF_FOUR_LEGS_WITH_WEAK_SERVOS,
    DEFAULTS_OF_SERVOS,
    DEFAULTS_OF_WIDE_LEGS_WITH_SERVOS,
    LARGE_LOAD,
    PRESETS,
    WEAK_TORQUE,
    WIDE_STANCE,
)
from arc_suite.cpg.rising import Rising, RisingParameters
from arc_suite.cpg.sighted import Sighted, SightedParameters
from arc_suite.cpg.stepping import Stepping, SteppingParameters
from arc_suite.cpg.straight import Straight, StraightParameters
from arc_suite.cpg.stride_law import StrideLaw
from arc_suite.cpg.tracked import Tracked, TrackingParameters
from arc_suite.models.standing import GRAVITY, PoseMechanics, measure_standing
from arc_suite.robots.spec import Body
from arc_suite.tasks.contract import Task

# By class of preset; `registration.register` adds those of other packages.
LAWS: dict[type, Any] = {
    Preset: PrescribedLaw,
    float: StrideLaw,
    SteppingParameters: Stepping,
    StraightParameters: Straight,
    ClimbingParameters: Climbing,
    SightedParameters: Sighted,
    LeapingParameters: Leaping,
    LimpingParameters: Limping,
    PlanningParameters: Planned,
    TrackingParameters: Tracked,
    RisingParameters: Rising,
}

_STRAIGHT_PRESETS = ("refined", "tuned", "straight", "medium")  # presets that walk straight ahead, the best first
# Presets in place of others whose state networks without memory cannot learn.
_MEMORYLESS = {
    "straight": "medium",
    "steered": "reactive",
    "posed": "reactive",
    "braced": "reactive",
    "limping": "reactive",
    "climbing": "surefooted",
    "crossing": "surefooted",
    "hiking": "surefooted",
}
_COMMAND_BLOCKS = ("command", "pose", "gait", "goal")  # blocks of the observation that show what a task commands


def law(task: Task, preset: Any, laws: Mapping[type, Any] = LAWS):
    """Return the law of a preset, fitted to a task; see `cpg.law`.

    Args:
        task: task to act in.
        preset: parameters of the law.
        laws: laws by class of preset.

    Raises:
        ValueError: the preset is of no class that has a law, or does not fit.
    """
    kind = law_class(preset, laws)
    return kind(task, preset)


def law_class(preset: Any, laws: Mapping[type, Any] = LAWS) -> Any:
    """Return the class of the law of a preset.

    Raises:
        ValueError: the preset is of no class that has a law.
    """
    preset_class = float if isinstance(preset, Real) else type(preset)
    if preset_class not in laws:
        expected = ", ".join(known_class.__name__ for known_class in laws)
        raise ValueError(f"preset: expected one of {expected}, got {preset_class.__name__}")
    return laws[preset_class]


def preset_of(body: Body, name: str) -> Any:
    """Return a body's preset by name.

    Args:
        body: body, whose own presets come first.
        name: name of `presets_of`, or `module:name` of a law of another package, whose module is imported.

    Raises:
        ValueError: an unknown name, or a body of a robot's name that has other joints.
    """
    if isinstance(name, str) and ":" in name:
        name = check_preset_name(name)
    presets = presets_of(body)
    return presets[checks.name(name, presets, "preset")]


def check_preset_name(name: str) -> str:
    """Return the name of a preset of any body, without the module of a law of another package, which is imported.

    Raises:
        ValueError: an unknown name.
    """
    if isinstance(name, str) and ":" in name:
        registry.find("law", name, {})
        return registry.bare_name(name)
    return checks.name(name, preset_names(), "preset")


def presets_of(body: Body) -> Mapping[str, Any]:
    """Return a body's presets by name: its own, the defaults of others, and those of laws of other packages.

    Raises:
        ValueError: a body of a robot's name that has other joints.
    """
    body_presets = robots.parameters(PRESETS, body, "presets") or {}
    defaults = {**_default_presets(body), **_registered_presets()}
    return body_presets | {name: preset for name, preset in defaults.items() if name not in body_presets}


def memoryless_preset(task: Task) -> str:
    """Return the preset that suits a task and its body, with an integral left out: networks without memory learn it.

    Raises:
        ValueError: as `suited_preset`.
    """
    name = suited_preset(task)
    return _MEMORYLESS.get(name, name)


def _registered_presets() -> dict[str, Any]:
    """Return the presets of laws of other packages by name."""
    return {name: law.preset for name, law in registry.ADDITIONS["law"].items()}


def _default_presets(body: Body) -> Mapping[str, Any]:
    """Return the presets that suit any body of its kind by name."""
    has_four_legs = len(body.legs) <= 4
    if not body.source:
        return DEFAULTS_OF_FOUR_LEGS if has_four_legs else DEFAULTS
    standing = measure_standing(body)
    if abs(standing.soles[:, 1]).mean() > WIDE_STANCE * standing.height:
        return DEFAULTS_OF_WIDE_LEGS_WITH_SERVOS
    return _default_presets_by_motors(body, standing) if has_four_legs else DEFAULTS_OF_SERVOS


def _default_presets_by_motors(body: Body, standing: PoseMechanics) -> Mapping[str, Any]:
    """Return the presets that suit any imported body with four legs, by what its motors give and carry."""
    torques = np.array([joint.torque for leg in body.legs for joint in leg.joints])
    if (abs(standing.loads) > LARGE_LOAD * torques).any():
        return DEFAULTS_OF_FOUR_LEGS_WITH_LOADED_SERVOS
    if np.median(torques) < WEAK_TORQUE * standing.mass * GRAVITY * standing.height:
        return DEFAULTS_OF_FOUR_LEGS_WITH_WEAK_SERVOS
    return DEFAULTS_OF_FOUR_LEGS_WITH_SERVOS


def preset_names() -> tuple[str, ...]:
    """Return the names of the presets of all robots and laws, including those of other packages."""
    tables = (*PRESETS.values(), DEFAULTS, DEFAULTS_OF_FOUR_LEGS_WITH_WEAK_SERVOS, _registered_presets())
    return tuple(dict.fromkeys(name for presets in tables for name in presets))


SUITE_PRESETS = frozenset(preset_names())  # before other packages add any


def suited_presets(task: Task) -> tuple[str, ...]:
    """Return the presets that suit a task and its body, the best first; empty where none does.

    First come the task's `demonstrators`, then `steered`, then those that walk straight ahead if the task prescribes
    a gait. Of these, the body must have the preset, and the task must observe the blocks of its law.

    Raises:
        ValueError: as `presets_of`.
    """
    presets = presets_of(task.scene.body)
    candidates = [*task.demonstrators, "steered"]
    if task.parameters is not None:
        candidates += _STRAIGHT_PRESETS
    suited_names = []
    for name in dict.fromkeys(candidates):
        if name in presets and _is_able(task, presets[name]):
            suited_names.append(name)
    return tuple(suited_names)


def obedient_presets(task: Task) -> tuple[str, ...]:
    """Return the presets of a task's body that obey all that the task commands, the one that suits it best first.

    Presets with the same parameters are one.

    Raises:
        ValueError: as `suited_preset`.
    """
    presets = presets_of(task.scene.body)
    default = suited_preset(task)
    name_of_parameters = {checks.full_repr(presets[default]): default}
    for name, preset in presets.items():
        if _is_able(task, preset) and not ignored_commands(task, law(task, preset)):
            name_of_parameters.setdefault(checks.full_repr(preset), name)
    return tuple(name_of_parameters.values())


def _is_able(task: Task, preset: Any) -> bool:
    """Return whether a task observes the blocks of a preset's law."""
    return set(law_class(preset).reads) <= task.blocks.keys()


def ignored_commands(task: Task, law) -> tuple[str, ...]:
    """Return the names of the blocks that show what a task commands and that a law, fitted to it, does not read."""
    return tuple(name for name in _COMMAND_BLOCKS if name in task.blocks and name not in law.reads)


def suited_preset(task: Task) -> str:
    """Return the first of the presets that suit a task and its body.

    Raises:
        ValueError: no preset suits the task, or as `presets_of`.
    """
    names = suited_presets(task)
    if names:
        return names[0]
    raise ValueError(
        f"task {task.name}: no demonstrator suits a task that observes no command and prescribes no gait; choose "
        f"another policy, such as zero, or a preset: {', '.join(presets_of(task.scene.body))}"
    )
