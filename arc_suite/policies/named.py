"""Policies by name: some need no training; any other is found on Python's path."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from arc_suite import checks, versions
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.selection import preset_names
from arc_suite.policies import network
from arc_suite.policies.protocol import Individuals, Mixture, Policy, Positioned, Script, Sum
from arc_suite.robots import ROBOTS, is_robot
from arc_suite.robots.spec import Body
from arc_suite.tasks import Task

_ZIP = ".zip"  # in which stable-baselines3 saves
_CHUNK = 256  # control steps that are drawn at once


def _cpg(body: Body, presets: Sequence[str], num_envs: int, task: Task | None) -> Policy:
    if not presets:
        raise ValueError(f"preset: expected one or more of {', '.join(preset_names())}, got none")
    demonstrators = [Demonstrator(task or body, preset) for preset in presets]
    made = demonstrators[0] if len(demonstrators) == 1 else Mixture(demonstrators, num_envs)
    return Positioned(made, task) if task and task.actions == "position" else made


def _zero(body: Body, presets: Sequence[str], num_envs: int, task: Task | None) -> Policy:
    return Script(lambda seed: (), num_envs, len(body.joint_names))


def _random(body: Body, presets: Sequence[str], num_envs: int, task: Task | None) -> Policy:
    joints = len(body.joint_names)

    def draw(seed):
        random = np.random.default_rng(seed)
        while True:
            yield from random.uniform(-1.0, 1.0, (_CHUNK, joints))

    return Script(draw, num_envs, joints)


# By name: a function that makes the policy of a body, presets, a number of environments and a task, if there is one.
POLICIES = {"cpg": _cpg, "zero": _zero, "random": _random}

HELP = (
    f"One of {', '.join(POLICIES)}; or the folder of a run of arc-suite train; or a zip that stable-baselines3 has "
    "saved, whose pickles are run; or module:attribute, a function that makes a policy from a robot's name, or from "
    "any other Body."
)
PRESET_HELP = f"Of the cpg: {', '.join(preset_names())}, or another that the robot has."


def policy(
    name: str,
    robot: str | Body,
    presets: str | Sequence[str] = "medium",
    num_envs: int = 1,
    noise: float = 0.0,
    task: Task | None = None,
) -> Policy:
    """Make a policy for a batch of environments, or for one environment; see `protocol.alone`.

    Args:
        name: cpg, the demonstrator; zero, which does nothing; random, uniform in [-1, 1] by the
            episode's seed; the path of a run's folder, of a policy file (.npz), see `network`, or of a
            folder of checkpoints, which take turns from seed to seed, see `checkpoints`; that of a zip of
            stable-baselines3, see `sb3_file`; or `module:attribute`, a function on Python's path that makes
            a function from a `TimeStep` to an action, from the name of a robot, or from a body that is none.
        robot: queen, bastion, tick or leaper, or any body.
        presets: of the demonstrator, a name or several that take turns from seed to seed; see `cpg.Demonstrator`.
        num_envs: number of environments.
        noise: standard deviation of normal noise on the actions, by the episode's seed.
        task: that it is to act in. The demonstrator is fitted to it, and gives positions in place of torques
            where the task takes them, as `protocol.Positioned`. None for walk with default settings.

    Raises:
        ValueError: an unknown name, or a value out of range.
        OSError: a file that cannot be read.
    """
    presets = (presets,) if isinstance(presets, str) else tuple(presets)
    for preset in presets:
        checks.name(preset, preset_names(), "preset")
    checks.number("noise", noise, 0.0)
    body = robot if isinstance(robot, Body) else ROBOTS[checks.name(robot, ROBOTS, "robot")]
    if isinstance(name, os.PathLike) or (isinstance(name, str) and _is_path(name)):
        turns = network.checkpoint_files(Path(name))
        several = [_from_file(path, body, task) for path in turns or [Path(name)]]
        made = Mixture(several, num_envs) if turns else several[0]
    elif isinstance(name, str) and ":" in name:
        made = _from_path(name, body, num_envs)
    else:
        made = POLICIES[checks.name(name, POLICIES, "policy")](body, presets, num_envs, task)
    return Sum(made, _noise(body, noise, num_envs)) if noise else made


def _noise(body: Body, deviation: float, num_envs: int) -> Policy:
    joints = len(body.joint_names)

    def draw(seed):
        random = np.random.default_rng((seed, 1))  # the 1 keeps this stream apart from that of the random policy
        while True:
            yield from random.normal(0.0, deviation, (_CHUNK, joints))

    return Script(draw, num_envs, joints)


def is_file(name: str) -> bool:
    """Return whether a policy's name is that of a folder of a run or of checkpoints that is there, or of a zip."""
    if name in POLICIES:
        return False
    return name.endswith(_ZIP) or (Path(name) / network.FILE).is_file() or bool(network.checkpoint_files(Path(name)))


def _is_path(name: str) -> bool:
    return is_file(name) or name.endswith((network.EXTENSION, _ZIP)) or (os.sep in name and ":" not in name)


def _from_file(path: Path, body: Body, task: Task | None) -> Policy:
    if path.suffix == _ZIP:
        return _from_zip(path, body)
    made = network.load(path)
    setup = made.setup
    if setup.body != body and not (is_robot(setup.body) and setup.body.name == body.name):
        name = "another body of that name" if setup.body.name == body.name else setup.body.name
        raise ValueError(f"policy {path}: made for {name}, and not for {body.name}")
    if made.joints != len(body.joint_names):
        raise ValueError(f"policy {path}: moves {made.joints} joints, and {body.name} has {len(body.joint_names)}")
    if task is not None and (actions := setup.definition.actions) != task.actions:
        raise ValueError(f"policy {path}: its actions are a {actions} a joint, and {task.name} takes a {task.actions}")
    return made


def _from_zip(path: Path, body: Body) -> Policy:
    try:
        from arc_suite.policies import sb3_file
    except ImportError as error:
        raise versions.MissingExtra(f"policy {path}: zips need stable-baselines3", "sb3", error) from None
    return sb3_file.Saved(path, body)


def _from_path(path: str, body: Body, num_envs: int) -> Policy:
    factory = checks.imported(path, "policy")
    if not callable(factory):
        raise ValueError(f"policy {path!r}: expected a function that makes a policy from a robot's name")
    make = _checked(path, factory, body.name if is_robot(body) else body)
    make()  # finds out at once whether it makes one
    return Individuals(make, num_envs, len(body.joint_names), f"policy {path!r}")


def _checked(path: str, factory: Callable, robot: str | Body) -> Callable[[], Callable]:
    def make():
        made = factory(robot)
        if not callable(made):
            kind = type(made).__name__
            raise ValueError(f"policy {path!r}: expected it to return a function of a TimeStep, got {kind}")
        return made

    return make
