"""Names of an imported body's parts: legs from front to rear by side, everything else after the file, cleaned."""

import re
from collections.abc import Iterator
from typing import NamedTuple

from arc_suite.importing.poses import Leg
from arc_suite.importing.tree import Robot
from arc_suite.robots.spec import MAX_NAME

_MIDLINE = 1e-4  # m, to the right; a foot that is nearer to the midline stands on the left
_RESERVED = ("torso", "root", "floor", "world")  # names of the suite's own parts
_MAX_SUFFIX = 5  # characters of the number behind a name that occurs twice


class Names(NamedTuple):
    """Names in the model, by MuJoCo's indices in the file.

    Attributes:
        legs: one value for each leg, in the order of the legs.
        joints: all joints except the free one.
        bodies: all bodies of the robot.
        held: joints outside of the legs that have motors.
    """

    legs: tuple[str, ...]
    joints: dict[int, str]
    bodies: dict[int, str]
    held: tuple[int, ...]


def choose_names(robot: Robot, legs: tuple[Leg, ...]) -> Names:
    """Return the names of a robot's parts; a body with several joints of a leg has the name of its last link."""
    labels = _leg_labels(legs)
    joints = {}
    bodies = {robot.root: "torso"}
    used_names = set(_RESERVED)
    for label, leg in zip(labels, legs, strict=True):
        for number, joint in enumerate(leg.joints, start=1):
            joints[joint] = f"{label}_joint{number}"
            bodies[int(robot.model.jnt_bodyid[joint])] = f"{label}_link{number}"
        used_names.update(_part_names(label, leg))
    used_names.update(joints.values())
    used_names.update(bodies.values())

    other_joints = tuple(joint for joint in robot.joints if joint not in joints)
    for joint in other_joints:
        joints[joint] = _add_unique_name(robot.joint_name(joint), "joint", used_names)
    for body in robot.bodies:
        if body not in bodies:
            bodies[body] = _add_unique_name(robot.model.body(body).name, "body", used_names)
    return Names(labels, joints, bodies, tuple(joint for joint in other_joints if joint not in robot.passive))


def _part_names(label: str, leg: Leg) -> Iterator[str]:
    """Yield the names of a leg's links and foot."""
    for number in range(1, len(leg.joints) + 1):
        yield f"{label}_link{number}"
    yield f"{label}_foot"


def _leg_labels(legs: tuple[Leg, ...]) -> tuple[str, ...]:
    """Return l1, l2 and so on for left legs, r1, r2 and so on for right ones, from front to rear."""
    sides = ["r" if leg.center[1] < -_MIDLINE else "l" for leg in legs]
    labels = []
    for side, leg in zip(sides, legs, strict=True):
        legs_of_side = [neighbor for neighbor_side, neighbor in zip(sides, legs, strict=True) if neighbor_side == side]
        legs_ahead = [neighbor for neighbor in legs_of_side if neighbor.center[0] > leg.center[0]]
        labels.append(f"{side}{len(legs_ahead) + 1}")
    if len(set(labels)) < len(labels):  # two feet are equally far in front
        return tuple(f"leg{number}" for number in range(1, len(legs) + 1))
    return tuple(labels)


def clean_name(text: str) -> str:
    """Return a text as a name of [a-z0-9_], at most as long as names are; "" if no such character is in it."""
    name = re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_")
    return name[:MAX_NAME].strip("_")


def _add_unique_name(text: str, kind: str, used_names: set[str]) -> str:
    """Return a clean name that is not used yet, and add it to the used ones."""
    base = clean_name(text) or kind
    name = base
    count = 1
    while name in used_names:
        count += 1
        name = f"{base[: MAX_NAME - _MAX_SUFFIX]}_{count}"
    used_names.add(name)
    return name
