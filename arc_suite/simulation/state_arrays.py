"""Snapshots of simulations: arrays by name, with a leading axis for the simulations.

MuJoCo ends the process where arrays do not fit, so those that come from a file are checked.
"""

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from arc_suite.simulation.model import FIELDS, check_fields, field

MODEL_PREFIX = "model_"  # prefix of a field of the models
LASTING_PREFIX = "lasting_"  # prefix of a field of the models that stays over resets
# Parts of MuJoCo's state that lie before the buffers of delayed controls.
_BEFORE_HISTORY = int(
    mujoco.mjtState.mjSTATE_TIME
    | mujoco.mjtState.mjSTATE_QPOS
    | mujoco.mjtState.mjSTATE_QVEL
    | mujoco.mjtState.mjSTATE_ACT
)
MAX_NUMBER = 1e10  # beyond it, MuJoCo calls a simulation diverged


def check_snapshot(
    like: Mapping[str, np.ndarray], models: Sequence[mujoco.MjModel], arrays: Mapping[str, np.ndarray]
) -> Mapping[str, np.ndarray]:
    """Return the arrays of a snapshot if simulations can take them.

    Args:
        like: arrays by name, whose shapes and types those of the snapshot must have.
        models: the compiled model of each simulation.
        arrays: the snapshot.

    Raises:
        ValueError: an array is missing, too many, of another shape or type, or holds a value out of range.
    """
    fields = {f"{kind}{name}": name for name in FIELDS for kind in (MODEL_PREFIX, LASTING_PREFIX)}
    expected = {**like, **dict.fromkeys(arrays.keys() & fields.keys())}
    differences = expected.keys() ^ arrays.keys()
    if differences:
        name = min(differences)
        raise ValueError(f"{name}: {'missing' if name in expected else 'no array of a snapshot'}")
    for name, array in like.items():
        check_finite(name, check_same_form(name, arrays[name], array))
    for model, state in zip(models, arrays["state"], strict=True):
        _check_cursors(model, state)
    for name in expected.keys() - like.keys():
        compiled = np.stack([field(model, fields[name]) for model in models])
        values = check_same_form(name, arrays[name], compiled)
        if name.startswith(LASTING_PREFIX):  # NaN stands for no change
            values = np.where(np.isnan(values), compiled, values)
        for model, model_values in zip(models, values, strict=True):
            check_fields(model, {fields[name]: model_values})
    return arrays


def _check_cursors(model: mujoco.MjModel, state: np.ndarray) -> None:
    """Raise ValueError for a cursor outside of its buffer of delayed controls: MuJoCo would read foreign memory."""
    sizes = model.actuator_history[:, 0]
    has_history = sizes > 0
    start = mujoco.mj_stateSize(model, _BEFORE_HISTORY)
    cursors = state[start + 1 + model.actuator_historyadr[has_history]]
    is_inside = (cursors >= 0.0) & (cursors < sizes[has_history]) & (cursors == cursors.round())
    if not is_inside.all():
        raise ValueError("state: expected cursors of delays inside of their buffers")


def model_fields(arrays: Mapping[str, np.ndarray]) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return two mappings by name of the models' fields in a snapshot: all values, and those that stay over resets."""
    return _copy_with_prefix(MODEL_PREFIX, arrays), _copy_with_prefix(LASTING_PREFIX, arrays)


def _copy_with_prefix(prefix: str, arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name.removeprefix(prefix): array.copy() for name, array in arrays.items() if name.startswith(prefix)}


def check_same_form(name: str, array: np.ndarray, like: np.ndarray) -> np.ndarray:
    """Return an array that has the shape and type of another one.

    Raises:
        ValueError: it has another shape or type.
    """
    if (array.shape, array.dtype) != (like.shape, like.dtype):
        raise ValueError(f"{name}: expected {like.dtype} {like.shape}, got {array.dtype} {array.shape}")
    return array


def check_finite(name: str, array: np.ndarray, may_be_nan: np.ndarray | bool = False) -> np.ndarray:
    """Return an array of finite numbers that simulations can reach.

    Args:
        name: name of the array, for the error.
        array: any.
        may_be_nan: where NaN may stand.

    Raises:
        ValueError: a number is not finite, or too large.
    """
    if not ((abs(array) <= MAX_NUMBER) | (may_be_nan & np.isnan(array))).all():
        raise ValueError(f"{name}: expected finite numbers of at most {MAX_NUMBER:g}")
    return array
