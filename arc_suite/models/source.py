"""Models of imported bodies: their source with what it lacks, never rebuilt.

A source is MJCF of one free body `torso` alone, whose parts and joints have the names of the body's legs. It stays
the record of the physics. Servos, cameras and a sensor are added, and the ground.
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
from arc_suite.models.outline import CORNERS, outline
from arc_suite.models.visuals import scene
from arc_suite.robots.spec import Body, Servo, SpecError

HOME = "home"  # keyframe of the standing pose

_OF_SCENES = ("option", "keyframe")  # sections that a scene has itself
_INERT = {"mass": "0", "group": "2", "contype": "0", "conaffinity": "0"}


def mjcf_tree(body: Body, arena: Arena | None, decorated: bool = False, releases: bool = False) -> ElementTree.Element:
    """Return the MJCF of an imported body.

    Args:
        body: with a source.
        arena: where it moves; None leaves free joint, options and ground to the scene that takes the body.
        decorated: whether it has looks; colliders are what is seen.
        releases: whether legs can weaken or hang; see `_add_servos`.

    Raises:
        SpecError: a source that MuJoCo cannot read, or that lacks a part of the body.
    """
    compile_source(body)  # finds out at once whether MuJoCo reads it
    root = ElementTree.fromstring(body.source)
    root.set("model", body.name)
    bodies = {part.get("name"): part for part in root.iter("body")}
    _add_servos(root, body, releases)
    views = {name: ("trackcom", camera) for name, camera in _cameras(body).items()}
    for name, (mode, camera) in (views | {builder.EYE: ("fixed", builder.eye(body))}).items():
        attributes = {key: exact(value) for key, value in camera.items()}
        SubElement(bodies["torso"], "camera", name=name, mode=mode, **attributes)
    SubElement(SubElement(root, "sensor"), "accelerometer", name="torso_acceleration", site="torso")
    if decorated:
        _show_colliders(bodies, body)
    if arena is None:
        bodies["torso"].remove(bodies["torso"].find("joint"))
        for section in [each for each in root if each.tag in _OF_SCENES]:
            root.remove(section)
    else:
        _set_options(root, body)
    _add_ground(root, bodies["torso"], _ground(body, arena, decorated))
    return root


def model_spec(body: Body, arena: Arena, decorated: bool = False) -> mujoco.MjSpec:
    """Return the spec of an imported body's model; without looks, its servos have releases. See `tree`."""
    root = mjcf_tree(body, arena, decorated, releases=not decorated)
    heights = [np.array(field.attrib.pop("elevation").split(), float) for field in root.iter("hfield")]
    spec = mujoco.MjSpec.from_string(ElementTree.tostring(root, encoding="unicode"))
    for field, values in zip(spec.hfields, heights, strict=True):  # as numbers: see `assembly.model_spec`
        field.userdata = values.reshape(field.nrow, field.ncol)[::-1].ravel()
    return spec


@functools.lru_cache(maxsize=64)
def compile_source(body: Body) -> mujoco.MjModel:
    """Return the compiled model of a source as it is, whose keyframe is the standing pose.

    Raises:
        SpecError: MuJoCo cannot read it, or it lacks the keyframe, a part or a joint of the body.
    """
    try:
        model = mujoco.MjModel.from_xml_string(body.source)
        model.key(HOME)
        for name in body.part_names:
            model.body(name)
        for name in (*body.joint_names, *(joint.name for joint in body.held)):
            model.joint(name)
    except (ValueError, KeyError) as error:
        raise SpecError(" ".join(str(error).split())[:200], "source", f"Body({body.name})") from None
    return model


def angles_at_home(body: Body) -> dict[str, float]:
    """Return the positions of a source's joints in the standing pose by name: rad, or m of a slide."""
    model = compile_source(body)
    hinges = (joint for joint in range(model.njnt) if model.jnt_type[joint] != mujoco.mjtJoint.mjJNT_FREE)
    return {model.joint(joint).name: float(model.key(HOME).qpos[model.jnt_qposadr[joint]]) for joint in hinges}


def _add_servos(root: ElementTree.Element, body: Body, releases: bool) -> None:
    """Add the servos of all joints, those of held joints last.

    A servo holds its joint in the standing pose for a control of 0, and a reach away from it for 1. Its torque is
    k (reach u + home - q) - d v for a control u. That of its release is -r (k (home - q) - d v) for a control r. With
    controls s u and 1 - s a joint has the share s of its torque. Releases follow the servos of legs, in their order.
    """
    joints, home = {joint.get("name"): joint for joint in root.iter("joint")}, angles_at_home(body)
    legs = [
        (leg.full_name(joint), joint.servo, np.radians(np.abs(joint.range_deg)).max())
        for leg in body.legs
        for joint in leg.joints
    ]
    actuator = SubElement(root, "actuator")

    def add(name: str, joint: str, low: float, **attributes: str) -> None:
        SubElement(
            actuator, "general", name=name, joint=joint, ctrllimited="true", ctrlrange=exact((low, 1.0)), **attributes
        )

    def hold(name: str, servo: Servo, reach: float) -> None:
        bias = exact((servo.stiffness * home[name], -servo.stiffness, -servo.damping))
        add(name, name, -1.0, biastype="affine", gainprm=exact(servo.stiffness * reach), biasprm=bias)
        limit = exact((-servo.limit, servo.limit))  # of the sum of what acts on the joint
        joints[name].attrib |= {"actuatorfrclimited": "true", "actuatorfrcrange": limit}

    for each in legs:
        hold(*each)
    for name, servo, _ in legs if releases else ():
        gain = exact((-servo.stiffness * home[name], servo.stiffness, servo.damping))
        add(f"{name}-release", name, 0.0, gaintype="affine", gainprm=gain)
    for joint in body.held:
        hold(joint.name, joint.servo, 0.0)


def _cameras(body: Body) -> dict[str, dict]:
    """Return the cameras by name, which frame the standing body with its colliders.

    MuJoCo keeps a camera where it is seen from the center of mass in the pose of all joints at zero.
    """
    model = compile_source(body)
    data, centers = mujoco.MjData(model), []
    for qpos in (model.qpos0, model.key(HOME).qpos):
        data.qpos[:] = qpos
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        centers.append(data.subtree_com[1] - data.xpos[1])
    middles, halves = model.geom_aabb[:, None, :3], model.geom_aabb[:, None, 3:]
    turns = data.geom_xmat.reshape(-1, 3, 3).swapaxes(-1, -2)
    boxes = (middles + CORNERS * halves) @ turns + data.geom_xpos[:, None] - data.xpos[1]
    points = np.concatenate([outline(body), boxes.reshape(-1, 3)])
    moved = centers[0] - centers[1]
    return {name: camera | {"pos": camera["pos"] + moved} for name, camera in builder.cameras(body, points).items()}


def _show_colliders(bodies: dict[str, ElementTree.Element], body: Body) -> None:
    """Give the colliders materials, and the feet spheres that can show a reward."""
    for name, part in bodies.items():
        for geom in part.findall("geom"):
            geom.set("material", "shell" if name == "torso" else "limb")
    for leg, name in zip(body.legs, body.foot_names, strict=True):
        size = exact(1.04 * leg.foot.radius)
        SubElement(bodies[name], "geom", name=f"visual-{name}", type="sphere", size=size, material="glow", **_INERT)


def _set_options(root: ElementTree.Element, body: Body) -> None:
    option = root.find("option")
    option = SubElement(root, "option") if option is None else option
    option.attrib |= {"timestep": exact(body.simulation.timestep), "integrator": "implicitfast"}
    flag = option.find("flag")
    (SubElement(option, "flag") if flag is None else flag).set("island", "disable")


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
    root.extend([section for section in ground if section.tag in ("asset", "visual", "statistic")])
    for element in ground.find("worldbody"):
        if element.get("name") == "torso":
            torso.extend(element)
        else:
            root.find("worldbody").append(element)
