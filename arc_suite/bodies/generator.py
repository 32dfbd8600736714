"""Bodies with a number of legs and links: with default proportions, or with random ones.

They hold geometry alone; `sizing` derives motors and constants from it. With all joints at zero
they stand with every foot on the floor.
"""

import math
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import checks
from arc_suite.bodies import imported_variants
from arc_suite.models import imported_sizes
from arc_suite.robots import mirror
from arc_suite.robots.spec import MAX_NAME, Ballast, Body, Foot, Joint, Leg, Link, Solid, Torso, Vector

LEG_RANGE = (4, 12)  # fewest and most
LINK_RANGE = (1, 4)  # fewest and most, of a leg
SCALE_RANGE = (0.01, 100.0)  # smallest and largest factor
LAYOUTS = ("pairs", "radial")

# A leg in its vertical plane, by number of links: of each, its share of the leg's length and its
# elevation above the horizontal in degrees. The first link sweeps, the others bend.
PROFILES = {
    1: ((1.0, -50.0),),
    2: ((0.3, 5.0), (0.7, -55.0)),
    3: ((0.25, 10.0), (0.35, -30.0), (0.4, -80.0)),
    4: ((0.2, 10.0), (0.25, 15.0), (0.25, -35.0), (0.3, -80.0)),
}
LINK_NAMES = {
    1: ("upper",),
    2: ("upper", "lower"),
    3: ("upper", "middle", "lower"),
    4: ("upper", "middle", "lower", "toe"),
}
JOINT_NAMES = ("hip", "knee", "ankle", "toe")

_HIP = Joint(name="hip", axis=(0.0, 0.0, 1.0), range_deg=(-45.0, 45.0))
_BEND = Joint(name="knee", axis=(-1.0, 0.0, 0.0), range_deg=(-80.0, 80.0))

_SUFFIX = re.compile("_(scaled|mutated)$")  # of names

# Default proportions.
_HEIGHT = 0.4  # m
_SPACING = 0.5  # of the height, between neighboring legs of a side
_REACH = 0.9  # of the height, from mount to foot
_HALF_WIDTH = 0.4  # of the height, of a long torso
_HALF_THICKNESS = 0.25  # of the height
_FAN = 35.0  # degrees

_FOOT_RADIUS = 0.06  # of the height
_LINK_THICKNESS = 0.8  # in foot radii, of the last link: thinner than the foot, so that the foot touches the ground
_LINK_THICKENING = 0.35  # share of it, for each link nearer to the torso


class Proportions(NamedTuple):
    """Proportions of a generated body; lengths of the torso are half-extents.

    Attributes:
        height: from the floor to the mounts, m.
        half_length, half_width: of the torso, m.
        thickness: half of it, of the height.
        fan: degrees by which the first pair of legs points forward and the last one backward.
        profile: profile of every leg; see `PROFILES`.
        reaches: reaches of each pair, or of each leg around a torso: from mount to foot, seen from above, of
            the height.
    """

    height: float
    half_length: float
    half_width: float
    thickness: float
    fan: float
    profile: Sequence[tuple[float, float]]
    reaches: Sequence[float]


def generate(legs: int, links: int, layout: str | None = None) -> Body:
    """Make a body with a number of legs, each of a number of links.

    Pairs stand mirrored along a long torso, l1 and r1 in front. Radial legs stand around a round
    torso, counting counter-clockwise; of an odd number, leg1 points forward.

    Args:
        legs: 4 to 12.
        links: actuated links of each leg, 1 to 4.
        layout: pairs, for an even number of legs, or radial; None for pairs where there can be.

    Returns:
        The body, `walker_<legs>x<links>`, 0.4 m high.

    Raises:
        ValueError: a value out of range.
    """
    legs = checks.integer("legs", legs, *LEG_RANGE)
    links = checks.integer("links", links, *LINK_RANGE)
    layout = _check_layout(layout, legs)
    if layout == "radial":
        half_length = _SPACING * _HEIGHT * legs / (2.0 * math.pi)  # radius of a circle of legs
        half_width = half_length
    else:
        half_length = _SPACING * _HEIGHT * legs / 4.0
        half_width = _HALF_WIDTH * _HEIGHT
    proportions = Proportions(
        height=_HEIGHT,
        half_length=half_length,
        half_width=half_width,
        thickness=_HALF_THICKNESS,
        fan=_FAN,
        profile=PROFILES[links],
        reaches=(_REACH,) * legs,
    )
    return assemble_body(f"walker_{legs}x{links}", legs, layout, proportions)


def random_body(seed: int, legs: int | None = None, links: int | None = None, layout: str | None = None) -> Body:
    """Make a random body, the same for the same arguments; its legs may overlap, unlike `bodies.families.sound_body`'s.

    Args:
        seed: 0 or more.
        legs: 4 to 12.
        links: 1 to 4.
        layout: pairs or radial.

    Returns:
        The body, `random_<seed>`; see `drawn`.

    Raises:
        ValueError: a value out of range.
    """
    random = np.random.default_rng(checks.seed(seed))
    return draw_body(random, legs, links, layout).replace(name=f"random_{seed}")


def draw_body(
    random: np.random.Generator, legs: int | None = None, links: int | None = None, layout: str | None = None
) -> Body:
    """Draw a body, `random`.

    Legs, links and layout are drawn unless they are arguments: 4 to 12 legs, 2 to 4 links and, for an even number of
    legs, the layout, radial for three in ten. Always drawn are:

    - half of the torso's length, log-uniform from 0.08 to 1.2 m;
    - the height at which it stands, 0.6 to 1.4 times that;
    - its half-width, 0.35 to 0.7 times its half-length (radial: all of it), and its
      half-thickness, 0.15 to 0.3 times the height;
    - the fan of the legs, 15 to 45 degrees;
    - the legs' profile, each link's share of the length within 20 % and its elevation within 8
      degrees of `generate`'s;
    - the legs' reach, 0.7 to 1.2 times the height; in four bodies of ten legs are unequal, and each
      pair (radial: each leg) reaches 0.75 to 1.3 times that.

    Args:
        random: generator of random numbers.
        legs: 4 to 12.
        links: 1 to 4.
        layout: pairs or radial.

    Raises:
        ValueError: a value out of range.
    """
    # The order of the draws stands for a seed's body, and each is made whether it is used or not.
    random_legs = int(random.integers(LEG_RANGE[0], LEG_RANGE[1] + 1))
    random_links = int(random.integers(2, LINK_RANGE[1] + 1))
    legs = checks.integer("legs", random_legs if legs is None else legs, *LEG_RANGE)
    links = checks.integer("links", random_links if links is None else links, *LINK_RANGE)
    is_radial = random.uniform() < 0.3 or legs % 2 == 1
    random_layout = "radial" if is_radial else "pairs"
    layout = _check_layout(layout or random_layout, legs)
    half_length = math.exp(random.uniform(math.log(0.08), math.log(1.2)))
    height = half_length * random.uniform(0.6, 1.4)
    width_share = random.uniform(0.35, 0.7)
    has_unequal_legs = random.uniform() < 0.4
    reach = random.uniform(0.7, 1.2)  # of the height
    reaches = reach * (random.uniform(0.75, 1.3, legs) if has_unequal_legs else np.ones(legs))
    proportions = Proportions(
        height=height,
        half_length=half_length,
        half_width=half_length * (1.0 if layout == "radial" else width_share),
        thickness=random.uniform(0.15, 0.3),
        fan=random.uniform(15.0, 45.0),
        profile=[
            (share * random.uniform(0.8, 1.2), elevation + random.uniform(-8.0, 8.0))
            for share, elevation in PROFILES[links]
        ],
        reaches=tuple(map(float, reaches)),
    )
    return assemble_body("random", legs, layout, proportions)


def scaled(body: Body, factor: float) -> Body:
    """Return a body with all lengths multiplied, to be sized anew.

    Args:
        body: body to scale.
        factor: 0.01 to 100.

    Returns:
        The body, `<name>_scaled`: a robot's name would give it the robot's numbers. An imported body moves like the
        first one, see `imported_sizes`. MuJoCo bounds inertias from below: at the density of 10 kg/m^3 legs must be
        0.9 mm thick, which those of a body of `generate` are down to a height of 2 cm; at 300 kg/m^3 one of 1 cm walks
        too.

    Raises:
        ValueError: the factor, or a length of the scaled body, is out of range.
    """
    factor = checks.number("scale", factor, *SCALE_RANGE)
    if body.source:
        return imported_sizes.scale_import(body, factor).replace(name=_changed_name(body, "scaled"))

    standing_height = factor * body.torso.standing_height
    solids = tuple(_scale_solid(solid, factor) for solid in body.torso.solids)
    torso = Torso(standing_height=standing_height, solids=solids)
    ballast = tuple(_scale_solid(solid, factor) for solid in body.ballast)
    legs = [_scale_leg(leg, factor) for leg in body.legs]
    return _change_body(body, "scaled", torso=torso, ballast=ballast, legs=legs)


def _scale_solid(solid: Solid, factor: float) -> Solid:
    scaled_solid = solid.replace(
        size=_scale_lengths(solid.size, factor), position=_scale_lengths(solid.position, factor)
    )
    if isinstance(scaled_solid, Ballast):
        return scaled_solid.replace(mass=factor**3 * scaled_solid.mass)
    return scaled_solid


def _scale_leg(leg: Leg, factor: float) -> Leg:
    links = []
    for link in leg.links:
        scaled_link = link.replace(end=_scale_lengths(link.end, factor), radius=factor * link.radius)
        if link.joint:  # torques scale with weights times lengths
            friction_loss = factor**4 * link.joint.friction_loss
            scaled_link = scaled_link.replace(joint=link.joint.replace(friction_loss=friction_loss))
        links.append(scaled_link)
    foot = leg.foot.replace(radius=factor * leg.foot.radius)
    return leg.replace(mount=_scale_lengths(leg.mount, factor), links=tuple(links), foot=foot)


def _scale_lengths(lengths: Sequence[float], factor: float) -> tuple[float, ...]:
    return tuple(factor * length for length in lengths)


def mutated(body: Body, seed: int, amount: float = 0.1) -> Body:
    """Return a body that differs a little, the same for the same arguments.

    Mirrored legs stay mirrored, and feet at their height.

    Args:
        body: body to change.
        seed: 0 or more.
        amount: standard deviation of the logarithm of lengths, and of leg's headings in rad; 0 to 0.5.

    Returns:
        The body, `<name>_mutated`, to be sized anew.

    Raises:
        ValueError: a value out of range, or a length grown out of range.
    """
    random = np.random.default_rng(checks.seed(seed))
    amount = checks.number("amount", amount, 0.0, 0.5)
    changes = amount * random.standard_normal(len(list_deformations(body)))
    return deform_legs(body, changes)


def list_deformations(body: Body) -> tuple[str, ...]:
    """Return the names of the numbers that `deform_legs` takes: l1_upper of a length, l1_heading of a heading, ...

    The name of a leg stands for its mirror images, too. A leg on the midline has no heading: it would have no image. Of
    imported bodies only links with a length of their own change.
    """
    if body.source:
        return imported_variants.list_changes(body)
    names = []
    for leg, _ in _legs_with_images(body):
        names += [leg.full_name(link) for link in leg.links]
        if not mirror.are_images(body, leg, leg):
            names.append(f"{leg.name}_heading")
    return tuple(names)


def deform_legs(body: Body, changes: np.ndarray) -> Body:
    """Return a body with legs of other lengths and headings; mirrored legs stay mirrored, and feet at their height.

    Args:
        body: body to change.
        changes: (deformations,) in the order of `list_deformations`: the logarithm of the factor of a length, or the
            turn of a leg about the vertical, rad. Where a foot would leave its height, all links of the leg then change
            in height. Legs of imported bodies do not turn; see `imported_variants`.

    Returns:
        The body, `<name>_mutated`, to be sized anew; an imported body keeps its motors.

    Raises:
        ValueError: other numbers of changes, or a length grown out of range.
    """
    changes = np.asarray(changes, float)
    names = list_deformations(body)
    if changes.shape != (len(names),):
        raise ValueError(f"changes: expected {len(names)} numbers, of {', '.join(names)}, got shape {changes.shape}")
    if body.source:
        variant = imported_variants.deform_imported_legs(body, changes)
        return variant.replace(name=_changed_name(body, "mutated"))
    deformed_legs = {}
    first = 0  # index of the leg's changes
    for leg, images in _legs_with_images(body):
        turn_index = first + len(leg.links)
        logarithms = changes[first:turn_index, None]
        has_heading = not mirror.are_images(body, leg, leg)
        turn = float(changes[turn_index]) if has_heading else 0.0
        deformed_legs[leg.name] = _deform_leg(leg, logarithms, turn)
        for image in images:
            deformed_legs[image.name] = _deform_leg(image, logarithms, -turn)
        first = turn_index + has_heading
    return _change_body(body, "mutated", legs=[deformed_legs[leg.name] for leg in body.legs])


def _legs_with_images(body: Body) -> Iterator[tuple[Leg, list[Leg]]]:
    """Yield legs, each with its mirror images among later legs. Images are not yielded themselves."""
    known_names = set()
    for leg in body.legs:
        if leg.name in known_names:
            continue
        known_names.add(leg.name)
        images = [
            candidate
            for candidate in body.legs
            if candidate.name not in known_names and mirror.are_images(body, leg, candidate)
        ]
        known_names.update(image.name for image in images)
        yield leg, images


def _deform_leg(leg: Leg, logarithms: np.ndarray, turn: float) -> Leg:
    """Return a leg whose links are longer by factors, and whose foot stays at its height if it can.

    Args:
        leg: leg to change.
        logarithms: (links, 1) logarithms of the factors.
        turn: turn of the leg about the vertical, rad.
    """
    ends = np.array([link.end for link in leg.links])
    drop = ends[:, 2].sum()  # of the foot below the mount, m
    ends *= np.exp(logarithms)
    deformed_drop = ends[:, 2].sum()
    if deformed_drop * drop > 0.0:
        ends[:, 2] *= drop / deformed_drop
    links = [link.replace(end=tuple(map(float, end))) for link, end in zip(leg.links, ends, strict=True)]
    return leg.replace(links=tuple(links), yaw_deg=leg.yaw_deg + math.degrees(turn))


def _change_body(body: Body, change: str, legs: Sequence[Leg], **fields) -> Body:
    """Return a body with other legs and fields, to be sized anew.

    Args:
        body: body to change.
        change: in its name, "scaled" or "mutated".
        legs: legs of the body.
        **fields: fields of the body.
    """
    legs_to_size = tuple(_forget_sizes(leg) for leg in legs)
    return body.replace(name=_changed_name(body, change), legs=legs_to_size, simulation=None, camera=None, **fields)


def _changed_name(body: Body, change: str) -> str:
    """Return the name of a body with a change in place of an earlier one."""
    stem = _SUFFIX.sub("", body.name)[: MAX_NAME - len(change) - 1]
    return f"{stem}_{change}"


def _forget_sizes(leg: Leg) -> Leg:
    """Return a leg whose joints are to be sized."""
    links = []
    for link in leg.links:
        if link.joint:
            link = link.replace(joint=link.joint.replace(armature=None, damping=None, motor=None))
        links.append(link)
    return leg.replace(links=tuple(links))


def _check_layout(layout: str | None, legs: int) -> str:
    if layout is None:
        return "radial" if legs % 2 else "pairs"
    if layout == "pairs" and legs % 2:
        raise ValueError(f"layout: expected radial for an odd number of legs, got 'pairs' for {legs}")
    return checks.name(layout, LAYOUTS, "layout")


def assemble_body(name: str, legs: int, layout: str, proportions: Proportions) -> Body:
    """Return a body of proportions; the number of legs and the layout are as in `generate`, and not checked."""
    half_length = proportions.half_length
    half_width = proportions.half_width
    if layout == "radial":
        label = "leg"
        mounts = radial_mounts(legs, 0.8 * half_length, 0.8 * half_width)
    else:
        label = "l"
        mounts = left_mounts(legs // 2, 0.8 * half_length, 0.6 * half_width, proportions.fan)
    body_legs = []
    for index, (mount, heading) in enumerate(mounts):
        leg = _make_leg(f"{label}{index + 1}", mount, heading, proportions.reaches[index], proportions)
        body_legs.append(leg)
    if layout == "pairs":
        body_legs += [leg.mirrored(leg.name.replace("l", "r")) for leg in body_legs]
    size = (half_length, half_width, proportions.thickness * proportions.height)
    chassis = Solid(name="chassis", shape="ellipsoid", size=size)
    torso = Torso(standing_height=proportions.height, solids=(chassis,))
    return Body(name=name, torso=torso, legs=tuple(body_legs))


def mount_shares(legs: int, layout: str) -> np.ndarray:
    """Return how far ahead legs are mounted, from 1, in front, to -1: one share for each of `Proportions.reaches`."""
    if layout == "pairs":
        return np.linspace(1.0, -1.0, legs // 2)
    return np.cos(np.radians(_headings(legs)))


def left_mounts(pairs: int, along: float, across: float, fan: float) -> list[tuple[Vector, float]]:
    """Return mounts and headings, degrees, of the legs on the left of a long torso, the first in front.

    Args:
        pairs: number of legs, at least 2.
        along: distance of the first mount in front of the middle, m.
        across: distance of the mounts to the left of it, m.
        fan: degrees by which the first leg points forward and the last one backward.
    """
    shares = [1.0 - 2.0 * pair / (pairs - 1) for pair in range(pairs)]  # from 1, in front, to -1
    return [((along * share, across, 0.0), 90.0 - fan * share) for share in shares]


def radial_mounts(legs: int, along: float, across: float) -> list[tuple[Vector, float]]:
    """Return mounts and headings, degrees, of legs all around a torso, counter-clockwise.

    Args:
        legs: their number.
        along: half-axis forward of the ellipse of mounts, m.
        across: the same to the left.
    """
    headings = _headings(legs)
    return [((along * _cos(heading), across * _sin(heading), 0.0), heading) for heading in headings]


def _headings(legs: int) -> list[float]:
    """Return the headings of legs around a torso, degrees."""
    # An even number leaves the front free, so that both sides have as many.
    start = 0.0 if legs % 2 else 180.0 / legs
    headings = [start + 360.0 * leg / legs for leg in range(legs)]
    return [(heading + 180.0) % 360.0 - 180.0 for heading in headings]  # from -180 to 180


def _make_leg(name: str, mount: Vector, heading: float, reach: float, proportions: Proportions) -> Leg:
    """Return a leg that points to a heading and ends on the floor.

    Args:
        name: name of the leg.
        mount: m.
        heading: degrees, counter-clockwise from forward.
        reach: from mount to foot, seen from above, of the height.
        proportions: proportions of the body.
    """
    profile = proportions.profile
    height = proportions.height
    foot_radius = _FOOT_RADIUS * height
    # Factors of the profile, so that the leg reaches out and down as far as it should.
    out = reach * height / sum(share * _cos(elevation) for share, elevation in profile)
    down = (height - foot_radius) / -sum(share * _sin(elevation) for share, elevation in profile)
    link_count = len(profile)
    links = []
    for index, (share, elevation) in enumerate(profile):
        # Links lie in the y-z plane of the first link's frame, which the leg's yaw turns outwards.
        end = (0.0, out * share * _cos(elevation), down * share * _sin(elevation))
        joint = (_HIP if index == 0 else _BEND).replace(name=JOINT_NAMES[index])
        links_after = link_count - 1 - index
        radius = _LINK_THICKNESS * foot_radius * (1.0 + _LINK_THICKENING * links_after)
        links.append(Link(name=LINK_NAMES[link_count][index], end=end, radius=radius, joint=joint))
    return Leg(name=name, mount=mount, links=tuple(links), foot=Foot(radius=foot_radius), yaw_deg=heading - 90.0)


def _cos(degrees: float) -> float:
    return math.cos(math.radians(degrees))


def _sin(degrees: float) -> float:
    return math.sin(math.radians(degrees))
