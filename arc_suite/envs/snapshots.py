"""Snapshots of environments: arrays by name, from which another environment continues bit-exactly.

A single environment has the snapshot of a vector environment of one. Unlike a pickle, the arrays may come from
others: they are data, and all are checked before any is used.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from arc_suite import parsers
from arc_suite.envs import setup_facts, trees
from arc_suite.envs.prepare import with_changes
from arc_suite.simulation.state_arrays import check_finite, check_same_form
from arc_suite.tasks import Task

# Names of the arrays of the environment itself, as opposed to its simulations and its task. They have a leading axis
# for the environments. A `VectorEnv` has each as an attribute, with an underscore before the name.
ENVIRONMENT_ARRAYS = ("stream_seeds", "streams_begin", "steps", "ended", "resting", "observation")


class _RandomArray(NamedTuple):
    """An array with one part of the states of all `RandomState`s.

    Attributes:
        dtype: dtype of the array.
        smallest: smallest valid number.
        largest: largest valid number.
    """

    dtype: type
    smallest: int
    largest: int


_GENERATOR = "MT19937"  # of `RandomState(seed)`
_KEY_COUNT = 624  # numbers in the key of the Mersenne Twister
# By name, in the order of the parts of `RandomState.get_state()` after the generator's name: keys, pos, has_gauss and
# cached_gaussian. The generator draws normal numbers in pairs, of which the last two parts store the second.
_RANDOM_ARRAYS = {
    "random/keys": _RandomArray(np.uint32, 0, 2**32 - 1),
    "random/positions": _RandomArray(np.int64, 0, _KEY_COUNT),
    "random/halves": _RandomArray(np.int64, 0, 1),
    "random/normals": _RandomArray(np.float64, -64, 64),
}
# Bytes (setups, bytes) of the JSON of each setup, see `setup_facts`, and the setup's index of each environment.
# Snapshots of earlier versions have neither.
_SETUPS = "setup/facts"
_SETUP_INDICES = "setup/indices"
_STREAM_PREFIX = "stream/"  # then the index of the environment, and of the leaf
_SETTINGS_ARRAYS = ("settings/present", "settings/next")  # snapshots have them only if a setting was changed


class State(NamedTuple):
    """State of environments whose episodes have begun.

    Attributes:
        simulations: arrays of the simulations by name.
        memory: memory of the task, with a leading axis for the environments.
        streams: state of each environment's stream of episodes; see `Task.stream_state`.
        randoms: state of each environment's `RandomState`, as its `get_state` returns it.
        environment_arrays: by the names of `ENVIRONMENT_ARRAYS`.
        settings: JSON of the changed settings of each environment: of the present episodes, and of the next ones.
    """

    simulations: Mapping[str, np.ndarray]
    memory: Any
    streams: list
    randoms: list[Any]
    environment_arrays: Mapping[str, np.ndarray]
    settings: tuple[list[str], list[str]]


def check_generator(random: np.random.RandomState) -> None:
    """Raise ValueError for a generator whose state no snapshot holds, such as PCG64 of `default_rng`."""
    generator = type(random._bit_generator).__name__
    if generator != _GENERATOR:
        raise ValueError(
            f"random: snapshots hold states of {_GENERATOR} alone, got {generator}; "
            "reset(seed=...) or np.random.RandomState(seed) begins such a stream"
        )


def to_arrays(state: State, opened_tasks: Sequence[Task]) -> dict[str, np.ndarray]:
    """Return the snapshot of a state, given the task of each environment with the settings of its opening."""
    arrays = {f"batch/{name}": array for name, array in state.simulations.items()}
    arrays |= _setup_arrays(opened_tasks)
    for leaf_index, leaf in enumerate(trees.leaves(state.memory)):
        arrays[f"memory/{leaf_index}"] = leaf.copy()
    arrays |= state.environment_arrays
    for index, stream in enumerate(state.streams):
        for leaf_index, leaf in enumerate(trees.leaves(stream)):
            arrays[_stream_name(index, leaf_index)] = np.asarray(leaf)
    for part_index, (name, random_array) in enumerate(_RANDOM_ARRAYS.items(), start=1):  # part 0 is a name
        values = [random_state[part_index] for random_state in state.randoms]
        arrays[name] = np.array(values, random_array.dtype)
    present_texts, next_texts = state.settings
    if any(text != "{}" for text in [*present_texts, *next_texts]):
        for name, texts in zip(_SETTINGS_ARRAYS, state.settings, strict=True):
            arrays[name] = np.array(texts)
    return arrays


def from_arrays(
    like: State,
    task: Task,
    check_simulations: Callable[[Mapping[str, np.ndarray]], Any],
    arrays: Mapping[str, np.ndarray],
    opened_tasks: Sequence[Task],
    settings: Mapping[str, Any],
) -> tuple[State, list[list[Task]]]:
    """Return the state of a snapshot, and the tasks of its episodes and of the next ones.

    Args:
        like: the present state of the environments that will continue from the snapshot; shapes must be equal.
        task: task of all these environments together.
        check_simulations: raises ValueError for arrays of the simulations that do not fit.
        arrays: the snapshot.
        opened_tasks: task of each environment with the settings with which it was opened.
        settings: these settings.

    Raises:
        ValueError: another setup, or an array is missing or does not fit.
    """
    with parsers.guard("snapshot: of another setup or number of environments"):
        _check_setups(opened_tasks, arrays)
        simulations = _with_prefix("batch/", arrays)
        check_simulations(simulations)
        memory = _read_memory(like.memory, task, arrays)
        environment_arrays = {}
        for name, array in like.environment_arrays.items():
            environment_arrays[name] = check_finite(name, check_same_form(name, arrays[name], array)).copy()
        randoms = _read_randoms(arrays, len(like.streams))
        streams = []
        for index, opened_task in enumerate(opened_tasks):
            streams.append(_read_stream(opened_task.first(), _with_prefix(f"{_STREAM_PREFIX}{index}/", arrays)))
        present_texts, next_texts = (_read_texts(arrays.get(name), len(opened_tasks)) for name in _SETTINGS_ARRAYS)
        present_tasks = _change_tasks(opened_tasks, settings, present_texts)
        next_tasks = _change_tasks(opened_tasks, settings, next_texts)
    state = State(simulations, memory, streams, randoms, environment_arrays, (present_texts, next_texts))
    return state, [present_tasks, next_tasks]


def select_environments(arrays: Mapping[str, np.ndarray], environments: range) -> dict[str, np.ndarray]:
    """Return the snapshot of some successive environments, from that of more environments of the same setup."""
    rows = slice(environments.start, environments.stop)
    selected_arrays = {}
    for name, array in arrays.items():
        if name.startswith(_STREAM_PREFIX):
            index, leaf = _split_stream_name(name)
            if index in environments:
                selected_arrays[_stream_name(index - environments.start, leaf)] = array
        else:
            selected_arrays[name] = array if name == _SETUPS else array[rows]
    return selected_arrays


def join_environments(snapshots: Sequence[Mapping[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Return the snapshot of the environments of all snapshots, which are of the same setup.

    Raises:
        KeyError, ValueError: a snapshot lacks an array, or has one of another shape.
    """
    joint_arrays = {}
    for name, array in snapshots[0].items():
        if name == _SETUPS:
            joint_arrays[name] = array
        elif not name.startswith(_STREAM_PREFIX):
            joint_arrays[name] = np.concatenate([snapshot[name] for snapshot in snapshots])
    first_index = 0
    for snapshot in snapshots:
        for name, array in snapshot.items():
            if name.startswith(_STREAM_PREFIX):
                index, leaf = _split_stream_name(name)
                joint_arrays[_stream_name(first_index + index, leaf)] = array
        first_index += len(snapshot["steps"])
    return joint_arrays


def _stream_name(index: int, leaf: int | str) -> str:
    """Return the name of the array of a leaf of an environment's stream."""
    return f"{_STREAM_PREFIX}{index}/{leaf}"


def _split_stream_name(name: str) -> tuple[int, str]:
    """Return the index of the environment, and the leaf, of the name of an array of a stream."""
    index, leaf = name.removeprefix(_STREAM_PREFIX).split("/")
    return int(index), leaf


def to_number_like(value: np.ndarray, like) -> Any:
    """Return an array () as a number of the type of `like`; if `like` is an array, return the array as it is."""
    if isinstance(like, np.ndarray):
        return value
    return type(like)(value[()])


def _setup_arrays(opened_tasks: Sequence[Task]) -> dict[str, np.ndarray]:
    """Return the arrays with the facts of the environments' setups."""
    facts = [setup_facts.describe(task) for task in opened_tasks]
    different_facts = list(dict.fromkeys(facts))
    indices = [different_facts.index(text) for text in facts]
    encoded_facts = [text.encode() for text in different_facts]
    width = max(map(len, encoded_facts))
    rows = [np.frombuffer(text.ljust(width), np.uint8) for text in encoded_facts]
    return {_SETUPS: np.stack(rows), _SETUP_INDICES: np.array(indices)}


def _check_setups(opened_tasks: Sequence[Task], arrays: Mapping[str, np.ndarray]) -> None:
    """Refuse a snapshot of other setups than those of the environments.

    Raises:
        ValueError: another body, task, arena or setting.
        KeyError: one of the two arrays is missing.
    """
    if _SETUPS not in arrays and _SETUP_INDICES not in arrays:  # of an earlier version
        return
    rows = np.asarray(arrays[_SETUPS])
    if rows.ndim != 2 or rows.dtype != np.uint8:
        raise ValueError(f"{_SETUPS}: expected uint8 (setups, bytes), got {rows.dtype} {rows.shape}")
    texts = [row.tobytes().decode() for row in rows]
    facts_here = [setup_facts.describe(task) for task in opened_tasks]
    indices = check_same_form(_SETUP_INDICES, arrays[_SETUP_INDICES], np.zeros(len(facts_here), int))
    if not ((indices >= 0) & (indices < len(texts))).all():
        raise ValueError(f"{_SETUP_INDICES}: expected numbers from 0 to {len(texts) - 1}")
    pairs = zip(facts_here, indices.tolist(), strict=True)
    for facts, index in dict.fromkeys(pairs):  # equal pairs once
        setup_facts.check_equal(facts, texts[index])


def _with_prefix(prefix: str, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return the arrays whose names begin with a prefix, by name without it."""
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}


def _read_memory(like, task: Task, arrays: Mapping[str, np.ndarray]) -> Any:
    """Return the memory of a snapshot: a tree like another memory."""
    num_envs = len(next(trees.leaves(like)))
    # A memory in which NaN marks the places of live commands: there a snapshot may have NaN, too.
    marked_memory = like
    for name, size in task.commands.items():
        marked_memory = task.with_command(marked_memory, name, np.full((num_envs, size), np.nan))
    leaf_indices = iter(range(len(list(trees.leaves(like)))))

    def read_leaf(leaf, marked_leaf):
        array = arrays[f"memory/{next(leaf_indices)}"]
        return check_finite("memory", check_same_form("memory", array, leaf), np.isnan(marked_leaf)).copy()

    return trees.map_leaves(read_leaf, like, marked_memory)


def _read_randoms(arrays: Mapping[str, np.ndarray], num_envs: int) -> list[tuple]:
    """Return the state of each environment's `RandomState`."""
    for name, (dtype, smallest, largest) in _RANDOM_ARRAYS.items():
        shape = (num_envs, _KEY_COUNT) if name == "random/keys" else (num_envs,)
        array = check_same_form(name, arrays[name], np.empty(shape, dtype))
        if not ((array >= smallest) & (array <= largest)).all():
            raise ValueError(f"{name}: expected numbers from {smallest} to {largest}")
    keys, positions, halves, normals = (arrays[name] for name in _RANDOM_ARRAYS)
    parts = zip(keys, positions.tolist(), halves.tolist(), normals.tolist(), strict=True)
    return [(_GENERATOR, *parts_of_state) for parts_of_state in parts]


def _read_stream(like, leaves_by_index: Mapping[str, np.ndarray]) -> Any:
    """Return the stream state of a snapshot: a tree like another stream state."""
    leaf_indices = iter(range(len(list(trees.leaves(like)))))

    def read_leaf(leaf):
        array = leaves_by_index[str(next(leaf_indices))]
        leaf_array = np.asarray(leaf)
        checked_array = check_finite("stream", check_same_form("stream", array, leaf_array), np.isnan(leaf_array))
        return to_number_like(checked_array, leaf)

    return trees.map_leaves(read_leaf, like)


def _read_texts(array: np.ndarray | None, count: int) -> list[str]:
    """Return the JSON of the changed settings of each environment; of no changes if the snapshot has no array."""
    if array is None:
        return ["{}"] * count
    if array.shape != (count,) or array.dtype.kind != "U":
        raise ValueError(f"settings: expected {count} texts, got {array.dtype} {array.shape}")
    return array.tolist()


def _change_tasks(opened_tasks: Sequence[Task], settings: Mapping[str, Any], texts: Sequence[str]) -> list[Task]:
    """Return the task of each environment with changed settings; equal changes of one task give one task."""
    changed_tasks: dict[tuple[int, str], Task] = {}
    tasks = []
    for opened_task, text in zip(opened_tasks, texts, strict=True):
        key = (id(opened_task), text)
        if key not in changed_tasks:
            changed_tasks[key] = with_changes(opened_task, settings, text)
        tasks.append(changed_tasks[key])
    return tasks
