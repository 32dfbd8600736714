"""What the suite knows: its own robots and tasks, those of other packages, and Gymnasium's ids for them all."""

import sys
from collections.abc import Callable, Mapping
from typing import Any

import gymnasium

from arc_suite.cpg.demonstrator import pattern
from arc_suite.cpg.presets import SPEEDS, TUNINGS, Preset
from arc_suite.models.looks import LOOKS
from arc_suite.models.looks.look import Look
from arc_suite.registry import all_tasks
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body
from arc_suite.tasks import TASKS, walk

MAX_EPISODE_STEPS = 1000

_modules = {}  # (kind, name) of what comes from elsewhere -> the module whose import registers it


def register(
    *,
    body: Body | None = None,
    walk: Mapping[str, Any] | None = None,
    tuning: Mapping[str, Preset] | None = None,
    look: Look | None = None,
    tasks: Mapping[str, Callable] | None = None,
) -> None:
    """Adds a robot, tasks or both to the suite: every task then exists for every robot.

    Call it where a module is imported. `load` and Gymnasium's ids then name the robot as they name
    Queen; processes that do not share this one's memory import the module to know the name too.

    Args:
        body: of the robot; its name becomes a domain.
        walk: the robot's row of numbers in the task walk: keys and units as in `tasks.walk.SETTINGS`,
            and any of `tasks.walk.COMMON`; None to have them fitted to the body.
        tuning: presets of a demonstrator of the robot by name, slow, medium and fast among them; None
            to have them fitted likewise.
        look: what the robot wears; None for what every body wears.
        tasks: factories by name, called as `tasks.walk.walk` is: with a body, `environment_kwargs` and
            the caller's `task_kwargs`, `random` among them. The environment's physics is a
            `physics.Physics`; its task, like dm_control.suite's, keeps its random stream in `_random`.
            What it offers as `terms`, a mapping of floats, Gymnasium's steps report.

    Raises:
        ValueError: a name that is taken, or a number or tuning that does not fit the body; one line,
            and nothing has been registered.
    """
    module = sys._getframe(1).f_globals.get("__name__")
    tasks = dict(tasks or {})
    for name, factory in tasks.items():
        if not (isinstance(name, str) and name.isidentifier()):
            raise ValueError(f"task {name!r}: expected a name of letters, digits and underscores")
        if not callable(factory):
            raise ValueError(f"task {name!r}: expected a function that makes an environment, got {factory!r}")
        if name in TASKS and _modules.get(("task", name)) != module:
            raise ValueError(f"task {name!r} is already registered")
    if body is None:
        if (walk, tuning, look) != (None, None, None):
            raise ValueError("walk, tuning and look belong to a body, and none is given")
        if not tasks:
            raise ValueError("nothing to register: give a body, tasks or both")
    else:
        _register_body(body, walk, tuning, look)
        _modules["domain", body.name] = module
    TASKS.update(tasks)
    _modules.update({("task", name): module for name in tasks})
    register_ids()


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
    needed = walk.SETTINGS["queen"].keys() - {"weights"}
    if missing := sorted(needed - row.keys()):
        raise ValueError(f"walk: {body.name} has no {' and no '.join(missing)}")
    walk.settings(body, row)


def _check_tuning(body: Body, tuning: Mapping[str, Preset]) -> None:
    if missing := [name for name in SPEEDS if name not in tuning]:
        raise ValueError(f"tuning: {body.name} has no {' and no '.join(missing)}")
    for name, preset in tuning.items():
        try:
            pattern(body, preset)
        except ValueError as error:
            raise ValueError(f"tuning {name!r}: {error}") from None


def register_ids() -> None:
    """Registers `arc_suite/<robot>-<task>-v0` for every task that has no id yet.

    The adapters are imported when an environment is made.
    """
    for domain_name, task_name in all_tasks():
        env_id = f"arc_suite/{domain_name}-{task_name}-v0"
        if env_id not in gymnasium.registry:
            gymnasium.register(
                env_id,
                entry_point="arc_suite.envs.gym:Env",
                vector_entry_point="arc_suite.envs.vector:VectorEnv",
                max_episode_steps=MAX_EPISODE_STEPS,
                kwargs={"domain_name": _importable("domain", domain_name), "task_name": _importable("task", task_name)},
            )


def _importable(kind: str, name: str) -> str:
    module = _modules.get((kind, name))
    return name if module in (None, "__main__") else f"{module}:{name}"
