"""Snapshots of a vector environment: arrays by name, from which another one goes on to the bit.

Unlike a pickle, arrays of others are data.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from arc_suite import checks

# Attributes of the environment that are arrays with a leading axis for the rows.
_ARRAYS = ("_stream_seeds", "_streams_begin", "_steps", "_ended", "_resting", "_observation")


def taken(environment) -> dict[str, np.ndarray]:
    """Return the snapshot of a `VectorEnv` whose episodes have begun."""
    keys, positions, halves, normals = [], [], [], []
    for random in environment._randoms:
        _, key, position, half, normal = random.get_state()
        keys.append(key), positions.append(position), halves.append(half), normals.append(normal)
    arrays = {f"batch/{name}": array for name, array in environment.batch.snapshot().items()}
    arrays |= {f"memory/{name}": array.copy() for name, array in environment._memory._asdict().items()}
    arrays |= {name.lstrip("_"): getattr(environment, name).copy() for name in _ARRAYS}
    for row, carry in enumerate(environment._carries):
        arrays |= {f"carry/{row}/{place}": np.asarray(leaf) for place, leaf in enumerate(_leaves(carry))}
    return arrays | {
        "random/keys": np.array(keys),
        "random/positions": np.array(positions),
        "random/halves": np.array(halves),
        "random/normals": np.array(normals),
    }


def put(environment, arrays: Mapping[str, np.ndarray]) -> None:
    """Let a `VectorEnv` whose episodes have begun go on from a snapshot.

    Raises:
        ValueError: an array is missing or does not fit; one line.
    """
    try:
        simulations = {
            name.removeprefix("batch/"): array for name, array in arrays.items() if name.startswith("batch/")
        }
        environment.batch.restore(simulations)
        memory = environment._memory
        environment._memory = type(memory)(
            **{name: _fitting(arrays[f"memory/{name}"], like) for name, like in memory._asdict().items()}
        )
        for name in _ARRAYS:
            setattr(environment, name, _fitting(arrays[name.lstrip("_")], getattr(environment, name)))
        for row, random in enumerate(environment._randoms):
            parts = (arrays[f"random/{part}"][row] for part in ("keys", "positions", "halves", "normals"))
            key, position, half, normal = parts
            random.set_state(("MT19937", key, int(position), int(half), float(normal)))
            leaves = (arrays[f"carry/{row}/{place}"] for place, _ in enumerate(_leaves(environment.task.first())))
            environment._carries[row] = _rebuilt(environment.task.first(), leaves)
    except (KeyError, ValueError, TypeError, IndexError) as error:
        raise ValueError(f"snapshot: of other rows or another task: {checks.quoted(error)}") from None


def _fitting(array: np.ndarray, like: np.ndarray) -> np.ndarray:
    if (array.shape, array.dtype) != (like.shape, like.dtype):
        raise ValueError(f"expected {like.dtype} {like.shape}, got {array.dtype} {array.shape}")
    return array.copy()


def _leaves(carry) -> Iterator:
    """The numbers and arrays of a task's carry, which is one, a tuple of such, or None."""
    if isinstance(carry, tuple):
        for item in carry:
            yield from _leaves(item)
    elif carry is not None:
        yield carry


def _rebuilt(like, leaves: Iterator[np.ndarray]):
    """A carry like another one, with other numbers."""
    if isinstance(like, tuple):
        items = [_rebuilt(item, leaves) for item in like]
        return type(like)(*items) if hasattr(like, "_fields") else tuple(items)
    if like is None:
        return None
    leaf = next(leaves)
    return leaf if isinstance(like, np.ndarray) else type(like)(leaf[()])
