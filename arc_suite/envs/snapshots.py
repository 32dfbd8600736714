"""Snapshots of a vector environment: arrays by name, from which another one continues bit-exactly.

Unlike a pickle, arrays of others are data.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from arc_suite import checks
from arc_suite.envs import trees

# Attributes of the environment that are arrays with a leading axis for the environments.
_ARRAYS = ("_stream_seeds", "_streams_begin", "_steps", "_ended", "_resting", "_observation")


def taken(environment) -> dict[str, np.ndarray]:
    """Return the snapshot of a `VectorEnv` whose episodes have begun."""
    keys, positions, halves, normals = [], [], [], []
    for random in environment._randoms:
        _, key, position, half, normal = random.get_state()
        keys.append(key), positions.append(position), halves.append(half), normals.append(normal)
    arrays = {f"batch/{name}": array for name, array in environment.batch.snapshot().items()}
    arrays |= {f"memory/{place}": leaf.copy() for place, leaf in enumerate(trees.leaves(environment._memory))}
    arrays |= {name.lstrip("_"): getattr(environment, name).copy() for name in _ARRAYS}
    for index, stream in enumerate(environment._streams):
        arrays |= {f"stream/{index}/{place}": np.asarray(leaf) for place, leaf in enumerate(trees.leaves(stream))}
    return arrays | {
        "random/keys": np.array(keys),
        "random/positions": np.array(positions),
        "random/halves": np.array(halves),
        "random/normals": np.array(normals),
    }


def put(environment, arrays: Mapping[str, np.ndarray]) -> None:
    """Let a `VectorEnv` whose episodes have begun go on from a snapshot.

    Raises:
        ValueError: an array is missing or does not fit.
    """
    try:
        simulations = {
            name.removeprefix("batch/"): array for name, array in arrays.items() if name.startswith("batch/")
        }
        environment.batch.restore(simulations)
        memory = (arrays[f"memory/{place}"] for place, _ in enumerate(trees.leaves(environment._memory)))
        environment._memory = trees.mapped(lambda like: _fitting(next(memory), like), environment._memory)
        for name in _ARRAYS:
            setattr(environment, name, _fitting(arrays[name.lstrip("_")], getattr(environment, name)))
        for index, random in enumerate(environment._randoms):
            parts = (arrays[f"random/{part}"][index] for part in ("keys", "positions", "halves", "normals"))
            key, position, half, normal = parts
            random.set_state(("MT19937", key, int(position), int(half), float(normal)))
            first = environment._task.first()
            stream = (arrays[f"stream/{index}/{place}"] for place, _ in enumerate(trees.leaves(first)))
            environment._streams[index] = _refilled(first, stream)
    except (KeyError, ValueError, TypeError, IndexError) as error:
        raise ValueError(f"snapshot: of another task or number of environments: {checks.quoted(error)}") from None


def _fitting(array: np.ndarray, like: np.ndarray) -> np.ndarray:
    if (array.shape, array.dtype) != (like.shape, like.dtype):
        raise ValueError(f"expected {like.dtype} {like.shape}, got {array.dtype} {array.shape}")
    return array.copy()


def _refilled(like, values: Iterator[np.ndarray]):
    """A tree like another one, with other numbers."""
    return trees.mapped(lambda leaf: _as(next(values), leaf), like)


def _as(value: np.ndarray, like):
    return value if isinstance(like, np.ndarray) else type(like)(value[()])
