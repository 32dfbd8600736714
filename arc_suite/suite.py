"""The registry: every task x every robot, or any other body."""

import os

from arc_suite import names
from arc_suite.robots import ROBOTS
from arc_suite.spec import Body
from arc_suite.spec_files import load_body
from arc_suite.tasks import TASKS

TASKS_BY_DOMAIN = {domain: tuple(TASKS) for domain in ROBOTS}
ALL_TASKS = tuple((domain, task) for domain, tasks in TASKS_BY_DOMAIN.items() for task in tasks)


def body_of(domain) -> Body:
    """The body that a domain stands for.

    Args:
        domain: name of a robot, path of a file that holds a body (a `Path`, or a string that ends
            in .json), or the body itself.

    Raises:
        ValueError: an unknown name, or a file that holds no body; one line.
        OSError: the file cannot be read; one line.
    """
    if isinstance(domain, Body):
        return domain
    if isinstance(domain, os.PathLike) or (isinstance(domain, str) and domain.endswith(".json")):
        return load_body(domain)
    return ROBOTS[names.check(domain, ROBOTS, "domain")]


def load(domain_name, task_name, task_kwargs=None, environment_kwargs=None, visualize_reward=False):
    """Opens an environment, as `dm_control.suite.load` does.

    Args:
        domain_name: a robot: queen, bastion, tick or leaper; or any body; see `body_of`.
        task_name: walk.
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
    body = body_of(domain_name)
    task = TASKS[names.check(task_name, TASKS, "task")]
    environment = task(body, environment_kwargs=environment_kwargs, **(task_kwargs or {}))
    environment.task.visualize_reward = visualize_reward
    return environment
