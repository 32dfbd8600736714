"""The compiled model of a body in an arena: bit-equal to the MJCF of `models.assemble`, and faster."""

import copy
import functools
from collections.abc import Mapping

import mujoco
import numpy as np

from arc_suite import models
from arc_suite.arenas import FLAT, Arena
from arc_suite.models import direct
from arc_suite.models.sizing import sized
from arc_suite.robots.spec import Body

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
    spec = direct.on_flat_ground(sized(body)) if arena == FLAT else models.parsed(body, arena)
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
        getattr(model, name)[:] = values
    mujoco.mj_setConst(model, scratch)


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
    for pair in np.argwhere(touches):
        first, second = (model.geom(index).name for index in pair)
        spec.add_pair(geomname1=first, geomname2=second, **_contact(model, *pair))
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
