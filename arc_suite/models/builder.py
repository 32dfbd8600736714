"""From a `Body` to one PyMJCF root element: dynamics alone, without visuals."""

import math

import numpy as np
from dm_control import mjcf

from arc_suite.models.outline import outline, torso_box
from arc_suite.robots.spec import Body, Joint, Leg, Simulation, Solid

SOLVER_ITERATIONS = 200

_TOUCHES_NOTHING = {"contype": 0, "conaffinity": 0}

# Cameras that ride along: azimuth from straight ahead and elevation, rad.
_VIEWS = (("portrait", math.radians(-35.0), math.radians(13.0)), ("profile", math.radians(-65.0), math.radians(12.0)))
EYE = "eye"  # the camera that looks ahead from the torso's front, for policies that see
CAMERAS = ("tracking", *(name for name, *_ in _VIEWS), EYE)
_FIELD, _DOWN = 70.0, math.radians(15.0)  # of the eye: field of view, degrees, and how far it looks down
_FOVY = 30.0  # degrees, as MJCF wants it whatever the compiler's angle
_ASPECT, _MARGIN = 4.0 / 3.0, 1.3  # of the picture; room for legs that swing


def build(body: Body) -> mjcf.RootElement:
    """Assemble the body in an empty world: no floor, no decorations.

    Every element is named: bodies, geoms and sites after the part, joints and motors
    `<leg>_<joint>`. The legs are written into the one root, since PyMJCF's `attach` would add a
    body for each and so change the observation.

    Args:
        body: the spec, with nothing left to be sized.

    Returns:
        The model, in radians, with the torso as a free body at its standing height.
    """
    # Robot geoms meet only the floor (conaffinity 1), never one another.
    touches_floor = {"contype": 1, "conaffinity": 0, "density": body.density, **contact(body.simulation)}
    root = mjcf.RootElement(model=body.name)
    root.compiler.angle = "radian"
    root.option.timestep = body.simulation.timestep
    root.option.integrator = "implicitfast"
    root.option.solver = "Newton"
    root.option.iterations = SOLVER_ITERATIONS
    root.option.flag.filterparent = "enable"
    root.option.flag.island = "disable"  # a single creature is one island: finding it only costs time

    torso = root.worldbody.add("body", name="torso", pos=(0.0, 0.0, body.torso.standing_height))
    torso.add("freejoint", name="root")
    for solid in body.torso.solids:
        _add_solid(torso, solid, **touches_floor)
    for ballast in body.ballast:
        _add_solid(torso, ballast, mass=ballast.mass, **_TOUCHES_NOTHING)
    for leg in body.legs:
        _add_leg(root, torso, leg, touches_floor, body.simulation)
    for name, camera in cameras(body).items():
        torso.add("camera", name=name, mode="trackcom", **camera)
    torso.add("camera", name=EYE, mode="fixed", **eye(body))

    # The accelerometer is what makes every mj_step fill cfrc_ext, which the task observes: MuJoCo
    # computes contact forces on bodies only where a sensor needs them.
    site = torso.add("site", name="torso", size=(0.01,), group=4)
    root.sensor.add("accelerometer", name="torso_acceleration", site=site)
    return root


def contact(simulation: Simulation) -> dict:
    """Return the contact attributes of geoms; dimensionless ones are the same for all bodies."""
    return {
        "condim": 3,
        "friction": (1.0, 0.5, 0.5),
        "margin": simulation.contact_margin,
        "solref": (simulation.contact_time, 1.0),
        "solimp": (0.9, 0.95, simulation.contact_width, 0.5, 2.0),
    }


def _add_solid(torso, solid: Solid, **attributes) -> None:
    torso.add(
        "geom",
        name=solid.name,
        type=solid.shape,
        size=solid.size,
        pos=solid.position,
        euler=[math.radians(angle) for angle in solid.euler_deg],
        **attributes,
    )


def _add_leg(root, torso, leg: Leg, geom, simulation: Simulation) -> None:
    parent, pos, yaw = torso, leg.mount, math.radians(leg.yaw_deg)
    for link in leg.links:
        name = leg.full_name(link)
        parent = parent.add("body", name=name, pos=pos, euler=(0.0, 0.0, yaw))
        if link.joint:
            _add_joint(root, parent, leg, link.joint, simulation)
        parent.add("geom", name=name, type="capsule", fromto=(0.0, 0.0, 0.0, *link.end), size=(link.radius,), **geom)
        pos, yaw = link.end, 0.0
    name = leg.full_name(leg.foot)
    foot = parent.add("body", name=name, pos=pos)
    foot.add("geom", name=name, type="sphere", size=(leg.foot.radius,), **geom)
    foot.add("site", name=name, size=(leg.foot.radius,), group=4)


def _add_joint(root, link, leg: Leg, joint: Joint, simulation: Simulation) -> None:
    element = link.add(
        "joint",
        name=leg.full_name(joint),
        type="hinge",
        axis=joint.axis,
        limited=True,
        range=[math.radians(angle) for angle in joint.range_deg],
        armature=joint.armature,
        damping=joint.damping,
        solreflimit=(simulation.contact_time, 1.0),
    )
    root.actuator.add(
        "motor",
        name=leg.full_name(joint),
        joint=element,
        gear=(joint.motor.gear,),
        ctrllimited=True,
        ctrlrange=(-1.0, 1.0),
    )


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
