"""The hash of a compiled model's physics, which is the same on all kinds of processors."""

import hashlib

import mujoco
import numpy as np

PHYSICS = "physics_sha256"  # name of the hash in records of setups; those of earlier versions lack it

# Last bits of numbers that linear algebra computes differ among processors, by up to about 1e-14 of the largest.
_RESOLUTION = 1e-9  # of the largest absolute value in an array

# Fields on which physics does not depend: those of pictures, names, sizes, and the search trees of collision.
_PREFIXES_WITHOUT_PHYSICS = ("_", "cam_", "light_", "mat_", "tex_", "skin_", "name", "bvh_")
_SUFFIXES_WITHOUT_PHYSICS = ("_rgba", "_matid")


def hash_physics(model: mujoco.MjModel) -> str:
    """Return the SHA-256 of the options and the arrays of a model, without what only pictures show.

    Numbers are rounded to 1e-9 of the largest in their array.
    """
    content_hash = hashlib.sha256()
    for name, values in _physics_fields(model):
        content_hash.update(f"{name} {values.shape} {_round_values(values)}".encode())
    return content_hash.hexdigest()


def _physics_fields(model: mujoco.MjModel) -> list[tuple[str, np.ndarray]]:
    """Return the names and values of the arrays and options on which physics depends."""
    fields = []
    for name in sorted(dir(model)):
        if name.startswith(_PREFIXES_WITHOUT_PHYSICS) or name.endswith(_SUFFIXES_WITHOUT_PHYSICS):
            continue
        values = getattr(model, name)
        if isinstance(values, np.ndarray) and values.size:
            fields.append((name, values))
    for name in sorted(dir(model.opt)):
        if not name.startswith("_"):
            fields.append((f"opt.{name}", np.asarray(getattr(model.opt, name))))
    return fields


def _round_values(values: np.ndarray) -> list[int | str]:
    """Return all values; floats as the largest absolute value, and multiples of `_RESOLUTION` of it."""
    if values.dtype.kind != "f":
        return values.ravel().tolist()
    largest = np.abs(values).max()
    if not largest:
        return [0]
    multiples = np.rint(values / largest / _RESOLUTION).astype(int)
    return [f"{largest:.8e}", *multiples.ravel().tolist()]
