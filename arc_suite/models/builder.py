"""From a `Body` to the elements of its model, and to one PyMJCF root element: dynamics alone, without visuals."""

import math
from typing import Any, NamedTuple

import numpy as np
from dm_control import mjcf

from arc_suite.models.outline import outline, torso_box
from arc_suite.robots.spec import Body, Joint, Leg, Simulation, Solid

WORLD, ACTUATOR, SENSOR = "worldbody", "actuator", "sensor"  # sections of a model

_HIDDEN = 4  # group of sites
_TOUCHES_NOTHING = {"contype": 0, "conaffinity": 0}

# Cameras that ride along: azimuth from straight ahead and elevation, rad.
_VIEWS = (("portrait", math.radians(-35.0), math.radians(13.0)), ("profile", math.radians(-65.0), math.radians(12.0)))
EYE = "eye"  # the camera that looks ahead from the torso's front, for policies that see
CAMERAS = ("tracking", *(name for name, *_ in _VIEWS), EYE)
_FIELD, _DOWN = 70.0, math.radians(15.0)  # of the eye: field of view, degrees, and how far it looks down
_FOVY = 30.0  # degrees, as MJCF wants it whatever the compiler's angle
_ASPECT, _MARGIN = 4.0 / 3.0, 1.3  # of the picture; room for legs that swing

FLAGS = {
    "filterparent": "enable",
    "island": "disable",  # a single creature is one island: finding it only costs time
}


class Element(NamedTuple):
    """An element of a model, in the words of MJCF; angles are in radians.

    Attributes:
        tag: its kind.
        parent: name of the rigid part, or of the section, that holds it.
        attributes: by name.
    """

    tag: str
    parent: str
    attributes: dict[str, Any]


def build(body: Body) -> mjcf.RootElement:
    """Assemble the body in an empty world: no floor, no decorations.

    The legs are written into the one root, since PyMJCF's `attach` would add a body for each and so change the
    observation.

    Args:
        body: the spec, with nothing left to be sized.

    Returns:
        The model, in radians, with the torso as a free body at its standing height.
    """
    root = mjcf.RootElement(model=body.name)
    root.compiler.angle = "radian"
    root.option.set_attributes(**options(body))
    root.option.flag.set_attributes(**FLAGS)
    parents = {WORLD: root.worldbody, ACTUATOR: root.actuator, SENSOR: root.sensor}
    for tag, parent, attributes in elements(body):
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


def elements(body: Body) -> list[Element]:
    """Return all elements of a body in an empty world, parents first.

    Every element is named: bodies, geoms and sites after the part, joints and motors `<leg>_<joint>`.

    Args:
        body: the spec, with nothing left to be sized.
    """
    listed = parts(body, body.simulation)
    for name, joint in zip(body.joint_names, body.joints, strict=True):
        listed.append(_motor(name, joint))
    for name, view in cameras(body).items():
        listed.append(Element("camera", "torso", {"name": name, "mode": "trackcom", **view}))
    listed.append(Element("camera", "torso", {"name": EYE, "mode": "fixed", **eye(body)}))
    listed.append(_site("torso", 0.01))
    for name, leg in zip(body.foot_names, body.legs, strict=True):
        listed.append(_site(name, leg.foot.radius))
    # The accelerometer is what makes every mj_step fill cfrc_ext, which the task observes: MuJoCo
    # computes contact forces on bodies only where a sensor needs them.
    listed.append(Element("accelerometer", SENSOR, {"name": "torso_acceleration", "site": "torso"}))
    return listed


def parts(body: Body, simulation: Simulation | None = None) -> list[Element]:
    """Return the rigid parts of a body with their joints and shapes, parents first.

    Args:
        body: the spec.
        simulation: its constants; None leaves out contacts, and the limits and dynamics of joints.
    """
    geom = {"density": body.density}
    if simulation:
        # Robot geoms meet only the floor (conaffinity 1), never one another.
        geom |= {"contype": 1, "conaffinity": 0, **contact(simulation)}
    listed = [
        Element("body", WORLD, {"name": "torso", "pos": (0.0, 0.0, body.torso.standing_height)}),
        Element("freejoint", "torso", {"name": "root"}),
    ]
    for solid in body.torso.solids:
        listed.append(Element("geom", "torso", {**_shape(solid), **geom}))
    for ballast in body.ballast:
        listed.append(Element("geom", "torso", {**_shape(ballast), "mass": ballast.mass, **_TOUCHES_NOTHING}))
    for leg in body.legs:
        listed += _leg(leg, geom, simulation)
    return listed


def _leg(leg: Leg, geom: dict[str, Any], simulation: Simulation | None) -> list[Element]:
    listed = []
    joint_names = iter(leg.joint_names)
    *link_names, foot = leg.part_names
    parent, pos, yaw = "torso", leg.mount, math.radians(leg.yaw_deg)
    for name, link in zip(link_names, leg.links, strict=True):
        listed.append(Element("body", parent, {"name": name, "pos": pos, "euler": (0.0, 0.0, yaw)}))
        if link.joint:
            listed.append(_joint(name, next(joint_names), link.joint, simulation))
        capsule = {"name": name, "type": "capsule", "fromto": (0.0, 0.0, 0.0, *link.end), "size": (link.radius,)}
        listed.append(Element("geom", name, {**capsule, **geom}))
        parent, pos, yaw = name, link.end, 0.0
    listed.append(Element("body", parent, {"name": foot, "pos": pos}))
    listed.append(Element("geom", foot, {"name": foot, "type": "sphere", "size": (leg.foot.radius,), **geom}))
    return listed


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
    return Element("joint", part, attributes)


def _motor(name: str, joint: Joint) -> Element:
    control = {"ctrllimited": True, "ctrlrange": (-1.0, 1.0)}
    return Element("motor", ACTUATOR, {"name": name, "joint": name, "gear": (joint.motor.gear,), **control})


def _site(part: str, radius: float) -> Element:
    return Element("site", part, {"name": part, "size": (radius,), "group": _HIDDEN})


def cameras(body: Body, points: np.ndarray | None = None) -> dict[str, dict]:
    """Return cameras that ride along by name: `tracking`, of the spec, `portrait` and `profile`, which frame the body.

    Args:
        body: the spec.
        points: (n, 3) in the torso's frame that they show; None for those of `outline`.
    """
    points = outline(body) if points is None else points
    tracking = {"pos": body.camera.position, "xyaxes": body.camera.xyaxes}
    views = {name: {"fovy": _FOVY, **_framing(points, azimuth, elevation)} for name, azimuth, elevation in _VIEWS}
    return {"tracking": tracking, **views}


def eye(body: Body) -> dict:
    """Return the camera in the middle of the front of the box around the torso, in whose frame it is fixed."""
    low, high = torso_box(body)
    place = (float(high[0]), *(0.5 * (low + high)[1:]).tolist())
    axes = (0.0, -1.0, 0.0, math.sin(_DOWN), 0.0, math.cos(_DOWN))
    return {"pos": place, "xyaxes": axes, "fovy": _FIELD}


def _framing(points: np.ndarray, azimuth: float, elevation: float) -> dict:
    """Return the nearest position from which a camera in a given direction sees all points (n, 3).

    With a point (u, v, b) along the camera's right, up and back, the camera at (cu, cv, cb) and t
    the tangent of half its field of view, the point is in view if |u - cu| <= t (cb - b), and
    |v - cv| <= t (cb - b): each side of the picture is a plane that touches the hull of the outline.
    """
    back = np.array(
        (math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation))
    )
    right = np.array((-math.sin(azimuth), math.cos(azimuth), 0.0))
    axes = np.stack((right, np.cross(back, right), back))
    points = points @ axes.T
    half_field = math.tan(math.radians(_FOVY / 2.0)) / _MARGIN * np.array((_ASPECT, 1.0))
    depth = half_field * points[:, 2:]
    high, low = (points[:, :2] + depth).max(axis=0), (points[:, :2] - depth).min(axis=0)
    place = (*((high + low) / 2.0), ((high - low) / (2.0 * half_field)).max())
    return {"pos": tuple(place @ axes), "xyaxes": tuple(axes[:2].ravel())}
