"""The model of a body by MuJoCo's own `MjSpec`: the bits of `builder.build`, without PyMJCF and its text."""

from collections.abc import Iterable, Mapping
from typing import Any

import mujoco

from arc_suite.arenas.flat import PLANE
from arc_suite.models import builder
from arc_suite.models.builder import Element
from arc_suite.robots.spec import Body

# Shapes of a body.
GEOMS = {
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    "box": mujoco.mjtGeom.mjGEOM_BOX,
}
# MuJoCo's enumerations by the words of MJCF.
_GEOMS = {**GEOMS, "plane": mujoco.mjtGeom.mjGEOM_PLANE}
_BIASES = {"affine": mujoco.mjtBias.mjBIAS_AFFINE}
_JOINTS = {"hinge": mujoco.mjtJoint.mjJNT_HINGE}
_CAMERA_MODES = {"fixed": mujoco.mjtCamLight.mjCAMLIGHT_FIXED, "trackcom": mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM}
_INTEGRATORS = {"implicitfast": mujoco.mjtIntegrator.mjINT_IMPLICITFAST}
_SOLVERS = {"Newton": mujoco.mjtSolver.mjSOL_NEWTON}
_FLAGS = {"filterparent": mujoco.mjtDisableBit.mjDSBL_FILTERPARENT, "island": mujoco.mjtDisableBit.mjDSBL_ISLAND}


def on_flat_ground(body: Body) -> mujoco.MjSpec:
    """Return the spec of a body on a plane; its compiled model has the bytes of the compiled MJCF of `assemble(body)`.

    Args:
        body: without a source, and with nothing left to be sized.
    """
    floor = Element("geom", builder.WORLD, {**PLANE, **builder.contact(body.simulation)})
    spec = write([*builder.elements(body), floor])
    spec.modelname = body.name
    options = builder.options(body)
    spec.option.timestep = options["timestep"]
    spec.option.integrator = _INTEGRATORS[options["integrator"]]
    spec.option.solver = _SOLVERS[options["solver"]]
    spec.option.iterations = options["iterations"]
    for name, value in builder.FLAGS.items():
        if value == "disable":
            spec.option.disableflags |= _FLAGS[name]
    return spec


def write(elements: Iterable[Element]) -> mujoco.MjSpec:
    """Return a spec of elements.

    Args:
        elements: parents first.
    """
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    parents = {builder.WORLD: spec.worldbody, builder.ACTUATOR: spec, builder.SENSOR: spec}
    for tag, parent, attributes in elements:
        add = _ADD[tag]
        spec_element = add(parents[parent], **attributes)
        if tag == "body":
            parents[attributes["name"]] = spec_element
    return spec


def _add_joint(part: mujoco.MjsBody, name: str, type: str, axis, limited: bool = False, **dynamics: Any) -> None:
    joint = part.add_joint(name=name, type=_JOINTS[type], axis=axis)
    if limited:
        joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        joint.range = dynamics["range"]
        joint.armature = dynamics["armature"]
        joint.damping[0] = dynamics["damping"]  # the linear term of a polynomial
        joint.solref_limit = dynamics["solreflimit"]
    if "frictionloss" in dynamics:
        joint.frictionloss = dynamics["frictionloss"]
    if "actuatorfrcrange" in dynamics:
        joint.actfrclimited = mujoco.mjtLimited.mjLIMITED_TRUE
        joint.actfrcrange = dynamics["actuatorfrcrange"]


def _add_geom(part: mujoco.MjsBody, type: str, size, **attributes: Any) -> None:
    padded_size = (*size, 0.0, 0.0)[:3]  # MuJoCo has three numbers for any shape
    part.add_geom(type=_GEOMS[type], size=padded_size, **attributes)


def _add_site(part: mujoco.MjsBody, size, **attributes: Any) -> None:
    site = part.add_site(**attributes)
    site.size[0] = size[0]


def _add_camera(part: mujoco.MjsBody, mode: str, **attributes: Any) -> None:
    part.add_camera(mode=_CAMERA_MODES[mode], **attributes)


def _add_motor(
    spec: mujoco.MjSpec, name: str, joint: str, gear, ctrllimited: bool, ctrlrange, **attributes: Any
) -> None:
    motor = spec.add_actuator(name=name, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    motor.set_to_motor()
    motor.gear[0] = gear[0]
    motor.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE if ctrllimited else mujoco.mjtLimited.mjLIMITED_FALSE
    motor.ctrlrange = ctrlrange
    _set_delay(motor, attributes)


def _add_general(spec: mujoco.MjSpec, name: str, joint: str, biastype: str, biasprm, **attributes: Any) -> None:
    actuator = spec.add_actuator(name=name, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    actuator.gaintype = mujoco.mjtGain.mjGAIN_FIXED
    actuator.gainprm[0] = attributes.get("gainprm", (1.0,))[0]
    actuator.biastype = _BIASES[biastype]
    actuator.biasprm[: len(biasprm)] = biasprm
    if "gear" in attributes:
        actuator.gear[0] = attributes["gear"][0]
    for limited, limits in (("ctrllimited", "ctrlrange"), ("forcelimited", "forcerange")):
        if attributes.get(limited):
            setattr(actuator, limited, mujoco.mjtLimited.mjLIMITED_TRUE)
            setattr(actuator, limits, attributes[limits])
    _set_delay(actuator, attributes)


def _set_delay(actuator: mujoco.MjsActuator, attributes: Mapping[str, Any]) -> None:
    for name in ("delay", "nsample"):
        if name in attributes:
            setattr(actuator, name, attributes[name])


def _add_accelerometer(spec: mujoco.MjSpec, name: str, site: str) -> None:
    sensor = mujoco.mjtSensor.mjSENS_ACCELEROMETER
    spec.add_sensor(name=name, type=sensor, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=site)


# Functions that add an element to its parent, by tag.
_ADD = {
    "body": mujoco.MjsBody.add_body,
    "freejoint": mujoco.MjsBody.add_freejoint,
    "joint": _add_joint,
    "geom": _add_geom,
    "site": _add_site,
    "camera": _add_camera,
    "motor": _add_motor,
    "general": _add_general,
    "accelerometer": _add_accelerometer,
}
