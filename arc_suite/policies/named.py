"""Policies by name: some need no training; any other is a file, or is found on Python's path."""

import hashlib
import importlib.util
import itertools
import os
import pkgutil
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from arc_suite import checks, files, registry, seed_ranges
from arc_suite.cpg import Demonstrator, suited_preset
from arc_suite.cpg.selection import check_preset_name, preset_names
from arc_suite.envs.prepare import prepare_task
from arc_suite.envs.setup import Setup
from arc_suite.policies import network, other_libraries
from arc_suite.policies.network import PACKAGED, Network
from arc_suite.policies.other_libraries import PolicyFile
from arc_suite.policies.protocol import Individuals, Mixture, Policy, Positioned, Script, Sum
from arc_suite.robots import is_robot
from arc_suite.robots.spec import Body
from arc_suite.tasks import Task

MODULE = ".py"  # extension of a file that holds a function which makes a policy
_MANY_BODIES = "arc_suite.bodies.universal"  # the module of policies that were trained with many bodies
_CHUNK = 256  # control steps that are drawn at once


def _cpg(body: Body, presets: Sequence[str], num_envs: int, task: Task | None) -> Policy:
    if not presets:
        raise ValueError(f"preset: expected one or more of {', '.join(preset_names())}, got none")
    demonstrators = [Demonstrator(task or body, preset) for preset in presets]
    made = demonstrators[0] if len(demonstrators) == 1 else Mixture(demonstrators, num_envs)
    # Demonstrators give positions to servos. Of motors, modified tasks alone take positions.
    controlled = task and task.actions == "position" and not body.source
    return Positioned(made, task) if controlled else made  # type: ignore[arg-type]


def _zero(body: Body, presets: Sequence[str], num_envs: int, task: Task | None) -> Policy:
    return Script(lambda seed: (), num_envs, len(body.joint_names))


def _random(body: Body, presets: Sequence[str], num_envs: int, task: Task | None) -> Policy:
    joints = len(body.joint_names)

    def draw(seed):
        random = np.random.default_rng(seed)
        while True:
            yield from random.uniform(-1.0, 1.0, (_CHUNK, joints))

    return Script(draw, num_envs, joints)


def _ppo(body: Body, presets: Sequence[str], num_envs: int, task: Task | None) -> Policy:
    """A trained policy that comes with the package; `policies.json` holds its command, hash and return."""
    path = PACKAGED / f"{body.name}-{task.name if task else 'walk'}{network.EXTENSION}"
    if not (is_robot(body) and path.is_file()):
        there = ", ".join(sorted(each.stem for each in PACKAGED.glob(f"*{network.EXTENSION}")))
        others = "arc-suite train makes others, and universal moves any body"
        raise ValueError(f"policy ppo: none for {path.stem} (there are: {there}); {others}")
    return _from_file(path, body, task)


def _universal(body: Body, presets: Sequence[str], num_envs: int, task: Task | None) -> Policy:
    """A trained policy of any body that comes with the package, for walk or for tasks with a command."""
    task = task or prepare_task(body, "walk")[0]
    universal = registry.resolve(_MANY_BODIES)
    return universal.Universal(universal.load(universal.NAME, task), task)


# By name: a function that makes the policy of a body, presets, a number of environments and a task, if there is one.
POLICIES = {"cpg": _cpg, "zero": _zero, "random": _random, "ppo": _ppo, "universal": _universal}
_UNTRAINED = ("zero", "random")

HELP = (
    "cpg, the demonstrator; zero, which stands still; random, uniform actions; ppo, trained for a robot; universal, "
    "trained for any body; the folder of a run of arc-suite train; a zip that stable-baselines3 has saved, whose "
    "pickles run code; or module:attribute or file.py:attribute, a function that makes a policy from a robot's name, "
    "or from any other Body."
)
PRESET_HELP = (
    f"Of the demonstrator: {', '.join(preset_names())}, another that the robot has, or module:name of a law that "
    "another package has."
)


def policy(
    name: str,
    robot: str | Body,
    presets: str | Sequence[str] | None = "medium",
    num_envs: int = 1,
    noise: float = 0.0,
    task: Task | None = None,
) -> Policy:
    """Make a policy for a batch of environments, or for one environment; see `protocol.alone`.

    Args:
        name: cpg, the demonstrator; zero, which does nothing; random, uniform in [-1, 1] by the
            episode's seed; ppo, a trained policy of one robot that comes with the package; universal, one of any
            body; the path of a run's folder, of a
            policy file (.npz), see `network`, or of a folder of checkpoints, which take turns from seed to seed,
            see `checkpoints`; that of a zip of stable-baselines3, see `zips`; or `module:attribute`, a function on
            Python's path that makes a function from a `TimeStep` to an action, from the name of a robot, or from a
            body that is none; or `file.py:attribute`, such a function in a file of any name.
        robot: a body; see `registry.body_of`.
        presets: of the demonstrator, a name or several that take turns from seed to seed, see `cpg.Demonstrator`; None
            for the one that suits the task and the body.
        num_envs: number of environments.
        noise: standard deviation of normal noise on the actions, by the episode's seed.
        task: that it is to act in. The demonstrator is fitted to it, and gives positions in place of torques
            where the task takes them, as `protocol.Positioned`. None for walk with default settings.

    Raises:
        ValueError: an unknown name, or a value out of range.
        OSError: a file that cannot be read.
    """
    body = registry.body_of(robot)
    if presets is None:
        presets = suited_preset(task or prepare_task(body, "walk")[0]) if name == "cpg" else ()
    presets = (presets,) if isinstance(presets, str) else tuple(presets)
    for preset in presets:
        check_preset_name(preset)
    checks.number("noise", noise, 0.0)
    if isinstance(name, os.PathLike) or (isinstance(name, str) and _is_path(name)):
        turns = network.checkpoint_files(Path(name))
        several = [_from_file(path, body, task) for path in turns or [Path(name)]]
        made = Mixture(several, num_envs) if turns else several[0]
    elif isinstance(name, str) and ":" in name:
        made = _from_path(name, body, num_envs)
    else:
        made = POLICIES[checks.name(name, POLICIES, "policy")](body, presets, num_envs, task)
    return Sum(made, _noise(body, noise, num_envs)) if noise else made


def acting(given, task: Task, presets: str | Sequence[str] | None = None) -> Policy:
    """Return a policy for one environment.

    Args:
        given: a name or a path, as of `policy`; a policy for one environment; or a function of a `TimeStep` with
            named blocks.
        task: that it is to act in.
        presets: of the demonstrator, see `policy`.

    Raises:
        ValueError: something else, or as `policy`.
        OSError: as `policy`.
    """
    body = task.scene.body
    if isinstance(given, str | os.PathLike):
        return policy(given, body, presets, task=task)
    if hasattr(given, "act"):
        return given
    if callable(given):
        return Individuals(lambda: given, 1, len(body.joint_names))
    raise ValueError(f"policy: expected a name, a policy or a function of a TimeStep, got {type(given).__name__}")


def _noise(body: Body, deviation: float, num_envs: int) -> Policy:
    joints = len(body.joint_names)

    def draw(seed):
        random = np.random.default_rng((seed, 1))  # the 1 keeps this stream apart from that of the random policy
        while True:
            yield from random.normal(0.0, deviation, (_CHUNK, joints))

    return Script(draw, num_envs, joints)


def is_file(name: str) -> bool:
    """Return whether a name is that of a folder of a run or of checkpoints, or of a file of another library."""
    if name in POLICIES:
        return False
    if other_libraries.find(name):
        return True
    try:
        return (Path(name) / network.FILE).is_file() or bool(network.checkpoint_files(Path(name)))
    except OSError:  # no path: the text is too long
        return False


def function_file(name: str) -> Path | None:
    """Return the file of the function that a policy's name gives; None for other names, and where no file is."""
    module, colon, _ = name.rpartition(":")
    if not colon or name in POLICIES or other_libraries.find(name):
        return None
    if module.endswith(MODULE):
        return Path(module)
    try:
        found = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        return None
    return Path(found.origin) if found and found.has_location else None


def digest(name: str) -> str:
    """Return the sha256 of the files of a policy.

    They are those of a run, all checkpoints, a zip and its statistics, or the file of a function. What that file
    imports or reads is not among them.

    Raises:
        ValueError: a damaged file of another library, or one without a file that belongs to it.
        OSError: a file cannot be read.
    """
    if policy_file := other_libraries.find(name):
        held = policy_file.policy_files()
    elif (code := function_file(name)) is not None:
        held = [code]
    else:
        held = _policy_files(Path(name))
    return hashlib.sha256(b"".join(file.read_bytes() for file in held)).hexdigest()


def setup_of(name) -> Setup | None:
    """Return the setup that a policy was trained in; None for one that is no network, and where no file is.

    Args:
        name: of a policy, or the policy. A zip of stable-baselines3 may not hold its setup; nothing else that it holds
            is read.

    Raises:
        ValueError: a damaged file, or a robot, task or arena whose module has not been imported.
        OSError: a file cannot be read.
    """
    if not isinstance(name, str | os.PathLike):
        return name.setup if isinstance(name, Network) else None
    if not (isinstance(name, os.PathLike) or _is_path(name)):
        return None
    if policy_file := other_libraries.find(name):
        return policy_file.setup()
    path = Path(name)
    if not path.exists():
        return None
    return network.load(_policy_files(path)[0]).setup


def training_seeds(name) -> seed_ranges.Ranges | None:
    """Return the seeds of the episodes that a policy, or one of a name, learned from; None where they are unknown.

    Demonstrators and the trained policies of the package learned from `seed_ranges.LEARNING`. Files of policies hold
    their seeds; zips of stable-baselines3 and functions do not.

    Raises:
        ValueError: a damaged file.
        OSError: a file cannot be read.
    """
    if not isinstance(name, str | os.PathLike):
        return name.training_seeds if isinstance(name, Network) else None
    name = os.fspath(name)
    if name in POLICIES:
        return () if name in _UNTRAINED else (seed_ranges.LEARNING,)
    if other_libraries.find(name) or not _is_path(name):
        return None
    found = [network.load(path).training_seeds for path in _policy_files(Path(name))]
    return None if None in found else tuple(dict.fromkeys(itertools.chain.from_iterable(found)))


def _policy_files(path: Path) -> list[Path]:
    """Files of a run, of all checkpoints in a folder, or the file itself."""
    return network.checkpoint_files(path) or [path / network.FILE if path.is_dir() else path]


def trained(name: str | os.PathLike) -> Network:
    """Return a policy file, the policy of a run's folder, or a zip of stable-baselines3, as a network.

    Raises:
        ValueError: a damaged file, a zip that does not hold its setup, or a network of other layers.
        OSError: a file cannot be read.
    """
    if (policy_file := other_libraries.find(name)) is None:
        made = network.load(name)
        if made.setup.several:
            raise ValueError(f"policy {name}: expected one of one body, or --robot; got one of {made.setup.robot}")
        return made
    if (setup := policy_file.setup()) is None:
        raise ValueError(f"policy {policy_file.path}: {policy_file.reader.NO_SETUP}")
    return policy_file.load().network(setup)


def _is_path(name: str) -> bool:
    return is_file(name) or name.endswith(network.EXTENSION) or (os.sep in name and ":" not in name)


def _from_file(path: Path, body: Body, task: Task | None) -> Policy:
    if policy_file := other_libraries.find(path):
        return _from_other_library(policy_file, body, task)
    made = network.load(path)
    if made.setup.several:
        return registry.resolve(_MANY_BODIES).Universal(made, task or prepare_task(body, "walk")[0])
    _check(path, made.setup, body, task)
    _check_joints(path, made.joints, body)
    return made


def _from_other_library(policy_file: PolicyFile, body: Body, task: Task | None) -> Policy:
    path, setup = policy_file.path, policy_file.setup()
    if setup is None:
        warnings.warn(f"policy {path}: {policy_file.reader.NO_SETUP}", stacklevel=5)
    else:
        _check(path, setup, body, task)
    loaded = policy_file.load()
    _check_joints(path, loaded.joints, body)
    return loaded


def _check(path: Path, setup: Setup, body: Body, task: Task | None) -> None:
    """Raise a ValueError of one line if a policy was trained for another body, or for other actions."""
    if setup.body != body and not (is_robot(setup.body) and setup.body.name == body.name):
        name = "another body of that name" if setup.body.name == body.name else setup.body.name
        raise ValueError(f"policy {path}: made for {name}, and not for {body.name}")
    if task is not None and (actions := setup.definition.actions) != task.actions:
        raise ValueError(f"policy {path}: its actions are a {actions} a joint, and {task.name} takes a {task.actions}")


def _check_joints(path: Path, joints: int, body: Body) -> None:
    if joints != len(body.joint_names):
        raise ValueError(f"policy {path}: moves {joints} joints, and {body.name} has {len(body.joint_names)}")


def _from_path(path: str, body: Body, num_envs: int) -> Policy:
    resolve = _in_file if path.rpartition(":")[0].endswith(MODULE) else pkgutil.resolve_name
    factory = checks.import_object(path, "policy", resolve)
    if not callable(factory):
        raise ValueError(f"policy {checks.preview(path)}: expected a function that makes a policy from a robot's name")
    make = _checked(path, factory, body.name if is_robot(body) else body)
    make()  # finds out at once whether it makes one
    return Individuals(make, num_envs, len(body.joint_names), f"policy {checks.preview(path)}")


def _in_file(path: str) -> Any:
    """Return what `file.py:attribute` stands for; the file is run."""
    file, _, attribute = path.rpartition(":")
    with files.reading(file):
        spec = importlib.util.spec_from_file_location(file, files.plain(file))
    module = sys.modules[file] = importlib.util.module_from_spec(spec)  # type: ignore[arg-type]
    spec.loader.exec_module(module)  # type: ignore[union-attr]
    return getattr(module, attribute)


def _checked(path: str, factory: Callable, robot: str | Body) -> Callable[[], Callable]:
    def make():
        made = factory(robot)
        if not callable(made):
            kind = type(made).__name__
            raise ValueError(
                f"policy {checks.preview(path)}: expected it to return a function of a TimeStep, got {kind}"
            )
        return made

    return make
