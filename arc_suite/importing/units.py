"""Units of files: lengths in centimeters, millimeters or inches, meshes in millimeters, masses in grams."""

import math

import mujoco
import numpy as np

from arc_suite import parsers
from arc_suite.importing.inertias import find_implausible_bodies
from arc_suite.importing.poses import Stance
from arc_suite.importing.tree import Robot
from arc_suite.models.standing import GRAVITY
from arc_suite.robots.spec import MAX_LENGTH, SpecError

UNITS = {"inches": 0.0254, "cm": 0.01, "mm": 0.001}  # m, by name
SCALE_RANGE = (1e-6, 1e6)

# Mass by the cube of the standing height, kg/m^3: 4 to 1052 for 41 robots of others, mostly about 500.
_COMMON_DENSITY = 500.0
_MIN_DENSITY = 0.05
_MAX_DENSITY = 1e5
_MAX_GRAVITY_DIFFERENCE = 0.05  # of the suite's gravity; a file with another gravity has units of its own

# Powers of a length in the numbers of qpos, by kind of joint.
_LENGTH_POWERS = {
    mujoco.mjtJoint.mjJNT_FREE: (1, 1, 1, 0, 0, 0, 0),
    mujoco.mjtJoint.mjJNT_BALL: (0, 0, 0, 0),
    mujoco.mjtJoint.mjJNT_SLIDE: (1,),
    mujoco.mjtJoint.mjJNT_HINGE: (0,),
}

# Radius of a mesh in spans of the joints; 0.8 at most for robots of others.
_MAX_MESH_RADIUS = 20.0
_COMMON_MESH_RADIUS = 0.3


def scale_lengths(spec: mujoco.MjSpec, scale: float) -> None:
    """Multiply all lengths of a spec by a factor; masses and torques stay."""
    for kind in (spec.bodies, spec.geoms, spec.sites, spec.joints, spec.cameras, spec.lights, spec.frames):
        for element in kind:
            element.pos *= scale
    for body in spec.bodies:
        body.ipos *= scale
    for geom in spec.geoms:
        geom.size *= scale
        geom.fromto *= scale
        geom.margin *= scale
        geom.gap *= scale
    for mesh in spec.meshes:
        mesh.scale *= scale  # which acts after refpos
    for joint in spec.joints:
        if joint.type == mujoco.mjtJoint.mjJNT_SLIDE:
            joint.range *= scale
            joint.ref *= scale
            joint.springref *= scale
            joint.margin *= scale
    _scale_equalities(spec, scale)
    _scale_keyframes(spec, scale)


def _scale_equalities(spec: mujoco.MjSpec, scale: float) -> None:
    """Multiply the lengths of anchors and of polynomials between joints."""
    slides = {joint.name for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_SLIDE}
    for equality in spec.equalities:
        if equality.type in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
            equality.data[:6] *= scale  # anchors
        elif equality.type == mujoco.mjtEq.mjEQ_JOINT:
            follower_factor = scale if equality.name1 in slides else 1.0
            leader_factor = scale if equality.name2 in slides else 1.0
            equality.data[:5] *= follower_factor / leader_factor ** np.arange(5)


def _scale_keyframes(spec: mujoco.MjSpec, scale: float) -> None:
    """Multiply the places of free joints and slides in keyframes."""
    powers = [power for joint in spec.joints for power in _LENGTH_POWERS[joint.type]]
    factors = scale ** np.array(powers, float)
    for key in spec.keys:
        if len(key.qpos) == len(factors):  # the compiler refuses others, except those without numbers
            key.qpos = factors * np.array(key.qpos)


def scale_inertias(spec: mujoco.MjSpec, model: mujoco.MjModel, torso: int, scale: float) -> mujoco.MjModel:
    """Return the model of a scaled spec with its inertias scaled, too, unless they fit the lengths as they are."""
    if scale == 1.0 or not find_implausible_bodies(model, torso):
        return model
    for body in spec.bodies:
        body.inertia *= scale**2
        body.fullinertia *= scale**2
    return spec.compile()


def repair_meshes(spec: mujoco.MjSpec, model: mujoco.MjModel, torso: int) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """Return the model with the robot's meshes in the units of its joints, and a note if any were in other units."""
    radii: dict[str, float] = {}
    for geom in range(model.ngeom):
        is_of_robot = model.body_rootid[model.geom_bodyid[geom]] == torso  # and not of a scene, which may be large
        if is_of_robot and model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_MESH:
            name = model.mesh(int(model.geom_dataid[geom])).name
            radii[name] = float(model.geom_rbound[geom])
    largest = max(radii.values(), default=0.0)
    unit = find_mesh_unit(model, torso, largest)
    if unit is None:
        return model, ()
    for name in radii:
        spec.mesh(name).scale *= UNITS[unit]
    with parsers.guard(f"MuJoCo cannot compile it with meshes in {unit}", raises=SpecError):
        return spec.compile(), (describe_repair(f"{len(radii)} meshes", unit, largest),)


def find_mesh_unit(model: mujoco.MjModel, torso: int, radius: float) -> str | None:
    """Return the unit of a robot's meshes; None if they fit its joints.

    Args:
        model: model of the file.
        torso: body of the torso.
        radius: radius of the largest mesh, m.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    span = float(np.linalg.norm(np.ptp(data.xpos[model.body_rootid == torso], axis=0)))  # m
    if radius <= _MAX_MESH_RADIUS * span or span == 0.0:
        return None
    return _find_unit(_COMMON_MESH_RADIUS * span / radius)


def describe_repair(meshes: str, unit: str, radius: float) -> str:
    """Return a line on meshes that were in another unit, the largest of which has a radius, m."""
    return f"repaired: {meshes} are in {unit}, as {radius:.3g} m is far beyond the joints"


def unit_notes(robot: Robot, stance: Stance) -> tuple[str, ...]:
    """Return a line for the user if a robot's height and mass look as if they were in other units.

    Raises:
        SpecError: no body is so high.
    """
    mass = float(robot.model.body_subtreemass[robot.root])
    density = mass / stance.height**3
    gravity = float(np.linalg.norm(robot.model.opt.gravity))
    size = f"stands {stance.height:.3g} m high at {mass:.3g} kg"
    has_common_gravity = abs(gravity - GRAVITY) <= _MAX_GRAVITY_DIFFERENCE * GRAVITY
    line = ""
    if density < _MIN_DENSITY and has_common_gravity:
        unit = _find_unit((density / _COMMON_DENSITY) ** (1.0 / 3.0))
        line = f"{size}: lengths in {unit}? --scale={UNITS[unit]:g}"
    elif density > _MAX_DENSITY and has_common_gravity:
        line = f"{size}: masses in g?"
    if stance.height > MAX_LENGTH:
        raise SpecError(line or f"{size}; expected at most {MAX_LENGTH:g} m: --scale=0.01 is for lengths in cm")
    return (f"units: {line}",) if line else ()


def _find_unit(factor: float) -> str:
    """Return the unit whose length in m is nearest to a factor."""
    return min(UNITS, key=lambda unit: abs(math.log(UNITS[unit] / factor)))
