"""From a compiled robot to the MJCF of a source: the same numbers to the last bit, names of the suite, nothing else.

MuJoCo's own writer keeps classes, assets, actuators and six digits. Here, every number is what the compiler made
of the file, written so that it is read back as itself: compiling the text gives the bits of the file.
"""

import xml.etree.ElementTree as ElementTree
from typing import Any
from xml.etree.ElementTree import SubElement

import mujoco
import numpy as np

from arc_suite.importing.meshes import Mesh
from arc_suite.importing.naming import Names
from arc_suite.importing.poses import Leg, Stance
from arc_suite.importing.tree import HINGE, Robot
from arc_suite.models.mjcf_text import exact
from arc_suite.robots import sources

SITE = {"group": "4"}

_GEOMS = {
    mujoco.mjtGeom.mjGEOM_SPHERE: ("sphere", 1),
    mujoco.mjtGeom.mjGEOM_CAPSULE: ("capsule", 2),
    mujoco.mjtGeom.mjGEOM_CYLINDER: ("cylinder", 2),
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: ("ellipsoid", 3),
    mujoco.mjtGeom.mjGEOM_BOX: ("box", 3),
}

# What MuJoCo takes for attributes that are left out.
_SOFTNESS = {"solref": (0.02, 1.0), "solimp": (0.9, 0.95, 0.001, 0.5, 2.0)}
_BODY: dict[str, Any] = {"pos": (0.0, 0.0, 0.0), "quat": (1.0, 0.0, 0.0, 0.0), "gravcomp": 0.0}
_JOINT: dict[str, Any] = {
    "pos": (0.0, 0.0, 0.0), "margin": 0.0, "ref": 0.0, "springref": 0.0, "armature": 0.0, "frictionloss": 0.0,
    "stiffness": (0.0, 0.0, 0.0), "damping": (0.0, 0.0, 0.0),
    **{f"{name}{what}": value for name, value in _SOFTNESS.items() for what in ("limit", "friction")},
}  # fmt: skip
_GEOM: dict[str, Any] = {
    "condim": 3, "priority": 0, "solmix": 1.0, "margin": 0.0,
    "gap": 0.0, "friction": (1.0, 0.005, 0.0001), "adhesion": 0.0, "surfacevel": (0.0,) * 6, **_SOFTNESS,
}  # fmt: skip


def write_source(robot: Robot, stance: Stance, names: Names, meshes: dict[int, Mesh]) -> str:
    """Return the MJCF of a robot: one free body, its joints and colliders, a site in each foot, the keyframe `home`."""
    root = ElementTree.Element("mujoco")
    SubElement(root, "compiler", angle="radian", autolimits="false", inertiafromgeom="false")
    _add_option(root, robot.model)
    placed = _add_meshes(root, robot, meshes)
    world = SubElement(root, "worldbody")
    elements = {}
    for body in robot.bodies:
        parent = world if body == robot.root else elements[int(robot.model.body_parentid[body])]
        elements[body] = _add_body(parent, robot, body, names, placed)
    SubElement(elements[robot.root], "site", name="torso", size=exact(0.01), **SITE)
    for label, leg in zip(names.legs, stance.legs, strict=True):
        _add_leg_bodies(elements, robot, stance, names, label, leg)
    SubElement(SubElement(root, "keyframe"), "key", name="home", qpos=exact(_home(robot, stance)))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _differing(plain: dict[str, Any], given: dict[str, Any]) -> dict[str, str]:
    """Return the attributes whose numbers are not those that MuJoCo takes where they are left out."""
    return {name: exact(value) for name, value in given.items() if not np.array_equal(value, plain[name])}


def _add_option(root: ElementTree.Element, model: mujoco.MjModel) -> None:
    plain, option = mujoco.MjSpec().option, model.opt
    attributes = {}
    for name, kind in sources.OPTIONS.items():
        value = getattr(option, name)
        if not np.array_equal(value, getattr(plain, name)):
            attributes[name] = kind[int(value)] if isinstance(kind, tuple) else exact(value)  # one of words
    element = SubElement(root, "option", **attributes)
    bits = {name: int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name.upper()}")) for name in sources.FLAGS}
    flags = {name: "disable" for name, bit in bits.items() if option.disableflags & bit}
    if flags:
        SubElement(element, "flag", **flags)


def _add_meshes(root: ElementTree.Element, robot: Robot, meshes: dict[int, Mesh]) -> dict[int, dict[str, str]]:
    """Add the meshes of colliders, and return the attributes of their geoms."""
    own = {geom: meshes[geom] for geom in robot.colliders if geom in meshes}
    asset = SubElement(root, "asset") if own else root
    names = {}
    for mesh in own.values():
        key = tuple(mesh.attributes.items())
        if key not in names:
            names[key] = f"mesh{len(names)}"
            SubElement(asset, "mesh", name=names[key], **mesh.attributes)
    return {
        geom: {"type": "mesh", "mesh": names[tuple(mesh.attributes.items())]}
        | _differing(_BODY, {"pos": mesh.position, "quat": mesh.orientation})
        for geom, mesh in own.items()
    }


def _add_body(
    parent: ElementTree.Element, robot: Robot, body: int, names: Names, meshes: dict[int, dict[str, str]]
) -> ElementTree.Element:
    """Add a body with its inertia, joints and colliders."""
    model = robot.model
    given = {"pos": model.body_pos[body], "quat": model.body_quat[body], "gravcomp": model.body_gravcomp[body]}
    element = SubElement(parent, "body", name=names.bodies[body], **_differing(_BODY, given))
    if model.body_mass[body] > 0.0:
        given = {"quat": model.body_iquat[body], "diaginertia": model.body_inertia[body]}
        mass = {"pos": exact(model.body_ipos[body]), "mass": exact(model.body_mass[body])}
        SubElement(element, "inertial", **mass, **{name: exact(value) for name, value in given.items()})
    for joint in range(model.body_jntadr[body], model.body_jntadr[body] + model.body_jntnum[body]):
        own = _free(model, joint) if body == robot.root else _joint(model, joint)
        SubElement(element, "joint", name=names.joints.get(joint, "root"), **own)
    own = [geom for geom in robot.colliders if model.geom_bodyid[geom] == body]
    for place, geom in enumerate(own):
        SubElement(element, "geom", name=f"{names.bodies[body]}_geom{place}", **_geom(model, geom, meshes.get(geom)))
    return element


def _resistance(model: mujoco.MjModel, joint: int) -> dict[str, Any]:
    """Return what resists the movement of any joint."""
    dof = model.jnt_dofadr[joint]
    return {
        "armature": model.dof_armature[dof],
        "frictionloss": model.dof_frictionloss[dof],
        "stiffness": (model.jnt_stiffness[joint], *model.jnt_stiffnesspoly[joint]),
        "damping": (model.dof_damping[dof], *model.dof_dampingpoly[dof]),
        "solreffriction": model.dof_solref[dof],
        "solimpfriction": model.dof_solimp[dof],
    }


def _free(model: mujoco.MjModel, joint: int) -> dict[str, str]:
    """Return the attributes of the torso's joint; the classes of some files resist its movement, too."""
    return {"type": "free", **_differing(_JOINT, _resistance(model, joint))}


def _joint(model: mujoco.MjModel, joint: int) -> dict[str, str]:
    """Return the attributes of a hinge or slide."""
    place = model.jnt_qposadr[joint]
    given = _resistance(model, joint) | {
        "pos": model.jnt_pos[joint],
        "margin": model.jnt_margin[joint],
        "ref": model.qpos0[place],
        "springref": model.qpos_spring[place],
        "solreflimit": model.jnt_solref[joint],
        "solimplimit": model.jnt_solimp[joint],
    }
    attributes = {"type": "hinge" if model.jnt_type[joint] == HINGE else "slide", "axis": exact(model.jnt_axis[joint])}
    if model.jnt_limited[joint]:
        attributes |= {"limited": "true", "range": exact(model.jnt_range[joint])}
    if model.jnt_actfrclimited[joint]:
        attributes |= {"actuatorfrclimited": "true", "actuatorfrcrange": exact(model.jnt_actfrcrange[joint])}
    if model.jnt_actgravcomp[joint]:
        attributes["actuatorgravcomp"] = "true"
    return attributes | _differing(_JOINT, given)


def _geom(model: mujoco.MjModel, geom: int, mesh: dict[str, str] | None) -> dict[str, str]:
    """Return the attributes of a collider, which touches the floor alone and weighs nothing.

    Args:
        model: of the file.
        geom: the collider.
        mesh: its shape and place if it is a mesh.
    """
    given = {name: getattr(model, f"geom_{name}")[geom] for name in _GEOM}
    touch = {"mass": "0", "contype": "1", "conaffinity": "0", **_differing(_GEOM, given)}
    if mesh is None:
        kind, sizes = _GEOMS[mujoco.mjtGeom(model.geom_type[geom])]
        place = {"pos": model.geom_pos[geom], "quat": model.geom_quat[geom]}
        mesh = {"type": kind, "size": exact(model.geom_size[geom][:sizes]), **_differing(_BODY, place)}
    return mesh | touch


def _add_leg_bodies(
    elements: dict[int, ElementTree.Element], robot: Robot, stance: Stance, names: Names, label: str, leg: Leg
) -> None:
    """Add a massless body to each foot, and to each link that shares its body with the next one."""
    for place, joint in enumerate(leg.joints, start=1):
        body = int(robot.model.jnt_bodyid[joint])
        if names.bodies[body] != f"{label}_link{place}":
            SubElement(elements[body], "body", name=f"{label}_link{place}")
    last = int(robot.model.jnt_bodyid[leg.joints[-1]])
    data = robot.placed(stance.qpos)
    place = data.xmat[last].reshape(3, 3).T @ (leg.center - data.xpos[last])
    foot = SubElement(elements[last], "body", name=f"{label}_foot", pos=exact(place))
    SubElement(foot, "site", name=f"{label}_foot", size=exact(leg.radius), **SITE)


def _home(robot: Robot, stance: Stance) -> list[float]:
    """Return qpos of the standing pose in the model of the source."""
    return [0.0, 0.0, stance.height, 1.0, 0.0, 0.0, 0.0, *(stance.qpos[robot.place(joint)] for joint in robot.joints)]
