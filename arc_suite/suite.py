"""The registry: every task x every robot."""

import importlib

from arc_suite import names
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS


def tasks_by_domain() -> dict[str, tuple[str, ...]]:
    """Names of the tasks by name of the robot, as they are now."""
    return {domain: tuple(TASKS) for domain in ROBOTS}


def all_tasks() -> tuple[tuple[str, str], ...]:
    """Names of a robot and a task, of all there are now."""
    return tuple((domain, task) for domain in ROBOTS for task in TASKS)


def load(domain_name, task_name, task_kwargs=None, environment_kwargs=None, visualize_reward=False):
    """Opens an environment, as `dm_control.suite.load` does.

    Args:
        domain_name: a robot: queen, bastion, tick or leaper; or one of another package, as
            `module:name` where that has not been imported yet.
        task_name: walk, or likewise one of another package.
        task_kwargs: settings of the task: `time_limit` (s), `random` (a seed or `RandomState`),
            `weights`, and every target and threshold; see `arc_suite.tasks.walk.settings`.
        environment_kwargs: `flat_observation=True` gives one vector in place of named blocks.
        visualize_reward: let rendered pictures show the reward as a colour.

    Returns:
        A `dm_control.rl.control.Environment`.

    Raises:
        ValueError: an unknown name, or a value that does not fit; one line that names it and the
            nearest valid name.
    """
    body, task = _find(domain_name, ROBOTS, "domain"), _find(task_name, TASKS, "task")
    environment = task(body, environment_kwargs=environment_kwargs, **(task_kwargs or {}))
    environment.task.visualize_reward = visualize_reward
    return environment


def _find(name, table, kind: str):
    if isinstance(name, str) and ":" in name:
        module, _, name = name.rpartition(":")
        try:
            importlib.import_module(module)
        except ImportError as error:
            raise ValueError(f"{kind} {name!r}: cannot import {module}: {error}") from None
    return table[names.check(name, table, kind)]
