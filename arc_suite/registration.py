"""Parts of other packages: robots, tasks, laws, learners and others; and Gymnasium's ids for all robots and tasks."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import gymnasium

from arc_suite import checks, registry
from arc_suite.arenas import ARENAS
from arc_suite.cpg.law import Law
from arc_suite.cpg.presets import PRESETS
from arc_suite.cpg.selection import LAWS, SUITE_PRESETS, law
from arc_suite.envs.prepare import prepare_task
from arc_suite.models.visuals import VISUALS
from arc_suite.models.visuals.spec import Visuals
from arc_suite.registry import ADDITIONS, BODIES_ENV, FAMILIES, MODULE_OF_NAME
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body
from arc_suite.tasks import TASKS, Task
from arc_suite.tasks.contract import STEPS
from arc_suite.tasks.modifiers import MODIFIERS, Modifier
from arc_suite.tasks.parameters import PARAMETERS, SHARED_NOISE

BODIES = "bodies"  # in place of a robot in ids of environments of different bodies

_TABLES: dict[str, dict[str, Any]] = {
    "task": TASKS,
    "arena": ARENAS,
    "family": FAMILIES,
    "modifier": MODIFIERS,
    **ADDITIONS,
}

_OF_ALL_TASKS = ("time_limit", "arena", "random", "on_divergence")  # settings that no modifier has


def register(
    *,
    module: str | None = None,
    body: Body | None = None,
    parameters: Mapping[str, Mapping[str, Any]] | None = None,
    presets: Mapping[str, Any] | None = None,
    visuals: Visuals | None = None,
    tasks: Iterable[type[Task]] = (),
    arenas: Mapping[str, Any] | None = None,
    families: Mapping[str, Callable[[int], Body]] | None = None,
    modifiers: Iterable[type[Modifier]] = (),
    laws: Mapping[str, type[Law]] | None = None,
    networks: Mapping[str, Any] | None = None,
    algorithms: Mapping[str, Any] | None = None,
    clips: Mapping[str, Any] | None = None,
    programs: Mapping[str, str] | None = None,
) -> None:
    """Add a robot, or parts of other kinds, to the suite: every task then exists for every robot.

    Call it where a module is imported. `load` and Gymnasium's ids then name the robot as they name
    Queen. Callers name a part of any kind as `name`, or as `module:name`, which imports the module.

    Args:
        module: whose import makes this call, `__name__` there; processes that do not share this
            one's memory import it to know the names too. None where nobody else needs them.
        body: of the robot; its name becomes a domain.
        parameters: of the robot in tasks, by name of the task: for walk all keys of
            `tasks.parameters.PARAMETERS["walk"]["queen"]`, in the same units; for other tasks those that differ from
            walk's. Noise that walk does not set, and all parameters without walk's, are fitted to the body.
        presets: of the robot's demonstrators by name: a `cpg.prescribed.Preset`, or parameters of
            another law, see `cpg.selection.LAWS`; those that every body has are fitted where not given.
        visuals: decorations and colors; None for those that suit any body.
        tasks: classes by the contract of `tasks.contract`, each with its name.
        arenas: functions by name, from a body to the `Arena` that suits it.
        families: functions by name, from a seed to a body, always the same for the same seed; see
            `bodies.families.sound`. `name:seed` then stands for the body wherever a domain does, and comes before
            a module of that name.
        modifiers: classes of `tasks.modifiers.Modifier`. Their settings become settings of every task; a task has the
            modifier where one of them is given.
        laws: classes of demonstrators' laws by name; see `cpg.law.Law`. Presets of their class have the law,
            and `name` stands for the class's own `preset` on every body.
        networks: functions by name that make an architecture for a task, for `--hp network=`; see
            `learning.agents.architectures.of`.
        algorithms: values by name of `learning.agents.algorithms.Algorithm`.
        clips: values by name of `animation.clips.catalog`, such as `Acted`.
        programs: modules by name, as texts, that `arc-suite` runs: each has a docstring and a function `main`.

    A network, an algorithm or a clip may be a text `module:attribute` that says where it is: it is imported when it is
    used. It is checked then, too.

    Raises:
        ValueError: a name that is taken, a task or a law that lacks methods, or parameters or a preset that do not fit
            the body; nothing has been registered.
    """
    module = None if module == "__main__" else module
    parts = {
        "task": {_task_name(task): task for task in tasks},
        "arena": arenas,
        "family": families,
        "modifier": {name: kind for kind in modifiers for name in _modifier_settings(kind)},
        "law": laws,
        "network": networks,
        "algorithm": algorithms,
        "clip": clips,
        "program": programs,
    }
    parts = {kind: dict(additions) for kind, additions in parts.items() if additions}
    for kind, additions in parts.items():
        _check_names(kind, additions, module)
    for name, path in parts.get("program", {}).items():
        _check_program(name, path)
    law_by_preset = {_preset_class(name, added): added for name, added in parts.get("law", {}).items()}
    if body is None:
        if (parameters, presets, visuals) != (None, None, None):
            raise ValueError("parameters, presets and visuals belong to a body, and none is given")
        if not parts:
            kinds = "a body, tasks, arenas, families, modifiers, laws, networks, algorithms, clips or programs"
            raise ValueError(f"nothing to register: give {kinds}")
    else:
        _register_body(body, parameters or {}, presets, visuals, {**LAWS, **law_by_preset})
        MODULE_OF_NAME["robot", body.name] = module
    LAWS.update(law_by_preset)
    for kind, additions in parts.items():
        _TABLES[kind].update(additions)
        MODULE_OF_NAME.update({(kind, name): module for name in additions})
    register_ids()


def _check_names(kind: str, additions: Mapping[str, Any], module: str | None) -> None:
    """Raise ValueError for a name that nobody can write, or that something else has."""
    table = _TABLES[kind]
    for name, value in additions.items():
        if not (isinstance(name, str) and name.isidentifier()):
            raise ValueError(f"{kind} {checks.preview(name)}: expected a name of letters, digits and underscores")
        is_again = table.get(name) is value or (module is not None and MODULE_OF_NAME.get((kind, name)) == module)
        if name in table and not is_again:
            raise ValueError(f"{kind} {checks.preview(name)} is already registered; choose another name")


def _check_program(name: str, path) -> None:
    if not isinstance(path, str):
        raise ValueError(f"program {name!r}: expected the name of a module, got {checks.preview(path)}")


def _preset_class(name: str, law) -> type:
    """Return the class of the presets that a law of another package has.

    Raises:
        ValueError: it is no law, or the name or the class are those of another law.
    """
    attributes = {attribute for base in getattr(law, "__mro__", ()) for attribute in vars(base)}
    if missing := [part for part in ("preset", "reads", "initial", "__call__") if part not in attributes]:
        raise ValueError(f"law {name!r}: has no {' and no '.join(missing)}, which arc_suite.cpg.law.Law requires")
    if not {"posture", "velocities"} <= set(law.reads):
        raise ValueError(
            f"law {name!r}: reads: expected posture, velocities and others, got {checks.preview(law.reads)}"
        )
    if name in SUITE_PRESETS:
        raise ValueError(f"law {name!r}: the suite has presets of this name; choose another name")
    preset_class = type(law.preset)
    if LAWS.get(preset_class, law) is not law:
        raise ValueError(f"law {name!r}: presets of {preset_class.__name__} are those of {LAWS[preset_class].__name__}")
    return preset_class


def _task_name(task) -> str:
    name = getattr(task, "name", None)
    if not (isinstance(task, type) and issubclass(task, Task)):
        raise ValueError(f"tasks: expected classes by the contract of arc_suite.tasks.Task, got {checks.preview(task)}")
    if missing := sorted(task.__abstractmethods__):
        lacks = " and no ".join(missing)
        raise ValueError(f"task {checks.preview(name)}: has no {lacks}, which arc_suite.tasks.Task requires")
    return name


def _modifier_settings(kind) -> Mapping[str, Any]:
    """Return the default values of a modifier's settings by name.

    Raises:
        ValueError: it is no modifier, has no settings, or one that tasks have.
    """
    if not (isinstance(kind, type) and issubclass(kind, Modifier) and issubclass(kind, tuple)):
        expected = "NamedTuples that inherit from arc_suite.tasks.modifiers.Modifier"
        raise ValueError(f"modifiers: expected {expected}, got {checks.preview(kind)}")
    if not kind.defaults:
        raise ValueError(f"modifier {kind.__name__}: expected settings in its `defaults`, got none")
    of_tasks = {name for task in TASKS.values() for name in getattr(task, "names", tuple)()}
    if taken := sorted(kind.defaults.keys() & {*of_tasks, *_OF_ALL_TASKS}):
        raise ValueError(f"modifier {kind.__name__}: {taken[0]} is a setting of tasks; choose another name")
    return kind.defaults


def _register_body(body, parameters, presets, visuals, laws) -> None:
    if not isinstance(body, Body):
        raise ValueError(f"body: expected a spec.Body, got {checks.preview(body)}")
    if body.name == BODIES:
        raise ValueError(f"robot {BODIES!r}: ids of environments of different bodies have this name; choose another")
    if ROBOTS.get(body.name, body) != body:
        raise ValueError(f"robot {body.name!r} is already registered")
    for task, given in parameters.items():
        _check_parameters(body, checks.name(task, TASKS, "task of parameters"), given)
    if presets is not None:
        _check_presets(body, parameters.get("walk", {}), presets, laws)
    ROBOTS[body.name] = body
    tables: list[tuple[dict, Any]] = [(PARAMETERS.setdefault(task, {}), given) for task, given in parameters.items()]
    for table, value in (*tables, (PRESETS, presets), (VISUALS, visuals)):
        if value is not None:
            table[body.name] = value


def _check_parameters(body: Body, task: str, given: Mapping[str, Any]) -> None:
    needed = PARAMETERS["walk"]["queen"].keys() - {"weights", *SHARED_NOISE}
    if task == "walk" and (missing := sorted(needed - given.keys())):
        raise ValueError(f"parameters of {task}: {body.name} has no {' and no '.join(missing)}")
    TASKS[task].settings_for(body, given)


def _check_presets(body: Body, walk: Mapping[str, Any], presets: Mapping[str, Any], laws: Mapping[type, Any]) -> None:
    task, _ = prepare_task(body, "walk", walk)
    for name, preset in presets.items():
        try:
            law(task, preset, laws)
        except ValueError as error:
            raise ValueError(f"preset {checks.preview(name)}: {error}") from None


def register_ids() -> None:
    """Register `arc_suite/<robot>-<task>-v<version>` with Gymnasium for every pair that has no id yet.

    `bodies` in place of a robot is for `gymnasium.make_vec` alone: environments of different bodies. The adapters
    are imported when an environment is made.
    """
    for domain_name, task_name in registry.all_tasks():
        env_id = registry.env_id(domain_name, TASKS[task_name])
        if env_id not in gymnasium.registry:
            gymnasium.register(
                env_id,
                entry_point="arc_suite.envs.gym:Env",
                vector_entry_point="arc_suite.envs.vector:VectorEnv",
                max_episode_steps=STEPS,
                kwargs={
                    "domain_name": registry.importable_name("robot", domain_name),
                    "task_name": registry.importable_name("task", task_name),
                },
            )
    for task_name, task in TASKS.items():
        env_id = registry.env_id(BODIES, task)
        if env_id not in gymnasium.registry:
            gymnasium.register(
                env_id,
                vector_entry_point=BODIES_ENV,
                kwargs={"task_name": registry.importable_name("task", task_name)},
            )
