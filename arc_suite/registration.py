"""Robots, families of bodies and tasks of other packages, and Gymnasium's ids for all there are."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import gymnasium

from arc_suite import checks, registry
from arc_suite.arenas import ARENAS
from arc_suite.cpg.presets import PRESETS
from arc_suite.cpg.selection import law
from arc_suite.envs.prepare import prepared
from arc_suite.models.visuals import VISUALS
from arc_suite.models.visuals.spec import Visuals
from arc_suite.registry import BODIES_ENV, FAMILIES, MODULES
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body
from arc_suite.tasks import TASKS, Task
from arc_suite.tasks.contract import STEPS
from arc_suite.tasks.parameters import PARAMETERS, SHARED_NOISE

BODIES = "bodies"  # in place of a robot in ids of environments of different bodies


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
) -> None:
    """Add a robot, tasks, arenas, families or all of them to the suite: every task then exists for every robot.

    Call it where a module is imported. `load` and Gymnasium's ids then name the robot as they name
    Queen.

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

    Raises:
        ValueError: a name that is taken, a task that lacks methods, or parameters or a preset that do not fit the
            body; nothing has been registered.
    """
    module = None if module == "__main__" else module
    new_tasks: dict[str, Any] = {_task_name(task): task for task in tasks}
    new_arenas = dict(arenas or {})
    new_families = {_family_name(name): make for name, make in (families or {}).items()}
    added: list[tuple[str, dict, dict]]
    added = [("task", TASKS, new_tasks), ("arena", ARENAS, new_arenas), ("family", FAMILIES, new_families)]
    for kind, table, new in added:
        for name, value in new.items():
            if name in table and (module is None or MODULES.get((kind, name)) != module) and table[name] is not value:
                raise ValueError(f"{kind} {checks.shown(name)} is already registered; choose another name")
    if body is None:
        if (parameters, presets, visuals) != (None, None, None):
            raise ValueError("parameters, presets and visuals belong to a body, and none is given")
        if not (new_tasks or new_arenas or new_families):
            raise ValueError("nothing to register: give a body, tasks, arenas or families")
    else:
        _register_body(body, parameters or {}, presets, visuals)
        MODULES["robot", body.name] = module
    for kind, table, new in added:
        table.update(new)
        MODULES.update({(kind, name): module for name in new})
    register_ids()


def _family_name(name) -> str:
    if not (isinstance(name, str) and name.isidentifier()):
        raise ValueError(f"family {checks.shown(name)}: expected a name of letters, digits and underscores")
    return name


def _task_name(task) -> str:
    name = getattr(task, "name", None)
    if not (isinstance(task, type) and issubclass(task, Task)):
        raise ValueError(f"tasks: expected classes by the contract of arc_suite.tasks.Task, got {checks.shown(task)}")
    if not (isinstance(name, str) and name.isidentifier()):
        raise ValueError(f"task {checks.shown(name)}: expected a name of letters, digits and underscores")
    if missing := sorted(task.__abstractmethods__):
        lacks = " and no ".join(missing)
        raise ValueError(f"task {checks.shown(name)}: has no {lacks}, which arc_suite.tasks.Task requires")
    return name


def _register_body(body, parameters, presets, visuals) -> None:
    if not isinstance(body, Body):
        raise ValueError(f"body: expected a spec.Body, got {checks.shown(body)}")
    if body.name == BODIES:
        raise ValueError(f"robot {BODIES!r}: ids of environments of different bodies have this name; choose another")
    if ROBOTS.get(body.name, body) != body:
        raise ValueError(f"robot {body.name!r} is already registered")
    for task, given in parameters.items():
        _check_parameters(body, checks.name(task, TASKS, "task of parameters"), given)
    if presets is not None:
        _check_presets(body, parameters.get("walk", {}), presets)
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


def _check_presets(body: Body, walk: Mapping[str, Any], presets: Mapping[str, Any]) -> None:
    task, _ = prepared(body, "walk", walk)
    for name, preset in presets.items():
        try:
            law(task, preset)
        except ValueError as error:
            raise ValueError(f"preset {checks.shown(name)}: {error}") from None


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
                    "domain_name": registry.importable("robot", domain_name),
                    "task_name": registry.importable("task", task_name),
                },
            )
    for task_name, task in TASKS.items():
        env_id = registry.env_id(BODIES, task)
        if env_id not in gymnasium.registry:
            gymnasium.register(
                env_id,
                vector_entry_point=BODIES_ENV,
                kwargs={"task_name": registry.importable("task", task_name)},
            )
