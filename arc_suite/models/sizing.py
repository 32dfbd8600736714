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

_REFERENCE_HEIGHT = 0.3  # m; a body of this height has MuJoCo's own constants, and those of others are scaled

# Motors give thirty times the load of a joint: position control brakes and pushes a body about its path with what is
# left. The load is the largest torque of a stride.
_TORQUE_PER_LOAD = 30.0
_MIN_LOAD_SHARE = 0.25  # of the largest load in the leg: a joint with less load has to swing the leg
_MIN_LEVER = 0.1  # standing heights, of the leg's share of the weight: the least load in a leg without any

# Position control closes its loop every control step T: its natural frequency w is a fixed share of 1 / T. Below
# this share a critically damped loop on sampled states settles without ringing.
_FREQUENCY_SHARE = 0.5  # w T

# By this angle a joint sags under its load. It fixes the stiffness, and so the inertia that the joint has to move:
# (I + armature) w^2 = load / angle.
_SAG = 0.035  # rad

_MIN_ARMATURE_SHARE = 0.3  # of the link's own inertia
_DAMPING_SHARE = 0.1  # of w (I + armature): calms a joint that nobody controls; the control damps the others
_CAMERA_OFFSET = (0.0, -4.0, 1.6)  # in the larger of the height and the span of the feet


def control_timestep(body: Body) -> float:
    """Return the control step, s."""
    constants = simulation(body)
    return constants.substeps * constants.timestep


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


def sole_clearance(body: Body) -> float:
    """Return how high soles are over level ground that carries the body, m: the margins of a foot and of the ground."""
    return 2.0 * simulation(body).contact_margin


def natural_frequency(body: Body) -> float:
    """Return the natural frequency of the position control of the body's joints, rad/s."""
    return _FREQUENCY_SHARE / control_timestep(body)


def position_gains(body: Body, inertias: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the stiffness, action per rad, and damping, action per rad/s, of critically damped position control.

    Servos have gains of their own, which are divided by their torque limits.

    Args:
        body: sized.
        inertias: (joints,) inertias that the joints move, without armature, kg m^2.
    """
    joints = body.joints
    if body.source:
        servos = [joint.servo for joint in joints]
        stiffness = np.array([servo.stiffness / servo.limit for servo in servos])
        damping = np.array([servo.damping / servo.limit for servo in servos])
        return stiffness, damping
    total_inertias = inertias + [joint.armature for joint in joints]
    torques = np.array([joint.torque for joint in joints])
    joint_dampings = np.array([joint.damping for joint in joints])
    frequency = natural_frequency(body)
    stiffness = total_inertias * frequency**2 / torques
    damping = (2.0 * total_inertias * frequency - joint_dampings).clip(0.0) / torques
    return stiffness, damping


def action_reaches(body: Body) -> np.ndarray:
    """Return the angles (joints,) of actions of 1: from the standing pose to the farther limit, rad."""
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
    has_sized_joints = all(None not in (joint.armature, joint.damping, joint.torque) for joint in body.joints)
    if has_sized_joints and body.simulation and body.camera:
        return body
    pose = measure_standing(body)
    frequency = natural_frequency(body)
    inertias_of_legs = by_leg(body, pose.inertias)
    loads_of_legs = by_leg(body, sizing_loads(body))
    legs = [
        _size_leg(leg, body.agility, inertias, loads, frequency)
        for leg, inertias, loads in zip(body.legs, inertias_of_legs, loads_of_legs, strict=True)
    ]
    return body.replace(
        legs=tuple(legs),
        simulation=simulation(body),
        camera=body.camera or _choose_camera(pose),
    )


def sizing_loads(body: Body) -> np.ndarray:
    """Return the torques (joints,) that joints are sized for, N m: the largest of a stride, and never 0."""
    pose = measure_standing(body)
    swing_torques = pose.inertias * stride.swing_accelerations(body)
    torques = np.maximum(stride.stride_loads(body), swing_torques)
    least_of_leg = _MIN_LEVER * pose.height * pose.mass * GRAVITY / len(body.legs)
    loads_of_legs = []
    for torques_of_leg in by_leg(body, torques):
        largest = max(*torques_of_leg, least_of_leg)
        loads_of_legs.append(torques_of_leg.clip(min=_MIN_LOAD_SHARE * largest))
    return np.concatenate(loads_of_legs)


def _size_leg(leg: Leg, agility: float, inertias: np.ndarray, loads: np.ndarray, frequency: float) -> Leg:
    """Return a leg with sized joints.

    Args:
        leg: leg to size.
        agility: factor on the torques of motors.
        inertias: (joints of the leg,) inertias that the joints move, kg m^2.
        loads: (joints of the leg,) N m.
        frequency: natural frequency of position control, rad/s.
    """
    inertia_and_load = zip(inertias.tolist(), loads.tolist(), strict=True)
    links = []
    for link in leg.links:
        if link.joint:
            inertia, load = next(inertia_and_load)
            link = link.replace(joint=_size_joint(link.joint, agility, inertia, load, frequency))
        links.append(link)
    return leg.replace(links=tuple(links))


def _size_joint(joint: Joint, agility: float, inertia: float, load: float, frequency: float) -> Joint:
    """Return a joint whose open fields are sized; arguments are as of `_size_leg`, for one joint."""
    motor = joint.motor or Motor(gear=agility * _TORQUE_PER_LOAD * load)
    armature = joint.armature
    if armature is None:
        stiff_inertia = load / (_SAG * frequency**2)
        armature = max(_MIN_ARMATURE_SHARE * inertia, stiff_inertia - inertia)
    damping = joint.damping
    if damping is None:
        damping = _DAMPING_SHARE * frequency * (inertia + armature)
    return joint.replace(motor=motor, armature=armature, damping=damping)


def _choose_camera(pose: PoseMechanics) -> TrackingCamera:
    """Return a camera from which all feet are seen."""
    span = abs(pose.soles[:, :2]).max()
    size = float(max(span, pose.height))
    x, y, z = _CAMERA_OFFSET
    return TrackingCamera(position=(x, y * size, z * size))
