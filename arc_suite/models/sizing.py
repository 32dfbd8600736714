"""Sizing of the open fields of a body: motors, armature, damping, simulation constants, camera.

Everything follows from the standing pose and from a stride in the fitted gait by rules without
dimension, so that bodies of one shape and different size are dynamically similar: lengths scale
with the height h, times with sqrt(h / g), and a mite and a giant walk alike.
"""

import functools
import math

import numpy as np

from arc_suite.models import stride
from arc_suite.models.standing import GRAVITY, PoseMechanics, by_leg, measure_standing
from arc_suite.robots.spec import Body, Joint, Leg, Motor, Simulation, TrackingCamera

# A body of this height has MuJoCo's own constants; others are scaled from it.
_REFERENCE_HEIGHT = 0.3  # m

# Motors give thirty times the largest load of a stride: position control brakes and pushes a body about its path with
# what is left. A joint without load still counts as if it bore a quarter of its leg's largest one, to swing the leg,
# and a leg in which no joint bears any as if its share of the weight pulled at a short lever.
_STRENGTH = 30.0
_LEAST_SHARE = 0.25
_LEAST_LEVER = 0.1  # of the standing height

# Position control closes its loop every control step T: its natural frequency w is a fixed share
# of 1 / T, below which a critically damped loop on sampled states settles without ringing.
_STIFFNESS = 0.5  # w T

# By this angle a joint sags under the largest load of a stride. It fixes the stiffness, and so the inertia to be
# moved: (I + armature) w^2 = load / angle.
_SAG = 0.035  # rad

# Armature is never less than this share of the link's own inertia.
_LEAST_ARMATURE = 0.3


def control_timestep(body: Body) -> float:
    """Return the control step, s."""
    return simulation(body).substeps * simulation(body).timestep


def simulation(body: Body) -> Simulation:
    """Return the body's simulation constants, or sized ones: times scale with sqrt(h), lengths with h."""
    if body.simulation:
        return body.simulation
    scale = body.torso.standing_height / _REFERENCE_HEIGHT
    default = Simulation()
    return Simulation(
        timestep=default.timestep * math.sqrt(scale),
        contact_time=default.contact_time * math.sqrt(scale),
        contact_width=default.contact_width * scale,
        contact_margin=default.contact_margin * scale,
    )


def natural_frequency(body: Body) -> float:
    """Return the natural frequency of the position control of the body's joints, rad/s."""
    return _STIFFNESS / control_timestep(body)


def position_gains(body: Body, inertias: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the stiffness, action per rad, and damping, action per rad/s, of critically damped position control.

    Of servos they are their own, by their largest torque.

    Args:
        body: sized.
        inertias: (joints,) that the joints move, without armature, kg m^2.
    """
    joints = body.joints
    inertia = inertias + [joint.armature for joint in joints]
    if body.source:
        servos = [joint.servo for joint in joints]
        return tuple(np.array([(s.stiffness / s.limit, s.damping / s.limit) for s in servos]).T)
    gear = np.array([joint.torque for joint in joints])
    friction = np.array([joint.damping for joint in joints])
    frequency = natural_frequency(body)
    return inertia * frequency**2 / gear, (2.0 * inertia * frequency - friction).clip(0.0) / gear


def action_reaches(body: Body) -> np.ndarray:
    """Return the angles (joints,) that actions of 1 ask for: to the farther limit from the standing pose, rad."""
    return abs(np.radians([joint.range_deg for joint in body.joints])).max(axis=-1)


@functools.lru_cache(maxsize=256)
def size_body(body: Body) -> Body:
    """Return the body with all open fields sized.

    Args:
        body: the spec.

    Returns:
        A body without None among armatures, dampings, motors, simulation and camera; the same one if
        it leaves nothing open.
    """
    complete = all(None not in (j.armature, j.damping, j.torque) for j in body.joints)
    if complete and body.simulation and body.camera:
        return body
    pose, frequency = measure_standing(body), natural_frequency(body)
    moved = zip(body.legs, by_leg(body, pose.inertias), by_leg(body, sizing_loads(body)), strict=True)
    return body.replace(
        legs=tuple(_sized_leg(leg, body.agility, *numbers, frequency) for leg, *numbers in moved),
        simulation=simulation(body),
        camera=body.camera or _camera(pose),
    )


sized = size_body  # the former name, which other packages import


def sizing_loads(body: Body) -> np.ndarray:
    """Return the torques (joints,) that joints are sized for, N m: the largest of a stride, and never nothing."""
    pose = measure_standing(body)
    every = np.maximum(stride.stride_loads(body), pose.inertias * stride.swing_accelerations(body))
    least = _LEAST_LEVER * pose.height * pose.mass * GRAVITY / len(body.legs)
    return np.concatenate([own.clip(min=_LEAST_SHARE * max(*own, least)) for own in by_leg(body, every)])


def _sized_leg(leg: Leg, agility: float, inertias: np.ndarray, loads: np.ndarray, frequency: float) -> Leg:
    numbers = zip(inertias.tolist(), loads.tolist(), strict=True)
    links = []
    for link in leg.links:
        if link.joint:
            inertia, load = next(numbers)
            link = link.replace(joint=_sized_joint(link.joint, agility, inertia, load, frequency))
        links.append(link)
    return leg.replace(links=tuple(links))


def _sized_joint(joint: Joint, agility: float, inertia: float, load: float, frequency: float) -> Joint:
    motor = joint.motor or Motor(gear=agility * _STRENGTH * load)
    wanted = load / (_SAG * frequency**2)
    armature = max(_LEAST_ARMATURE * inertia, wanted - inertia) if joint.armature is None else joint.armature
    # The control damps the joint; a little friction of its own calms one that nobody controls.
    damping = 0.1 * frequency * (inertia + armature) if joint.damping is None else joint.damping
    return joint.replace(motor=motor, armature=armature, damping=damping)


def _camera(pose: PoseMechanics) -> TrackingCamera:
    size = max(abs(pose.soles[:, :2]).max(), pose.height)
    return TrackingCamera(position=(0.0, -4.0 * float(size), 1.6 * float(size)))
