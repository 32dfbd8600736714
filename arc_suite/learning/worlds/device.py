"""Simulations of one model as functions of JAX, on MuJoCo's MJX: many worlds at once, on a GPU or not.

Functions take one world; `jax.vmap` maps them over many. `jax` is MJX's own implementation, for any device.
`warp` is MuJoCo Warp, for NVIDIA's GPUs and, slowly, for processors.
"""

import contextlib
import copy
import importlib.util
import io
import math
import types
from collections.abc import Iterable

import mujoco
import numpy as np

from arc_suite import checks, versions

try:
    import jax
    import jax.numpy as jnp

    with contextlib.redirect_stdout(io.StringIO()):  # MJX prints that Warp is missing
        from mujoco import mjx
except ImportError as error:
    raise versions.MissingExtra("worlds on a GPU need MJX", "gpu", error) from None

IMPLEMENTATIONS = ("jax", "warp")

# Of the solver under `jax`, whose loops run until the slowest world is done: fewer cost return, more only time. See
# docs/gpu.md.
SOLVER_ITERATIONS, LINE_SEARCH_ITERATIONS = 20, 8

MAX_CONTACTS = 2000  # that are possible in a world under `jax`, each with four dense rows of constraints

_SENSOR = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
_SOLVER = 1 << 9 | 1 << 10  # bits of Warp's overflow that tell of iterations, not of tables
_LARGEST = 1e10  # of positions and velocities, beyond which MuJoCo calls a simulation diverged
# Contact points of a geom with a plane.
_POINTS = {
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): 2,
    int(mujoco.mjtGeom.mjGEOM_BOX): 4,
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): 4,
}
# Sizes of a geom that grow with it in all directions: of a capsule the radius alone.
_LENGTHS = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): 1,
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): 1,
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): 3,
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): 2,
    int(mujoco.mjtGeom.mjGEOM_BOX): 3,
}


def choose_implementation(name: str | None) -> str:
    """Return a checked name of an implementation; for None the faster one of this machine.

    Raises:
        ValueError: no such implementation.
        MissingExtra: a package of it is not installed.
    """
    if name is None:
        return "warp" if jax.default_backend() == "gpu" and _has_warp() else "jax"
    if checks.name(name, IMPLEMENTATIONS, "impl") == "warp" and not _has_warp():
        error = ImportError("No module named 'warp'")
        raise versions.MissingExtra("impl 'warp' needs warp-lang", "gpu", error)
    return name


def _has_warp() -> bool:
    return importlib.util.find_spec("warp") is not None


def adapt_model(model: mujoco.MjModel, impl: str) -> mujoco.MjModel:
    """Return a copy of a model with the settings of an implementation."""
    model = copy.copy(model)
    if impl == "jax":
        model.opt.iterations, model.opt.ls_iterations = SOLVER_ITERATIONS, LINE_SEARCH_ITERATIONS
        model.opt.disableflags |= _SENSOR  # `advance` computes contact forces
        return model
    # Warp 3.17 forgets the margin in the distance to a height field, and turns the normal where geoms do not overlap.
    # Geoms that are larger by the margin overlap where contacts begin, and push as they do in C.
    field = model.geom_type == mujoco.mjtGeom.mjGEOM_HFIELD
    pairs = field[model.pair_geom1] | field[model.pair_geom2]
    geoms = np.where(field[model.pair_geom1], model.pair_geom2, model.pair_geom1)
    for geom, margin in dict(zip(geoms[pairs], model.pair_margin[pairs], strict=True)).items():
        model.geom_size[geom, : _LENGTHS[int(model.geom_type[geom])]] += margin
        model.geom_aabb[geom, 3:] += margin
        model.geom_rbound[geom] += math.sqrt(3.0) * margin
    model.pair_margin[pairs] = 0.0
    # Cells as deep as wide: in deeper ones Warp finds wrong contacts now and then, which throw a body.
    wide = 2.0 * model.hfield_size[:, 0] / np.maximum(model.hfield_ncol - 1, 1)
    model.hfield_size[:, 3] = np.minimum(model.hfield_size[:, 3], wide)
    return model


def put_model(model: mujoco.MjModel, impl: str) -> mjx.Model:
    """Put a model, as `adapt_model` returns it, on the device.

    Raises:
        ValueError: the implementation cannot simulate it.
    """
    try:
        return mjx.put_model(model, impl=impl)
    except NotImplementedError as error:
        raise ValueError(f"impl {impl!r}: MJX cannot simulate this model: {error}; use impl='warp'") from None


def make_data(model: mujoco.MjModel, impl: str, num_envs: int) -> mjx.Data:
    """Return data of one world, as after MuJoCo's reset.

    Args:
        model: of the world, as `adapt_model` returns it.
        impl: the implementation.
        num_envs: worlds that step together; they share Warp's table of contacts.

    Raises:
        ValueError: too many contacts are possible.
    """
    if impl == "jax":
        data = mjx.make_data(model, impl=impl)
        if (contacts := data._impl.ncon) > MAX_CONTACTS:
            need = f"place for every possible contact, here {contacts}, and has it for {MAX_CONTACTS}"
            raise ValueError(f"impl 'jax': MJX needs {need}; use impl='warp'")
        return data
    contacts, rows = table_sizes(model)
    return mjx.make_data(model, impl=impl, naconmax=contacts * num_envs, njmax=rows)


def table_sizes(model: mujoco.MjModel) -> tuple[int, int]:
    """Return how many contacts and constraints a world of Warp has place for.

    Half of the points that planes could touch, as bodies fall on one side; all that height fields could, since a geom
    may touch several triangles.
    """
    pairs = np.stack([model.pair_geom1, model.pair_geom2])
    plane = (model.geom_type[pairs] == mujoco.mjtGeom.mjGEOM_PLANE).any(axis=0)
    points = [max(_POINTS.get(int(kind), 1) for kind in model.geom_type[pair]) for pair in pairs.T]
    contacts = max(16, int(np.dot(points, np.where(plane, 0.5, 1.0))))
    return contacts, 4 * contacts + int(model.jnt_limited.sum())


def advance(model: mjx.Model, data: mjx.Data, substeps: int) -> mjx.Data:
    """Return data after substeps, with derived quantities one substep behind the state, as `mj_step` leaves them."""
    if data.impl == mjx.Impl.WARP:  # which adds up overflows, and whose sensors compute contact forces
        data = data.tree_replace({"_impl.overflow": jnp.zeros_like(data._impl.overflow)})
    data = jax.lax.fori_loop(0, substeps, lambda _, data: mjx.step(model, data), data)
    # Contact forces of the last substep, before anything computes kinematics anew.
    return mjx.rne_postconstraint(model, data) if data.impl == mjx.Impl.JAX else data


def select_fields(data: mjx.Data, names: Iterable[str]) -> types.SimpleNamespace:
    """Return fields of data by their names in `MjData`, among them those that MJX keeps to its implementation."""
    own = data._impl
    return types.SimpleNamespace(**{name: getattr(own if hasattr(own, name) else data, name) for name in names})


def has_diverged(data: mjx.Data):
    """Return whether a position or velocity is no number, or beyond MuJoCo's bound."""
    state = jnp.concatenate([data.qpos, data.qvel])
    return ~(abs(state) <= _LARGEST).all()


def has_overflow(data: mjx.Data):
    """Return whether Warp's tables had no place for a contact or constraint; MJX's own have place for all."""
    if data.impl == mjx.Impl.JAX:
        return jnp.zeros((), bool)
    return (data._impl.overflow & ~_SOLVER).any()
