"""Snapshots of environments: arrays by name, from which another one continues bit-exactly.

One environment has the snapshot of a vector environment of one. Unlike a pickle, arrays of others are data: all are
checked before any is used.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from arc_suite import checks
from arc_suite.envs import trees
from arc_suite.envs.prepare import with_changes
from arc_suite.simulation.state_arrays import bounded, fitting
from arc_suite.tasks import Task

# Arrays of the driver, with a leading axis for the environments.
OWN = ("stream_seeds", "streams_begin", "steps", "ended", "resting", "observation")
# Parts of the state of a RandomState, by their names in a snapshot: types, and the largest sizes.
_RANDOM = {
    "random/keys": (np.uint32, 2**32 - 1),
    "random/positions": (np.int64, 624),
    "random/halves": (np.int64, 1),
    "random/normals": (np.float64, 64),
}
_SETTINGS = ("settings/present", "settings/next")  # missing where none was changed


class State(NamedTuple):
    """State of environments whose episodes have begun.

    Attributes:
        simulations: arrays of the simulations.
        memory: of the task, with a leading axis for the environments.
        streams: state of each environment's stream.
        randoms: states of each environment's `RandomState`.
        own: arrays of the driver, by the names of `OWN`.
        settings: JSON of changed settings of each environment: of the present episodes, and of the next.
    """

    simulations: Mapping[str, np.ndarray]
    memory: Any
    streams: list
    randoms: list[tuple]
    own: Mapping[str, np.ndarray]
    settings: tuple[list[str], list[str]]


def to_arrays(state: State) -> dict[str, np.ndarray]:
    """Return the snapshot of a state."""
    found = {f"batch/{name}": array for name, array in state.simulations.items()}
    found |= {f"memory/{place}": leaf.copy() for place, leaf in enumerate(trees.leaves(state.memory))}
    found |= state.own
    for index, stream in enumerate(state.streams):
        found |= {f"stream/{index}/{place}": np.asarray(leaf) for place, leaf in enumerate(trees.leaves(stream))}
    columns = zip(*(random[1:] for random in state.randoms), strict=True)
    named = zip(_RANDOM.items(), columns, strict=True)
    found |= {name: np.array(values, kind) for (name, (kind, _)), values in named}
    if any(text != "{}" for texts in state.settings for text in texts):
        found |= {name: np.array(texts) for name, texts in zip(_SETTINGS, state.settings, strict=True)}
    return found


def from_arrays(
    like: State,
    task: Task,
    simulations: Callable[[Mapping[str, np.ndarray]], Any],
    given: Mapping[str, np.ndarray],
    opened: Sequence[Task],
    settings: Mapping[str, Any],
) -> tuple[State, list[list[Task]]]:
    """Return the state of a snapshot, and the tasks of its episodes and of the next ones.

    Args:
        like: the present state of the environments that it is for.
        task: of them all.
        simulations: checks the arrays of the simulations.
        given: the snapshot.
        opened: task of each environment, as it was opened.
        settings: with which.

    Raises:
        ValueError: an array is missing or does not fit.
    """
    try:
        ours = _of("batch/", given)
        simulations(ours)
        memory = _memory(like.memory, task, given)
        own = {name: bounded(name, fitting(name, given[name], array)).copy() for name, array in like.own.items()}
        states = _random_states(given, len(like.streams))
        streams = [_refilled(each.first(), _of(f"stream/{index}/", given)) for index, each in enumerate(opened)]
        texts = tuple(_texts(given.get(name), len(opened)) for name in _SETTINGS)
        tasks = [_tasks(opened, settings, each) for each in texts]
    except (KeyError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise ValueError(f"snapshot: of another task or number of environments: {checks.quote(error)}") from None
    return State(ours, memory, streams, states, own, texts), tasks


def _of(prefix: str, given: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name.removeprefix(prefix): array for name, array in given.items() if name.startswith(prefix)}


def _memory(like, task: Task, given: Mapping[str, np.ndarray]) -> Any:
    """A memory with the values of a snapshot; NaN stands where a command may be missing."""
    free, count = like, len(next(trees.leaves(like)))
    for name, size in task.commands.items():
        free = task.with_command(free, name, np.full((count, size), np.nan))
    places = iter(range(len(list(trees.leaves(like)))))

    def filled(old, commanded):
        name = f"memory/{next(places)}"
        return bounded("memory", fitting("memory", given[name], old), np.isnan(commanded)).copy()

    return trees.map_leaves(filled, like, free)


def _random_states(given: Mapping[str, np.ndarray], count: int) -> list[tuple]:
    for name, (kind, largest) in _RANDOM.items():
        array = fitting(name, given[name], np.empty((count, 624) if name.endswith("keys") else count, kind))
        least = 0 if kind is np.int64 else -largest
        if not ((array >= least) & (array <= largest)).all():
            raise ValueError(f"{name}: expected numbers from {least} to {largest}")
    keys, *others = (given[name] for name in _RANDOM)
    return [("MT19937", key, *values) for key, *values in zip(keys, *(each.tolist() for each in others), strict=True)]


def _refilled(like, given: Mapping[str, np.ndarray]) -> Any:
    """Return a tree like another one, with the values of arrays."""
    values = (given[str(place)] for place, _ in enumerate(trees.leaves(like)))
    return trees.map_leaves(lambda leaf: number(_stream(next(values), np.asarray(leaf)), leaf), like)


def _stream(value: np.ndarray, like: np.ndarray) -> np.ndarray:
    return bounded("stream", fitting("stream", value, like), np.isnan(like))


def number(value: np.ndarray, like) -> Any:
    """Return an array as a number of the type of another one, or as it is."""
    return value if isinstance(like, np.ndarray) else type(like)(value[()])


def _texts(given: np.ndarray | None, count: int) -> list[str]:
    if given is None:
        return ["{}"] * count
    if given.shape != (count,) or given.dtype.kind != "U":
        raise ValueError(f"settings: expected {count} texts, got {given.dtype} {given.shape}")
    return given.tolist()


def _tasks(opened: Sequence[Task], settings: Mapping[str, Any], texts: Sequence[str]) -> list[Task]:
    found: dict[tuple[int, str], Task] = {}
    keys = [(id(task), text) for task, text in zip(opened, texts, strict=True)]
    for key, task in zip(keys, opened, strict=True):
        if key not in found:
            found[key] = with_changes(task, settings, key[1])
    return [found[key] for key in keys]
