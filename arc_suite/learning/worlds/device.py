"""Simulations of one model as functions of JAX, on MuJoCo's MJX: many worlds at once, on a GPU or not.

Functions take one world; `jax.vmap` maps them over many. `jax` is MJX's own implementation, for any device.
`warp` is MuJoCo Warp, for NVIDIA's GPUs and, slowly, for processors.
"""

import contextlib
import copy
import importlib.util
import io
import math
import os
import types
from collections.abc import Iterable

import mujoco
import numpy as np

from arc_suite import checks, versions

# Warp takes memory of its own. JAX would take three quarters of a GPU's before.
os.environ.setdefault("XLA_PYTHON_CLIENT_PREALLOCATE", "false")

try:
    import jax
    import jax.numpy as jnp

    with contextlib.redirect_stdout(io.StringIO()):  # MJX prints that Warp is missing
        from mujoco import mjx
except ImportError as error:
    raise versions.MissingExtra("worlds on a GPU need MJX", "gpu", error) from None

IMPLEMENTATIONS = ("jax", "warp")

# Limits of the solver under `jax`, whose loops run until the slowest world is ready. With lower limits policies have
# lower returns, higher ones only take time. See docs/gpu.md.
SOLVER_ITERATIONS = 20
LINE_SEARCH_ITERATIONS = 8

MAX_CONTACTS = 2000  # possible contacts of a world under `jax`, each of which has four dense rows of constraints

_MIN_CONTACTS = 16  # of a world in Warp's table
_DISABLE_SENSORS = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
_ITERATION_BITS = 1 << 9 | 1 << 10  # bits of Warp's overflow that report iterations, and not full tables
_MAX_STATE = 1e10  # of positions and velocities, beyond which MuJoCo calls a simulation diverged

# Number of contact points of a geom with a plane, where it is not 1.
_PLANE_CONTACTS = {
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): 2,
    int(mujoco.mjtGeom.mjGEOM_BOX): 4,
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): 4,
}
# How many of a geom's sizes, from the first, grow when it grows in all directions: of a capsule only the radius.
_GROWING_SIZES = {
    int(mujoco.mjtGeom.mjGEOM_SPHERE): 1,
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): 1,
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): 3,
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): 2,
    int(mujoco.mjtGeom.mjGEOM_BOX): 3,
}


def choose_implementation(name: str | None) -> str:
    """Check the name of an implementation, and return it; for None return the faster one of this machine.

    Raises:
        ValueError: no such implementation.
        MissingExtra: a package of it is not installed.
    """
    if name is None:
        is_warp_faster = jax.default_backend() == "gpu" and _has_warp()
        return "warp" if is_warp_faster else "jax"
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
        model.opt.iterations = SOLVER_ITERATIONS
        model.opt.ls_iterations = LINE_SEARCH_ITERATIONS
        model.opt.disableflags |= _DISABLE_SENSORS  # not needed, as `advance` computes the contact forces
    else:
        _move_margins_into_geoms(model)
        _limit_cell_depth(model)
    return model


def _move_margins_into_geoms(model: mujoco.MjModel) -> None:
    """Enlarge geoms that touch height fields by the margin of their pair, and set the margin to 0.

    Warp 3.17 forgets the margin in the distance to a height field, and turns the normal where geoms do not overlap.
    Geoms that are larger by the margin overlap where contacts begin, and push as they do in C.
    """
    is_field = model.geom_type == mujoco.mjtGeom.mjGEOM_HFIELD
    is_pair_with_field = is_field[model.pair_geom1] | is_field[model.pair_geom2]
    other_geoms = np.where(is_field[model.pair_geom1], model.pair_geom2, model.pair_geom1)
    geoms = other_geoms[is_pair_with_field]
    margins = model.pair_margin[is_pair_with_field]
    # A geom may be in several pairs with fields, all of one margin: it grows once.
    margin_of_geom = dict(zip(geoms, margins, strict=True))
    for geom, margin in margin_of_geom.items():
        growing_sizes = _GROWING_SIZES[int(model.geom_type[geom])]
        model.geom_size[geom, :growing_sizes] += margin
        model.geom_aabb[geom, 3:] += margin  # half-extents of the bounding box
        model.geom_rbound[geom] += math.sqrt(3.0) * margin  # a corner of the bounding box moves so far
    model.pair_margin[is_pair_with_field] = 0.0


def _limit_cell_depth(model: mujoco.MjModel) -> None:
    """Make cells of height fields at most as deep as wide: in deeper ones Warp finds wrong contacts now and then."""
    cells = np.stack([model.hfield_ncol - 1, model.hfield_nrow - 1], axis=-1)  # along x and y
    cell_widths = (2.0 * model.hfield_size[:, :2] / np.maximum(cells, 1)).min(axis=-1)
    depths = model.hfield_size[:, 3]  # of the base below the lowest point
    model.hfield_size[:, 3] = np.minimum(depths, cell_widths)


def put_model(model: mujoco.MjModel, impl: str) -> mjx.Model:
    """Put a model, as `adapt_model` returns it, on the device.

    Raises:
        ValueError: the implementation cannot simulate it.
    """
    if model.nhistory:  # MJX ignores delays of actuators, and Warp 3.17 reads wrong controls at an episode's start
        raise ValueError("delay: expected none of motors in worlds, which do not simulate it; use the setting delay")
    if impl == "warp":
        import warp

        warp.config.log_level = warp.LOG_WARNING  # no line for each module that it loads
    try:
        return mjx.put_model(model, impl=impl)
    except NotImplementedError as error:
        raise ValueError(f"impl {impl!r}: MJX cannot simulate this model: {error}; use impl='warp'") from None


def make_data(model: mujoco.MjModel, impl: str, num_envs: int) -> mjx.Data:
    """Return data of one world, as after MuJoCo's reset.

    Args:
        model: model of the world, as `adapt_model` returns it.
        impl: the implementation.
        num_envs: worlds that step together; they share Warp's table of contacts.

    Raises:
        ValueError: too many contacts are possible.
    """
    if impl == "jax":
        data = mjx.make_data(model, impl=impl)
        possible_contacts = data._impl.ncon
        if possible_contacts > MAX_CONTACTS:
            need = f"place for every possible contact, here {possible_contacts}, and has it for {MAX_CONTACTS}"
            raise ValueError(f"impl 'jax': MJX needs {need}; use impl='warp'")
        return data
    contacts, constraints = table_sizes(model)
    return mjx.make_data(model, impl=impl, naconmax=contacts * num_envs, njmax=constraints)


def table_sizes(model: mujoco.MjModel) -> tuple[int, int]:
    """Return how many contacts and constraints a world of Warp has place for.

    Planes get half as many contacts as points could touch them, as bodies fall on one side. Height fields get as many
    as points, since a geom may touch several triangles.
    """
    geom_types = np.stack([model.geom_type[model.pair_geom1], model.geom_type[model.pair_geom2]])  # (2, pairs)
    has_plane = (geom_types == mujoco.mjtGeom.mjGEOM_PLANE).any(axis=0)
    points = []  # for each pair, how many points of its geoms can touch a plane or a height field
    for first_type, second_type in geom_types.T.tolist():
        points.append(max(_PLANE_CONTACTS.get(first_type, 1), _PLANE_CONTACTS.get(second_type, 1)))
    contacts = max(_MIN_CONTACTS, int(np.dot(points, np.where(has_plane, 0.5, 1.0))))
    contact_constraints = 4 * contacts  # edges of the friction pyramid
    limit_constraints = int(model.jnt_limited.sum())
    return contacts, contact_constraints + limit_constraints


def advance(model: mjx.Model, data: mjx.Data, substeps: int) -> mjx.Data:
    """Return data after substeps, with derived quantities one substep behind the state, as `mj_step` leaves them."""
    if data.impl == mjx.Impl.WARP:  # Warp keeps the bits of earlier overflows
        data = data.tree_replace({"_impl.overflow": jnp.zeros_like(data._impl.overflow)})
    data = jax.lax.fori_loop(0, substeps, lambda _, substep_data: mjx.step(model, substep_data), data)
    if data.impl == mjx.Impl.JAX:
        # The contact forces of the last substep, which sensors compute in Warp. They belong to its kinematics, which
        # nothing may have replaced by those of the new state.
        data = mjx.rne_postconstraint(model, data)
    return data


def select_fields(data: mjx.Data, names: Iterable[str]) -> types.SimpleNamespace:
    """Return fields of data by their names in `MjData`; some of them MJX has in the part of an implementation."""
    implementation_data = data._impl
    values = {}
    for name in names:
        holder = implementation_data if hasattr(implementation_data, name) else data
        values[name] = getattr(holder, name)
    return types.SimpleNamespace(**values)


def has_diverged(data: mjx.Data):
    """Return whether a position or velocity is no number, or beyond MuJoCo's bound."""
    state = jnp.concatenate([data.qpos, data.qvel])
    is_valid = abs(state) <= _MAX_STATE  # False for no number
    return ~is_valid.all()


def has_overflow(data: mjx.Data):
    """Return whether Warp's tables had no place for a contact or constraint; those of `jax` have place for all."""
    if data.impl == mjx.Impl.JAX:
        return jnp.zeros((), bool)
    table_bits = data._impl.overflow & ~_ITERATION_BITS
    return table_bits.any()
