"""From a `Body` to the elements of its model, and to one PyMJCF root element: dynamics alone, without visuals."""

import math
from typing import Any, NamedTuple

import numpy as np
from dm_control import mjcf

from arc_suite.models.outline import outline, torso_box
from arc_suite.robots.spec import Body, Joint, Leg, Motor, Servo, Simulation, Solid

# Sections of a model.
WORLD = "worldbody"
ACTUATOR = "actuator"
SENSOR = "sensor"

_SITE_GROUP = 4  # which pictures do not show
_TOUCHES_NOTHING = {"contype": 0, "conaffinity": 0}

DRAG = "-drag"  # ends the name of an actuator for the drag of a joint's motor
EYE = "eye"  # the camera that looks ahead from the torso's front, for policies with pictures
CAMERAS = ("tracking", "portrait", "profile", EYE)

# Cameras that frame the body: azimuth from straight ahead and elevation, rad, by name.
_VIEWS = {
    "portrait": (math.radians(-35.0), math.radians(13.0)),
    "profile": (math.radians(-65.0), math.radians(12.0)),
}
_VIEW_FOVY = 30.0  # degrees, vertical field of view; MJCF has degrees here whatever the compiler's angle
_VIEW_ASPECT = 4.0 / 3.0  # width by height of the picture
_VIEW_MARGIN = 1.3  # factor on the size of the body: room for legs that swing
_EYE_FOVY = 70.0  # degrees
_EYE_PITCH = math.radians(15.0)  # downwards

FLAGS = {
    "filterparent": "enable",
    "island": "disable",  # a single creature is one island: finding it only costs time
}


class Element(NamedTuple):
    """An element of a model, in the words of MJCF; angles are in radians.

    Attributes:
        tag: its kind.
        parent: name of the rigid part or of the section that it is in.
        attributes: by name.
    """

    tag: str
    parent: str
    attributes: dict[str, Any]


def build(body: Body, framed_points: np.ndarray | None = None) -> mjcf.RootElement:
    """Assemble the body in an empty world: no floor, no decorations.

    The legs are written into the one root, since PyMJCF's `attach` would add a body for each and so change the
    observation.

    Args:
        body: the spec, with nothing left to be sized.
        framed_points: see `cameras`.

    Returns:
        The model, in radians, with the torso as a free body at its standing height.
    """
    root = mjcf.RootElement(model=body.name)
    root.compiler.angle = "radian"
    root.option.set_attributes(**options(body))
    root.option.flag.set_attributes(**FLAGS)
    parents = {WORLD: root.worldbody, ACTUATOR: root.actuator, SENSOR: root.sensor}
    for tag, parent, attributes in elements(body, framed_points):
        element = parents[parent].add(tag, **attributes)
        if tag == "body":
            parents[attributes["name"]] = element
    return root


def options(body: Body) -> dict[str, Any]:
    """Return the options of a body's simulation."""
    return {
        "timestep": body.simulation.timestep,
        "integrator": "implicitfast",
        "solver": "Newton",
        "iterations": 200,
    }


def elements(body: Body, framed_points: np.ndarray | None = None) -> list[Element]:
    """Return all elements of a body in an empty world, parents first.

    Every element is named: bodies, geoms and sites after the part, joints and motors `<leg>_<joint>`.

    Args:
        body: the spec, with nothing left to be sized.
        framed_points: see `cameras`.
    """
    body_elements = parts(body, body.simulation)
    for name, joint in zip(body.joint_names, body.joints, strict=True):
        body_elements.append(_motor(name, joint, body.simulation))
    for name, joint in zip(body.joint_names, body.joints, strict=True):
        if joint.motor.drag is not None:
            body_elements.append(_drag(name, joint.motor.drag))
    for name, camera in cameras(body, framed_points).items():
        body_elements.append(Element("camera", "torso", {"name": name, "mode": "trackcom", **camera}))
    body_elements.append(Element("camera", "torso", {"name": EYE, "mode": "fixed", **eye(body)}))
    body_elements.append(_site("torso", radius=0.01))
    for name, leg in zip(body.foot_names, body.legs, strict=True):
        body_elements.append(_site(name, leg.foot.radius))
    # The accelerometer makes every mj_step fill cfrc_ext, which the task observes: MuJoCo computes contact forces on
    # bodies only where a sensor needs them.
    body_elements.append(Element("accelerometer", SENSOR, {"name": "torso_acceleration", "site": "torso"}))
    return body_elements


def parts(body: Body, simulation: Simulation | None = None) -> list[Element]:
    """Return the rigid parts of a body with their joints and shapes, parents first.

    Args:
        body: the spec.
        simulation: its constants; None leaves out contacts, and the limits and dynamics of joints.
    """
    # Attributes of all geoms of the body except ballast.
    material = {"density": body.density}
    if simulation:
        # Geoms of the robot touch only the floor, whose conaffinity is 1, and never one another.
        material |= {"contype": 1, "conaffinity": 0, **contact(simulation)}
    rigid_parts = [
        Element("body", WORLD, {"name": "torso", "pos": (0.0, 0.0, body.torso.standing_height)}),
        Element("freejoint", "torso", {"name": "root"}),
    ]
    for solid in body.torso.solids:
        rigid_parts.append(Element("geom", "torso", {**_shape(solid), **material}))
    for ballast in body.ballast:
        rigid_parts.append(Element("geom", "torso", {**_shape(ballast), "mass": ballast.mass, **_TOUCHES_NOTHING}))
    for leg in body.legs:
        rigid_parts += _leg_elements(leg, material, simulation)
    return rigid_parts


def _leg_elements(leg: Leg, material: dict[str, Any], simulation: Simulation | None) -> list[Element]:
    """Return the links and the foot of a leg.

    Args:
        leg: leg of the body.
        material: attributes of its geoms.
        simulation: as of `parts`.
    """
    leg_elements = []
    joint_names = iter(leg.joint_names)
    *link_names, foot_name = leg.part_names
    # Where the next part begins, in the frame of its parent.
    parent = "torso"
    position = leg.mount
    yaw = math.radians(leg.yaw_deg)
    for name, link in zip(link_names, leg.links, strict=True):
        leg_elements.append(Element("body", parent, {"name": name, "pos": position, "euler": (0.0, 0.0, yaw)}))
        if link.joint:
            leg_elements.append(_joint(name, next(joint_names), link.joint, simulation))
        capsule = {"name": name, "type": "capsule", "fromto": (0.0, 0.0, 0.0, *link.end), "size": (link.radius,)}
        leg_elements.append(Element("geom", name, {**capsule, **material}))
        parent = name
        position = link.end
        yaw = 0.0
    leg_elements.append(Element("body", parent, {"name": foot_name, "pos": position}))
    ball = {"name": foot_name, "type": "sphere", "size": (leg.foot.radius,)}
    leg_elements.append(Element("geom", foot_name, {**ball, **material}))
    return leg_elements


def contact(simulation: Simulation) -> dict:
    """Return the contact attributes of geoms; dimensionless ones are the same for all bodies."""
    return {
        "condim": 3,
        "friction": (1.0, 0.5, 0.5),
        "margin": simulation.contact_margin,
        "solref": (simulation.contact_time, 1.0),
        "solimp": (0.9, 0.95, simulation.contact_width, 0.5, 2.0),
    }


def _shape(solid: Solid) -> dict[str, Any]:
    return {
        "name": solid.name,
        "type": solid.shape,
        "size": solid.size,
        "pos": solid.position,
        "euler": [math.radians(angle) for angle in solid.euler_deg],
    }


def _joint(part: str, name: str, joint: Joint, simulation: Simulation | None) -> Element:
    attributes: dict[str, Any] = {"name": name, "type": "hinge", "axis": joint.axis}
    if simulation:
        low, high = joint.range_deg
        attributes["limited"] = True
        attributes["range"] = (math.radians(low), math.radians(high))
        attributes["armature"] = joint.armature
        attributes["damping"] = joint.damping
        attributes["solreflimit"] = (simulation.contact_time, 1.0)
        if joint.friction_loss:
            attributes["frictionloss"] = joint.friction_loss
        if joint.drive and (joint.drive.drag is not None or joint.drive.delay):  # of motor and drag together
            attributes["actuatorfrclimited"] = True
            attributes["actuatorfrcrange"] = (-joint.torque, joint.torque)
    return Element("joint", part, attributes)


def delay_attributes(drive: Motor | Servo, simulation: Simulation) -> dict[str, Any]:
    """Return the attributes of an actuator whose control acts after the delay of a drive; none without a delay.

    The time lies in the middle of a substep, so that its rounding never moves a control to another substep.
    """
    substeps = round(drive.delay / simulation.timestep)
    if substeps == 0:
        return {}
    return {"delay": (substeps - 0.5) * simulation.timestep, "nsample": substeps + 1}


def _motor(name: str, joint: Joint, simulation: Simulation) -> Element:
    """Return the motor of a joint.

    With a drag d, its torque at a control u and a speed v is g u + d v, at most the stall torque. Another actuator
    takes d v away. Together they are the torque g u within limits that fall with speed, in every substep.
    """
    motor = joint.motor
    attributes = {"name": name, "joint": name, "gear": (motor.gear,), "ctrllimited": True, "ctrlrange": (-1.0, 1.0)}
    attributes |= delay_attributes(motor, simulation)
    if motor.drag is None:
        return Element("motor", ACTUATOR, attributes)
    share = motor.stall_torque / motor.gear  # the gear multiplies forces, and speeds too
    bias = (0.0, 0.0, motor.drag / motor.gear**2)
    limits = {"biastype": "affine", "biasprm": bias, "forcelimited": True, "forcerange": (-share, share)}
    return Element("general", ACTUATOR, {**attributes, **limits})


def _drag(name: str, drag: float) -> Element:
    """Return the actuator of the drag of a joint's motor; its control has no effect."""
    bias = (0.0, 0.0, -drag)
    return Element(
        "general",
        ACTUATOR,
        {"name": f"{name}{DRAG}", "joint": name, "gainprm": (0.0,), "biastype": "affine", "biasprm": bias},
    )


def _site(part: str, radius: float) -> Element:
    return Element("site", part, {"name": part, "size": (radius,), "group": _SITE_GROUP})


def cameras(body: Body, framed_points: np.ndarray | None = None) -> dict[str, dict]:
    """Return cameras that ride along by name: `tracking`, of the spec, `portrait` and `profile`, which frame the body.

    Args:
        body: the spec.
        framed_points: (n, 3) points in the torso's frame that they show, m; None for those of `outline`.
    """
    if framed_points is None:
        framed_points = outline(body)
    tracking_camera = {"pos": body.camera.position, "xyaxes": body.camera.xyaxes}
    camera_of_name: dict[str, dict[str, Any]] = {"tracking": tracking_camera}
    for name, (azimuth, elevation) in _VIEWS.items():
        camera_of_name[name] = {"fovy": _VIEW_FOVY, **_framing_pose(framed_points, azimuth, elevation)}
    return camera_of_name


def eye(body: Body) -> dict:
    """Return the camera in the middle of the front of the box around the torso, fixed in the torso's frame."""
    low, high = torso_box(body)
    middle = 0.5 * (low + high)
    position = (float(high[0]), *middle[1:].tolist())
    right = (0.0, -1.0, 0.0)
    up = (math.sin(_EYE_PITCH), 0.0, math.cos(_EYE_PITCH))
    return {"pos": position, "xyaxes": (*right, *up), "fovy": _EYE_FOVY}


def _framing_pose(points: np.ndarray, azimuth: float, elevation: float) -> dict:
    """Return the pose of the nearest camera in a direction that sees all points.

    With a point (u, v, b) along the camera's right, up and back, the camera at (cu, cv, cb) and t
    the tangent of half its field of view, the point is in view if |u - cu| <= t (cb - b), and
    |v - cv| <= t (cb - b): each side of the picture is a plane that touches the hull of the points.

    Args:
        points: (n, 3) in the torso's frame, m.
        azimuth: azimuth of the camera from straight ahead, rad.
        elevation: elevation of the camera, rad.
    """
    back = np.array(
        (math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation))
    )
    right = np.array((-math.sin(azimuth), math.cos(azimuth), 0.0))
    up = np.cross(back, right)
    axes = np.stack((right, up, back))
    camera_points = points @ axes.T
    right_and_up = camera_points[:, :2]
    tangents = math.tan(math.radians(_VIEW_FOVY / 2.0)) / _VIEW_MARGIN * np.array((_VIEW_ASPECT, 1.0))
    half_widths = tangents * camera_points[:, 2:]  # of the field of view at the depth of the points
    high = (right_and_up + half_widths).max(axis=0)
    low = (right_and_up - half_widths).min(axis=0)
    distance = ((high - low) / (2.0 * tangents)).max()
    position = (*((high + low) / 2.0), distance)
    return {"pos": tuple(position @ axes), "xyaxes": tuple(axes[:2].ravel())}
