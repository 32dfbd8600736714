"""Policies that need no training, by name: TimeStep -> action."""

from collections.abc import Callable

import numpy as np

from arc_suite import names
from arc_suite.cpg import Demonstrator
from arc_suite.robots import ROBOTS
from arc_suite.spec import Body

POLICIES = ("cpg", "zero", "random")


def policy(name: str, robot: str | Body, preset: str = "medium", seed: int | None = None) -> Callable:
    """Makes a policy for one environment.

    Args:
        name: cpg, the demonstrator; zero, which stands still; random, uniform in [-1, 1].
        robot: queen, bastion, tick or leaper, or any body.
        preset: of the demonstrator: slow, medium or fast.
        seed: of the random policy.

    Returns:
        A function of a dm_env `TimeStep` that returns an action, (joints,).

    Raises:
        ValueError: an unknown name; one line that names it and the nearest valid one.
    """
    names.check(name, POLICIES, "policy")
    if name == "cpg":
        return Demonstrator(robot, preset)
    body = robot if isinstance(robot, Body) else ROBOTS[names.check(robot, ROBOTS, "robot")]
    size = len(body.joint_names)
    if name == "zero":
        return lambda time_step: np.zeros(size)
    random = np.random.default_rng(seed)
    return lambda time_step: random.uniform(-1.0, 1.0, size)
