"""Checks of what a task returns: the kinds and shapes of its results, and whether they are finite numbers."""

import functools
from collections.abc import Mapping
from typing import Any

import numpy as np

from arc_suite import checks
from arc_suite.cpg.selection import preset_names, presets_of
from arc_suite.envs import trees
from arc_suite.envs.setup import Setup
from arc_suite.simulation.model import simulation_at
from arc_suite.tasks import Task
from arc_suite.tasks.readings import Readings, root_qpos, root_qvel
from arc_suite.tasks.scene import Inputs, Start

_PACKAGE = __name__.partition(".")[0]
_NUM_ENVS = 3  # of the batch in which kinds and shapes are checked
_NUM_FINITE_ENVS = 16  # that random actions move
_READ_ONLY = "read-only"  # in NumPy's error of a write into a frozen array
# What reports and tables say of every episode or policy; a metric of the same name would take its place.
_TAKEN_NAMES = (
    *("provenance", "preset", "zero_return", "paper_return", "return", "score", "no_score", "anchors"),
    *("length", "episodes", "run", "step", "policy_sha256", "seed", "wall_seconds", "cpu_seconds"),
)
_TAKEN_PREFIX = "style_"  # of the metrics of style
_SEPARATORS = frozenset(',"\r\n')  # of the cells of a table


def check_results(setup: Setup) -> None:
    """Call the methods of a task at the start of an episode, alone and in a batch, and check their results.

    Args:
        setup: any.

    Raises:
        ValueError: the first result that is not as `tasks.contract.Task` says. The error names class, method, what was
            expected and what was returned. Errors of the methods themselves pass through.
    """
    task, model = setup.prepare()
    definition = task.unwrapped
    if "scene" not in vars(definition):
        raise ValueError(
            f"{_place(task, '__init__')}: expected a call of super().__init__(scene, settings, step_limit)"
        )
    weights = getattr(task.settings, "weights", None)
    if not isinstance(weights, Mapping):
        _refuse(task, "settings_for", "settings with a field weights, a mapping", task.settings)
    for name, weight in weights.items():
        if not _is_finite_number(weight):
            _refuse(task, "settings_for", f"a finite number as weight of {name!r}", weight)
    known_attributes = set(vars(definition))
    memory, readings = _start_alone(task, model)
    _check_commands(definition, memory)
    _check_demonstrators(definition)
    action = np.full(len(task.scene.body.joint_names), 0.1)
    _check_step(task, memory, readings, action, ())
    _check_step(task, _repeat(memory), _repeat(readings), _repeat(action), (_NUM_ENVS,))
    for name in vars(definition).keys() - known_attributes:
        if not isinstance(getattr(type(definition), name, None), functools.cached_property):
            raise ValueError(
                f"{type(definition).__name__}: a method sets the attribute {name!r}; a task is a frozen value, and its "
                "memory holds what changes"
            )


def check_results_of_others(setup: Setup) -> None:
    """Call `check_results` for a task of another package; the suite's own are as the contract says.

    Raises:
        ValueError: as `check_results`.
    """
    if setup.kind.__module__.partition(".")[0] != _PACKAGE:
        check_results(setup)


def find_non_finite(setup: Setup, steps: int) -> str | None:
    """Return the first term, block or reward of a task under random actions that is not finite; None without one.

    Args:
        setup: any.
        steps: control steps, over one or several episodes.

    Returns:
        Such as "step 3: term 'forward' is nan".
    """
    environments = setup.make_vec(_NUM_FINITE_ENVS, seed=0)
    random = np.random.RandomState(0)
    try:
        observation, _ = environments.reset()
        reward = np.zeros(_NUM_FINITE_ENVS)
        for step in range(steps + 1):
            results = {f"block {name!r}": block for name, block in environments.task.split(observation).items()}
            results |= {f"term {name!r}": term for name, term in environments.task.terms.items()}
            results["reward"] = reward
            for name, numbers in results.items():
                value = _first_non_finite(numbers)
                if value is not None:
                    return f"step {step}: {name} is {value}"
            actions = random.uniform(-1.0, 1.0, environments.action_space.shape)
            observation, reward, *_ = environments.step(actions)
    finally:
        environments.close()
    return None


def _first_non_finite(numbers) -> float | None:
    """Return the first number of an array that is not finite; None without one."""
    flat_numbers = np.ravel(np.asarray(numbers, float))
    non_finite = flat_numbers[~np.isfinite(flat_numbers)]
    return float(non_finite[0]) if non_finite.size else None


def _start_alone(task: Task, model: Any) -> tuple[Any, Readings]:
    """Return memory and readings of one environment at the start of an episode, after checks of both."""
    start = task.start(np.random.RandomState(0), task.first())
    if not isinstance(start, Start):
        _refuse(task, "start", "a Start of arc_suite.tasks.scene", start)
    for name, size in (("qpos", model.nq), ("qvel", model.nv)):
        if np.shape(getattr(start, name)) != (size,):
            _refuse(task, "start", f"{name} of shape {(size,)}", f"shape {np.shape(getattr(start, name))}")
    _check_memory(task, "start", start.memory, start.memory)
    layout = task.scene.layout
    qpos = root_qpos(start.qpos, layout)
    data = simulation_at(model, qpos, root_qvel(start.qvel, qpos, layout), start.mocap_pos)
    readings = task.read(data)
    memory = _call(task, "begin", start.memory, readings)
    _check_memory(task, "begin", memory, start.memory)
    return memory, readings


def _check_step(task: Task, memory, readings: Readings, action: np.ndarray, shape: tuple[int, ...]) -> None:
    """Check the results of one control step, whose leading axes are of a shape."""
    step_inputs = _call(task, "before", memory, action)
    if not (type(step_inputs) is tuple and len(step_inputs) == 2 and isinstance(step_inputs[1], Inputs)):
        _refuse(task, "before", "a pair of a memory and Inputs", step_inputs)
    memory_with_action, _ = step_inputs
    _check_memory(task, "before", memory_with_action, memory)
    next_memory = _call(task, "after", memory_with_action, readings)
    _check_memory(task, "after", next_memory, memory)
    _check_numbers(task, "terms", _call(task, "terms", next_memory, readings), shape)
    metrics = _call(task, "progress", next_memory)
    _check_numbers(task, "progress", metrics, shape)
    _check_metric_names(task, metrics)
    blocks = _call(task, "observe", next_memory, readings)
    if not isinstance(blocks, Mapping):
        _refuse(task, "observe", "a dictionary of blocks by name", blocks)
    for name, block in blocks.items():
        if not isinstance(block, np.ndarray):
            _refuse(task, "observe", f"an array as block {name!r}", block)
        if block.shape[:-1] != shape:
            _refuse(task, "observe", f"block {name!r} of shape {(*shape, 'size')}", f"shape {block.shape}")
    _check_ends(task, _call(task, "ended", next_memory, readings), shape)


def _check_memory(task: Task, method: str, memory, earlier_memory) -> None:
    """Raise ValueError for a memory that is no NamedTuple, or not of the class of the earlier one."""
    if not (isinstance(memory, tuple) and hasattr(memory, "_fields")):
        _refuse(task, method, "a memory, a NamedTuple", memory)
    if type(memory) is not type(earlier_memory):
        _refuse(task, method, f"a memory of class {type(earlier_memory).__name__}", memory)
    for name, field in zip(memory._fields, memory, strict=True):
        for leaf in trees.leaves(field):
            if not checks.is_numeric(leaf):
                _refuse(task, method, f"numbers or arrays as {name!r} of the memory", leaf)


def _check_numbers(task: Task, method: str, numbers: Any, shape: tuple[int, ...]) -> None:
    """Raise ValueError for results that are no mapping from names to numbers of a shape."""
    if not isinstance(numbers, Mapping):
        _refuse(task, method, "a dictionary of numbers by name", numbers)
    for name, value in numbers.items():
        if not checks.is_numeric(value):
            _refuse(task, method, f"a number for each environment as {name!r}", value)
        if np.shape(value) not in ((), shape):
            _refuse(task, method, f"{name!r} of shape {shape}", f"shape {np.shape(value)}")


def _check_metric_names(task: Task, metrics: Mapping) -> None:
    """Raise ValueError for a metric whose name reports or tables cannot hold, or have for another value."""
    for name in metrics:
        if not isinstance(name, str) or _SEPARATORS & set(name):
            _refuse(task, "progress", "a text without commas, quotes and line breaks as name of a metric", name)
        if name in _TAKEN_NAMES or name.startswith(_TAKEN_PREFIX):
            expected = f"another name of a metric, such as 'task_{name}', as tables have their own {name!r}"
            _refuse(task, "progress", expected, name)


def _check_ends(task: Task, ends: Any, shape: tuple[int, ...]) -> None:
    """Raise ValueError if there are not two booleans for each environment."""
    expected = "a pair of booleans, whether the episode is terminated and whether it is truncated"
    if not (isinstance(ends, tuple) and len(ends) == 2):
        _refuse(task, "ended", expected, ends)
    for value in ends:
        if checks.numeric_kind(value) != "b":
            _refuse(task, "ended", expected, ends)
        if np.shape(value) not in ((), shape):
            _refuse(task, "ended", f"booleans of shape {shape}", f"shape {np.shape(value)}")


def _check_commands(definition: Task, memory) -> None:
    """Raise ValueError for a live command that is neither a field of the memory nor set by a method of the task."""
    if type(definition).with_command is not Task.with_command:
        return
    for name in definition.commands:
        if name not in memory._fields:
            raise ValueError(
                f"{type(definition).__name__}.commands: {name!r} is no field of {type(memory).__name__}; expected one, "
                "or a method with_command"
            )


def _check_demonstrators(definition: Task) -> None:
    """Raise ValueError for a demonstrator that no body has."""
    known_names = dict.fromkeys((*presets_of(definition.scene.body), *preset_names()))
    for name in definition.demonstrators:
        checks.name(name, known_names, f"preset in {type(definition).__name__}.demonstrators")


def _call(task: Task, method: str, *arguments):
    """Return the result of a method for arguments into which it cannot write."""
    frozen_arguments = [trees.map_leaves(_freeze, tree) for tree in arguments]
    try:
        return getattr(task, method)(*frozen_arguments)
    except ValueError as error:
        if _READ_ONLY not in str(error):
            raise
        cure = "expected a new memory, such as memory._replace(...)"
        raise ValueError(f"{_place(task, method)}: writes into its arguments; {cure}") from error


def _freeze(leaf):
    """Return a copy of an array into which nothing can write; numbers as they are."""
    if not isinstance(leaf, np.ndarray):
        return leaf
    copied = leaf.copy()
    copied.flags.writeable = False
    return copied


def _repeat(tree):
    """Return a tree with a leading axis of environments that are all alike."""
    return trees.map_leaves(lambda leaf: np.stack([leaf] * _NUM_ENVS), tree)


def _is_finite_number(weight) -> bool:
    return isinstance(weight, int | float | np.number) and bool(np.isfinite(weight))


def _refuse(task: Task, method: str, expected: str, value: Any) -> None:
    """Raise the error of a result, or of a shape in words, that is not as expected."""
    returned = value if isinstance(value, str) and value.startswith("shape ") else checks.preview(value)
    raise ValueError(f"{_place(task, method)}: expected {expected}, got {returned}")


def _place(task: Task, method: str) -> str:
    """Return a method with the class that defines it, as in `Carry.terms`."""
    definition_class = type(task.unwrapped)
    owner = next((base for base in definition_class.__mro__ if method in vars(base)), definition_class)
    return f"{owner.__name__}.{method}"
