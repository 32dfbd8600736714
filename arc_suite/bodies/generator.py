"""Bodies made to order: a number of legs and links with sensible defaults, or random ones of all proportions.

They hold geometry alone; `sizing` derives motors and constants from it. With all joints at zero
they stand with every foot on the floor.
"""

import math
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import checks
from arc_suite.robots.spec import MAX_NAME, Ballast, Body, Foot, Joint, Leg, Link, Solid, Torso, Vector

LEGS = (4, 12)  # fewest and most
LINKS = (1, 4)
SCALE = (0.01, 100.0)
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

_CHANGED = re.compile("_(scaled|mutated)$")

_HEIGHT = 0.4  # m
_SPACING = 0.5  # of the height, between neighboring legs of a side
_REACH = 0.9  # of the height, from mount to foot


class Proportions(NamedTuple):
    """Proportions of a generated body; lengths of the torso are half-extents.

    Attributes:
        height: from the floor to the mounts, m.
        half_length, half_width: of the torso, m.
        thickness: half of it, of the height.
        fan: degrees by which the first pair of legs points forward and the last one backward.
        profile: of every leg; see `PROFILES`.
        reaches: of each pair, or of each leg around a torso: from mount to foot, seen from above, of
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
    legs, links = checks.integer("legs", legs, *LEGS), checks.integer("links", links, *LINKS)
    layout = _check_layout(layout, legs)
    if layout == "radial":
        half_length = half_width = _SPACING * _HEIGHT * legs / (2.0 * math.pi)
    else:
        half_length, half_width = _SPACING * _HEIGHT * legs / 4.0, 0.4 * _HEIGHT
    proportions = Proportions(_HEIGHT, half_length, half_width, 0.25, 35.0, PROFILES[links], (_REACH,) * legs)
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

    Draws, where not given, 4 to 12 legs, 2 to 4 links and, for an even number of legs, the layout,
    radial for three in ten. Always draws:

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
        random: to draw from.
        legs: 4 to 12.
        links: 1 to 4.
        layout: pairs or radial.

    Raises:
        ValueError: a value out of range.
    """
    drawn_legs, drawn_links = (int(random.integers(low, high + 1)) for low, high in (LEGS, (2, LINKS[1])))
    legs, links = drawn_legs if legs is None else legs, drawn_links if links is None else links
    legs, links = checks.integer("legs", legs, *LEGS), checks.integer("links", links, *LINKS)
    drawn_layout = "radial" if random.uniform() < 0.3 or legs % 2 else "pairs"
    layout = _check_layout(layout or drawn_layout, legs)
    half_length = math.exp(random.uniform(math.log(0.08), math.log(1.2)))
    height = half_length * random.uniform(0.6, 1.4)
    width = random.uniform(0.35, 0.7)
    unequal = random.uniform() < 0.4
    reaches = random.uniform(0.7, 1.2) * (random.uniform(0.75, 1.3, legs) if unequal else np.ones(legs))
    proportions = Proportions(
        height=height,
        half_length=half_length,
        half_width=half_length * (1.0 if layout == "radial" else width),
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
        body: to scale.
        factor: 0.01 to 100.

    Returns:
        The body, `<name>_scaled`: a robot's name would give it the robot's numbers. MuJoCo bounds
        inertias from below: at the density of 10 kg/m^3 legs must be 0.9 mm thick, which those of a
        body of `generate` are down to a height of 2 cm; at 300 kg/m^3 one of 1 cm walks too.

    Raises:
        ValueError: the factor, or a length of the scaled body, is out of range.
    """
    factor = checks.number("scale", factor, *SCALE)
    if body.source:
        raise ValueError(f"scale: {body.name} was imported, and keeps the size of its file")

    def times(lengths: Sequence[float]) -> tuple[float, ...]:
        return tuple(factor * length for length in lengths)

    def solid(shape: Solid) -> Solid:
        mass = {"mass": factor**3 * shape.mass} if isinstance(shape, Ballast) else {}
        return shape.replace(size=times(shape.size), position=times(shape.position), **mass)

    def leg(leg: Leg) -> Leg:
        links = tuple(link.replace(end=times(link.end), radius=factor * link.radius) for link in leg.links)
        foot = leg.foot.replace(radius=factor * leg.foot.radius)
        return leg.replace(mount=times(leg.mount), links=links, foot=foot)

    torso = Torso(standing_height=factor * body.torso.standing_height, solids=tuple(map(solid, body.torso.solids)))
    ballast = tuple(map(solid, body.ballast))
    return _changed(body, "scaled", torso=torso, ballast=ballast, legs=tuple(map(leg, body.legs)))


def mutated(body: Body, seed: int, amount: float = 0.1) -> Body:
    """Return a body that differs a little, the same for the same arguments.

    Mirrored legs stay mirrored, and feet at their height.

    Args:
        body: to change.
        seed: 0 or more.
        amount: standard deviation of the logarithm of lengths, and of leg's headings in rad; 0 to 0.5.

    Returns:
        The body, `<name>_mutated`, to be sized anew.

    Raises:
        ValueError: a value out of range, or a length grown out of range.
    """
    random, amount = np.random.default_rng(checks.seed(seed)), checks.number("amount", amount, 0.0, 0.5)
    return deform_legs(body, amount * random.standard_normal(deformation_count(body)))


def deformation_count(body: Body) -> int:
    """Return how many changes `deformed` takes: for every leg without a mirror image before it, its links and one."""
    return sum(len(leg.links) + 1 for leg, _ in _with_images(body))


def deform_legs(body: Body, changes: np.ndarray) -> Body:
    """Return a body with legs of other lengths and headings; mirrored legs stay mirrored, and feet at their height.

    Args:
        body: to change.
        changes: (deformations,) for each of these legs the logarithm of the factor of each link, and the turn of the
            leg about the vertical, rad.

    Returns:
        The body, `<name>_mutated`, to be sized anew.

    Raises:
        ValueError: a length grown out of range.
    """
    legs, first = {}, 0
    for leg, images in _with_images(body):
        last = first + len(leg.links)
        legs[leg.name] = changed = _deformed_leg(leg, changes[first:last, None], float(changes[last]))
        legs |= {name: changed.mirrored(name) for name in images}
        first = last + 1
    return _changed(body, "mutated", legs=tuple(legs[leg.name] for leg in body.legs))


def _with_images(body: Body) -> Iterator[tuple[Leg, list[str]]]:
    """Yield every leg without a mirror image before it, and the names of its images behind it."""
    seen = set()
    for leg in body.legs:
        if leg.name not in seen:
            seen.add(leg.name)
            images = [other.name for other in body.legs if other.name not in seen and leg.mirrored(other.name) == other]
            seen.update(images)
            yield leg, images


def _deformed_leg(leg: Leg, logarithms: np.ndarray, turn: float) -> Leg:
    ends = np.array([link.end for link in leg.links])
    drop = ends[:, 2].sum()
    ends *= np.exp(logarithms)
    if ends[:, 2].sum() * drop > 0.0:
        ends[:, 2] *= drop / ends[:, 2].sum()
    links = tuple(link.replace(end=tuple(map(float, end))) for link, end in zip(leg.links, ends, strict=True))
    return leg.replace(links=links, yaw_deg=leg.yaw_deg + math.degrees(turn))


def _changed(body: Body, how: str, legs: Sequence[Leg], **fields) -> Body:
    """Return a body with other legs and fields, a name that says how it came about, and all open that can be sized."""

    def opened(link: Link) -> Link:
        return link.replace(joint=link.joint and link.joint.replace(armature=None, damping=None, motor=None))

    stem = _CHANGED.sub("", body.name)[: MAX_NAME - len(how) - 1]
    legs = tuple(leg.replace(links=tuple(map(opened, leg.links))) for leg in legs)
    return body.replace(name=f"{stem}_{how}", legs=legs, simulation=None, camera=None, **fields)


def _check_layout(layout: str | None, legs: int) -> str:
    if layout is None:
        return "radial" if legs % 2 else "pairs"
    if layout == "pairs" and legs % 2:
        raise ValueError(f"layout: expected radial for an odd number of legs, got 'pairs' for {legs}")
    return checks.name(layout, LAYOUTS, "layout")


def assemble_body(name: str, legs: int, layout: str, proportions: Proportions) -> Body:
    """Return a body of given proportions; checked legs and layout are as in `generate`."""
    p = proportions
    if layout == "radial":
        mounts = radial_mounts(legs, 0.8 * p.half_length, 0.8 * p.half_width)
        all_legs = tuple(_leg(f"leg{i + 1}", *mount, p.reaches[i], p) for i, mount in enumerate(mounts))
    else:
        mounts = left_mounts(legs // 2, 0.8 * p.half_length, 0.6 * p.half_width, p.fan)
        left = tuple(_leg(f"l{i + 1}", *mount, p.reaches[i], p) for i, mount in enumerate(mounts))
        all_legs = (*left, *(leg.mirrored(leg.name.replace("l", "r")) for leg in left))
    size = (p.half_length, p.half_width, p.thickness * p.height)
    chassis = Solid(name="chassis", shape="ellipsoid", size=size)
    return Body(name=name, torso=Torso(standing_height=p.height, solids=(chassis,)), legs=all_legs)


def mount_shares(legs: int, layout: str) -> np.ndarray:
    """Return how far ahead the legs of `Proportions.reaches` are mounted: from 1, in front, to -1."""
    if layout == "pairs":
        return np.linspace(1.0, -1.0, legs // 2)
    return np.cos(np.radians(_headings(legs)))


def left_mounts(pairs: int, along: float, across: float, fan: float) -> list[tuple[Vector, float]]:
    """Return mounts and headings, degrees, of the legs on the left of a long torso, the first in front.

    Args:
        pairs: number of legs, at least 2.
        along: of the first mount in front of the middle, m.
        across: of the mounts left of it, m.
        fan: degrees by which the first leg points forward and the last one backward.
    """
    shares = [1.0 - 2.0 * i / (pairs - 1) for i in range(pairs)]
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
    return [(start + 360.0 * i / legs + 180.0) % 360.0 - 180.0 for i in range(legs)]


def _leg(name: str, mount: Vector, heading: float, reach: float, p: Proportions) -> Leg:
    """Return a leg that points to a heading (degrees, counter-clockwise from forward) and ends on the floor."""
    links = len(p.profile)
    foot_radius = 0.06 * p.height
    out = reach * p.height / sum(share * _cos(elevation) for share, elevation in p.profile)
    down = (p.height - foot_radius) / -sum(share * _sin(elevation) for share, elevation in p.profile)
    chain = []
    for i, (share, elevation) in enumerate(p.profile):
        # Links lie in the y-z plane of the first link's frame, which the leg's yaw turns outwards.
        end = (0.0, out * share * _cos(elevation), down * share * _sin(elevation))
        joint = (_HIP if i == 0 else _BEND).replace(name=JOINT_NAMES[i])
        radius = 0.8 * foot_radius * (1.0 + 0.35 * (links - 1 - i))  # thinner than the foot, so that the foot touches
        chain.append(Link(name=LINK_NAMES[links][i], end=end, radius=radius, joint=joint))
    return Leg(name=name, mount=mount, links=tuple(chain), foot=Foot(radius=foot_radius), yaw_deg=heading - 90.0)


def _cos(degrees: float) -> float:
    return math.cos(math.radians(degrees))


def _sin(degrees: float) -> float:
    return math.sin(math.radians(degrees))
