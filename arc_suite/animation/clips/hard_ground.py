"""Models for clips: the ground is hard, and what is drawn of torso and links lies on it, not only their colliders."""

import copy
import functools

import mujoco
import numpy as np

from arc_suite import models
from arc_suite.models import visuals
from arc_suite.robots.spec import Body
from arc_suite.simulation.model import compile_model, list_contacts

_FLOOR = "floor"
_TIME_STEPS = 5.0  # in the time constant of a contact: harder ones make feet slip after a landing
_IMPEDANCE = (0.97, 0.995, 0.001, 0.5, 2.0)  # MuJoCo's solimp


def compile_on_hard_ground(body: Body) -> mujoco.MjModel:
    """Return a new model of a body on hard ground, which the caller may change."""
    return copy.copy(_shared_model(body, visuals.key_of(body)))


@functools.lru_cache(maxsize=8)
def _shared_model(body: Body, visuals_key: str) -> mujoco.MjModel:
    """Return the model of `compile_on_hard_ground`, the same one for the same `visuals.key_of`."""
    model = compile_model(body) if body.source else _compile_with_drawn_shapes(body)
    harden(model)
    return model


def harden(model: mujoco.MjModel) -> None:
    """Make the ground of a model hard."""
    model.pair_solref[:] = _TIME_STEPS * model.opt.timestep, 1.0
    model.pair_solimp[:] = _IMPEDANCE
    model.pair_margin[:] = 0.0  # else bodies rest above the ground
    model.pair_gap[:] = 0.0


def _compile_with_drawn_shapes(body: Body) -> mujoco.MjModel:
    """Return a model in which the shapes that are drawn on torso and links touch the ground, too, if they are rigid."""
    spec = models.model_spec(body, decorated=True)
    model = spec.compile()
    list_contacts(spec, model)
    feet = [model.body(name).id for name in body.foot_names]
    touches = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    is_drawn = ~touches & (model.geom_bodyid > 0) & ~np.isin(model.geom_bodyid, feet)
    drawn_names = [model.geom(geom).name for geom in np.flatnonzero(is_drawn).tolist()]
    swinging_names = visuals.geoms_of_bones(body)
    for name in drawn_names:
        if name not in swinging_names:
            spec.add_pair(geomname1=_FLOOR, geomname2=name)
    return spec.compile()
