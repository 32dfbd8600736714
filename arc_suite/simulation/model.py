"""The compiled model of a body in an arena: bit-equal to the MJCF of `models.assemble`, and faster."""

import copy
import functools
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np

from arc_suite import checks, models
from arc_suite.arenas import FLAT, Arena
from arc_suite.models import direct
from arc_suite.models.sizing import size_body
from arc_suite.robots.spec import Body

_MOST = 1e6  # of a value of a model's field
_ROUNDING = 1e-6  # of the length of a quaternion
_POSITIVE = ("body_mass", "body_inertia")  # which accelerations divide by

# Fields that `checked_fields` takes, with the bounds of their values.
FIELDS = {
    "gravity": (-_MOST, _MOST),  # of `opt`
    **dict.fromkeys(_POSITIVE, (0.0, _MOST)),
    "body_ipos": (-_MOST, _MOST),
    "body_iquat": (-1.0, 1.0),
    "dof_armature": (0.0, _MOST),
    "dof_damping": (0.0, _MOST),
    "dof_frictionloss": (0.0, _MOST),
    "jnt_stiffness": (0.0, _MOST),
    "actuator_gear": (-_MOST, _MOST),
    "actuator_gainprm": (-_MOST, _MOST),
    "actuator_biasprm": (-_MOST, _MOST),
    "jnt_actfrcrange": (-_MOST, _MOST),
    "pair_friction": (0.0, _MOST),
    "pair_solref": (-_MOST, _MOST),
    "pair_solimp": (0.0, _MOST),
    "pair_margin": (0.0, _MOST),
    "geom_friction": (0.0, _MOST),
}

_LARGE = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
_NO_DAMPING = int(mujoco.mjtDisableBit.mjDSBL_DAMPER | mujoco.mjtDisableBit.mjDSBL_EULERDAMP)


def compiled(body: Body, arena: Arena = FLAT) -> mujoco.MjModel:
    """Compile the model that simulations of a body in an arena step.

    Simulation results are bit-equal to those of `models.assemble`, with two differences in the model.
    Contacts are explicit pairs, which is faster: `contype` and `conaffinity` are 0, and contacts take
    friction, solref, solimp, margin and gap from `pair_*`, not from `geom_*`. In an arena of many geoms
    only planes and height fields have pairs. The integrator is Euler's where results stay the same.

    Args:
        body: the spec; what it leaves open is sized.
        arena: where it moves.

    Returns:
        The model; the caller's own, to write to.
    """
    return copy.copy(_compiled(body, arena))


@functools.lru_cache(maxsize=32)
def _compiled(body: Body, arena: Arena) -> mujoco.MjModel:
    quick = arena == FLAT and not body.source
    spec = direct.on_flat_ground(size_body(body)) if quick else models.model_spec(body, arena)
    model = spec.compile()
    list_contacts(spec, model, all_geoms=arena.lists_contacts)
    model = spec.compile()
    if euler_suffices(model):
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER
    return model


def change(model: mujoco.MjModel, fields: Mapping[str, np.ndarray], scratch: mujoco.MjData) -> None:
    """Write fields of a model, by name, and update the constants that MuJoCo derives from them.

    Args:
        model: to write to.
        fields: values by name, of the shapes that the model's fields have.
        scratch: data of such a model; overwritten.
    """
    for name, values in fields.items():
        field(model, name)[:] = values
    mujoco.mj_setConst(model, scratch)


def field(model: mujoco.MjModel, name: str) -> np.ndarray:
    """Return a field of a model or of its options, live."""
    return getattr(model if hasattr(model, name) else model.opt, name)


def checked_fields(
    model: mujoco.MjModel, fields: Any, count: int | None = None, every: bool = False
) -> dict[str, np.ndarray]:
    """Return values of a model's fields, each in the field's shape.

    Args:
        model: as compiled.
        fields: values by name: what broadcasts to the field's shape, or of several models (count, *shape).
        count: number of models, which the values then have as a leading axis; None for one model.
        every: whether fields without effect on this model are taken, too.

    Raises:
        ValueError: no such field, one without effect on this model, or values that do not fit.
    """
    without = {
        "geom_friction": not model.geom_contype.any(),
        "jnt_actfrcrange": not model.jnt_actfrclimited.any(),
        "actuator_biasprm": not model.actuator_biastype.any(),
    }
    valid = [name for name in FIELDS if every or not without.get(name)]
    if "geom_friction" in checks.mapping("model", fields) and "geom_friction" not in valid:
        raise ValueError("model field 'geom_friction': contacts of this model read pair_friction; change that")
    found = {}
    for name, values in checks.mapping("model", fields).items():
        like = field(model, checks.name(name, valid, "model field"))
        found[name] = _values(name, values, like if count is None else np.broadcast_to(like, (count, *like.shape)))
    return found


def _values(name: str, values: Any, like: np.ndarray) -> np.ndarray:
    low, high = FIELDS[name]
    try:
        found = np.broadcast_to(np.asarray(values, float), like.shape).copy()
    except (TypeError, ValueError, OverflowError, RecursionError):
        raise ValueError(
            f"model field {name!r}: expected numbers of shape {like.shape}, got {checks.preview(values)}"
        ) from None
    least = np.where(like > 0.0, 1e-15, low) if name in _POSITIVE else low
    if not ((found >= least) & (found <= high)).all():
        above = ", above 0 where the model's are" if name in _POSITIVE else ""
        raise ValueError(
            f"model field {name!r}: expected numbers from {low:g} to {high:g}{above}, got {checks.preview(values)}"
        )
    if name == "body_iquat" and (abs(np.linalg.norm(found, axis=-1) - 1.0) > _ROUNDING).any():
        raise ValueError(f"model field {name!r}: expected quaternions of length 1, got {checks.preview(values)}")
    return found


class ReadOnly:
    """A model whose fields can be read."""

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
        all_geoms: write those of all geoms; else only of planes and height fields, which are endless or large, so that
            a search finds them near every body.
    """
    body = model.body_weldid[model.geom_bodyid]
    large = np.isin(model.geom_type, _LARGE)
    touches = (model.geom_contype[:, None] & model.geom_conaffinity) != 0
    touches = np.triu((touches | touches.T) & (body[:, None] != body))
    if not all_geoms:
        touches &= large[:, None] | large
    for first, second in np.argwhere(touches):
        names = {"geomname1": model.geom(first).name, "geomname2": model.geom(second).name}
        spec.add_pair(**names, **_contact(model, first, second))
    for geom in spec.geoms:
        if all_geoms or geom.type in _LARGE:
            geom.contype = geom.conaffinity = 0


def _contact(model: mujoco.MjModel, first: int, second: int) -> dict:
    """Return the attributes of a contact pair, mixed from its geoms by MuJoCo's rules."""
    both = np.array((first, second))
    friction, condim, solimp = model.geom_friction[both], model.geom_condim[both], model.geom_solimp[both]
    solref, priority, share = model.geom_solref[both], model.geom_priority[both], model.geom_solmix[both]
    if priority[0] != priority[1]:
        mixed = {"condim": condim, "friction": friction, "solref": solref, "solimp": solimp}
        mixed = {name: values[priority.argmax()] for name, values in mixed.items()}
    else:
        share = share[0] / share.sum()
        mixed = {
            "condim": condim.max(),
            "friction": friction.max(axis=0),
            "solref": share * solref[0] + (1.0 - share) * solref[1]
            if (solref[:, 0] > 0.0).all()
            else solref.min(axis=0),
            "solimp": share * solimp[0] + (1.0 - share) * solimp[1],
        }
    slide, spin, roll = mixed["friction"]
    return mixed | {
        "friction": (slide, slide, spin, roll, roll),
        "margin": model.geom_margin[both].sum(),
        "gap": model.geom_gap[both].sum(),
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
