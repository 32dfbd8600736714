"""The registry: every task x every robot, or any other body."""

import importlib
import os
from collections.abc import Mapping

from arc_suite import checks
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body
from arc_suite.robots.spec_files import body_from_json, load_body
from arc_suite.tasks import TASKS


def tasks_by_domain() -> dict[str, tuple[str, ...]]:
    """Names of the tasks by name of the robot, as they are now."""
    return {domain: tuple(TASKS) for domain in ROBOTS}


def all_tasks() -> tuple[tuple[str, str], ...]:
    """Names of a robot and a task, of all there are now."""
    return tuple((domain, task) for domain in ROBOTS for task in TASKS)


def body_of(domain) -> Body:
    """The body that a domain stands for.

    Args:
        domain: name of a robot, path of a file that holds a body (a `Path`, or a string that ends
            in .json), the text of such a file, or the body itself.

    Raises:
        ValueError: an unknown name, or a file that holds no body; one line.
        OSError: the file cannot be read; one line.
    """
    if isinstance(domain, Body):
        return domain
    if isinstance(domain, os.PathLike) or (isinstance(domain, str) and domain.endswith(".json")):
        return load_body(domain)
    if isinstance(domain, str) and domain.startswith("{"):
        return body_from_json(domain)
    return _find(domain, ROBOTS, "domain")


def load(domain_name, task_name, task_kwargs=None, environment_kwargs=None, visualize_reward=False):
    """Opens an environment, as `dm_control.suite.load` does.

    Args:
        domain_name: a robot: queen, bastion, tick or leaper; one of another package, as `module:name`
            where that has not been imported yet; or any body; see `body_of`.
        task_name: walk, or a task of another package likewise.
        task_kwargs: settings of the task: `time_limit` (s), `random` (a seed or `RandomState`),
            `gait`, `weights`, and every target and threshold; see `arc_suite.tasks.walk.settings`.
        environment_kwargs: `flat_observation=True` gives one vector in place of named blocks.
        visualize_reward: let rendered pictures show the reward as a colour.

    Returns:
        A `dm_control.rl.control.Environment`.

    Raises:
        ValueError: an unknown name, or a value that does not fit; one line that names it and the
            nearest valid name.
        OSError: a file that cannot be read.
    """
    body, task = body_of(domain_name), _find(task_name, TASKS, "task")
    for name, kwargs in (("task_kwargs", task_kwargs), ("environment_kwargs", environment_kwargs)):
        if not isinstance(kwargs, Mapping | None):
            raise ValueError(f"{name}: expected a mapping of names to values, got {kwargs!r}")
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
    return table[checks.name(name, table, kind)]
