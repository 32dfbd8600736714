"""Draws of bodies of many kinds: what `generator.random_body` varies, and joints, axes, planes of legs and torsos.

A draw may be unsound, with a torso below its feet for instance; `models.families` draws again.
"""

import math
from typing import NamedTuple

import numpy as np

from arc_suite.bodies import generator
from arc_suite.bodies.generator import JOINT_NAMES, LEG_RANGE, LINK_NAMES, PROFILES
from arc_suite.robots import bastion, leaper, queen, tick
from arc_suite.robots.spec import Ballast, Body, Foot, Joint, Leg, Link, Solid, Torso, Vector

LINK_RANGE = (2, 4)  # fewest and most; a leg of one link cannot lift its foot

ROBOTS = (queen.BODY, bastion.BODY, tick.BODY, leaper.BODY)  # never more, as a seed stands for a body
_ROBOT_SHARE = 0.2  # of bodies, that are mutated robots
_ROBOT_SCALES = (0.25, 4.0)
_MUTATIONS = (0.05, 0.2)  # never none: unmutated robots test policies, which are blind to size

# Shares of generated bodies.
_RADIAL_SHARE = 0.3
_UNEQUAL_SHARE = 0.4  # with pairs of different lengths
_SAME_JOINTS_SHARE = 0.6  # with the same joints in all pairs
_THREE_SOLIDS_SHARE = 0.25
_SHELL_SHARE = 0.15

_MAX_LEAN = 25.0  # degrees
_LEAN_SHARES = (0.5, 0.3, 0.3)  # of joints whose plane is tilted, whose axes are skewed, whose first axis leans
_NEGATIVE_AXIS_SHARE = 0.4
_LINK_THICKNESS = 0.8  # in foot radii, of the last link
_LINK_THICKENING = 0.35  # share of it, for each link nearer to the torso


class _Joints(NamedTuple):
    """Joints of a leg, from the torso outwards.

    Attributes:
        ranges: ranges of each joint, degrees.
        signs: signs of each axis; a negative one turns the other way.
        tilt: tilt of the leg's plane from the vertical, degrees.
        skew: skew of the axes of bends from the normal of that plane, about the vertical, degrees.
        lean: lean of the first axis from the vertical, in that plane, degrees.
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
        foot: radius of the foot, m.
        reach: from mount to foot, seen from above, m.
        profile: of each link its share of the leg's length and its elevation in degrees.
    """

    height: float
    foot: float
    reach: float
    profile: tuple[tuple[float, float], ...]


def draw_varied_body(random: np.random.Generator) -> Body:
    """Draw a body, `varied`.

    Two in ten are robots of the suite, mutated by 0.05 to 0.2 and 0.25 to 4 times as large. The others are new:

    - legs, layout, size and proportions are drawn as in `generator.random_body`, with wider bounds;
    - joint ranges differ to both sides, and three in ten bends bend one way only;
    - axes have either sign, and lean from the vertical and from the normal of the leg's plane by up to 25 degrees;
    - planes of legs lean by up to 25 degrees;
    - in four bodies of ten pairs have different joints, and in four of ten different lengths;
    - torsos are ellipsoids and boxes; a quarter have three solids, three in twenty a shell.

    Args:
        random: generator of random numbers.

    Raises:
        SpecError: a length is out of range.
    """
    if random.uniform() < _ROBOT_SHARE:
        return _draw_robot(random)
    return _draw_new_body(random)


def _draw_robot(random: np.random.Generator) -> Body:
    """Draw a mutated robot of the suite, of another size."""
    robot = ROBOTS[random.integers(len(ROBOTS))]
    scale = math.exp(random.uniform(*np.log(_ROBOT_SCALES)))
    scaled_robot = generator.scaled(robot, scale)
    seed = int(random.integers(2**32))
    body = generator.mutated(scaled_robot, seed, random.uniform(*_MUTATIONS))
    return body.replace(name="varied", torso=body.torso.replace(standing_height=None))


def _draw_new_body(random: np.random.Generator) -> Body:
    """Draw a body of new proportions. The order of the draws stands for a seed's body: it must stay."""
    leg_count = int(random.integers(LEG_RANGE[0], LEG_RANGE[1] + 1))
    link_count = int(random.integers(LINK_RANGE[0], LINK_RANGE[1] + 1))
    is_radial = random.uniform() < _RADIAL_SHARE or leg_count % 2 == 1
    half_length = math.exp(random.uniform(math.log(0.08), math.log(1.2)))
    height = half_length * random.uniform(0.5, 1.6)
    half_width = half_length * (1.0 if is_radial else random.uniform(0.35, 0.9))
    half_thickness = height * random.uniform(0.12, 0.35)
    foot_radius = height * random.uniform(0.045, 0.08)
    profile = tuple(
        (share * random.uniform(0.75, 1.25), elevation + random.uniform(-12.0, 12.0))
        for share, elevation in PROFILES[link_count]
    )
    drawn_count = leg_count if is_radial else leg_count // 2  # legs, or left legs
    reach = height * random.uniform(0.65, 1.2)
    has_unequal_legs = random.uniform() < _UNEQUAL_SHARE
    reach_factors = random.uniform(0.75, 1.3, drawn_count) if has_unequal_legs else np.ones(drawn_count)
    has_same_joints = random.uniform() < _SAME_JOINTS_SHARE
    joints = [_draw_joints(random, link_count) for _ in range(drawn_count)]
    if has_same_joints:
        joints = joints[:1] * drawn_count
    shapes = [_Shape(height, foot_radius, float(leg_reach), profile) for leg_reach in reach * reach_factors]
    fan = random.uniform(10.0, 50.0)  # degrees

    if is_radial:
        mounts = generator.radial_mounts(leg_count, 0.8 * half_length, 0.8 * half_width)
        names = [f"leg{number}" for number in range(1, leg_count + 1)]
    else:
        mounts = generator.left_mounts(drawn_count, 0.8 * half_length, 0.6 * half_width, fan)
        names = [f"l{number}" for number in range(1, drawn_count + 1)]
    legs = []
    for name, (mount, heading), shape, leg_joints in zip(names, mounts, shapes, joints, strict=True):
        legs.append(_make_leg(name, mount, heading, shape, leg_joints))
    if not is_radial:
        legs += [leg.mirrored(leg.name.replace("l", "r")) for leg in legs]
    solids, ballast = _draw_torso(random, np.array((half_length, half_width, half_thickness)))
    torso = Torso(standing_height=height, solids=solids)
    return Body(name="varied", torso=torso, ballast=ballast, legs=tuple(legs))


def _draw_joints(random: np.random.Generator, link_count: int) -> _Joints:
    """Draw the joints of a leg."""
    leans = random.uniform(-_MAX_LEAN, _MAX_LEAN, 3)
    has_lean = random.uniform(size=3) < _LEAN_SHARES
    tilt, skew, lean = map(float, leans * has_lean)
    ranges = [(-random.uniform(25.0, 60.0), random.uniform(25.0, 60.0))]  # degrees
    for bend in range(link_count - 1):
        low = random.uniform(40.0, 110.0)
        high = random.uniform(40.0, 110.0)
        direction = random.uniform()
        # The knee lifts a foot by negative angles about the normal of the leg's plane, so that it keeps these.
        is_knee = bend == 0
        bends_negative = is_knee or direction >= 0.15
        bends_positive = direction >= 0.3 if is_knee else direction < 0.85
        ranges.append((-low if bends_negative else -0.0, high if bends_positive else 0.0))
    is_negative = random.uniform(size=link_count) < _NEGATIVE_AXIS_SHARE
    signs = np.where(is_negative, -1.0, 1.0)
    return _Joints(tuple(ranges), tuple(map(float, signs)), tilt, skew, lean)


def _make_leg(name: str, mount: Vector, heading: float, shape: _Shape, joints: _Joints) -> Leg:
    """Return a leg that points to a heading (degrees, counter-clockwise from forward) and ends on the floor."""
    tilt, skew, lean = map(math.radians, (joints.tilt, joints.skew, joints.lean))
    # The leg's frame looks outwards along y; `up` and the normal of the leg's plane lean with the plane.
    up = np.array((math.sin(tilt), 0.0, math.cos(tilt)))
    normal = np.array((-math.cos(tilt) * math.cos(skew), math.sin(skew), math.sin(tilt) * math.cos(skew)))
    first_axis = math.cos(lean) * np.array((0.0, 0.0, 1.0)) + math.sin(lean) * np.array((0.0, 1.0, 0.0))
    # Ends of links in the leg's plane, scaled so that the leg reaches out and down as far as its shape says.
    outs = np.array([share * math.cos(math.radians(elevation)) for share, elevation in shape.profile])
    rises = np.array([share * math.sin(math.radians(elevation)) for share, elevation in shape.profile])
    outs *= shape.reach / outs.sum()
    rises *= (shape.height - shape.foot) / -rises.sum() / up[2]

    link_count = len(shape.profile)
    links = []
    for index in range(link_count):
        sign = joints.signs[index]
        low, high = joints.ranges[index]
        range_deg = (-high, -low) if sign < 0.0 else (low, high)  # of the signed axis
        axis = first_axis if index == 0 else normal
        joint = Joint(name=JOINT_NAMES[index], axis=_to_vector(sign * axis), range_deg=range_deg)
        end = _to_vector((0.0, outs[index], 0.0) + rises[index] * up)
        links_after = link_count - 1 - index
        radius = _LINK_THICKNESS * shape.foot * (1.0 + _LINK_THICKENING * links_after)
        links.append(Link(name=LINK_NAMES[link_count][index], end=end, radius=radius, joint=joint))
    return Leg(name=name, mount=mount, links=tuple(links), foot=Foot(radius=shape.foot), yaw_deg=heading - 90.0)


def _draw_torso(random: np.random.Generator, half: np.ndarray) -> tuple[tuple[Solid, ...], tuple[Ballast, ...]]:
    """Draw the solids and the shell of a torso of half-extents (3,), m. All draws are made for every kind."""
    kind = random.uniform()
    is_box = random.uniform() < 0.4
    elevation = random.uniform(0.0, 0.8)  # of head, tail and shell, in half-thicknesses
    head_share, tail_share = random.uniform(0.3, 0.7, 2)  # sizes, in those of the chassis
    shell_shares = random.uniform(0.8, 1.3, 3)
    shell_weight = random.uniform(0.2, 1.0)
    size = half * (0.8 if is_box else 1.0)  # corners of a box lie farther out
    shape = "box" if is_box else "ellipsoid"
    solids = [Solid(name="chassis", shape=shape, size=tuple(map(float, size)))]
    if kind < _THREE_SOLIDS_SHARE:
        for name, share, side in (("head", head_share, 1.0), ("tail", tail_share, -1.0)):
            ahead = side * (1.0 + 0.4 * share) * half * (1.0, 0.0, 0.0)
            above = elevation * half * (0.0, 0.0, 1.0)
            position = _to_vector(ahead + above)
            solids.append(Solid(name=name, position=position, shape="ellipsoid", size=_to_vector(share * half)))
    if kind < 1.0 - _SHELL_SHARE:
        return tuple(solids), ()
    # As heavy as a share of a solid chassis of the density of bodies.
    mass = shell_weight * Body.density * 4.0 / 3.0 * math.pi * float(np.prod(half))
    position = (0.0, 0.0, float(elevation * half[2]))
    extents = _to_vector(half * shell_shares)
    ballast = Ballast(name="shell", mass=mass, shape="ellipsoid", size=extents, position=position)
    return tuple(solids), (ballast,)


def _to_vector(values: np.ndarray) -> Vector:
    x, y, z = map(float, values)
    return x, y, z
