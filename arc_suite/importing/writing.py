"""From a compiled robot to the MJCF of a source: the same numbers to the last bit, names of the suite, nothing else.

MuJoCo's own writer keeps classes, assets, actuators and six digits. Here, every number is what the compiler made
of the file, written so that it is read back as itself: compiling the text gives the bits of the file.
"""

import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from typing import Any
from xml.etree.ElementTree import SubElement

import mujoco
import numpy as np

from arc_suite import rotations
from arc_suite.importing import loops, mesh_colors
from arc_suite.importing.facing import LEVEL
from arc_suite.importing.loops import Loop
from arc_suite.importing.meshes import Mesh
from arc_suite.importing.naming import Names
from arc_suite.importing.opening import RobotFile
from arc_suite.importing.poses import Leg, Stance
from arc_suite.importing.tree import HINGE, Robot
from arc_suite.importing.visual_meshes import SHAPES, Visuals
from arc_suite.models import source
from arc_suite.models.mjcf_text import exact
from arc_suite.robots import sources

SITE = {"group": "4"}  # attributes of all sites; pictures do not show this group

# Values that MuJoCo takes for attributes that are left out.
_SOLREF = (0.02, 1.0)
_SOLIMP = (0.9, 0.95, 0.001, 0.5, 2.0)
_BODY_DEFAULTS: dict[str, Any] = {"pos": (0.0, 0.0, 0.0), "quat": (1.0, 0.0, 0.0, 0.0), "gravcomp": 0.0}
_JOINT_DEFAULTS: dict[str, Any] = {
    "pos": (0.0, 0.0, 0.0),
    "margin": 0.0,
    "ref": 0.0,
    "springref": 0.0,
    "armature": 0.0,
    "frictionloss": 0.0,
    "stiffness": (0.0, 0.0, 0.0),
    "damping": (0.0, 0.0, 0.0),
    "solreflimit": _SOLREF,
    "solimplimit": _SOLIMP,
    "solreffriction": _SOLREF,
    "solimpfriction": _SOLIMP,
}
_GEOM_DEFAULTS: dict[str, Any] = {
    "condim": 3,
    "priority": 0,
    "solmix": 1.0,
    "margin": 0.0,
    "gap": 0.0,
    "friction": (1.0, 0.005, 0.0001),
    "adhesion": 0.0,
    "surfacevel": (0.0,) * 6,
    "solref": _SOLREF,
    "solimp": _SOLIMP,
}


def write_source(robot: Robot, stance: Stance, names: Names, file: RobotFile) -> str:
    """Return the MJCF of a robot: one free body, its joints and colliders, a site in each foot, the keyframe `home`.

    Where the torso is turned, a site has the orientation of the file's torso, which a robot's IMU shows.

    Args:
        robot: robot of the file.
        stance: stance in which it stands.
        names: names of its parts.
        file: file of the robot.
    """
    root = ElementTree.Element("mujoco")
    SubElement(root, "compiler", angle="radian", autolimits="false", inertiafromgeom="false")
    _add_option(root, robot.model)
    mesh_geoms = _add_meshes(root, robot, file.meshes)
    world = SubElement(root, "worldbody")
    elements = {}
    for body in robot.bodies:
        parent = world if body == robot.root else elements[int(robot.model.body_parentid[body])]
        elements[body] = _add_body(parent, robot, body, names, mesh_geoms)
    _add_visuals(root, elements, file.visuals)
    torso_place = _format_differences({"pos": robot.torso_place}, _BODY_DEFAULTS)
    SubElement(elements[robot.root], "site", name="torso", size=exact(0.01), **torso_place, **SITE)
    if file.facing != LEVEL:
        orientation = exact(file.facing.quaternion)
        SubElement(elements[robot.root], "site", name=source.FILE_FRAME, size=exact(0.01), quat=orientation, **SITE)
    for label, leg in zip(names.legs, stance.legs, strict=True):
        _add_leg_bodies(elements, robot, stance, names, label, leg)
    _add_loops(root, elements, robot, names)
    keyframe = SubElement(root, "keyframe")
    SubElement(keyframe, "key", name="home", qpos=exact(_home_qpos(robot, stance)))
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


def _format_differences(values: Mapping[str, Any], defaults: Mapping[str, Any]) -> dict[str, str]:
    """Return the attributes whose values are not the defaults, as text."""
    return {name: exact(value) for name, value in values.items() if not np.array_equal(value, defaults[name])}


def _add_option(root: ElementTree.Element, model: mujoco.MjModel) -> None:
    """Add the options and flags that are not MuJoCo's defaults."""
    default_option = mujoco.MjSpec().option
    attributes = {}
    for name, kind in sources.OPTIONS.items():
        value = getattr(model.opt, name)
        if np.array_equal(value, getattr(default_option, name)):
            continue
        if isinstance(kind, tuple):  # words, by MuJoCo's number
            attributes[name] = kind[int(value)]
        else:
            attributes[name] = exact(value)
    option = SubElement(root, "option", **attributes)

    flags = {}
    for name in sources.FLAGS:
        bit = int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name.upper()}"))
        if model.opt.disableflags & bit:
            flags[name] = "disable"
    if flags:
        SubElement(option, "flag", **flags)


def _add_meshes(root: ElementTree.Element, robot: Robot, meshes: dict[int, Mesh]) -> dict[int, dict[str, str]]:
    """Add the meshes of colliders, each once, and return the attributes of their geoms, by geom."""
    collider_meshes = {geom: meshes[geom] for geom in robot.colliders if geom in meshes}
    if not collider_meshes:
        return {}
    asset = SubElement(root, "asset")
    names = {}
    geoms = {}
    for geom, mesh in collider_meshes.items():
        key = tuple(mesh.attributes.items())
        if key not in names:
            names[key] = f"mesh{len(names)}"
            SubElement(asset, "mesh", name=names[key], **mesh.attributes)
        pose = {"pos": mesh.position, "quat": mesh.orientation}
        geoms[geom] = {"type": "mesh", "mesh": names[key], **_format_differences(pose, _BODY_DEFAULTS)}
    return geoms


def _add_visuals(root: ElementTree.Element, elements: Mapping[int, ElementTree.Element], visuals: Visuals) -> None:
    """Add the visual meshes and shapes, in numbers of four digits, as nothing is computed with them."""
    shown_meshes = [visual for visual in visuals.meshes if visual.body in elements]
    shown_shapes = [shape for shape in visuals.shapes if shape.body in elements]
    asset = root.find("asset")
    if shown_meshes and asset is None:
        asset = ElementTree.Element("asset")
        root.insert(list(root).index(root.find("worldbody")), asset)
    for number, visual in enumerate(shown_meshes):
        name = f"{sources.VISUAL}{number}"
        faces = " ".join(map(str, visual.faces.ravel().tolist()))
        SubElement(asset, "mesh", name=name, inertia="shell", vertex=_round(visual.points), face=faces)
        attributes = {"type": "mesh", "mesh": name, **sources.VISUAL_GEOM, **_format_color(visual.color)}
        SubElement(elements[visual.body], "geom", name=name, **attributes)
    for number, shape in enumerate(shown_shapes, start=len(shown_meshes)):
        kind, size_count = SHAPES[shape.kind]
        pose = {"pos": _round(shape.position), "quat": _round(shape.orientation)}
        attributes = {"type": kind, "size": _round(shape.size[:size_count]), **pose, **sources.VISUAL_GEOM}
        name = f"{sources.VISUAL}{number}"
        SubElement(elements[shape.body], "geom", name=name, **attributes, **_format_color(shape.color))


def _round(values: np.ndarray) -> str:
    return " ".join(f"{value:.4g}" for value in values.ravel())


def _format_color(color: np.ndarray | None) -> dict[str, str]:
    """Return the attribute of a color (3,) of what is only shown; none where there is no color."""
    return {} if color is None else {"rgba": " ".join(f"{share:.3g}" for share in (*color, 1.0))}


def _add_body(
    parent: ElementTree.Element, robot: Robot, body: int, names: Names, mesh_geoms: dict[int, dict[str, str]]
) -> ElementTree.Element:
    """Add a body with its inertia, joints and colliders."""
    model = robot.model
    pose = {"pos": model.body_pos[body], "quat": model.body_quat[body], "gravcomp": model.body_gravcomp[body]}
    element = SubElement(parent, "body", name=names.bodies[body], **_format_differences(pose, _BODY_DEFAULTS))
    if model.body_mass[body] > 0.0:
        SubElement(
            element,
            "inertial",
            pos=exact(model.body_ipos[body]),
            mass=exact(model.body_mass[body]),
            quat=exact(model.body_iquat[body]),
            diaginertia=exact(model.body_inertia[body]),
        )
    first_joint = model.body_jntadr[body]
    for joint in range(first_joint, first_joint + model.body_jntnum[body]):
        is_free = body == robot.root
        attributes = _free_joint_attributes(model, joint) if is_free else _joint_attributes(model, joint)
        SubElement(element, "joint", name=names.joints.get(joint, "root"), **attributes)
    body_colliders = [geom for geom in robot.colliders if model.geom_bodyid[geom] == body]
    for number, geom in enumerate(body_colliders):
        name = f"{names.bodies[body]}_geom{number}"
        SubElement(element, "geom", name=name, **_geom_attributes(model, geom, mesh_geoms.get(geom)))
    return element


def _joint_resistance(model: mujoco.MjModel, joint: int) -> dict[str, Any]:
    """Return what resists the movement of any joint, by attribute."""
    dof = model.jnt_dofadr[joint]
    return {
        "armature": model.dof_armature[dof],
        "frictionloss": model.dof_frictionloss[dof],
        "stiffness": (model.jnt_stiffness[joint], *model.jnt_stiffnesspoly[joint]),
        "damping": (model.dof_damping[dof], *model.dof_dampingpoly[dof]),
        "solreffriction": model.dof_solref[dof],
        "solimpfriction": model.dof_solimp[dof],
    }


def _free_joint_attributes(model: mujoco.MjModel, joint: int) -> dict[str, str]:
    """Return the attributes of the torso's joint; the classes of some files resist its movement, too."""
    return {"type": "free", **_format_differences(_joint_resistance(model, joint), _JOINT_DEFAULTS)}


def _joint_attributes(model: mujoco.MjModel, joint: int) -> dict[str, str]:
    """Return the attributes of a hinge or slide."""
    qpos_index = model.jnt_qposadr[joint]
    values = _joint_resistance(model, joint) | {
        "pos": model.jnt_pos[joint],
        "margin": model.jnt_margin[joint],
        "ref": model.qpos0[qpos_index],
        "springref": model.qpos_spring[qpos_index],
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
    return attributes | _format_differences(values, _JOINT_DEFAULTS)


def _geom_attributes(model: mujoco.MjModel, geom: int, mesh_geom: dict[str, str] | None) -> dict[str, str]:
    """Return the attributes of a collider, which touches the floor alone and weighs nothing.

    Args:
        model: model of the file.
        geom: the collider.
        mesh_geom: attributes of its shape and pose if it is a mesh.
    """
    contact_values = {name: getattr(model, f"geom_{name}")[geom] for name in _GEOM_DEFAULTS}
    contact = {"mass": "0", "contype": "1", "conaffinity": "0", **_format_differences(contact_values, _GEOM_DEFAULTS)}
    rgba = model.geom_rgba[geom]
    color = _format_color(rgba[:3].clip(0.0, 1.0) if mesh_colors.is_color(rgba) else None)
    if mesh_geom is not None:
        return mesh_geom | contact | color
    shape, size_count = SHAPES[mujoco.mjtGeom(model.geom_type[geom])]
    pose = {"pos": model.geom_pos[geom], "quat": model.geom_quat[geom]}
    size = exact(model.geom_size[geom][:size_count])
    return {"type": shape, "size": size, **_format_differences(pose, _BODY_DEFAULTS), **contact, **color}


def _add_leg_bodies(
    elements: dict[int, ElementTree.Element], robot: Robot, stance: Stance, names: Names, label: str, leg: Leg
) -> None:
    """Add a massless body to each foot, and to each link that shares its body with the next one."""
    for number, joint in enumerate(leg.joints, start=1):
        body = int(robot.model.jnt_bodyid[joint])
        if names.bodies[body] != f"{label}_link{number}":
            SubElement(elements[body], "body", name=f"{label}_link{number}")
    last_body = _find_foot_body(robot, leg)
    data = robot.forward_kinematics(stance.qpos)
    foot_position = data.xmat[last_body].reshape(3, 3).T @ (leg.center - data.xpos[last_body])  # in the body's frame
    foot = SubElement(elements[last_body], "body", name=f"{label}_foot", pos=exact(foot_position))
    SubElement(foot, "site", name=f"{label}_foot", size=exact(leg.radius), **SITE)


def _find_foot_body(robot: Robot, leg: Leg) -> int:
    """Return the body that carries a foot: the last one that a joint of the leg moves, or a passive joint after it."""
    leg_joints = {*leg.joints, *robot.passive}
    last_joint = [joint for joint in robot.lineage(leg.body) if joint in leg_joints][-1]
    return int(robot.model.jnt_bodyid[last_joint])


def _add_loops(root: ElementTree.Element, elements: dict[int, ElementTree.Element], robot: Robot, names: Names) -> None:
    """Add the constraints that are kept: of joints by name, of links by a site in each."""
    if not robot.loops:
        return
    section = SubElement(root, "equality")
    for number, loop in enumerate(robot.loops):
        constraint = _add_constraint(section, robot, loop)
        if loop.follower is not None:
            constraint.attrib |= {f"joint{side}": names.joints[joint] for side, joint in enumerate(loop.parts, start=1)}
            continue
        for side, (body, pose) in enumerate(loops.find_frames(robot, loop), start=1):
            site = f"loop{number}_{side}"
            SubElement(elements[body], "site", name=site, **_format_differences(pose, _BODY_DEFAULTS), **SITE)
            constraint.set(f"site{side}", site)


def _add_constraint(section: ElementTree.Element, robot: Robot, loop: Loop) -> ElementTree.Element:
    """Add a constraint without its parts."""
    model = robot.model
    data = model.eq_data[loop.equality]
    values = {"solref": model.eq_solref[loop.equality], "solimp": model.eq_solimp[loop.equality]}
    attributes = _format_differences(values, _GEOM_DEFAULTS)
    if loop.follower is not None:
        return SubElement(section, "joint", polycoef=exact(data[:5]), **attributes)
    if model.eq_type[loop.equality] == mujoco.mjtEq.mjEQ_WELD:
        return SubElement(section, "weld", torquescale=exact(data[10]), **attributes)
    return SubElement(section, "connect", **attributes)


def _home_qpos(robot: Robot, stance: Stance) -> list[float]:
    """Return qpos of the standing pose in the model of the source."""
    root_position = (0.0, 0.0, stance.height) - robot.torso_place  # where the torso's frame is level
    root_pose = [*root_position, *rotations.NO_TURN]
    return root_pose + [stance.qpos[robot.qpos_index(joint)] for joint in robot.joints]
