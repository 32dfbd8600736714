"""Draws of bodies of many kinds: what `generator.random_body` varies, and joints, axes, planes of legs and torsos.

A draw may be unsound, with a torso below its feet for instance; `models.families` draws again.
"""

import math
from typing import NamedTuple

import numpy as np

from arc_suite.bodies import generator
from arc_suite.bodies.generator import JOINT_NAMES, LEGS, LINK_NAMES, PROFILES
from arc_suite.robots import bastion, leaper, queen, tick
from arc_suite.robots.spec import Ballast, Body, Foot, Joint, Leg, Link, Solid, Torso, Vector

LINKS = (2, 4)  # fewest and most; a leg of one link cannot lift its foot

ROBOTS = (queen.BODY, bastion.BODY, tick.BODY, leaper.BODY)  # never more, as a seed stands for a body
_FROM_ROBOTS = 0.2  # share of bodies that are mutated robots
_SCALES = (0.25, 4.0)  # of these
_MUTATIONS = (0.05, 0.2)  # never none: unmutated robots test policies, which are blind to size

_SHARED = 0.6  # probability that all pairs of a body have the same joints
_BUILT, _SHELLED = 0.25, 0.15  # shares of bodies with three solids, and with one under a shell


class _Joints(NamedTuple):
    """Joints of a leg, from the torso outwards.

    Attributes:
        ranges: of each joint, degrees.
        signs: of each axis; a negative one turns the other way.
        tilt: of the leg's plane from the vertical, degrees.
        skew: of the axes of bends from the normal of that plane, about the vertical, degrees.
        lean: of the first axis from the vertical, in that plane, degrees.
    """

    ranges: tuple[tuple[float, float], ...]
    signs: tuple[float, ...]
    tilt: float
    skew: float
    lean: float


class _Shape(NamedTuple):
    """Proportions of a leg.

    Attributes:
        height: from the floor to the mount, m.
        foot: its radius, m.
        reach: from mount to foot, seen from above, m.
        profile: of each link, its share of the leg's length and its elevation in degrees.
    """

    height: float
    foot: float
    reach: float
    profile: tuple[tuple[float, float], ...]


def draw_varied_body(random: np.random.Generator) -> Body:
    """Draw a body, `varied`.

    Eight in ten are put together. The others are robots of the suite, mutated by 0.05 to 0.2 and 0.25 to 4 times as
    large. Of those put together:

    - legs, layout, size and proportions are drawn as in `generator.random_body`, with wider bounds;
    - joint ranges differ to both sides, and three in ten bends bend one way only;
    - axes have either sign, and lean from the vertical and from the normal of the leg's plane by up to 25 degrees;
    - planes of legs lean by up to 25 degrees;
    - in four bodies of ten pairs have different joints, and in four of ten different lengths;
    - torsos are ellipsoids and boxes; a quarter have three solids, three in twenty a shell.

    Args:
        random: to draw from.

    Raises:
        SpecError: a length is out of range.
    """
    return _robot(random) if random.uniform() < _FROM_ROBOTS else _made(random)


def _robot(random: np.random.Generator) -> Body:
    robot = ROBOTS[random.integers(len(ROBOTS))]
    body = generator.scaled(robot, math.exp(random.uniform(*np.log(_SCALES))))
    body = generator.mutated(body, int(random.integers(2**32)), random.uniform(*_MUTATIONS))
    return body.replace(name="varied", torso=body.torso.replace(standing_height=None))


def _made(random: np.random.Generator) -> Body:
    legs, links = (int(random.integers(low, high + 1)) for low, high in (LEGS, LINKS))
    layout = "radial" if random.uniform() < 0.3 or legs % 2 else "pairs"
    half_length = math.exp(random.uniform(math.log(0.08), math.log(1.2)))
    height = half_length * random.uniform(0.5, 1.6)
    half_width = half_length * (1.0 if layout == "radial" else random.uniform(0.35, 0.9))
    half_thickness = height * random.uniform(0.12, 0.35)
    foot = height * random.uniform(0.045, 0.08)
    profile = tuple(
        (share * random.uniform(0.75, 1.25), elevation + random.uniform(-12.0, 12.0))
        for share, elevation in PROFILES[links]
    )
    count = legs if layout == "radial" else legs // 2
    reach = height * random.uniform(0.65, 1.2)
    reaches = reach * (random.uniform(0.75, 1.3, count) if random.uniform() < 0.4 else np.ones(count))
    shared, joints = random.uniform() < _SHARED, [_joints(random, links) for _ in range(count)]
    joints = joints[:1] * count if shared else joints
    shapes = [_Shape(height, foot, float(each), profile) for each in reaches]
    fan = random.uniform(10.0, 50.0)
    if layout == "radial":
        places = generator.radial_mounts(legs, 0.8 * half_length, 0.8 * half_width)
        names = [f"leg{i + 1}" for i in range(legs)]
    else:
        places = generator.left_mounts(count, 0.8 * half_length, 0.6 * half_width, fan)
        names = [f"l{i + 1}" for i in range(count)]
    parts = zip(names, places, shapes, joints, strict=True)
    made = tuple(_leg(name, *place, shape, jointed) for name, place, shape, jointed in parts)
    if layout == "pairs":
        made = (*made, *(leg.mirrored(leg.name.replace("l", "r")) for leg in made))
    solids, ballast = _torso(random, np.array((half_length, half_width, half_thickness)))
    return Body(name="varied", torso=Torso(standing_height=height, solids=solids), ballast=ballast, legs=made)


def _joints(random: np.random.Generator, links: int) -> _Joints:
    leans = random.uniform(-25.0, 25.0, 3) * (random.uniform(size=3) < (0.5, 0.3, 0.3))
    ranges = [(-random.uniform(25.0, 60.0), random.uniform(25.0, 60.0))]
    for i in range(links - 1):
        low, high, way = random.uniform(40.0, 110.0), random.uniform(40.0, 110.0), random.uniform()
        # A foot is lifted by the knee, to negative angles about the normal of the leg's plane.
        ranges.append((-low, high * (way >= 0.3)) if i == 0 else (-low * (way >= 0.15), high * (way < 0.85)))
    signs = 1.0 - 2.0 * (random.uniform(size=links) < 0.4)
    return _Joints(tuple(ranges), tuple(map(float, signs)), *map(float, leans))


def _leg(name: str, mount: Vector, heading: float, shape: _Shape, joints: _Joints) -> Leg:
    """Return a leg that points to a heading (degrees, counter-clockwise from forward) and ends on the floor."""
    tilt, skew, lean = map(math.radians, (joints.tilt, joints.skew, joints.lean))
    # The leg's frame looks outwards along y; `up` and the normal of the leg's plane lean with the plane.
    up = np.array((math.sin(tilt), 0.0, math.cos(tilt)))
    normal = np.array((-math.cos(tilt) * math.cos(skew), math.sin(skew), math.sin(tilt) * math.cos(skew)))
    first = math.cos(lean) * np.array((0.0, 0.0, 1.0)) + math.sin(lean) * np.array((0.0, 1.0, 0.0))
    outs = np.array([share * math.cos(math.radians(elevation)) for share, elevation in shape.profile])
    rises = np.array([share * math.sin(math.radians(elevation)) for share, elevation in shape.profile])
    outs *= shape.reach / outs.sum()
    rises *= (shape.height - shape.foot) / -rises.sum() / up[2]
    chain, links = [], len(shape.profile)
    for i, (out, rise) in enumerate(zip(outs, rises, strict=True)):
        low, high = joints.ranges[i] if joints.signs[i] > 0.0 else (-joints.ranges[i][1], -joints.ranges[i][0])
        axis = joints.signs[i] * (normal if i else first)
        joint = Joint(name=JOINT_NAMES[i], axis=_vector(axis), range_deg=(low, high))
        end = _vector((0.0, out, 0.0) + rise * up)
        radius = 0.8 * shape.foot * (1.0 + 0.35 * (links - 1 - i))
        chain.append(Link(name=LINK_NAMES[links][i], end=end, radius=radius, joint=joint))
    return Leg(name=name, mount=mount, links=tuple(chain), foot=Foot(radius=shape.foot), yaw_deg=heading - 90.0)


def _torso(random: np.random.Generator, half: np.ndarray) -> tuple[tuple[Solid, ...], tuple[Ballast, ...]]:
    """Draw the solids and the shell of a torso of half-extents (3,), m."""
    kind, box, lifted = random.uniform(), random.uniform() < 0.4, random.uniform(0.0, 0.8)
    front, rear = random.uniform(0.3, 0.7, 2)
    shell, weight = random.uniform(0.8, 1.3, 3), random.uniform(0.2, 1.0)
    shape = "box" if box else "ellipsoid"
    size = half * (0.8 if box else 1.0)  # corners of a box lie farther out
    solids = [Solid(name="chassis", shape=shape, size=tuple(map(float, size)))]
    if kind < _BUILT:
        for name, share, along in (("head", front, 1.0), ("tail", rear, -1.0)):
            position = along * (1.0 + 0.4 * share) * half * (1.0, 0.0, 0.0) + lifted * half * (0.0, 0.0, 1.0)
            solids.append(Solid(name=name, position=_vector(position), shape="ellipsoid", size=_vector(share * half)))
    if kind < 1.0 - _SHELLED:
        return tuple(solids), ()
    extents = half * shell
    # As heavy as a share of the chassis, were it solid at the density of a body.
    mass = weight * Body.density * 4.0 / 3.0 * math.pi * float(np.prod(half))
    position = (0.0, 0.0, float(lifted * half[2]))
    ballast = Ballast(name="shell", mass=mass, shape="ellipsoid", size=_vector(extents), position=position)
    return tuple(solids), (ballast,)


def _vector(values: np.ndarray) -> Vector:
    x, y, z = map(float, values)
    return x, y, z
