"""Snapshots of simulations: arrays by name, with a leading axis for the simulations.

MuJoCo trusts what it is given, and ends the process; so arrays of others are checked.
"""

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from arc_suite.simulation.model import FIELDS, checked_fields, field

OF_MODEL, LASTING = "model_", "lasting_"  # with which names of models' fields begin, and of those that stay over resets
LARGEST = 1e10  # of a number, beyond which MuJoCo calls a simulation diverged


def checked_snapshot(
    like: Mapping[str, np.ndarray], models: Sequence[mujoco.MjModel], arrays: Mapping[str, np.ndarray]
) -> Mapping[str, np.ndarray]:
    """Return the arrays of a snapshot if simulations can take them.

    Args:
        like: arrays that the snapshot must have, of other values.
        models: of each simulation, as compiled.
        arrays: of the snapshot.

    Raises:
        ValueError: an array is missing, too many, of another shape or type, or holds a value out of range.
    """
    fields = {f"{kind}{name}": name for name in FIELDS for kind in (OF_MODEL, LASTING)}
    expected = {**like, **dict.fromkeys(arrays.keys() & fields.keys())}
    if missing := expected.keys() ^ arrays.keys():
        raise ValueError(f"{min(missing)}: {'missing' if min(missing) in expected else 'no array of a snapshot'}")
    for name, other in like.items():
        bounded(name, fitting(name, arrays[name], other))
    for name in expected.keys() - like.keys():
        compiled = np.stack([field(model, fields[name]) for model in models])
        values = fitting(name, arrays[name], compiled)
        unset = np.isnan(values) & name.startswith(LASTING)
        for model, own in zip(models, np.where(unset, compiled, values), strict=True):
            checked_fields(model, {fields[name]: own}, every=True)
    return arrays


def model_fields(arrays: Mapping[str, np.ndarray]) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the fields of models in a snapshot by name: their values, and those that stay over resets."""
    return tuple(  # type: ignore[return-value]
        {name.removeprefix(kind): array.copy() for name, array in arrays.items() if name.startswith(kind)}
        for kind in (OF_MODEL, LASTING)
    )


def fitting(name: str, array: np.ndarray, like: np.ndarray) -> np.ndarray:
    """Return an array that has the shape and type of another one.

    Raises:
        ValueError: it has not.
    """
    if (array.shape, array.dtype) != (like.shape, like.dtype):
        raise ValueError(f"{name}: expected {like.dtype} {like.shape}, got {array.dtype} {array.shape}")
    return array


def bounded(name: str, array: np.ndarray, missing: np.ndarray | bool = False) -> np.ndarray:
    """Return an array whose numbers simulations can reach.

    Args:
        name: of the array, for the error.
        array: of numbers.
        missing: where NaN may stand.

    Raises:
        ValueError: a number is not finite, or too large.
    """
    if not ((abs(array) <= LARGEST) | (missing & np.isnan(array))).all():
        raise ValueError(f"{name}: expected finite numbers of at most {LARGEST:g}")
    return array
