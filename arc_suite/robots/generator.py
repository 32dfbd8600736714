"""Bodies made to order: a number of legs, a number of links, and sensible defaults for everything else."""

import math

from arc_suite.spec import Body, Foot, Joint, Leg, Link, Motor, Solid, SpecError, Torso, TrackingCamera, Vector

LEGS = (4, 12)  # fewest and most
LINKS = (1, 4)

# A leg in its vertical plane, by number of links: of each, its share of the leg's length and its
# elevation above the horizontal in degrees. The first link sweeps, the others bend.
_PROFILES = {
    1: ((1.0, -50.0),),
    2: ((0.4, -10.0), (0.6, -75.0)),
    3: ((0.25, 10.0), (0.35, -30.0), (0.4, -80.0)),
    4: ((0.2, 10.0), (0.25, 15.0), (0.25, -35.0), (0.3, -80.0)),
}
_LINK_NAMES = {
    1: ("upper",),
    2: ("upper", "lower"),
    3: ("upper", "middle", "lower"),
    4: ("upper", "middle", "lower", "toe"),
}
_JOINT_NAMES = ("hip", "knee", "ankle", "toe")

_DENSITY = 10.0  # kg/m^3, Queen's; so are the joints and motors
_HIP = Joint(
    name="hip", axis=(0.0, 0.0, 1.0), range_deg=(-40.0, 40.0), armature=1.0, damping=1.0, motor=Motor(gear=120.0)
)
_BEND = _HIP.replace(name="knee", axis=(-1.0, 0.0, 0.0), range_deg=(-80.0, 80.0), armature=2.0, damping=10.0)

_DROP = 0.4  # m, from the mounts to the floor
_SPACING = 0.2  # m, between neighbouring legs of a side
_FAN = 35.0  # degrees, by which the first pair of legs points forward and the last one backward


def generate(legs: int, links: int) -> Body:
    """A body with so many legs of so many links.

    An even number of legs stands in mirrored pairs, l1 r1 being the first, along a long torso; an
    odd number stands around a round torso, leg1 pointing forward and the others counting counter-clockwise.
    All feet touch the floor with all joints at zero.

    Args:
        legs: 4 to 12.
        links: actuated links of each leg, 1 to 4.

    Returns:
        The body, `walker_<legs>x<links>`.

    Raises:
        SpecError: a number out of range; one line that names it.
    """
    _check_count("legs", legs, LEGS)
    _check_count("links", links, LINKS)
    if legs % 2:
        half_length = half_width = _SPACING * legs / (2.0 * math.pi)
        all_legs = _around(legs, links, half_length)
    else:
        half_length, half_width = _SPACING * legs / 4.0, 0.15
        left = _left_side(legs // 2, links, half_length, half_width)
        all_legs = (*left, *(leg.mirrored(leg.name.replace("l", "r")) for leg in left))
    reach = max(math.hypot(*leg.foot_position[:2]) for leg in all_legs)
    return Body(
        name=f"walker_{legs}x{links}",
        density=_DENSITY,
        torso=Torso(
            standing_height=_DROP,
            solids=(Solid(name="chassis", shape="ellipsoid", size=(half_length, half_width, 0.25 * _DROP)),),
        ),
        legs=all_legs,
        camera=TrackingCamera(position=(0.0, -4.0 * reach, 1.6 * reach)),
    )


def _check_count(name: str, value, bounds: tuple[int, int]) -> None:
    low, high = bounds
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise SpecError(f"{name}: expected a whole number from {low} to {high}, got {value!r}")


def _left_side(pairs: int, links: int, half_length: float, half_width: float) -> tuple[Leg, ...]:
    legs = []
    for i in range(pairs):
        along = 1.0 - 2.0 * i / (pairs - 1)  # 1 for the first leg, -1 for the last one
        mount = (0.8 * half_length * along, 0.6 * half_width, 0.0)
        legs.append(_leg(f"l{i + 1}", mount, 90.0 - _FAN * along, links))
    return tuple(legs)


def _around(legs: int, links: int, radius: float) -> tuple[Leg, ...]:
    headings = [(360.0 * i / legs + 180.0) % 360.0 - 180.0 for i in range(legs)]
    return tuple(
        _leg(f"leg{i + 1}", (0.8 * radius * _cos(heading), 0.8 * radius * _sin(heading), 0.0), heading, links)
        for i, heading in enumerate(headings)
    )


def _leg(name: str, mount: Vector, heading: float, links: int) -> Leg:
    """A leg that points to a heading (degrees, counter-clockwise from forward) and reaches the floor."""
    profile = _PROFILES[links]
    foot_radius = 0.06 * _DROP
    length = (_DROP - foot_radius) / -sum(share * _sin(elevation) for share, elevation in profile)
    chain = []
    for i, (share, elevation) in enumerate(profile):
        # Links lie in the y-z plane of the first link's frame, which the leg's yaw turns outwards.
        end = (0.0, share * length * _cos(elevation), share * length * _sin(elevation))
        joint = (_HIP if i == 0 else _BEND).replace(name=_JOINT_NAMES[i])
        radius = 0.8 * foot_radius * (1.0 + 0.35 * (links - 1 - i))  # thinner than the foot, so that the foot touches
        chain.append(Link(name=_LINK_NAMES[links][i], end=end, radius=radius, joint=joint))
    return Leg(name=name, mount=mount, links=tuple(chain), foot=Foot(radius=foot_radius), yaw_deg=heading - 90.0)


def _cos(degrees: float) -> float:
    return math.cos(math.radians(degrees))


def _sin(degrees: float) -> float:
    return math.sin(math.radians(degrees))
