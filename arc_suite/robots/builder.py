"""Turns a `Body` into one PyMJCF root element: the dynamics, and nothing that is only for show."""

import math

from dm_control import mjcf

from arc_suite.spec import Body, Joint, Leg, Simulation, Solid

SOLVER_ITERATIONS = 200

_TOUCHES_NOTHING = {"contype": 0, "conaffinity": 0}

_GREY = (0.55, 0.57, 0.6, 1.0)


def build(body: Body) -> mjcf.RootElement:
    """Assembles the body in an empty world: no floor, no decorations.

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
    root.default.geom.rgba = _GREY

    torso = root.worldbody.add("body", name="torso", pos=(0.0, 0.0, body.torso.standing_height))
    torso.add("freejoint", name="root")
    for solid in body.torso.solids:
        _add_solid(torso, solid, **touches_floor)
    for ballast in body.ballast:
        _add_solid(torso, ballast, mass=ballast.mass, **_TOUCHES_NOTHING)
    for leg in body.legs:
        _add_leg(root, torso, leg, touches_floor, body.simulation)
    _add_cameras(torso, body)

    # The accelerometer is what makes every mj_step fill cfrc_ext, which the task observes: MuJoCo
    # computes contact forces on bodies only where a sensor needs them.
    site = torso.add("site", name="torso", size=(0.01,), group=4)
    root.sensor.add("accelerometer", name="torso_acceleration", site=site)
    return root


def contact(simulation: Simulation) -> dict:
    """How floor and robot touch, as attributes of a geom; what has no dimension is the same for all."""
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


def _add_cameras(torso, body: Body) -> None:
    """Adds `tracking`, the side view of the spec, and `portrait`, a nearer one from the front."""
    camera = body.camera
    torso.add("camera", name="tracking", mode="trackcom", pos=camera.position, xyaxes=camera.xyaxes)
    reach = max(math.hypot(*leg.foot_position[:2]) for leg in body.legs)
    distance = 1.35 * max(2.0 * reach, body.torso.standing_height)
    torso.add(
        "camera",
        name="portrait",
        mode="trackcom",
        pos=(0.8 * distance, -0.75 * distance, 0.45 * distance),
        xyaxes=(0.75, 0.8, 0.0, -0.28, 0.27, 0.92),
    )
