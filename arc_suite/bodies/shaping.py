"""Bodies of other proportions and torsos: links, torso and heading of the legs by factors and degrees."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from arc_suite import checks
from arc_suite.bodies import generator
from arc_suite.bodies.torsos import UNCHANGED, replace_torso
from arc_suite.models.imported_links import adjustable_links, change_link_ends
from arc_suite.robots.spec import MAX_NAME, Ballast, Body, Leg, Link, Solid, Vector

FACTOR_RANGE = (0.1, 10.0)  # bounds of a factor of lengths
FAN_RANGE = (-90.0, 90.0)  # degrees, bounds
IMPORT_FIELDS = ("scale", "links", "ends")  # of a shape, that an imported body can have

_SUFFIX = "_shaped"  # of names
_MIDLINE = 1e-9  # m, half of its width


class Shape(NamedTuple):
    """Changes of a body's proportions; the defaults change nothing.

    Attributes:
        scale: factor of all lengths.
        length, width, thickness: factors of the torso along x, y and z, with the mounts of the legs along x and y.
        fan: degrees by which the first legs turn forward and the last ones backward.
        torso, head, tail: see `torsos.replace_torso`; the torso's form changes before its factors.
        links: factors of the lengths of links: of all legs by name of the link, of one leg by name of the part.
        ends: ends (3,) of links of single legs in place of the body's own, before all factors, m, by name of the part.
    """

    scale: float = 1.0
    length: float = 1.0
    width: float = 1.0
    thickness: float = 1.0
    fan: float = 0.0
    torso: str = UNCHANGED
    head: str = UNCHANGED
    tail: str = UNCHANGED
    links: Mapping[str, float] = {}
    ends: Mapping[str, Sequence[float]] = {}


def link_names(body: Body) -> tuple[str, ...]:
    """Return the names of the links of all legs, each once, from the torso outwards."""
    return tuple(dict.fromkeys(link.name for leg in body.legs for link in leg.links))


def parts_with_lengths(body: Body) -> tuple[str, ...]:
    """Return the names of the parts that are links whose lengths can change: all, except some of imported bodies."""
    return adjustable_links(body) if body.source else tuple(link_ends(body))


def link_ends(body: Body) -> dict[str, Vector]:
    """Return the ends (3,) of the links of all legs, m, by names of their parts."""
    return {leg.full_name(link): link.end for leg in body.legs for link in leg.links}


def shaped(body: Body, **changes: Any) -> Body:
    """Return a body of other proportions, to be sized anew; its lowest foot stands on the floor.

    Args:
        body: body to change.
        **changes: fields of `Shape`.

    Returns:
        The body, `<name>_shaped`: a robot's name would give it the robot's numbers. The body itself
        if nothing changes.

    Raises:
        ValueError: an unknown change, a value or a length out of range, a link that the body does not have, another
            torso of an imported body, or as `torsos.replace_torso`.
    """
    shape = Shape(**{checks.name(name, Shape._fields, "change of a shape"): value for name, value in changes.items()})
    body_ends = link_ends(body)
    link_factors = {}
    for name, factor in shape.links.items():
        if name not in body_ends:  # of one leg
            of_one_leg = f"of one leg, as {next(iter(body_ends))}"
            if name.endswith(tuple(f"_{link}" for link in link_names(body))):  # no link of all legs is meant
                checks.name(name, body_ends, "link")
            checks.name(name, link_names(body), "link", descriptions=(of_one_leg,))
        link_factors[name] = checks.number(f"links[{name!r}]", factor, *FACTOR_RANGE)
    ends = {checks.name(name, body_ends, "part"): end for name, end in shape.ends.items()}
    length = checks.number("length", shape.length, *FACTOR_RANGE)
    width = checks.number("width", shape.width, *FACTOR_RANGE)
    thickness = checks.number("thickness", shape.thickness, *FACTOR_RANGE)
    torso_factors = (length, width, thickness)
    fan = checks.number("fan", shape.fan, *FAN_RANGE)

    keeps_links = all(factor == 1.0 for factor in link_factors.values())
    keeps_ends = all(tuple(end) == body_ends[name] for name, end in ends.items())
    keeps_torso = shape._replace(links={}, ends={}) == Shape()
    if keeps_torso and keeps_links and keeps_ends:
        return body
    stem = body.name[: MAX_NAME - len(_SUFFIX)].removesuffix(_SUFFIX)
    if body.source:
        return _shape_import(body, shape, link_factors, ends).replace(name=stem + _SUFFIX)
    body = replace_torso(body, shape.torso, shape.head, shape.tail)

    farthest_mount = max(abs(leg.mount[0]) for leg in body.legs) or 1.0  # m, forward or backward
    legs = []
    for leg in body.legs:
        turn = fan * leg.mount[0] / farthest_mount  # degrees, forward
        legs.append(_shape_leg(leg, link_factors, ends, torso_factors, turn))
    solids = tuple(_stretch(solid, torso_factors) for solid in body.torso.solids)
    ballast = tuple(_stretch(solid, torso_factors) for solid in body.ballast)
    torso = body.torso.replace(standing_height=None, solids=solids)
    reshaped_body = body.replace(torso=torso, ballast=ballast, legs=tuple(legs))
    scaled_body = generator.scaled(reshaped_body, shape.scale)
    return scaled_body.replace(name=stem + _SUFFIX)


def _shape_import(
    body: Body, shape: Shape, link_factors: Mapping[str, float], ends: Mapping[str, Sequence[float]]
) -> Body:
    """Return an imported body of another size and with links of other lengths; arguments as of `_shape_leg`."""
    for field in Shape._fields:
        is_same = getattr(shape, field) == getattr(Shape(), field)
        if field not in IMPORT_FIELDS and not is_same:
            raise ValueError(
                f"{field}: {body.name} was imported, and keeps its torso; {', '.join(IMPORT_FIELDS)} change"
            )
    new_ends = {}
    for leg in body.legs:
        for link in leg.links:
            part = leg.full_name(link)
            new_ends[part] = _change_end(leg, link, link_factors, ends)
    return generator.scaled(change_link_ends(body, new_ends), shape.scale)


def _shape_leg(
    leg: Leg,
    link_factors: Mapping[str, float],
    ends: Mapping[str, Sequence[float]],
    torso_factors: Vector,
    turn: float,
) -> Leg:
    """Return a leg of other proportions.

    Args:
        leg: leg to change.
        link_factors: factors of lengths, by name of the link or of the part.
        ends: ends of links, m, by name of the part.
        torso_factors: factors by which the mount moves along x and y.
        turn: turn of the leg forward, degrees; a leg on the midline keeps its heading.
    """
    x, y, z = leg.mount
    length, width, _ = torso_factors
    links = []
    for link in leg.links:
        links.append(link.replace(end=_change_end(leg, link, link_factors, ends)))
    side = math.copysign(1.0, y) if abs(y) > _MIDLINE else 0.0
    return leg.replace(mount=(length * x, width * y, z), links=tuple(links), yaw_deg=leg.yaw_deg - side * turn)


def _change_end(leg: Leg, link: Link, link_factors: Mapping[str, float], ends: Mapping[str, Sequence[float]]) -> Vector:
    """Return the end of a link, m; arguments as of `_shape_leg`."""
    part = leg.full_name(link)
    factor = link_factors.get(link.name, 1.0) * link_factors.get(part, 1.0)
    x, y, z = ends.get(part, link.end)
    return factor * x, factor * y, factor * z


def _stretch(solid: Solid, factors: Vector) -> Solid:
    """Return a solid with its position and size times factors along the torso's axes; its angles stay."""
    position = tuple(factor * component for factor, component in zip(factors, solid.position, strict=True))
    # A local axis e becomes longer by |factors * e|, e in the torso's frame.
    stretches = []
    for axis in _axes(solid.euler_deg):
        stretched_axis = [factor * component for factor, component in zip(factors, axis, strict=True)]
        stretches.append(math.hypot(*stretched_axis))
    x_stretch, y_stretch, z_stretch = stretches

    shape = solid.shape
    size: tuple[float, ...]
    if shape == "sphere" and len(set(stretches)) > 1:
        shape = "ellipsoid"
        radius = solid.size[0]
        size = tuple(radius * stretch for stretch in stretches)
    elif shape in ("box", "ellipsoid"):
        size = tuple(half_extent * stretch for half_extent, stretch in zip(solid.size, stretches, strict=True))
    else:  # round about the local z axis
        radius, *half_lengths = solid.size
        radius_stretch = math.sqrt(x_stretch * y_stretch)
        size = (radius * radius_stretch, *(half_length * z_stretch for half_length in half_lengths))
    stretched_solid = solid.replace(shape=shape, size=size, position=position)
    if isinstance(stretched_solid, Ballast):  # gains weight as the torso gains volume
        return stretched_solid.replace(mass=stretched_solid.mass * math.prod(factors))
    return stretched_solid


def _axes(euler_deg: Vector) -> list[Vector]:
    """Return the axes of a frame that is turned about the x, y and z axes of the turning frame, in that order.

    Args:
        euler_deg: the three angles, degrees.
    """
    x_angle, y_angle, z_angle = (math.radians(angle) for angle in euler_deg)
    cos_x = math.cos(x_angle)
    sin_x = math.sin(x_angle)
    cos_y = math.cos(y_angle)
    sin_y = math.sin(y_angle)
    cos_z = math.cos(z_angle)
    sin_z = math.sin(z_angle)
    return [
        (cos_y * cos_z, cos_x * sin_z + sin_x * sin_y * cos_z, sin_x * sin_z - cos_x * sin_y * cos_z),
        (-cos_y * sin_z, cos_x * cos_z - sin_x * sin_y * sin_z, sin_x * cos_z + cos_x * sin_y * sin_z),
        (sin_y, -sin_x * cos_y, cos_x * cos_y),
    ]
