"""The registry: every task x every robot."""

from arc_suite import names
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS

TASKS_BY_DOMAIN = {domain: tuple(TASKS) for domain in ROBOTS}
ALL_TASKS = tuple((domain, task) for domain, tasks in TASKS_BY_DOMAIN.items() for task in tasks)


def load(domain_name, task_name, task_kwargs=None, environment_kwargs=None, visualize_reward=False):
    """Opens an environment, as `dm_control.suite.load` does.

    Args:
        domain_name: a robot: queen, bastion, tick or leaper.
        task_name: walk.
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
    body = ROBOTS[names.check(domain_name, ROBOTS, "domain")]
    task = TASKS[names.check(task_name, TASKS_BY_DOMAIN[domain_name], "task")]
    environment = task(body, environment_kwargs=environment_kwargs, **(task_kwargs or {}))
    environment.task.visualize_reward = visualize_reward
    return environment
