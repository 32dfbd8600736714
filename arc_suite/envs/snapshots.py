"""Snapshots of a vector environment: arrays by name, from which another one continues bit-exactly.

Unlike a pickle, arrays of others are data: all are checked before any is used.
"""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite import checks
from arc_suite.envs import trees
from arc_suite.simulation.batch import fitting
from arc_suite.tasks.contract import CHANGEABLE

# Attributes of the environment that are arrays with a leading axis for the environments.
_ARRAYS = ("_stream_seeds", "_streams_begin", "_steps", "_ended", "_resting", "_observation")
# Parts of the state of a RandomState, by their names in a snapshot: types, and the largest sizes.
_RANDOM = {
    "random/keys": (np.uint32, 2**32 - 1),
    "random/positions": (np.int64, 624),
    "random/halves": (np.int64, 1),
    "random/normals": (np.float64, 64),
}


def taken(environment) -> dict[str, np.ndarray]:
    """Return the snapshot of a `VectorEnv` whose episodes have begun."""
    arrays = {f"batch/{name}": array for name, array in environment.batch.snapshot().items()}
    arrays |= {f"memory/{place}": leaf.copy() for place, leaf in enumerate(trees.leaves(environment._memory))}
    arrays |= {name.lstrip("_"): getattr(environment, name).copy() for name in _ARRAYS}
    for index, stream in enumerate(environment._streams):
        arrays |= {f"stream/{index}/{place}": np.asarray(leaf) for place, leaf in enumerate(trees.leaves(stream))}
    states = zip(*(random.get_state()[1:] for random in environment._randoms), strict=True)
    named = zip(_RANDOM.items(), states, strict=True)
    return arrays | {name: np.array(values, kind) for (name, (kind, _)), values in named}


class Checked(NamedTuple):
    """A snapshot that fits an environment: arrays of its batch, memory, streams, other arrays, random states."""

    simulations: Mapping[str, np.ndarray]
    memory: Any
    streams: list
    own: Mapping[str, np.ndarray]
    states: list[tuple]


def checked(environment, arrays: Mapping[str, np.ndarray]) -> Checked:
    """Return the snapshot of a `VectorEnv` whose episodes have begun, ready for `put`.

    Raises:
        ValueError: an array is missing or does not fit.
    """
    try:
        simulations = _of("batch/", arrays)
        environment.batch.checked(simulations, CHANGEABLE)
        memory = (arrays[f"memory/{place}"] for place, _ in enumerate(trees.leaves(environment._memory)))
        memory = trees.mapped(lambda like: fitting("memory", next(memory), like).copy(), environment._memory)
        own = {name: fitting(name, arrays[name.lstrip("_")], getattr(environment, name)).copy() for name in _ARRAYS}
        states = _random_states(arrays, environment.num_envs)
        first = environment._task.first()
        streams = [_refilled(first, _of(f"stream/{index}/", arrays)) for index in range(environment.num_envs)]
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise ValueError(f"snapshot: of another task or number of environments: {checks.quoted(error)}") from None
    return Checked(simulations, memory, streams, own, states)


def put(environment, snapshot: Checked) -> None:
    """Let a `VectorEnv` whose episodes have begun go on from a snapshot."""
    environment.batch.restore(snapshot.simulations)
    environment._memory, environment._streams = snapshot.memory, snapshot.streams
    for name, array in snapshot.own.items():
        setattr(environment, name, array)
    for random, state in zip(environment._randoms, snapshot.states, strict=True):
        random.set_state(state)


def _of(prefix: str, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name.removeprefix(prefix): array for name, array in arrays.items() if name.startswith(prefix)}


def _random_states(arrays: Mapping[str, np.ndarray], count: int) -> list[tuple]:
    for name, (kind, largest) in _RANDOM.items():
        array = fitting(name, arrays[name], np.empty((count, 624) if name.endswith("keys") else count, kind))
        least = 0 if kind is np.int64 else -largest
        if not ((array >= least) & (array <= largest)).all():
            raise ValueError(f"{name}: expected numbers from {least} to {largest}")
    keys, *others = (arrays[name] for name in _RANDOM)
    return [("MT19937", key, *values) for key, *values in zip(keys, *(each.tolist() for each in others), strict=True)]


def _refilled(like, arrays: Mapping[str, np.ndarray]) -> Iterator[np.ndarray]:
    """Return a tree like another one, with the values of arrays."""
    values = (arrays[str(place)] for place, _ in enumerate(trees.leaves(like)))
    return trees.mapped(lambda leaf: _as(fitting("stream", next(values), np.asarray(leaf)), leaf), like)


def _as(value: np.ndarray, like):
    return value if isinstance(like, np.ndarray) else type(like)(value[()])
