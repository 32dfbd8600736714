"""Bodies of other proportions: links, torso and heading of the legs by factors and degrees."""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from arc_suite import checks
from arc_suite.bodies import generator
from arc_suite.robots.spec import MAX_NAME, Ballast, Body, Leg, Solid, Vector

FACTOR = (0.1, 10.0)  # of a length
FAN = (-90.0, 90.0)  # degrees


class Shape(NamedTuple):
    """Changes of a body's proportions; the defaults change nothing.

    Attributes:
        scale: factor of all lengths.
        length, width, thickness: factors of the torso along x, y and z, with the mounts of the legs along x and y.
        fan: degrees by which the first legs turn forward and the last ones backward.
        links: factors of the lengths of links, by name of the link.
        ends: ends (3,) of links of single legs in place of the body's own, before all factors, m, by name of the part.
    """

    scale: float = 1.0
    length: float = 1.0
    width: float = 1.0
    thickness: float = 1.0
    fan: float = 0.0
    links: Mapping[str, float] = {}
    ends: Mapping[str, Sequence[float]] = {}


def link_names(body: Body) -> tuple[str, ...]:
    """Return the names of the links of all legs, each once, from the torso outwards."""
    return tuple(dict.fromkeys(link.name for leg in body.legs for link in leg.links))


def link_ends(body: Body) -> dict[str, Vector]:
    """Return the ends (3,) of the links of all legs, m, by names of their parts."""
    return {leg.full_name(link): link.end for leg in body.legs for link in leg.links}


def shaped(body: Body, **changes) -> Body:
    """Return a body of other proportions, to be sized anew; its lowest foot stands on the floor.

    Args:
        body: to change.
        **changes: fields of `Shape`.

    Returns:
        The body, `<name>_shaped`: a robot's name would give it the robot's numbers. The body itself
        if nothing changes.

    Raises:
        ValueError: a value or a length out of range, a link that the body does not have, or an imported body.
    """
    shape = Shape(**changes)
    factors = {
        checks.name(name, link_names(body), "link"): checks.number(f"links[{name!r}]", factor, *FACTOR)
        for name, factor in shape.links.items()
    }
    own = link_ends(body)
    ends = {checks.name(name, own, "part"): end for name, end in shape.ends.items()}
    length, width, thickness = (
        checks.number(name, getattr(shape, name), *FACTOR) for name in ("length", "width", "thickness")
    )
    torso = length, width, thickness
    fan = checks.number("fan", shape.fan, *FAN)
    same_links = set(factors.values()) <= {1.0} and all(tuple(end) == own[name] for name, end in ends.items())
    if shape._replace(links={}, ends={}) == Shape() and same_links:
        return body
    if body.source:
        raise ValueError(f"shape: {body.name} was imported, and keeps the shape of its file")
    furthest = max(abs(leg.mount[0]) for leg in body.legs) or 1.0
    legs = tuple(_leg(leg, factors, ends, torso, fan * leg.mount[0] / furthest) for leg in body.legs)
    solids = tuple(_stretched(solid, torso) for solid in body.torso.solids)
    ballast = tuple(_stretched(each, torso) for each in body.ballast)
    reshaped = body.replace(torso=body.torso.replace(standing_height=None, solids=solids), ballast=ballast, legs=legs)
    stem = body.name[: MAX_NAME - len("_shaped")]
    return generator.scaled(reshaped, shape.scale).replace(name=f"{stem.removesuffix('_shaped')}_shaped")


def _leg(
    leg: Leg, factors: Mapping[str, float], ends: Mapping[str, Sequence[float]], torso: Vector, turn: float
) -> Leg:
    (x, y, z), (length, width, _) = leg.mount, torso
    side = math.copysign(1.0, y) if abs(y) > 1e-9 else 0.0  # a leg on the midline keeps its heading
    links = [link.replace(end=tuple(ends.get(leg.full_name(link), link.end))) for link in leg.links]
    links = [link.replace(end=tuple(factors.get(link.name, 1.0) * part for part in link.end)) for link in links]
    return leg.replace(mount=(length * x, width * y, z), links=tuple(links), yaw_deg=leg.yaw_deg - side * turn)


def _stretched(solid: Solid, factors: Vector) -> Solid:
    """Return a solid with its position and size times factors along the torso's axes; a turned one keeps its angles."""
    position = tuple(factor * part for factor, part in zip(factors, solid.position, strict=True))
    # A local axis e becomes longer by |factors * e|, e in the torso's frame.
    axes = [math.hypot(*(f * part for f, part in zip(factors, axis, strict=True))) for axis in _axes(solid.euler_deg)]
    size: tuple[float, ...]
    if solid.shape == "sphere" and len(set(axes)) > 1:
        return _changed(
            solid, factors, shape="ellipsoid", size=tuple(solid.size[0] * a for a in axes), position=position
        )
    if solid.shape in ("box", "ellipsoid"):
        size = tuple(half * axis for half, axis in zip(solid.size, axes, strict=True))
    else:  # round about the local z axis
        size = (solid.size[0] * math.sqrt(axes[0] * axes[1]), *(half * axes[2] for half in solid.size[1:]))
    return _changed(solid, factors, size=size, position=position)


def _changed(solid: Solid, factors: Vector, **fields) -> Solid:
    """Return a solid with other fields; ballast gains weight as the torso gains volume."""
    mass = {"mass": solid.mass * math.prod(factors)} if isinstance(solid, Ballast) else {}
    return solid.replace(**fields, **mass)


def _axes(euler_deg: Vector) -> list[Vector]:
    """Return the axes of a frame that is turned about the x, y and z axes of the turning frame, in that order."""
    (ca, sa), (cb, sb), (cc, sc) = (
        (math.cos(math.radians(angle)), math.sin(math.radians(angle))) for angle in euler_deg
    )
    return [
        (cb * cc, ca * sc + sa * sb * cc, sa * sc - ca * sb * cc),
        (-cb * sc, ca * cc - sa * sb * sc, sa * cc + ca * sb * sc),
        (sb, -sa * cb, ca * cb),
    ]
