"""Names of an imported body's parts: legs from front to rear by side, everything else after the file, cleaned."""

import re
from typing import NamedTuple

from arc_suite.importing.poses import Leg
from arc_suite.importing.tree import Robot
from arc_suite.robots.spec import MAX_NAME

_MIDLINE = 1e-4  # m; a foot that is nearer to it than that stands on the left


class Names(NamedTuple):
    """Names in the model, by MuJoCo's indices in the file.

    Attributes:
        legs: of each leg, in the order of the legs.
        joints: of all joints but the free one.
        bodies: of all bodies of the robot.
        held: joints outside of the legs.
    """

    legs: tuple[str, ...]
    joints: dict[int, str]
    bodies: dict[int, str]
    held: tuple[int, ...]


def choose_names(robot: Robot, legs: tuple[Leg, ...]) -> Names:
    """Return the names of a robot's parts; a body with several joints of a leg has the name of its last link."""
    labels, joints, bodies = _leg_names(legs), {}, {robot.root: "torso"}
    for label, leg in zip(labels, legs, strict=True):
        for place, joint in enumerate(leg.joints, start=1):
            joints[joint] = f"{label}_joint{place}"
            bodies[int(robot.model.jnt_bodyid[joint])] = f"{label}_link{place}"
    parts = {f"{label}_{part}" for label, leg in zip(labels, legs, strict=True) for part in _parts(leg)}
    held = tuple(joint for joint in robot.joints if joint not in joints)
    taken = {"torso", "root", "floor", "world", *joints.values(), *bodies.values(), *parts}
    for joint in held:
        joints[joint] = _unique(robot.name(joint), "joint", taken)
    for body in robot.bodies:
        if body not in bodies:
            bodies[body] = _unique(robot.model.body(body).name, "body", taken)
    return Names(labels, joints, bodies, held)


def _parts(leg: Leg) -> list[str]:
    return [*(f"link{place}" for place in range(1, len(leg.joints) + 1)), "foot"]


def _leg_names(legs: tuple[Leg, ...]) -> tuple[str, ...]:
    """Return l1, l2 and so on of left legs, r1, r2 and so on of right ones, from front to rear."""
    sides = ["r" if leg.center[1] < -_MIDLINE else "l" for leg in legs]
    ranks = [
        sum(other == side and ahead.center[0] > leg.center[0] for other, ahead in zip(sides, legs, strict=True))
        for side, leg in zip(sides, legs, strict=True)
    ]
    found = [f"{side}{rank + 1}" for side, rank in zip(sides, ranks, strict=True)]
    if len(set(found)) == len(found):
        return tuple(found)
    return tuple(f"leg{place}" for place in range(1, len(legs) + 1))  # two feet are equally far in front


def clean_name(text: str) -> str:
    """Return a name out of [a-z0-9_], at most as long as names are; "" where nothing of it is left."""
    return re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_")[:MAX_NAME].strip("_")


def _unique(text: str, kind: str, taken: set[str]) -> str:
    """Return a clean name that is not taken, and take it."""
    base = clean_name(text) or kind
    name, count = base, 1
    while name in taken:
        count += 1
        name = f"{base[: MAX_NAME - 5]}_{count}"
    taken.add(name)
    return name
