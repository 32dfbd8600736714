"""Robots and tasks of other packages, and Gymnasium's ids for all there are."""

from collections.abc import Iterable, Mapping
from typing import Any

import gymnasium

from arc_suite import registry
from arc_suite.arenas import ARENAS
from arc_suite.cpg.demonstrator import ahead, pattern
from arc_suite.cpg.presets import SPEEDS, TUNINGS, Preset
from arc_suite.models.looks import LOOKS
from arc_suite.models.looks.look import Look
from arc_suite.registry import MODULES
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body
from arc_suite.tasks import TASKS, Task, walk
from arc_suite.tasks.contract import STEPS


def register(
    *,
    module: str | None = None,
    body: Body | None = None,
    walk: Mapping[str, Any] | None = None,
    tuning: Mapping[str, Preset] | None = None,
    look: Look | None = None,
    tasks: Iterable[type[Task]] = (),
    arenas: Mapping[str, Any] | None = None,
) -> None:
    """Add a robot, tasks, arenas or all of them to the suite: every task then exists for every robot.

    Call it where a module is imported. `load` and Gymnasium's ids then name the robot as they name
    Queen.

    Args:
        module: whose import makes this call, `__name__` there; processes that do not share this
            one's memory import it to know the names too. None where nobody else needs them.
        body: of the robot; its name becomes a domain.
        walk: the robot's row of numbers in the task walk: keys and units as in `tasks.walk.SETTINGS`,
            and any of `tasks.walk.COMMON`; noise that it does not set is fitted, and None has all
            numbers fitted to the body.
        tuning: presets of a demonstrator of the robot by name, slow, medium and fast among them; None
            to have them fitted likewise.
        look: decorations and colours; None for those that suit any body.
        tasks: classes by the contract of `tasks.contract`, each with its name.
        arenas: functions by name, from a body to the `Arena` that suits it.

    Raises:
        ValueError: a name that is taken, or a number or tuning that does not fit the body; one line,
            and nothing has been registered.
    """
    module = None if module == "__main__" else module
    tasks, arenas = {_task_name(task): task for task in tasks}, dict(arenas or {})
    for kind, table, new in (("task", TASKS, tasks), ("arena", ARENAS, arenas)):
        for name, value in new.items():
            if name in table and (module is None or MODULES.get((kind, name)) != module) and table[name] is not value:
                raise ValueError(f"{kind} {name!r} is already registered")
    if body is None:
        if (walk, tuning, look) != (None, None, None):
            raise ValueError("walk, tuning and look belong to a body, and none is given")
        if not (tasks or arenas):
            raise ValueError("nothing to register: give a body, tasks or arenas")
    else:
        _register_body(body, walk, tuning, look)
        MODULES["domain", body.name] = module
    TASKS.update(tasks)
    ARENAS.update(arenas)
    MODULES.update({("task", name): module for name in tasks} | {("arena", name): module for name in arenas})
    register_ids()


def _task_name(task) -> str:
    name = getattr(task, "name", None)
    if not (isinstance(task, type) and issubclass(task, Task)):
        raise ValueError(f"tasks: expected classes by the contract of arc_suite.tasks.Task, got {task!r}")
    if not (isinstance(name, str) and name.isidentifier()):
        raise ValueError(f"task {name!r}: expected a name of letters, digits and underscores")
    return name


def _register_body(body, row, tuning, look) -> None:
    if not isinstance(body, Body):
        raise ValueError(f"body: expected a spec.Body, got {body!r}")
    if ROBOTS.get(body.name, body) != body:
        raise ValueError(f"robot {body.name!r} is already registered")
    if row is not None:
        _check_row(body, row)
    if tuning is not None:
        _check_tuning(body, tuning)
    ROBOTS[body.name] = body
    for table, value in ((walk.SETTINGS, row), (TUNINGS, tuning), (LOOKS, look)):
        if value is not None:
            table[body.name] = value


def _check_row(body: Body, row: Mapping[str, Any]) -> None:
    needed = walk.SETTINGS["queen"].keys() - {"weights", *walk.SHARED_NOISE}
    if missing := sorted(needed - row.keys()):
        raise ValueError(f"walk: {body.name} has no {' and no '.join(missing)}")
    walk.settings(body, row)


def _check_tuning(body: Body, tuning: Mapping[str, Preset]) -> None:
    if missing := [name for name in SPEEDS if name not in tuning]:
        raise ValueError(f"tuning: {body.name} has no {' and no '.join(missing)}")
    for name, preset in tuning.items():
        try:
            pattern(body, preset), ahead(body, preset)
        except ValueError as error:
            raise ValueError(f"tuning {name!r}: {error}") from None


def register_ids() -> None:
    """Register `arc_suite/<robot>-<task>-v<version>` with Gymnasium for every pair that has no id yet.

    The adapters are imported when an environment is made.
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
                    "domain_name": registry.importable("domain", domain_name),
                    "task_name": registry.importable("task", task_name),
                },
            )
