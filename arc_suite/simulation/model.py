"""The compiled model of a body in an arena: bit-equal to the MJCF of `models.assemble`, and faster."""

import copy
import functools
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import mujoco
import numpy as np

from arc_suite import checks, models
from arc_suite.arenas import FLAT, Arena
from arc_suite.models import direct
from arc_suite.models.sizing import size_body
from arc_suite.robots.spec import Body

_MAX_VALUE = 1e6  # of a model's field
_TOLERANCE = 1e-6  # of the length of a quaternion
_LEAST_POSITIVE = 1e-15  # of a field that must not be 0
_POSITIVE = ("body_mass", "body_inertia")  # fields that must not be 0, as accelerations divide by them

# Fields that `check_fields` takes, with the bounds of their values.
FIELDS = {
    "gravity": (-_MAX_VALUE, _MAX_VALUE),  # of the model's `opt`
    **dict.fromkeys(_POSITIVE, (0.0, _MAX_VALUE)),
    "body_ipos": (-_MAX_VALUE, _MAX_VALUE),
    "body_iquat": (-1.0, 1.0),
    "dof_armature": (0.0, _MAX_VALUE),
    "dof_damping": (0.0, _MAX_VALUE),
    "dof_frictionloss": (0.0, _MAX_VALUE),
    "jnt_stiffness": (0.0, _MAX_VALUE),
    "actuator_gear": (-_MAX_VALUE, _MAX_VALUE),
    "actuator_gainprm": (-_MAX_VALUE, _MAX_VALUE),
    "actuator_biasprm": (-_MAX_VALUE, _MAX_VALUE),
    "jnt_actfrcrange": (-_MAX_VALUE, _MAX_VALUE),
    "pair_friction": (0.0, _MAX_VALUE),
    "pair_solref": (-_MAX_VALUE, _MAX_VALUE),
    "pair_solimp": (0.0, _MAX_VALUE),
    "pair_margin": (0.0, _MAX_VALUE),
    "geom_friction": (0.0, _MAX_VALUE),
    "geom_solref": (-_MAX_VALUE, _MAX_VALUE),
    "geom_solimp": (0.0, _MAX_VALUE),
    "geom_margin": (0.0, _MAX_VALUE),
}


class ContactProperty(NamedTuple):
    """A property that all contacts of a model have, whether they are pairs of geoms or not.

    Attributes:
        shape: shape of a value.
        low: lowest value.
    """

    shape: tuple[int, ...] = ()
    low: float = 0.0


# Properties that `check_fields` takes in addition to fields, and writes into all fields that contacts read.
CONTACT_PROPERTIES = {
    "friction": ContactProperty(),  # sliding friction
    "solref": ContactProperty((2,), -_MAX_VALUE),
    "solimp": ContactProperty((5,)),
    "margin": ContactProperty(),  # m
}

_LARGE_GEOMS = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
_NO_DAMPING = int(mujoco.mjtDisableBit.mjDSBL_DAMPER | mujoco.mjtDisableBit.mjDSBL_EULERDAMP)


def compile_model(body: Body, arena: Arena = FLAT) -> mujoco.MjModel:
    """Compile the model that simulations of a body in an arena step.

    Simulation results are bit-equal to those of `models.assemble`, with two differences in the model.
    Contacts are explicit pairs, which is faster: `contype` and `conaffinity` are 0, and contacts take
    friction, solref, solimp, margin and gap from `pair_*`, not from `geom_*`. In an arena of many geoms
    only planes and height fields have pairs. The integrator is Euler's where results stay the same.

    Args:
        body: the spec; numbers that it leaves out are sized.
        arena: the ground and obstacles.

    Returns:
        A new model, to which the caller may write.
    """
    return copy.copy(shared_model(body, arena))


@functools.lru_cache(maxsize=32)
def shared_model(body: Body, arena: Arena) -> mujoco.MjModel:
    """Return the model of `compile_model`, to which nobody may write."""
    has_fast_path = arena == FLAT and not body.source
    spec = direct.on_flat_ground(size_body(body)) if has_fast_path else models.model_spec(body, arena)
    model = spec.compile()
    list_contacts(spec, model, all_geoms=arena.lists_contacts)
    model = spec.compile()
    if euler_suffices(model):
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    return model


def simulation_at(
    model: mujoco.MjModel, qpos: np.ndarray, qvel: np.ndarray, mocap_pos: np.ndarray | None = None
) -> mujoco.MjData:
    """Return a simulation in a state, with all that follows from it.

    Args:
        model: a compiled model.
        qpos: (nq,) positions.
        qvel: (nv,) velocities.
        mocap_pos: (mocap bodies, 3) positions of obstacles, m; None for those of the model.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = qpos
    data.qvel[:] = qvel
    if mocap_pos is not None:
        data.mocap_pos[:] = mocap_pos
    mujoco.mj_forward(model, data)
    return data


def change_fields(model: mujoco.MjModel, fields: Mapping[str, np.ndarray], scratch: mujoco.MjData) -> None:
    """Write fields of a model, by name, and update the constants that MuJoCo derives from them.

    Args:
        model: the model, which is changed.
        fields: values by name, in the shapes of the model's fields.
        scratch: data of such a model, which is overwritten.
    """
    for name, values in fields.items():
        field(model, name)[:] = values
    mujoco.mj_setConst(model, scratch)


def merge_lasting(values: np.ndarray, lasting: np.ndarray | None) -> np.ndarray:
    """Return values of a field, with its lasting values, where these are not NaN, in their place."""
    if lasting is None:
        return values
    return np.where(np.isnan(lasting), values, lasting)


def field(model: mujoco.MjModel, name: str) -> np.ndarray:
    """Return a field of a model or of its options, live."""
    return getattr(model if hasattr(model, name) else model.opt, name)


def check_fields(
    model: mujoco.MjModel,
    fields: Any,
    count: int | None = None,
    compiled_field: Callable[[str], np.ndarray] | None = None,
) -> dict[str, np.ndarray]:
    """Return values of a model's fields, each in the field's shape.

    Args:
        model: a model, whose fields may have been changed.
        fields: values by name of `FIELDS`, which broadcast to the field's shape, with a leading axis for several
            models. With `compiled_field` also values of `CONTACT_PROPERTIES`.
        count: number of models; None for one model without the leading axis.
        compiled_field: function of a name that returns the compiled values of a field, with the leading axis for
            several models. None takes no contact properties, and takes fields without effect, as snapshots hold them.

    Raises:
        ValueError: no such field, one without effect on this model, or values that do not fit.
    """
    values_by_name = checks.mapping("model", fields)
    if compiled_field is not None:
        _check_effect(model, values_by_name)
    known_names = [*FIELDS, *CONTACT_PROPERTIES] if compiled_field is not None else list(FIELDS)
    checked_values: dict[str, np.ndarray] = {}
    for name, values in values_by_name.items():
        if checks.name(name, known_names, "model field") in CONTACT_PROPERTIES:
            checked_values |= _contact_fields(name, values, count, compiled_field)
            continue
        like = field(model, name)
        if count is not None:
            like = np.broadcast_to(like, (count, *like.shape))
        checked_values[name] = _check_values(name, values, like)
    return checked_values


def select_environments(model: mujoco.MjModel, fields: Any, num_envs: int, indices: np.ndarray) -> Any:
    """Return values for `check_fields` of some environments, which share a batch, given those for all environments.

    Args:
        model: a model of the batch.
        fields: values by name. Those with a leading axis of `num_envs` are divided, others are for every environment.
        num_envs: number of all environments.
        indices: indices of the batch's environments.

    Raises:
        ValueError: a leading axis of another length.
    """
    selected_fields = {}
    for name, values in checks.mapping("model", fields).items():
        selected_fields[name] = values
        if name in CONTACT_PROPERTIES:
            dimensions = len(CONTACT_PROPERTIES[name].shape)
        elif name in FIELDS:
            dimensions = field(model, name).ndim
        else:
            continue  # `check_fields` refuses it
        try:
            shape = np.shape(values)
        except ValueError:  # lists of different lengths, which `check_fields` refuses, too
            continue
        if len(shape) != dimensions + 1 or shape[0] == 1:
            continue
        if shape[0] != num_envs:
            count = f"{num_envs} values, one of each environment"
            raise ValueError(f"model field {name!r}: expected {count}, got {checks.preview(values)}")
        selected_fields[name] = np.asarray(values)[indices]
    return selected_fields


def _check_effect(model: mujoco.MjModel, fields: Mapping[str, Any]) -> None:
    """Raise ValueError for a field that simulations of a model do not read.

    Contacts read fields of pairs in some scenes, and fields of geoms in others.
    """
    if "jnt_actfrcrange" in fields and not model.jnt_actfrclimited.any():
        raise ValueError("model field 'jnt_actfrcrange': torques of this model have no limits of joints")
    if "actuator_biasprm" in fields and not model.actuator_biastype.any():
        raise ValueError("model field 'actuator_biasprm': motors of this model have no bias; servos have")
    contacts_read = {"pair": model.npair > 0, "geom": bool(model.geom_contype.any())}
    for name in CONTACT_PROPERTIES:
        for kind, other_kind in (("pair", "geom"), ("geom", "pair")):
            field_name = f"{kind}_{name}"
            other_field = f"{other_kind}_{name}"
            if field_name not in fields:
                continue
            if name in fields:
                raise ValueError(f"model field {field_name!r}: {name} changes it, too; leave one of them out")
            if not contacts_read[kind]:
                reason = f"contacts of this model read {other_field}"
                raise ValueError(f"model field {field_name!r}: {reason}; change {name}")
            if contacts_read[other_kind] and other_field not in fields:
                reason = f"contacts of this model read {other_field}, too"
                raise ValueError(f"model field {field_name!r}: {reason}; change {name}")


def _contact_fields(
    name: str, values: Any, count: int | None, compiled_field: Callable[[str], np.ndarray]
) -> dict[str, np.ndarray]:
    """Return the fields of a model that give all contacts a property."""
    contact_property = CONTACT_PROPERTIES[name]
    shape = contact_property.shape if count is None else (count, *contact_property.shape)
    value = _check_numbers(name, values, shape, contact_property.low, _MAX_VALUE)
    pair_values = compiled_field(f"pair_{name}").copy()
    geom_values = compiled_field(f"geom_{name}").copy()
    if name == "friction":  # of pairs the first two, of geoms the first; the others are torsional and rolling friction
        pair_values[..., :2] = value[..., None, None]
        geom_values[..., 0] = value[..., None]
    elif name == "margin":
        pair_values[:] = value[..., None]
        geom_values[:] = 0.5 * value[..., None]  # MuJoCo adds up the margins of two geoms
    else:
        pair_values[:] = value[..., None, :]
        geom_values[:] = value[..., None, :]
    return {f"pair_{name}": pair_values, f"geom_{name}": geom_values}


def _check_numbers(name: str, values: Any, shape: tuple[int, ...], low: Any, high: float) -> np.ndarray:
    """Return values as an array of a shape; `low` broadcasts to the shape."""
    try:
        array = np.broadcast_to(np.asarray(values, float), shape).copy()
    except (TypeError, ValueError, OverflowError, RecursionError):
        raise ValueError(
            f"model field {name!r}: expected numbers of shape {shape}, got {checks.preview(values)}"
        ) from None
    if not ((array >= low) & (array <= high)).all():
        where = ", above 0 where the model's are" if name in _POSITIVE else ""
        lowest = np.min(low) if name not in _POSITIVE else 0.0
        raise ValueError(
            f"model field {name!r}: expected numbers from {lowest:g} to {high:g}{where}, got {checks.preview(values)}"
        )
    return array


def _check_values(name: str, values: Any, like: np.ndarray) -> np.ndarray:
    """Return values of a field in the shape of the present ones, `like`."""
    low, high = FIELDS[name]
    lowest = np.where(like > 0.0, _LEAST_POSITIVE, low) if name in _POSITIVE else low
    array = _check_numbers(name, values, like.shape, lowest, high)
    if name == "body_iquat" and (abs(np.linalg.norm(array, axis=-1) - 1.0) > _TOLERANCE).any():
        raise ValueError(f"model field {name!r}: expected quaternions of length 1, got {checks.preview(values)}")
    return array


class ReadOnly:
    """A model whose fields can only be read."""

    def __init__(self, model: mujoco.MjModel):
        """View a model, or its options."""
        self.__dict__["_model"] = model

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._model, name)
        if isinstance(value, np.ndarray):
            value = value.view()
            value.flags.writeable = False
        return ReadOnly(value) if isinstance(value, mujoco.MjOption) else value

    def __setattr__(self, name: str, value: Any):
        raise AttributeError(f"cannot set {name!r}: models are read-only; use change_model of the environments")


def list_contacts(spec: mujoco.MjSpec, model: mujoco.MjModel, all_geoms: bool = True) -> None:
    """Replace the masks `contype` and `conaffinity` by explicit contact pairs.

    Args:
        spec: the model to change; every geom that touches another has a name.
        model: the same, compiled; no two geoms of moving bodies touch one another.
        all_geoms: whether to write pairs of all geoms, or only those with planes and height fields. These are so large
            that MuJoCo's search finds them near every body.
    """
    body = model.body_weldid[model.geom_bodyid]
    is_large = np.isin(model.geom_type, _LARGE_GEOMS)
    touches = (model.geom_contype[:, None] & model.geom_conaffinity) != 0
    touches = np.triu((touches | touches.T) & (body[:, None] != body))
    if not all_geoms:
        touches &= is_large[:, None] | is_large
    for first, second in np.argwhere(touches):
        names = {"geomname1": model.geom(first).name, "geomname2": model.geom(second).name}
        spec.add_pair(**names, **_contact(model, first, second))
    for geom in spec.geoms:
        if all_geoms or geom.type in _LARGE_GEOMS:
            geom.contype = 0
            geom.conaffinity = 0


def _contact(model: mujoco.MjModel, first: int, second: int) -> dict:
    """Return the attributes of a contact pair, combined from those of its geoms by MuJoCo's rules."""
    pair = np.array((first, second))
    condim = model.geom_condim[pair]
    friction = model.geom_friction[pair]
    solref = model.geom_solref[pair]
    solimp = model.geom_solimp[pair]
    priority = model.geom_priority[pair]
    if priority[0] != priority[1]:
        geom = priority.argmax()
        contact = {
            "condim": condim[geom],
            "friction": friction[geom],
            "solref": solref[geom],
            "solimp": solimp[geom],
        }
    else:
        weights = model.geom_solmix[pair]
        share = weights[0] / weights.sum()
        are_standard = (solref[:, 0] > 0.0).all()  # a time constant and a damping ratio
        mean_solref = share * solref[0] + (1.0 - share) * solref[1]
        contact = {
            "condim": condim.max(),
            "friction": friction.max(axis=0),
            "solref": mean_solref if are_standard else solref.min(axis=0),
            "solimp": share * solimp[0] + (1.0 - share) * solimp[1],
        }
    sliding, torsional, rolling = contact["friction"]
    return contact | {
        "friction": (sliding, sliding, torsional, rolling, rolling),
        "margin": model.geom_margin[pair].sum(),
        "gap": model.geom_gap[pair].sum(),
    }


def euler_suffices(model: mujoco.MjModel) -> bool:
    """Return whether MuJoCo's Euler integrator gives the same bits as its implicitfast.

    Both solve (M - h D) a = f for the acceleration a, with the mass matrix M and the substep h.
    In implicitfast, D holds the derivatives of all passive and actuator forces by velocities; in
    Euler, those of the joints' linear damping alone, so that it need not assemble a matrix for
    them. The two agree where nothing else depends on velocities: no fluid, no tendons, flexes or
    plugins, no damping in actuators. Where no joint is damped, Euler takes the acceleration that
    the solver found without solving again, which rounds differently.
    """
    return bool(
        model.opt.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        and not model.opt.disableflags & _NO_DAMPING
        and model.dof_damping.any()
        and not model.dof_dampingpoly.any()
        and not (model.opt.density or model.opt.viscosity)
        and not (model.ntendon or model.nflex or model.nplugin)
        and (model.actuator_gaintype == mujoco.mjtGain.mjGAIN_FIXED).all()
        and (model.actuator_biastype == mujoco.mjtBias.mjBIAS_NONE).all()
        and not (model.actuator_damping.any() or model.actuator_dampingpoly.any())
    )
