"""The model of a body on flat ground by MuJoCo's own `MjSpec`: the bits of `assemble`, without PyMJCF and its text.

`builder` defines the model, and this module follows it. A test holds the two equal, byte for byte.
"""

import math

import mujoco

from arc_suite.models import builder
from arc_suite.models.standing import GEOMS
from arc_suite.robots.spec import Ballast, Body, Joint, Leg, Simulation

_TOUCHES_NOTHING = {"contype": 0, "conaffinity": 0}


def on_flat_ground(body: Body) -> mujoco.MjSpec:
    """Return the spec whose compiled model has the bytes of the compiled MJCF of `assemble(body)`.

    Args:
        body: without a source, and with nothing left to be sized.
    """
    contact = builder.contact(body.simulation)
    contact["friction"] = list(contact["friction"])
    touches_floor = {"contype": 1, "conaffinity": 0, "density": body.density, **contact}
    spec = mujoco.MjSpec()
    spec.modelname = body.name
    spec.compiler.degree = False
    spec.option.timestep = body.simulation.timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    spec.option.iterations = builder.SOLVER_ITERATIONS
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND
    torso = spec.worldbody.add_body(name="torso", pos=(0.0, 0.0, body.torso.standing_height))
    torso.add_freejoint(name="root")
    for solid in (*body.torso.solids, *body.ballast):
        own = {"mass": solid.mass, **_TOUCHES_NOTHING} if isinstance(solid, Ballast) else touches_floor
        shape = {"type": GEOMS[solid.shape], "size": _size(solid.size)}
        turn = [math.radians(angle) for angle in solid.euler_deg]
        torso.add_geom(name=solid.name, **shape, pos=solid.position, euler=turn, **own)
    for leg in body.legs:
        _add_leg(spec, torso, leg, touches_floor, body.simulation)
    for name, camera in builder.cameras(body).items():
        torso.add_camera(name=name, mode=mujoco.mjtCamLight.mjCAMLIGHT_TRACKCOM, **camera)
    torso.add_camera(name=builder.EYE, mode=mujoco.mjtCamLight.mjCAMLIGHT_FIXED, **builder.eye(body))
    torso.add_site(name="torso", group=4).size[0] = 0.01
    acceleration = {"type": mujoco.mjtSensor.mjSENS_ACCELEROMETER, "objtype": mujoco.mjtObj.mjOBJ_SITE}
    spec.add_sensor(name="torso_acceleration", objname="torso", **acceleration)
    plane = {"type": mujoco.mjtGeom.mjGEOM_PLANE, "size": (0.0, 0.0, 1.0)}
    spec.worldbody.add_geom(name="floor", conaffinity=1, **plane, **contact)
    return spec


def _size(lengths) -> tuple[float, ...]:
    return (*lengths, *(0.0,) * (3 - len(lengths)))


def _add_leg(spec: mujoco.MjSpec, torso, leg: Leg, geom: dict, simulation: Simulation) -> None:
    parent, pos, yaw = torso, leg.mount, math.radians(leg.yaw_deg)
    for link in leg.links:
        name = leg.full_name(link)
        parent = parent.add_body(name=name, pos=pos, euler=(0.0, 0.0, yaw))
        if link.joint:
            _add_joint(spec, parent, leg, link.joint, simulation)
        capsule = {"type": mujoco.mjtGeom.mjGEOM_CAPSULE, "size": _size((link.radius,))}
        parent.add_geom(name=name, fromto=(0.0, 0.0, 0.0, *link.end), **capsule, **geom)
        pos, yaw = link.end, 0.0
    name, radius = leg.full_name(leg.foot), leg.foot.radius
    foot = parent.add_body(name=name, pos=pos)
    foot.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=_size((radius,)), **geom)
    foot.add_site(name=name, group=4).size[0] = radius


def _add_joint(spec: mujoco.MjSpec, link, leg: Leg, joint: Joint, simulation: Simulation) -> None:
    name = leg.full_name(joint)
    added = link.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=joint.axis)
    added.limited, added.range = mujoco.mjtLimited.mjLIMITED_TRUE, [math.radians(angle) for angle in joint.range_deg]
    added.armature, added.damping[0] = joint.armature, joint.damping
    added.solref_limit = (simulation.contact_time, 1.0)
    motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    motor.set_to_motor()
    motor.gear[0] = joint.motor.gear
    motor.ctrllimited, motor.ctrlrange = mujoco.mjtLimited.mjLIMITED_TRUE, (-1.0, 1.0)
