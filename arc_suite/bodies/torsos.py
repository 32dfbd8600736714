"""Torsos of other forms, and heads and tails on them, for bodies with a plain torso; they have weight and contacts."""

import math

from arc_suite import checks
from arc_suite.robots.spec import Body, Solid, Vector

UNCHANGED = "own"  # leaves a part as the body has it

_BOX_SHARE = 0.85  # of the extents of a torso, that a box has: its corners stand out
_HEAD_HEIGHT = 0.8  # half-thicknesses of the torso, above its middle
_TAIL_RISE = 25.0  # degrees above the horizontal


def has_plain_torso(body: Body) -> bool:
    """Return whether a body can take a torso, a head and a tail: it has one level torso of three half-extents."""
    chassis = body.torso.solids[0]
    is_alone = len(body.torso.solids) == 1
    return is_alone and not body.source and len(chassis.size) == 3 and not any(chassis.euler_deg)


def replace_torso(body: Body, torso: str = UNCHANGED, head: str = UNCHANGED, tail: str = UNCHANGED) -> Body:
    """Return a body with another form of torso, a head and a tail; its name and sizes of motors stay to be changed.

    Args:
        body: body to change.
        torso: name of `TORSOS`, or `UNCHANGED`.
        head: name of `HEADS`, or `UNCHANGED`.
        tail: name of `TAILS`, or `UNCHANGED`.

    Raises:
        ValueError: an unknown name, or a body whose torso is not plain.
    """
    for (part, choices), name in zip(PARTS.items(), (torso, head, tail), strict=True):
        if name != UNCHANGED:
            checks.name(name, choices, part, suggestions=(UNCHANGED,))
    if torso == head == tail == UNCHANGED:
        return body
    if not has_plain_torso(body):
        raise ValueError(f"torso: {body.name} has a torso of its own form, which takes no other, no head and no tail")
    chassis = body.torso.solids[0]
    solids = [chassis]
    if torso != UNCHANGED:
        solids = [TORSOS[torso](chassis)]
    if head != UNCHANGED:
        solids.append(HEADS[head](chassis))
    if tail != UNCHANGED:
        solids.append(TAILS[tail](chassis))
    return body.replace(torso=body.torso.replace(solids=tuple(solids)))


def _box(chassis: Solid) -> Solid:
    return chassis.replace(shape="box", size=tuple(_BOX_SHARE * half_extent for half_extent in chassis.size))


def _capsule(chassis: Solid) -> Solid:
    """Return a capsule along x, as thick as the mounts of legs are apart."""
    half_length, half_width, half_thickness = chassis.size
    radius = max(0.7 * half_width, half_thickness)
    return chassis.replace(
        shape="capsule", size=(radius, max(half_length - radius, 0.1 * radius)), euler_deg=(0.0, 90.0, 0.0)
    )


def _round_head(chassis: Solid) -> Solid:
    half_length, _, half_thickness = chassis.size
    position = _place_on(chassis, half_length, _HEAD_HEIGHT * half_thickness)
    return Solid(name="head", shape="sphere", size=(0.8 * half_thickness,), position=position)


def _long_head(chassis: Solid) -> Solid:
    half_length, _, half_thickness = chassis.size
    size = (1.8 * half_thickness, 0.7 * half_thickness, 0.6 * half_thickness)
    position = _place_on(chassis, half_length + 0.8 * half_thickness, _HEAD_HEIGHT * half_thickness)
    return Solid(name="head", shape="ellipsoid", size=size, position=position)


def _tail(chassis: Solid, length: float) -> Solid:
    """Return a rod that rises behind the torso; its length is a multiple of the torso's."""
    half_length, _, half_thickness = chassis.size
    radius = 0.25 * half_thickness
    half_rod = length * half_length
    rise = math.radians(_TAIL_RISE)
    x = -0.85 * half_length - half_rod * math.cos(rise)
    z = 0.3 * half_thickness + half_rod * math.sin(rise)
    return Solid(
        name="tail",
        shape="capsule",
        size=(radius, half_rod),
        position=_place_on(chassis, x, z),
        euler_deg=(0.0, _TAIL_RISE - 90.0, 0.0),
    )


def _place_on(chassis: Solid, ahead: float, above: float) -> Vector:
    """Return the point (3,) of the torso's frame that is ahead of the middle of its solid and above it, m."""
    x, y, z = chassis.position
    return x + ahead, y, z + above


def _short_tail(chassis: Solid) -> Solid:
    return _tail(chassis, 0.3)


def _long_tail(chassis: Solid) -> Solid:
    return _tail(chassis, 0.7)


TORSOS = {"box": _box, "capsule": _capsule}
HEADS = {"round": _round_head, "long": _long_head}
TAILS = {"short": _short_tail, "long": _long_tail}
PARTS = {"torso": TORSOS, "head": HEADS, "tail": TAILS}  # by the argument of `replace_torso`
