"""Policies by name: those of the suite, files of trained policies, and functions on Python's path."""

import hashlib
import importlib.util
import itertools
import os
import pkgutil
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from arc_suite import checks, files, registry, seed_ranges, usage
from arc_suite.cpg import Demonstrator, suited_preset
from arc_suite.cpg.selection import check_preset_name, preset_names
from arc_suite.envs.prepare import prepare_task
from arc_suite.envs.setup import Setup
from arc_suite.policies import hints, network, other_libraries
from arc_suite.policies.network import PACKAGED, Network
from arc_suite.policies.other_libraries import PolicyFile
from arc_suite.policies.protocol import Individuals, Mixture, Policy, Script, Sum
from arc_suite.robots import is_robot
from arc_suite.robots.spec import Body
from arc_suite.tasks import Task

PYTHON_EXTENSION = ".py"  # of a file with a function that makes a policy
_UNIVERSAL_MODULE = "arc_suite.bodies.universal"  # of policies that were trained with many bodies
_STEPS_PER_DRAW = 256  # control steps
_STACK_LEVEL = 5  # of warnings from a check of a network: where the function was called that calls `policy`


def _cpg(body: Body, presets: Sequence[str], num_envs: int, task: Task | None) -> Policy:
    if not presets:
        raise ValueError(f"preset: expected one or more of {', '.join(preset_names())}, got none")
    demonstrators = [Demonstrator(task or body, preset) for preset in presets]
    if len(demonstrators) == 1:
        return demonstrators[0]
    return Mixture(demonstrators, num_envs)


def _zero(body: Body, presets: Sequence[str], num_envs: int, task: Task | None) -> Policy:
    return Script(lambda seed: (), num_envs, len(body.joint_names))


def _random(body: Body, presets: Sequence[str], num_envs: int, task: Task | None) -> Policy:
    return _draw_actions(body, num_envs, np.random.default_rng, lambda random, shape: random.uniform(-1.0, 1.0, shape))


def is_packaged(body: Body, task_name: str) -> bool:
    """Return whether the package has a trained policy of a body for a task: `ppo`."""
    return is_robot(body) and _packaged_path(body, task_name).is_file()


def _packaged_path(body: Body, task_name: str) -> Path:
    return PACKAGED / f"{body.name}-{task_name}{network.EXTENSION}"


def _ppo(body: Body, presets: Sequence[str], num_envs: int, task: Task | None) -> Policy:
    """Return a trained policy of the package; `policies.json` holds its command, hash and return."""
    task_name = "walk" if task is None else task.name
    path = _packaged_path(body, task_name)
    if not is_packaged(body, task_name):
        choices = checks.list_choices(sorted(file.stem for file in PACKAGED.glob(f"*{network.EXTENSION}")))
        hint = "arc-suite train makes others, and universal moves any body"
        raise ValueError(f"policy ppo: none for {path.stem} {choices}; {hint}")
    return _fit_network(f"policy {path}", network.load(path), body, task)


def _universal(body: Body, presets: Sequence[str], num_envs: int, task: Task | None) -> Policy:
    """Return the policy of any body of the package, for walk or for tasks with a command.

    Warns:
        UserWarning: a body whose motors or timesteps the suite did not choose, unlike those of the policy's training.
    """
    if body.source or body.simulation or any(joint.motor for joint in body.joints):
        text = f"policy universal: may fall or hardly walk, as {body.name} brings motors or timesteps of its own"
        warnings.warn(text, stacklevel=_STACK_LEVEL - 1)
    if task is None:
        task, _ = prepare_task(body, "walk")
    universal = registry.resolve(_UNIVERSAL_MODULE)
    return universal.Universal(universal.load(universal.NAME, task), task)


# By name: a function that makes a policy from a body, presets, a number of environments and a task or None. All take
# the same arguments, so that `policy` calls each alike; most of them use some only.
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
    presets: str | Sequence[str] | None = None,
    num_envs: int = 1,
    noise: float = 0.0,
    task: Task | None = None,
) -> Policy:
    """Make a policy for a batch of environments, or for one environment; see `protocol.alone`.

    Args:
        name: cpg, the demonstrator; zero, which does nothing; random, uniform in [-1, 1] by the
            episode's seed; ppo, a trained policy of the package for one robot; universal, one for any body; the path
            of a run's folder, of a policy file (.npz), see `network`, or of a folder of checkpoints, which take turns
            from seed to seed, see `checkpoints`; the path of a zip of stable-baselines3, see `zips`;
            `module:attribute`, a function on Python's path; or `file.py:attribute`, a function in a file of any name.
            A function takes the name of a robot, or another body, and returns a function from a `TimeStep` to an
            action.
        robot: a body; see `registry.body_of`.
        presets: presets of the demonstrator, a name or several that take turns from seed to seed, see
            `cpg.Demonstrator`; None for the one that suits the task and the body. Other policies take none.
        num_envs: number of environments.
        noise: standard deviation of normal noise on the actions, by the episode's seed.
        task: the task in which it acts, to which the demonstrator is fitted. None for walk with default settings.

    Raises:
        ValueError: an unknown name, or a value out of range.
        OSError: a file that cannot be read.
    """
    body = registry.body_of(robot)
    if presets is None and name == "cpg":
        presets = suited_preset(prepare_task(body, "walk")[0] if task is None else task)
    if presets is None:
        presets = ()
    preset_list = (presets,) if isinstance(presets, str) else tuple(presets)
    for preset in preset_list:
        check_preset_name(preset)
        check_preset(name, preset)
    checks.number("noise", noise, 0.0)
    source = None
    if isinstance(name, str | os.PathLike) and name not in POLICIES:
        hints.refuse_other_files(name)
        source = _find_source(name)
    if isinstance(source, PolicyFile):
        named_policy = _from_other_library(source, body, task)
    elif isinstance(source, NetworkPath):
        networks = {path: network.load(path) for path in network.checkpoint_files(source.path)}
        if networks:
            checkpoints = [_fit_network(f"policy {path}", networks[path], body, task) for path in networks]
            named_policy = Mixture(checkpoints, num_envs)
        else:
            named_policy = _fit_network(f"policy {source.path}", network.load(source.path), body, task)
    elif isinstance(source, FunctionName):
        named_policy = _from_function(source, body, num_envs)
    else:
        hints.refuse_other_words(name, POLICIES)
        make = POLICIES[checks.name(name, POLICIES, "policy")]
        named_policy = make(body, preset_list, num_envs, task)
    return Sum(named_policy, _noise(body, noise, num_envs)) if noise else named_policy


def check_preset(policy_name: Any, preset: str | None) -> None:
    """Raise ValueError for a preset of a policy other than the demonstrator: it has no effect.

    Args:
        policy_name: name of a policy, or the policy.
        preset: preset of the demonstrator; None for none.
    """
    if preset is not None and policy_name != "cpg":
        raise ValueError(
            f"preset {checks.preview(preset)}: goes with the policy cpg, got {checks.preview(policy_name)}"
        )


def acting(source, task: Task, presets: str | Sequence[str] | None = None) -> Policy:
    """Return a policy for one environment.

    Args:
        source: a name or a path, as of `policy`; a `Network`; another policy for one environment; or a function of
            a `TimeStep` with named blocks.
        task: the task in which it acts.
        presets: presets of the demonstrator, see `policy`.

    Raises:
        ValueError: something else, a network of another body or of other actions, or as `policy`.
        OSError: as `policy`.
    """
    body = task.scene.body
    if isinstance(source, str | os.PathLike):
        return policy(os.fspath(source), body, presets, task=task)
    if isinstance(source, Network):
        return _fit_network("policy", source, body, task)
    if hasattr(source, "act"):
        return source
    if callable(source):
        return Individuals(lambda: source, 1, len(body.joint_names))
    raise ValueError(f"policy: expected a name, a policy or a function of a TimeStep, got {type(source).__name__}")


def _noise(body: Body, deviation: float, num_envs: int) -> Policy:
    def begin(seed):
        return np.random.default_rng((seed, 1))  # another stream than that of the random policy

    return _draw_actions(body, num_envs, begin, lambda random, shape: random.normal(0.0, deviation, shape))


def _draw_actions(body: Body, num_envs: int, begin: Callable, draw: Callable) -> Policy:
    """Return a policy of random actions.

    Args:
        body: body that acts.
        num_envs: number of environments.
        begin: makes the random generator of an episode, from its seed.
        draw: draws actions of a shape with a generator.
    """
    joints = len(body.joint_names)

    def draw_episode(seed):
        random = begin(seed)
        while True:
            yield from draw(random, (_STEPS_PER_DRAW, joints))

    return Script(draw_episode, num_envs, joints)


def is_file(name: str) -> bool:
    """Return whether a name is that of a folder of a run or of checkpoints, or of a file of another library."""
    source = _find_source(name)
    return isinstance(source, PolicyFile) or (isinstance(source, NetworkPath) and source.has_networks())


def function_file(name: str) -> Path | None:
    """Return the file of the function that a policy's name gives; None for other names, and without a file."""
    source = _find_source(name)
    return source.file() if isinstance(source, FunctionName) else None


def digest(name: str) -> str:
    """Return the sha256 of the content of a policy; times and compression of files do not count.

    It is that of a network, see `network.digest`, of those of all checkpoints, of the members of a zip with its
    statistics, or of the file of a function. Files that a function imports or reads do not count; see `frozen`.

    Raises:
        ValueError: a damaged file, or one of another library without a file that belongs to it.
        OSError: a file cannot be read.
    """
    source = _find_source(name)
    if isinstance(source, PolicyFile):
        return source.digest()
    code = source.file() if isinstance(source, FunctionName) else None
    if code is not None:
        return hashlib.sha256(code.read_bytes()).hexdigest()
    digests = [network.digest(network.load(path)) for path in NetworkPath(Path(name)).files()]
    if len(digests) == 1:
        return digests[0]
    return hashlib.sha256("".join(digests).encode()).hexdigest()


def setup_of(name) -> Setup | None:
    """Return the setup in which a policy was trained; None for a policy that is no network, or without a file.

    Args:
        name: name of a policy, or the policy. Of a zip of stable-baselines3, only the setup is read, which may be
            missing.

    Raises:
        ValueError: a damaged file, or a robot, task or arena whose module has not been imported.
        OSError: a file cannot be read.
    """
    if not isinstance(name, str | os.PathLike):
        return name.setup if isinstance(name, Network) else None
    if name in POLICIES:
        return None
    hints.refuse_other_files(name)
    source = _find_source(name)
    if isinstance(source, PolicyFile):
        return source.setup()
    if isinstance(source, NetworkPath) and source.path.exists():
        return network.load(source.files()[0]).setup
    return None


def training_seeds(name) -> seed_ranges.Ranges | None:
    """Return the seeds of the episodes in which a policy, or that of a name, was trained; None if they are unknown.

    Those of demonstrators and of the trained policies of the package are `seed_ranges.LEARNING`. Files of policies hold
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
    source = _find_source(name)
    if not isinstance(source, NetworkPath):
        return None
    ranges_of_files = [network.load(path).training_seeds for path in source.files()]
    if None in ranges_of_files:
        return None
    return tuple(dict.fromkeys(itertools.chain.from_iterable(ranges_of_files)))


def load_network(name: str | os.PathLike[str]) -> Network:
    """Return the network of a policy file, of a run's folder, or of a zip of stable-baselines3.

    Raises:
        ValueError: a damaged file, a zip that does not hold its setup, or a network of other layers.
        OSError: a file cannot be read.
    """
    hints.refuse_other_files(name)
    source = _find_source(name)
    if not isinstance(source, PolicyFile):
        policy_network = network.load(name)
        setup = policy_network.setup
        if setup.several:
            raise ValueError(f"policy {name}: expected one of one body, or --robot; got one of {setup.robot}")
        return policy_network
    setup = source.setup()
    if setup is None:
        raise ValueError(f"policy {source.path}: {source.reader.NO_SETUP}")
    return source.load().network(setup)


class NetworkPath(NamedTuple):
    """Where networks lie, if it exists.

    Attributes:
        path: a policy file, the folder of a run, or a folder of checkpoints.
    """

    path: Path

    def has_networks(self) -> bool:
        """Return whether it is the folder of a run or of checkpoints."""
        try:
            return (self.path / network.FILE).is_file() or bool(network.checkpoint_files(self.path))
        except OSError:  # the text is too long for a path
            return False

    def files(self) -> list[Path]:
        """Return the files of all checkpoints in a folder, or the path itself, which `network.load` takes."""
        checkpoints = network.checkpoint_files(self.path)
        if checkpoints:
            return checkpoints
        return [self.path]


class FunctionName(NamedTuple):
    """The name of a function that makes a policy.

    Attributes:
        text: `module:attribute` or `file.py:attribute`.
    """

    text: str

    @property
    def module(self) -> str:
        """A module on Python's path, or a file of Python."""
        return self.text.rpartition(":")[0]

    @property
    def is_in_file(self) -> bool:
        """Whether the module is given as a file."""
        return self.module.endswith(PYTHON_EXTENSION)

    def file(self) -> Path | None:
        """Return the file of the function; None without one."""
        if self.is_in_file:
            return Path(self.module)
        try:
            spec = importlib.util.find_spec(self.module)
        except (ImportError, ValueError):
            return None
        if spec is None or not spec.has_location:
            return None
        return Path(spec.origin)


def _find_source(name: str | os.PathLike[str]) -> PolicyFile | NetworkPath | FunctionName | None:
    """Return what a policy's name leads to; None for a word, which is one of the suite or unknown.

    All functions here learn from it of which kind a name is.
    """
    text = os.fspath(name)
    if name in POLICIES:
        return None
    policy_file = other_libraries.find(text)
    if policy_file is not None:
        return policy_file
    network_path = NetworkPath(Path(text))
    if isinstance(name, os.PathLike) or text.lower().endswith(network.EXTENSION) or network_path.has_networks():
        return network_path
    if ":" in text:
        return FunctionName(text)
    if os.sep in text or files.is_folder(text) or os.path.isfile(text):
        return network_path
    return None


def _fit_network(label: str, policy_network: Network, body: Body, task: Task | None) -> Policy:
    """Return the policy of a network for a body and a task; one of many bodies acts in the order of the body's legs.

    Args:
        label: beginning of errors and warnings.
        policy_network: network of one body, or of many.
        body: body that acts.
        task: task in which it acts, None for walk.

    Raises:
        ValueError: a network of another body, or of other actions.
    """
    if policy_network.setup.several:
        if task is None:
            task, _ = prepare_task(body, "walk")
        return registry.resolve(_UNIVERSAL_MODULE).Universal(policy_network, task)
    _check_setup(label, policy_network.setup, body, task)
    _check_joints(label, policy_network.joints, body)
    _warn_of_other_model(label, policy_network)
    return policy_network


def _from_other_library(policy_file: PolicyFile, body: Body, task: Task | None) -> Policy:
    label = f"policy {policy_file.path}"
    setup = policy_file.setup()
    if setup is None:
        warnings.warn(f"{label}: {policy_file.reader.NO_SETUP}", stacklevel=_STACK_LEVEL - 1)
    else:
        _check_setup(label, setup, body, task)
    loaded = policy_file.load()
    _check_joints(label, loaded.joints, body)
    return loaded


def _check_setup(label: str, setup: Setup, body: Body, task: Task | None) -> None:
    """Raise ValueError if a policy was trained for another body, or for other actions."""
    is_robot_of_name = is_robot(setup.body) and setup.body.name == body.name
    if not setup.body.moves_like(body):
        if not is_robot_of_name:
            name = "another body of that name" if setup.body.name == body.name else setup.body.name
            raise ValueError(f"{label}: made for {name}, and not for {body.name}")
        warnings.warn(f"{label}: learned with another {body.name} than this one", stacklevel=_STACK_LEVEL)
    actions = setup.definition.actions
    if task is not None and actions != task.actions:
        raise ValueError(f"{label}: its actions are a {actions} a joint, and {task.name} takes a {task.actions}")


def _warn_of_other_model(label: str, policy_network: Network) -> None:
    """Warn if the model of a policy's training has changed since, with its robot, its task or the suite."""
    setup = policy_network.setup
    if policy_network.physics_sha256 not in (None, setup.physics_sha256):
        text = f"{label}: the model of {setup.name}, {setup.task_label} has changed since its training"
        warnings.warn(text, stacklevel=_STACK_LEVEL)


def _check_joints(label: str, joints: int, body: Body) -> None:
    if joints != len(body.joint_names):
        raise ValueError(f"{label}: moves {joints} joints, and {body.name} has {len(body.joint_names)}")


def _from_function(function: FunctionName, body: Body, num_envs: int) -> Policy:
    usage.add_source(usage.POLICY)
    path = function.text
    resolve = _resolve_in_file if function.is_in_file else pkgutil.resolve_name
    factory = checks.import_object(path, "policy", resolve)
    if not callable(factory):
        raise ValueError(f"policy {checks.preview(path)}: expected a function that makes a policy from a robot's name")
    hints.check_takes_robot(path, factory)
    make = _add_check(path, factory, body.name if is_robot(body) else body)
    make()  # raises an error at once if the function does not fit
    return _NamedFunctions(make, num_envs, len(body.joint_names), f"policy {checks.preview(path)}")


class _NamedFunctions(Individuals):
    """The functions that a name leads to. A run that acts by them uses a policy."""

    def act(self, observation: Mapping[str, np.ndarray], rewards: np.ndarray) -> np.ndarray:
        usage.add_source(usage.POLICY)
        return super().act(observation, rewards)


def _resolve_in_file(path: str) -> Any:
    """Return the object that `file.py:attribute` names; the file is run."""
    file, _, attribute = path.rpartition(":")
    with files.reading(file):
        spec = importlib.util.spec_from_file_location(file, files.plain(file))
    module = importlib.util.module_from_spec(spec)  # type: ignore[arg-type]
    sys.modules[file] = module
    spec.loader.exec_module(module)  # type: ignore[union-attr]
    return getattr(module, attribute)


def _add_check(path: str, factory: Callable, robot: str | Body) -> Callable[[], Callable]:
    """Return a function that calls another one and checks that it returns a function."""

    def make():
        act = factory(robot)
        if not callable(act):
            kind = type(act).__name__
            raise ValueError(
                f"policy {checks.preview(path)}: expected it to return a function of a TimeStep, got {kind}"
                f"{hints.suggest_method(act)}"
            )
        return act

    return make
