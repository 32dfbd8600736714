"""Imported bodies of other sizes, which move alike: times scale with the square root of lengths, forces with weights.

Bodies of one shape and one density move alike under the same gravity if their times scale with the square root of their
lengths: their Froude numbers are equal (Alexander, "Principles of Animal Locomotion", 2003, chapter 4). With lengths of
unit s, masses then have s^3, times s^0.5 and torques s^4. All numbers of a source follow from these.
"""

import xml.etree.ElementTree as ElementTree
from typing import Any

import numpy as np

from arc_suite.models.mjcf_text import exact
from arc_suite.robots import sources
from arc_suite.robots.spec import Body, Held, Joint, Leg, Servo, Simulation, Solid

_TIME = 0.5  # exponent of times
_SOLREF = (_TIME, 0.0)  # time constant and damping ratio
_DIRECT_SOLREF = (-2.0 * _TIME, -_TIME)  # stiffness and damping by mass: both numbers are negative
_SOLIMP = (0.0, 0.0, 1.0, 0.0, 0.0)  # of contacts and slides; those of hinges are angles

# Exponents of the numbers of an attribute; the last one holds for all further numbers.
_EXPONENTS: dict[str, dict[str, tuple[float, ...]]] = {
    "option": {"timestep": (_TIME,), "wind": (_TIME,), "viscosity": (1.5,)},
    "mesh": {"vertex": (1.0,), "refpos": (1.0,)},
    "body": {"pos": (1.0,)},
    "inertial": {"pos": (1.0,), "mass": (3.0,), "diaginertia": (5.0,)},
    "geom": {
        **dict.fromkeys(("pos", "size", "margin", "gap"), (1.0,)),
        "friction": (0.0, 1.0),
        "adhesion": (3.0,),
        "surfacevel": (0.5, 0.5, 0.5, -0.5),
        "solref": _SOLREF,
        "solimp": _SOLIMP,
    },
    "site": {"pos": (1.0,), "size": (1.0,)},
    "connect": {"solref": _SOLREF, "solimp": _SOLIMP},
    # `torquescale` stays: MuJoCo softens turns by the bodies' inertias without this scale.
    "weld": {"solref": _SOLREF, "solimp": _SOLIMP},
}
# Stiffness and damping have further numbers, for higher powers of the joint's place and velocity.
_JOINT_EXPONENTS: dict[str, dict[str, tuple[float, ...]]] = {
    "hinge": {
        "pos": (1.0,),
        "stiffness": (4.0,),
        "damping": (4.5, 5.0, 5.5),
        "armature": (5.0,),
        "frictionloss": (4.0,),
        "actuatorfrcrange": (4.0,),
        "solreflimit": _SOLREF,
        "solreffriction": _SOLREF,
    },
    "slide": {
        **dict.fromkeys(("pos", "range", "ref", "springref", "margin"), (1.0,)),
        "stiffness": (2.0, 1.0, 0.0),
        "damping": (2.5, 2.0, 1.5),
        "armature": (3.0,),
        "frictionloss": (3.0,),
        "actuatorfrcrange": (3.0,),
        "solreflimit": _SOLREF,
        "solreffriction": _SOLREF,
        "solimplimit": _SOLIMP,
    },
    "free": {"pos": (1.0,)},
}
_SERVO_EXPONENTS = {
    "stiffness": 4.0,
    "damping": 4.5,
    "limit": 4.0,
    "stall": 4.0,
    "no_load_speed": -_TIME,
    "winding_loss": -4.5,  # W/(N m)^2
    "delay": _TIME,
}

# Values that MuJoCo takes for attributes that are left out, of those that have units.
_CONTACT_DEFAULTS = {"solref": "0.02 1", "solimp": "0.9 0.95 0.001 0.5 2"}
_JOINT_DEFAULTS = {"solreflimit": "0.02 1", "solreffriction": "0.02 1", "solimplimit": "0.9 0.95 0.001 0.5 2"}
_DEFAULTS = {
    "geom": {"friction": "1 0.005 0.0001", **_CONTACT_DEFAULTS},
    "connect": _CONTACT_DEFAULTS,
    "weld": _CONTACT_DEFAULTS,
}


def scale_import(body: Body, factor: float) -> Body:
    """Return an imported body with all lengths multiplied, which moves like the first one.

    Its masses have the third power of the factor, torques of motors, springs and friction the fourth, inertias and
    armatures the fifth, and times, such as that of a control step, the square root.

    Args:
        body: with a source.
        factor: above 0.

    Raises:
        SpecError: a number of the scaled body is out of range.
    """
    torso = body.torso.replace(
        standing_height=factor * body.torso.standing_height,
        solids=tuple(_scale_solid(solid, factor) for solid in body.torso.solids),
    )
    held_joints = tuple(Held(name=joint.name, servo=_scale_servo(joint.servo, factor)) for joint in body.held)
    camera = body.camera and body.camera.replace(position=_scale_vector(body.camera.position, factor))
    scaled_body = body.replace(
        torso=torso,
        legs=tuple(_scale_leg(leg, factor) for leg in body.legs),
        camera=camera,
        simulation=_scale_simulation(body.simulation, factor),
        held=held_joints,
        source=_scale_source(body.source, factor),
    )
    return sources.check(scaled_body)


def _scale_vector(vector: tuple[float, ...], factor: float) -> Any:
    return tuple(factor * number for number in vector)


def _scale_solid(solid: Solid, factor: float) -> Solid:
    return solid.replace(size=_scale_vector(solid.size, factor), position=_scale_vector(solid.position, factor))


def _scale_leg(leg: Leg, factor: float) -> Leg:
    links = []
    for link in leg.links:
        joint = link.joint and _scale_joint(link.joint, factor)
        links.append(link.replace(end=_scale_vector(link.end, factor), radius=factor * link.radius, joint=joint))
    foot = leg.foot.replace(radius=factor * leg.foot.radius)
    return leg.replace(mount=_scale_vector(leg.mount, factor), links=tuple(links), foot=foot)


def _scale_joint(joint: Joint, factor: float) -> Joint:
    return joint.replace(
        armature=factor**5 * joint.armature,
        damping=factor**4.5 * joint.damping,
        servo=_scale_servo(joint.servo, factor),
    )


def _scale_servo(servo: Servo, factor: float) -> Servo:
    changes = {}
    for name, exponent in _SERVO_EXPONENTS.items():
        value = getattr(servo, name)
        if value is not None:
            changes[name] = factor**exponent * value
    return servo.replace(**changes)


def _scale_simulation(simulation: Simulation, factor: float) -> Simulation:
    return simulation.replace(
        timestep=factor**_TIME * simulation.timestep,
        contact_time=factor**_TIME * simulation.contact_time,
        contact_width=factor * simulation.contact_width,
        contact_margin=factor * simulation.contact_margin,
    )


def _scale_source(text: str, factor: float) -> str:
    """Return the MJCF of a source with all numbers scaled."""
    root = ElementTree.fromstring(text)
    hinges_and_slides = [joint for joint in root.find("worldbody").iter("joint") if joint.get("type") != "free"]
    kind_of_joint = {joint.get("name"): joint.get("type", "hinge") for joint in hinges_and_slides}
    for element in root.iter():
        if element.tag != "joint":
            is_visual = element.get("group") == sources.VISUAL_GROUP  # which touches nothing
            defaults = {} if is_visual else _DEFAULTS.get(element.tag, {})
            _scale_attributes(element, _EXPONENTS.get(element.tag, {}), defaults, factor)
        elif "joint1" in element.attrib:
            _scale_coupling(element, kind_of_joint, factor)
            _scale_attributes(element, _EXPONENTS["connect"], _CONTACT_DEFAULTS, factor)
        else:
            kind = element.get("type", "hinge")
            defaults = {} if kind == "free" else _JOINT_DEFAULTS
            _scale_attributes(element, _JOINT_EXPONENTS[kind], defaults, factor)
    (key,) = root.iter("key")
    qpos = np.array(key.get("qpos").split(), float)
    qpos[:3] *= factor
    for index, joint in enumerate(hinges_and_slides, start=7):
        if joint.get("type") == "slide":
            qpos[index] *= factor
    key.set("qpos", exact(qpos))
    return ElementTree.tostring(root, encoding="unicode")


def _scale_attributes(
    element: ElementTree.Element, exponents: dict[str, tuple[float, ...]], defaults: dict[str, str], factor: float
) -> None:
    """Scale the attributes of an element, and those that are left out, by their defaults."""
    for name, powers in exponents.items():
        text = element.get(name, defaults.get(name))
        if text is None:
            continue
        numbers = np.array(text.split(), float)
        if name.startswith("solref") and (numbers < 0.0).all():
            powers = _DIRECT_SOLREF
        all_powers = [powers[min(index, len(powers) - 1)] for index in range(len(numbers))]
        element.set(name, exact(numbers * factor ** np.array(all_powers)))


def _scale_coupling(element: ElementTree.Element, kind_of_joint: dict[str | None, str], factor: float) -> None:
    """Scale the polynomial by which one joint follows another: places of slides are lengths."""
    first_power, second_power = (
        1.0 if kind_of_joint.get(element.get(name)) == "slide" else 0.0 for name in ("joint1", "joint2")
    )
    coefficients = np.array(element.get("polycoef", "0 1 0 0 0").split(), float)
    powers = first_power - second_power * np.arange(len(coefficients))
    element.set("polycoef", exact(coefficients * factor**powers))
