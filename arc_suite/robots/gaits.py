"""Gaits as data: stance and swing of each leg.

A gait is a duty factor, the share of a cycle that a foot spends on the ground, and a phase offset
for each leg. A leg with phase offset p is in stance while (t + p) mod 1 < duty factor, with the time t in cycles.
"""

import itertools
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import checks
from arc_suite.robots.spec import Body

# Phase offsets, cycles.
TRIPOD = (0.5, 0.0, 0.5, 0.0, 0.5, 0.0)  # of the legs l1 l2 l3 r1 r2 r3
TROT = (0.0, 0.5, 0.5, 0.0)  # of the legs fl fr rl rr


class Gait(NamedTuple):
    """Stance and swing of each leg.

    Attributes:
        duty_factor: share of a cycle in stance.
        offsets: phase offsets of the legs, cycles in [0, 1).
    """

    duty_factor: float
    offsets: tuple[float, ...]


class Pace(NamedTuple):
    """How a body goes at a speed, compared with its walk: faster means quicker and higher steps, shorter stances.

    Attributes:
        speed: multiple of the speed.
        tempo: multiple of the frequency of the gait.
        duty_change: added to the duty factor.
        height: multiple of the height of feet in mid-swing.
    """

    speed: float
    tempo: float
    duty_change: float
    height: float


PACES = {
    "slow": Pace(0.6, 0.82, 0.05, 0.85),
    "fast": Pace(1.25, 1.15, -0.05, 1.1),
    "run": Pace(1.75, 1.35, -0.1, 1.3),
}
_WALK = Pace(1.0, 1.0, 0.0, 1.0)
PACES_BY_SPEED = (PACES["slow"], _WALK, PACES["fast"], PACES["run"])


def pace_at(speed: float) -> Pace:
    """Return the pace at a multiple of the walk's speed, between those of the table; beyond its ends their gaits."""
    speeds, *gaits = np.transpose(PACES_BY_SPEED)
    return Pace(speed, *(float(np.interp(speed, speeds, numbers)) for numbers in gaits))


def pace_under_command(command: Sequence[float] | np.ndarray) -> Pace:
    """Return the pace under a command, which counts ahead and in curves; other ways have the walk's.

    Args:
        command: forward, left and turning, in units of the body.
    """
    forward, left, turn = command
    if forward <= 0.0:
        return _WALK
    return pace_at(float(_speed_under(forward, left, turn)))


def _speed_under(forward, left, turn):
    """Return the multiple of the walk's speed that a command ahead asks for; steps aside and turns add to it."""
    return forward + abs(left) + abs(turn)


def lifts_under_commands(commands):
    """Return the heights (...) of paces under commands (..., 3); see `pace_under_command`."""
    xp = commands.__array_namespace__()
    speeds = _speed_under(commands[..., 0], commands[..., 1], commands[..., 2])
    heights = xp.zeros_like(speeds) + PACES_BY_SPEED[0].height
    for slower, faster in itertools.pairwise(PACES_BY_SPEED):
        share = ((speeds - slower.speed) / (faster.speed - slower.speed)).clip(0.0, 1.0)
        heights = heights + share * (faster.height - slower.height)
    return xp.where(commands[..., 0] > 0.0, heights, _WALK.height)


def gait(body: Body, name: str) -> Gait:
    """Return the gait of a body by name.

    Raises:
        ValueError: an unknown gait, or one that does not fit the legs.
    """
    checks.name(name, NAMES, "gait")
    valid_names = fitting_gaits(body)
    if name not in valid_names:
        raise ValueError(
            f"gait {name!r} does not fit {body.name} with its {len(body.legs)} legs (fit: {', '.join(valid_names)})"
        )
    return _GAIT_KINDS[name].make(body)


def fitting_gaits(body: Body) -> tuple[str, ...]:
    """Return the names of the gaits that fit the legs of a body."""
    sides = [leg.side for leg in body.legs]
    has_equal_sides = sides.count("left") == sides.count("right")
    return tuple(name for name, kind in _GAIT_KINDS.items() if kind.fits(len(sides), has_equal_sides))


def metachronal(body: Body, duty_factor: float) -> Gait:
    """Return the metachronal gait of a body: waves of swinging legs run from the rear to the front.

    Most gaits of animals follow this rule. On each side a leg takes off when the one behind it
    touches down, 1 - duty factor of a cycle later; the two sides are half a cycle apart (Wilson,
    "Insect walking", 1966). Six legs make a tripod gait at 1/2, a tetrapod at 2/3, a ripple at 3/4
    and a wave at 5/6.
    """
    rear_ranks = {}  # rank of the rearmost leg, by side
    for leg, rank in zip(body.legs, body.ranks, strict=True):
        rear_ranks[leg.side] = max(rank, rear_ranks.get(leg.side, 0))

    offsets = []
    for leg, rank in zip(body.legs, body.ranks, strict=True):
        side_offset = 0.5 if leg.side == "right" else 0.0
        legs_behind = rear_ranks[leg.side] - rank
        offsets.append((side_offset - legs_behind * (1.0 - duty_factor)) % 1.0)
    return Gait(duty_factor, tuple(offsets))


def _wave(body: Body) -> Gait:
    """Return the metachronal gait in which the legs of a side swing one after the other."""
    legs_of_longer_side = max(body.ranks) + 1
    return metachronal(body, 1.0 - 0.5 / legs_of_longer_side)


def _alternating(body: Body, duty_factor: float) -> Gait:
    """Return the gait in which every leg is half a cycle from its neighbors in front, behind and across."""
    return _in_two_groups(body, duty_factor, lambda rank, is_right: (rank % 2 == 1) != is_right)


def _in_two_groups(body: Body, duty_factor: float, is_late: Callable[[int, bool], bool]) -> Gait:
    """Return the gait of two groups of legs that are half a cycle apart.

    Args:
        body: any body.
        duty_factor: share of a cycle in stance.
        is_late: whether a leg belongs to the second group, given its rank (0 in front) and whether it is a right leg.
    """
    offsets = []
    for leg, rank in zip(body.legs, body.ranks, strict=True):
        offsets.append(0.5 if is_late(rank, leg.side == "right") else 0.0)
    return Gait(duty_factor, tuple(offsets))


class _GaitKind(NamedTuple):
    """A gait with a name.

    Attributes:
        fits: whether a body can have the gait, given its number of legs and whether both sides have equally many.
        make: function from a body to its gait.
    """

    fits: Callable[[int, bool], bool]
    make: Callable[[Body], Gait]


def _is_quadruped(legs: int, has_equal_sides: bool) -> bool:
    return has_equal_sides and legs == 4


# By name. Duty factors are the classical ones. Where two groups of legs alternate, they are a little above 1/2, so that
# the groups do not swap at the same instant.
_GAIT_KINDS = {
    "trot": _GaitKind(_is_quadruped, lambda body: _alternating(body, 0.6)),
    "pace": _GaitKind(_is_quadruped, lambda body: _in_two_groups(body, 0.6, lambda rank, is_right: is_right)),
    "bound": _GaitKind(_is_quadruped, lambda body: _in_two_groups(body, 0.6, lambda rank, is_right: rank % 2 == 1)),
    "walk": _GaitKind(_is_quadruped, lambda body: metachronal(body, 0.75)),
    "tripod": _GaitKind(lambda legs, equal_sides: equal_sides and legs >= 6, lambda body: _alternating(body, 0.6)),
    "tetrapod": _GaitKind(lambda legs, equal_sides: legs >= 6, lambda body: metachronal(body, 2.0 / 3.0)),
    "ripple": _GaitKind(lambda legs, equal_sides: legs >= 5, lambda body: metachronal(body, 0.75)),
    "wave": _GaitKind(lambda legs, equal_sides: True, _wave),
}

NAMES = tuple(_GAIT_KINDS)
