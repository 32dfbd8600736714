"""Answers to fields that no spec has, or that another spec has: what sets it, or where it belongs."""

import dataclasses

from arc_suite import checks
from arc_suite.robots.spec import Ballast, Body, Foot, Joint, Leg, Link, Motor, Simulation, Solid, Torso

# Fields that only `arc-suite import` writes; lists of fields leave them out.
_FIELDS_OF_IMPORTED = ("source", "held", "file_joints", "servo", "alias")
_SPECS = (Body, Torso, Leg, Link, Joint, Motor, Foot, Solid, Ballast, Simulation)

GRAVITY_HINT = "environment.change_model({'gravity': [0.0, 0.0, -1.62]}) sets it"
_WEIGHT = "density of the body sets the weight of all parts, ballast adds some"
_COLORS = "palette of the body has its colors"
_SPEED = "it is a setting of tasks, --set target_velocity=VALUE"
_CHAIN = "links of a leg are a chain, from the torso outwards"
_TORQUE = "gear of the motor is its largest torque, N m"
_GROUND = "--arena or a task such as rough has the ground"
CHARACTER_CURE = "arc-suite animate --weight takes a character: heavy, nervous or old"
_FORM = "docs/bodies.md: heads, tails and ballast"
_CURES = {
    **dict.fromkeys(("inertia", "mass", "weight"), _WEIGHT),
    **dict.fromkeys(("color", "colors", "material", "materials", "rgba"), _COLORS),
    **dict.fromkeys(("arena", "floor", "ground", "terrain"), _GROUND),
    **dict.fromkeys(("antennae", "eye", "eyes", "head", "horns", "neck", "tail"), _FORM),
    **dict.fromkeys(("character", "mood", "personality", "style", "temperament"), CHARACTER_CURE),
    **dict.fromkeys(("children", "parent"), _CHAIN),
    **dict.fromkeys(("max_torque", "torque"), _TORQUE),
    **dict.fromkeys(("speed", "velocity"), _SPEED),
    "feet": "each leg has its foot",
    "friction": "it is a setting of tasks, --set friction=VALUE",
    "gait": "it is a setting of tasks, --set gait=VALUE",
    "gravity": GRAVITY_HINT,
    "height": "standing_height of the torso sets it",
    "length": "end sets it: [x, y, z] from the start of the link, m",
    "joints": "each link has its joint",
    "motors": "each joint has its motor",
    "scale": "arc-suite build_model --spec FILE --scale 2 --json writes a larger body",
}


def describe_unknown(name: str, kind: type) -> str:
    """Return the reason of an error about a field that a spec does not have, with what takes its place.

    Args:
        name: the field.
        kind: class of the spec.
    """
    names = [field.name for field in dataclasses.fields(kind) if field.name not in _FIELDS_OF_IMPORTED]
    has_synonym = any(meaning in names for meaning in checks.meanings(name))
    owners = [spec.__name__ for spec in _SPECS if name in (field.name for field in dataclasses.fields(spec))]
    if name in _CURES and not has_synonym:
        cure = f"; {_CURES[name]}"
    elif owners and not has_synonym:
        cure = f"; it is a field of a {owners[0]}"
    else:
        cure = checks.hint(name, names)
    return f"unknown field {checks.preview(name)}{cure} {checks.list_choices(names)}"
