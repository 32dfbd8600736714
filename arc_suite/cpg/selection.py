"""Presets of a body, the law of each, and the preset that suits a task."""

from collections.abc import Mapping
from numbers import Real
from typing import Any

from arc_suite import checks, registry, robots
from arc_suite.cpg.balancing import Balanced, BalancingParameters
from arc_suite.cpg.leaping import Leaping, LeapingParameters
from arc_suite.cpg.planner import Planned, PlanningParameters
from arc_suite.cpg.prescribed import PrescribedLaw, Preset
from arc_suite.cpg.presets import BALANCING, DEFAULTS, DEFAULTS_OF_SERVOS, PRESETS
from arc_suite.cpg.sighted import Sighted, SightedParameters
from arc_suite.cpg.steering import Steered, SteeringParameters
from arc_suite.cpg.stepping import Directed, observes_gait_and_pose
from arc_suite.cpg.stride_law import StrideLaw
from arc_suite.robots.spec import Body
from arc_suite.tasks.contract import Task

# By class of preset; `registration.register` adds those of other packages.
LAWS: dict[type, Any] = {
    Preset: PrescribedLaw,
    float: StrideLaw,
    SteeringParameters: Steered,
    SightedParameters: Sighted,
    LeapingParameters: Leaping,
    BalancingParameters: Balanced,
    PlanningParameters: Planned,
}

# In place of these in a task whose pose and gait are by command.
_DIRECTED = {Steered: Directed}

_MOST_UNSTEADY = 5  # legs with which a body steps for its balance
_AHEAD = ("refined", "tuned", "medium")  # presets that walk straight ahead, the best first


def law(task: Task, preset: Any, laws: Mapping[type, Any] = LAWS):
    """Return the law of a preset, fitted to a task; see `cpg.law`.

    Args:
        task: to act in.
        preset: parameters of the law.
        laws: by class of preset.

    Raises:
        ValueError: the preset is of no class that has a law, or does not fit.
    """
    kind = law_class(preset, laws)
    return (_DIRECTED.get(kind, kind) if observes_gait_and_pose(task) else kind)(task, preset)


def law_class(preset: Any, laws: Mapping[type, Any] = LAWS) -> Any:
    """Return the class of the law that a preset has parameters of.

    Raises:
        ValueError: the preset is of no class that has a law.
    """
    kind = float if isinstance(preset, Real) else type(preset)
    if kind not in laws:
        kinds = ", ".join(each.__name__ for each in laws)
        raise ValueError(f"preset: expected one of {kinds}, got {kind.__name__}")
    return laws[kind]


def preset_of(body: Body, name: str) -> Any:
    """Return a body's preset of a name.

    Args:
        body: whose preset of the name comes first.
        name: see `presets_of`; or `module:name` of a law of another package, whose module is imported.

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
    own = robots.parameters(PRESETS, body, "presets") or {}
    defaults = {**_defaults(body), **_presets_of_added_laws()}
    return own | {name: preset for name, preset in defaults.items() if name not in own}


def _presets_of_added_laws() -> dict[str, Any]:
    return {name: law.preset for name, law in registry.ADDITIONS["law"].items()}


def _defaults(body: Body) -> Mapping[str, Any]:
    if not body.source:
        return DEFAULTS
    return DEFAULTS_OF_SERVOS if len(body.legs) > _MOST_UNSTEADY else DEFAULTS_OF_SERVOS | BALANCING


def preset_names() -> tuple[str, ...]:
    """Return the names of the presets of all robots and laws, those of other packages included."""
    tables = (*PRESETS.values(), DEFAULTS, _presets_of_added_laws())
    return tuple(dict.fromkeys(name for presets in tables for name in presets))


SUITE_PRESETS = frozenset(preset_names())  # before other packages add any


def suited_presets(task: Task) -> tuple[str, ...]:
    """Return the presets that suit a task and its body, the best first; empty where none does.

    They are those of the task's `demonstrators` that the body has and whose blocks the task observes; then
    `steered`; then, where the task prescribes a walk, those that walk straight ahead.

    Raises:
        ValueError: as `presets_of`.
    """
    presets = presets_of(task.scene.body)
    names = dict.fromkeys((*task.demonstrators, "steered", *(() if task.parameters is None else _AHEAD)))
    return tuple(n for n in names if n in presets and set(law_class(presets[n]).reads) <= task.blocks.keys())


def suited_preset(task: Task) -> str:
    """Return the first of the presets that suit a task and its body.

    Raises:
        ValueError: no preset suits the task, or as `presets_of`.
    """
    if names := suited_presets(task):
        return names[0]
    raise ValueError(
        f"task {task.name}: no demonstrator suits a task that observes no command and prescribes no gait; choose "
        f"another policy, such as zero, or a preset: {', '.join(presets_of(task.scene.body))}"
    )
