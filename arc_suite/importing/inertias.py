"""Inertias that no solid of the robot's size has: wrong units, or placeholders such as 1000 kg m^2 at 0.1 kg."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from arc_suite import parsers
from arc_suite.importing import tree
from arc_suite.robots.spec import SpecError

# The radius of gyration of a solid that is as long as the robot's span, and has all its mass at its ends.
_MAX_GYRATION = 0.5  # of the span
_LEAST_MOMENT = 1e-13  # kg m^2; MuJoCo refuses those below 1e-15
_BALL_DENSITY = 1000.0  # kg/m^3, of the ball that stands for a link without a shape


def ball_moment(mass: float) -> float:
    """Return the moment of inertia of a ball of a mass, kg m^2."""
    radius_squared = (0.75 * mass / (math.pi * _BALL_DENSITY)) ** (2.0 / 3.0)
    return 0.4 * mass * radius_squared


def correct_inertias(spec: mujoco.MjSpec, model: mujoco.MjModel, torso: int) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """Return the model with plausible inertias, and a note if any are corrected.

    An inertia that is too large for the robot becomes that of the link's colliders with the same mass. Its center of
    mass stays.

    Args:
        spec: spec of the file, which is changed.
        model: compiled from it.
        torso: body of the torso.

    Raises:
        SpecError: MuJoCo cannot compile the corrected spec.
    """
    bodies = find_implausible_bodies(model, torso)
    if not bodies:
        return model, ()
    shapes = _compile_shapes(spec)
    bodies_with_colliders = set(model.geom_bodyid[tree.colliding_geoms(model)].tolist())
    for body in bodies:
        element = spec.bodies[body]
        mass = float(model.body_mass[body])
        element.explicitinertial = True
        element.fullinertia[0] = np.nan
        moments = np.full(3, ball_moment(mass))
        if body in bodies_with_colliders:
            moments = shapes.body_inertia[body] * mass / shapes.body_mass[body]
            element.iquat = shapes.body_iquat[body]
        element.inertia = np.maximum(moments, _LEAST_MOMENT)
    with parsers.guard("MuJoCo cannot compile it with the inertias of its colliders", raises=SpecError):
        corrected_model = spec.compile()
    return corrected_model, (_correction_note(model, bodies),)


def find_implausible_bodies(model: mujoco.MjModel, torso: int) -> list[int]:
    """Return the bodies of a robot whose inertia is too large for its span."""
    bodies = np.flatnonzero((model.body_rootid == torso) & (model.body_mass > 0.0))
    gyrations = np.sqrt(model.body_inertia[bodies].max(axis=1) / model.body_mass[bodies])
    return bodies[gyrations > _MAX_GYRATION * _measure_span(model, torso)].tolist()


def _measure_span(model: mujoco.MjModel, torso: int) -> float:
    """Return the length of a robot with all joints at zero, from corner to corner of its bounds, m."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    geoms = [geom for geom in tree.colliding_geoms(model) if model.body_rootid[model.geom_bodyid[geom]] == torso]
    axes = np.eye(3)
    points = [data.xpos[body] for body in np.flatnonzero(model.body_rootid == torso)]
    for geom in geoms:
        points += [tree.support_point(model, data, geom, sign * axis) for axis in axes for sign in (1.0, -1.0)]
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _compile_shapes(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Return a model whose masses and inertias are those of colliders of one density, where a body has any."""
    shapes = spec.copy()
    shapes.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    shapes.compiler.inertiagrouprange = (0, mujoco.mjNGROUP - 1)
    for geom in shapes.geoms:
        geom.mass = np.nan if geom.contype or geom.conaffinity else 0.0
        geom.density = _BALL_DENSITY
    with parsers.guard("MuJoCo cannot find the inertias of its colliders", raises=SpecError):
        return shapes.compile()


def _correction_note(model: mujoco.MjModel, bodies: Sequence[int]) -> str:
    worst = max(bodies, key=lambda body: model.body_inertia[body].max() / model.body_mass[body])
    values = f"{model.body_inertia[worst].max():.3g} kg m^2 at {model.body_mass[worst]:.3g} kg"
    return (
        f"repaired: inertias of {len(bodies)} links, too large for the robot, are those of its colliders, "
        f"such as of {model.body(worst).name} ({values})"
    )
