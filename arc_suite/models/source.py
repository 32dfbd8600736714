"""Models of imported bodies: their source, with servos, cameras, a sensor and the ground added.

A source is MJCF of one free body `torso` alone, whose parts and joints have the names of the body's legs. It stays
the record of the physics.
"""

import functools
import xml.etree.ElementTree as ElementTree
from xml.etree.ElementTree import SubElement

import mujoco
import numpy as np
from dm_control import mjcf

from arc_suite.arenas import Arena
from arc_suite.models import builder, visuals
from arc_suite.models.mjcf_text import exact, to_mjcf
from arc_suite.models.outline import geom_corners, outline
from arc_suite.models.visuals import scene
from arc_suite.robots import sources
from arc_suite.robots.spec import Body, Servo, SpecError

HOME = "home"  # keyframe of the standing pose
FILE_FRAME = "file"  # site with the orientation of the torso in the robot's file, where it is turned

_SECTIONS_OF_SCENES = ("option", "keyframe")  # a scene that takes the body has its own
_TORSO = 1  # its index in the model
_DECORATION = {"mass": "0", "group": "2", "contype": "0", "conaffinity": "0"}
_HIDDEN_GROUP = "4"  # of colliders of parts with visual meshes; pictures do not show it
_FINISH = {"specular": "0.35", "shininess": "0.4"}  # of visual meshes with colors of the file
_FOOT_COVER = 1.04  # radius of the sphere around a foot, in radii of the foot


def mjcf_tree(body: Body, arena: Arena | None, decorated: bool = False, releases: bool = False) -> ElementTree.Element:
    """Return the MJCF of an imported body.

    Args:
        body: with a source.
        arena: where it moves; None leaves free joint, options and ground to the scene that takes the body.
        decorated: whether the colliders get materials.
        releases: whether legs can weaken or hang; see `_add_servos`.

    Raises:
        SpecError: a source that MuJoCo cannot read, or that lacks a part of the body.
    """
    compile_source(body)  # raises the error
    root = ElementTree.fromstring(body.source)
    if not decorated:
        sources.remove_visuals(root)
    root.set("model", body.name)
    parts = {part.get("name"): part for part in root.iter("body")}
    torso = parts["torso"]
    _add_servos(root, body, releases)
    _add_cameras(torso, body)
    sensors = SubElement(root, "sensor")
    SubElement(sensors, "accelerometer", name="torso_acceleration", site="torso")
    if decorated:
        _show_colliders(root, parts, body)
    if arena is None:
        torso.remove(torso.find("joint"))
        for section in list(root):
            if section.tag in _SECTIONS_OF_SCENES:
                root.remove(section)
    else:
        _set_options(root, body)
    _add_ground(root, torso, _ground(body, arena, decorated))
    return root


def model_spec(body: Body, arena: Arena, decorated: bool = False) -> mujoco.MjSpec:
    """Return the spec of an imported body's model; without decorations, its servos have releases. See `mjcf_tree`."""
    root = mjcf_tree(body, arena, decorated, releases=not decorated)
    # Heights of the ground go in as numbers: see `assembly.model_spec`.
    elevations = [np.array(field.attrib.pop("elevation").split(), float) for field in root.iter("hfield")]
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
    for field, elevation in zip(spec.hfields, elevations, strict=True):
        # MJCF lists rows from the far side in y.
        field.userdata = elevation.reshape(field.nrow, field.ncol)[::-1].ravel()
    return spec


@functools.lru_cache(maxsize=64)
def compile_source(body: Body) -> mujoco.MjModel:
    """Return the compiled model of a source as it is, whose keyframe is the standing pose.

    Raises:
        SpecError: MuJoCo cannot read it, or it lacks the keyframe, a part or a joint of the body.
    """
    try:
        root = sources.remove_visuals(ElementTree.fromstring(body.source))
        model = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
        # MuJoCo raises a KeyError for each name that the source lacks.
        model.key(HOME)
        for name in body.part_names:
            model.body(name)
        for name in (*body.joint_names, *(joint.name for joint in body.held)):
            model.joint(name)
    except (ValueError, KeyError) as error:
        raise SpecError(" ".join(str(error).split())[:200], "source", f"Body({body.name})") from None
    return model


def torso_place(body: Body) -> np.ndarray:
    """Return the origin (3,) of the torso's frame in that of the root body, m; 0 for a body without a source."""
    return compile_source(body).site("torso").pos if body.source else np.zeros(3)


def file_orientation(body: Body) -> np.ndarray:
    """Return the orientation (4,) of the torso's frame of the robot's file in that of the body, w first."""
    level = np.array((1.0, 0.0, 0.0, 0.0))
    if not body.source:
        return level
    model = compile_source(body)
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, FILE_FRAME)
    return level if site < 0 else model.site_quat[site].copy()


def angles_at_home(body: Body) -> dict[str, float]:
    """Return the positions of a source's joints in the standing pose by name: rad, or m of a slide."""
    model = compile_source(body)
    qpos = model.key(HOME).qpos
    angles = {}
    for joint in range(model.njnt):
        if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_FREE:
            angles[model.joint(joint).name] = float(qpos[model.jnt_qposadr[joint]])
    return angles


def _add_servos(root: ElementTree.Element, body: Body, releases: bool) -> None:
    """Add the servos of all joints: those of legs, their releases and drags in the same order, those of held joints.

    A servo holds its joint in the standing pose for a control of 0, and a reach away from it for 1. Its torque is
    k (reach u + home - q) - d v for a control u. That of its release is -r (k (home - q) - d v) for a control r. With
    controls s u and 1 - s a joint has the share s of its torque.

    A servo whose torque falls with speed has a drag: see `builder.elements`. It is the limit's, not the joint's: a
    control of 1 takes it away from a servo that fails. Where one servo has a drag, all of legs have one, maybe 0.
    """
    actuators = SubElement(root, "actuator")
    joints = {joint.get("name"): joint for joint in root.find("worldbody").iter("joint")}
    home = angles_at_home(body)  # rad
    leg_joints = [(leg.full_name(joint), joint) for leg in body.legs for joint in leg.joints]
    for name, joint in leg_joints:
        reach = np.radians(np.abs(joint.range_deg)).max()
        _add_servo(actuators, joints[name], joint.servo, home[name], reach, _delay_texts(joint.servo, body))
    if releases:
        for name, joint in leg_joints:
            _add_release(actuators, name, joint.servo, home[name], _delay_texts(joint.servo, body))
    servos = [joint.servo for _, joint in leg_joints] + [held_joint.servo for held_joint in body.held]
    if any(servo.drag is not None for servo in servos):
        for name, joint in leg_joints:
            _add_drag(actuators, name, joint.servo, _delay_texts(joint.servo, body) if releases else None)
    for held_joint in body.held:
        name = held_joint.name
        _add_servo(actuators, joints[name], held_joint.servo, home[name], reach=0.0, delay={})
    for held_joint in body.held:
        if held_joint.servo.drag is not None:
            _add_drag(actuators, held_joint.name, held_joint.servo)


def _add_servo(
    actuators: ElementTree.Element,
    joint: ElementTree.Element,
    servo: Servo,
    home: float,
    reach: float,
    delay: dict[str, str],
) -> None:
    """Add a servo, and limit the torque on its joint.

    Args:
        actuators: the section.
        joint: element of the joint.
        servo: servo of the joint.
        home: angle in the standing pose, rad.
        reach: angle from there for a control of 1, rad.
        delay: attributes of its delay.
    """
    name = joint.get("name")
    gain = exact(servo.stiffness * reach)
    damping = servo.damping - (servo.drag or 0.0)
    bias = exact((servo.stiffness * home, -servo.stiffness, -damping))
    limits = _stall_limits(servo)
    _add_actuator(actuators, name, name, (-1.0, 1.0), biastype="affine", gainprm=gain, biasprm=bias, **limits, **delay)
    torque_range = exact((-servo.limit, servo.limit))  # of all actuators of the joint together
    joint.attrib |= {"actuatorfrclimited": "true", "actuatorfrcrange": torque_range}


def _add_release(actuators: ElementTree.Element, joint: str, servo: Servo, home: float, delay: dict[str, str]) -> None:
    """Add the release of the servo of a joint, given by name; `home` is its angle in the standing pose, rad."""
    gain = exact((-servo.stiffness * home, servo.stiffness, servo.damping - (servo.drag or 0.0)))
    limits = _stall_limits(servo)
    _add_actuator(actuators, f"{joint}-release", joint, (0.0, 1.0), gaintype="affine", gainprm=gain, **limits, **delay)


def _add_drag(
    actuators: ElementTree.Element, joint: str, servo: Servo, release_delay: dict[str, str] | None = None
) -> None:
    """Add the drag of the servo of a joint, given by name.

    Args:
        actuators: the section.
        joint: name of the joint.
        servo: servo of the joint.
        release_delay: attributes of the delay of a control that takes the drag away; None for no such control.
    """
    drag = servo.drag or 0.0
    bias = {"biastype": "affine", "biasprm": exact((0.0, 0.0, -drag))}
    name = f"{joint}{builder.DRAG}"
    if release_delay is None:
        SubElement(actuators, "general", name=name, joint=joint, gainprm="0", **bias)
        return
    gain = {"gaintype": "affine", "gainprm": exact((0.0, 0.0, drag))}
    _add_actuator(actuators, name, joint, (0.0, 1.0), **gain, **bias, **release_delay)


def _delay_texts(servo: Servo, body: Body) -> dict[str, str]:
    """Return the attributes of the delay of a servo; see `builder.delay_attributes`."""
    return {name: exact(value) for name, value in builder.delay_attributes(servo, body.simulation).items()}


def _stall_limits(servo: Servo) -> dict[str, str]:
    """Return the attributes of an actuator that limit its force to the stall torque; none without a drag."""
    if servo.drag is None:
        return {}
    return {"forcelimited": "true", "forcerange": exact((-servo.stall_torque, servo.stall_torque))}


def _add_actuator(
    actuators: ElementTree.Element, name: str, joint: str, control_range: tuple[float, float], **attributes: str
) -> None:
    control = {"ctrllimited": "true", "ctrlrange": exact(control_range)}
    SubElement(actuators, "general", name=name, joint=joint, **control, **attributes)


def _add_cameras(torso: ElementTree.Element, body: Body) -> None:
    """Add the cameras that ride along, and the eye."""
    place = torso_place(body)
    for name, camera in _riding_cameras(body).items():
        _add_camera(torso, name, "trackcom", camera, place)
    _add_camera(torso, builder.EYE, "fixed", builder.eye(body), place)


def _add_camera(torso: ElementTree.Element, name: str, mode: str, camera: dict, place: np.ndarray) -> None:
    """Add a camera in the torso's frame, which has a place (3,) in that of its body."""
    attributes = {key: exact(value) for key, value in (camera | {"pos": camera["pos"] + place}).items()}
    SubElement(torso, "camera", name=name, mode=mode, **attributes)


def _riding_cameras(body: Body) -> dict[str, dict]:
    """Return the cameras that ride along by name; they frame the standing body with its colliders.

    MuJoCo keeps a camera where it is seen from the center of mass in the pose of all joints at zero. So cameras of
    the standing pose are moved by the difference of the centers of mass.
    """
    model = compile_source(body)
    data = mujoco.MjData(model)
    center_at_zero = _center_of_mass(model, data, model.qpos0)
    center_at_home = _center_of_mass(model, data, model.key(HOME).qpos)
    shift = center_at_zero - center_at_home

    corners = geom_corners(model, data) - data.site("torso").xpos
    points = np.concatenate([outline(body), corners.reshape(-1, 3)])
    cameras = builder.cameras(body, points)
    return {name: camera | {"pos": camera["pos"] + shift} for name, camera in cameras.items()}


def _center_of_mass(model: mujoco.MjModel, data: mujoco.MjData, qpos: np.ndarray) -> np.ndarray:
    """Put the data into a pose (nq,), and return the center of mass (3,) from the torso."""
    data.qpos[:] = qpos
    mujoco.mj_kinematics(model, data)
    mujoco.mj_comPos(model, data)
    return data.subtree_com[_TORSO] - data.xpos[_TORSO]


def _show_colliders(root: ElementTree.Element, parts: dict[str, ElementTree.Element], body: Body) -> None:
    """Give shapes materials, hide colliders next to visual meshes, and give feet spheres that can show a reward.

    Visual meshes have the colors of the file, unless the body has a palette.
    """
    material_of_color: dict[str, str] = {}
    for name, part in parts.items():
        geoms = part.findall("geom")
        visuals = [geom for geom in geoms if geom.get("group") == sources.VISUAL_GROUP]
        for geom in geoms:
            material = "shell" if name == "torso" else "limb"
            color = geom.attrib.pop("rgba", None)
            if color is not None and body.palette is None:
                material = material_of_color.setdefault(color, f"{sources.VISUAL}_color{len(material_of_color)}")
            geom.set("material", material)
            if visuals:
                geom.set("group", "0" if geom in visuals else _HIDDEN_GROUP)
    for leg, name in zip(body.legs, body.foot_names, strict=True):
        cover = {"name": f"visual-{name}", "type": "sphere", "size": exact(_FOOT_COVER * leg.foot.radius)}
        SubElement(parts[name], "geom", **cover, material="glow", **_DECORATION)
    for color, material in material_of_color.items():
        SubElement(_find_or_add(root, "asset"), "material", name=material, rgba=color, **_FINISH)


def _set_options(root: ElementTree.Element, body: Body) -> None:
    """Set the timestep and the integrator, and skip the search for islands, as for other bodies."""
    option = _find_or_add(root, "option")
    option.attrib |= {"timestep": exact(body.simulation.timestep), "integrator": "implicitfast"}
    _find_or_add(option, "flag").set("island", "disable")


def _find_or_add(parent: ElementTree.Element, tag: str) -> ElementTree.Element:
    element = parent.find(tag)
    return SubElement(parent, tag) if element is None else element


def _ground(body: Body, arena: Arena | None, decorated: bool) -> ElementTree.Element:
    """Return the MJCF of an arena and of a body's materials, in which lights stand in a body `torso`."""
    root = mjcf.RootElement(model="ground")
    root.worldbody.add("body", name="torso")
    if arena is not None:
        arena.add_to(root, **builder.contact(body.simulation))
    if decorated:
        if arena is not None:
            scene.add_scene(root, body.torso.standing_height)
        visuals.add_materials(root, body)
    return ElementTree.fromstring(to_mjcf(root))


def _add_ground(root: ElementTree.Element, torso: ElementTree.Element, ground: ElementTree.Element) -> None:
    """Add what `_ground` returns to the MJCF of a body: lights to its torso, the rest to the world."""
    root.extend([section for section in ground if section.tag in ("asset", "visual", "statistic")])
    for element in ground.find("worldbody"):
        if element.get("name") == "torso":
            torso.extend(element)
        else:
            root.find("worldbody").append(element)
