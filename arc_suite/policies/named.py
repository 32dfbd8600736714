"""Policies by name: TimeStep -> action. Some need no training; any other is found on Python's path."""

import pkgutil
from collections.abc import Callable

import numpy as np

from arc_suite import checks
from arc_suite.cpg import PRESETS, Demonstrator
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec import Body

POLICIES = ("cpg", "zero", "random")
HELP = (
    f"One of {', '.join(POLICIES)}, or module:attribute, which makes a policy from a robot's name, or from the Body "
    "of what is no robot of the suite."
)
PRESET_HELP = f"Of the cpg: {', '.join(PRESETS)}."


def policy(name: str, robot: str | Body, preset: str = "medium", seed: int | None = None) -> Callable:
    """Makes a policy for one environment.

    Args:
        name: cpg, the demonstrator; zero, which stands still; random, uniform in [-1, 1]; or
            `module:attribute`, a function on Python's path that makes a policy from the name of a
            robot, or from a body that is none.
        robot: queen, bastion, tick or leaper, or any body.
        preset: of the demonstrator, one of `cpg.PRESETS`.
        seed: of the random policy.

    Returns:
        A function of a dm_env `TimeStep` that returns an action, (joints,).

    Raises:
        ValueError: an unknown name; one line that names it and the nearest valid one.
    """
    checks.name(preset, PRESETS, "preset")
    body = robot if isinstance(robot, Body) else ROBOTS[checks.name(robot, ROBOTS, "robot")]
    if isinstance(name, str) and ":" in name:
        return _from_path(name, body)
    checks.name(name, POLICIES, "policy")
    if name == "cpg":
        return Demonstrator(body, preset)
    size = len(body.joint_names)
    if name == "zero":
        return lambda time_step: np.zeros(size)
    random = np.random.default_rng(None if seed is None else checks.seed(seed))
    return lambda time_step: random.uniform(-1.0, 1.0, size)


def _from_path(path: str, body: Body) -> Callable:
    try:
        factory = pkgutil.resolve_name(path)
    except (ImportError, ValueError, AttributeError) as error:
        raise ValueError(f"policy {path!r}: {error}") from None
    if not callable(factory):
        raise ValueError(f"policy {path!r}: expected a function that makes a policy from a robot's name")
    made = factory(body.name if ROBOTS.get(body.name) == body else body)
    if not callable(made):
        raise ValueError(f"policy {path!r}: expected it to return a function of a TimeStep, got {type(made).__name__}")
    return made
