"""Gaits as data: stance and swing of each leg.

A gait is a duty factor, the share of a cycle that a foot spends on the ground, and a phase offset
for each leg. A leg of offset p stands while (t + p) mod 1 < duty factor, t being cycles.
"""

from collections.abc import Callable
from typing import NamedTuple

from arc_suite import checks
from arc_suite.robots.spec import Body

TRIPOD = (0.5, 0.0, 0.5, 0.0, 0.5, 0.0)  # offsets of l1 l2 l3 r1 r2 r3, cycles
TROT = (0.0, 0.5, 0.5, 0.0)  # of fl fr rl rr


class Gait(NamedTuple):
    """Stance and swing of each leg.

    Attributes:
        duty_factor: share of a cycle in stance.
        offsets: of the legs, cycles in [0, 1).
    """

    duty_factor: float
    offsets: tuple[float, ...]


def metachronal(body: Body, duty_factor: float) -> Gait:
    """Return the metachronal gait of a body: waves of swinging legs run from the rear to the front.

    Most gaits of animals follow this rule. On each side a leg takes off when the one behind it
    touches down, 1 - duty factor of a cycle later; the two sides are half a cycle apart (Wilson,
    "Insect walking", 1966). Six legs make a tripod gait at 1/2, a tetrapod at 2/3, a ripple at 3/4
    and a wave at 5/6.
    """
    places = [(leg.side, rank) for leg, rank in zip(body.legs, body.ranks, strict=True)]
    rearmost = {side: max(rank for other, rank in places if other == side) for side, _ in places}
    offsets = [(0.5 * (side == "right") - (rearmost[side] - rank) * (1.0 - duty_factor)) % 1.0 for side, rank in places]
    return Gait(duty_factor, tuple(offsets))


def _alternating(body: Body, duty_factor: float) -> Gait:
    """Return the gait in which every leg is half a cycle from its neighbors, in front, behind and across."""
    return _of_groups(body, duty_factor, lambda rank, right: 0.5 * ((rank + right) % 2))


def _of_groups(body: Body, duty_factor: float, offset: Callable[[int, bool], float]) -> Gait:
    pairs = zip(body.legs, body.ranks, strict=True)
    return Gait(duty_factor, tuple(offset(rank, leg.side == "right") for leg, rank in pairs))


def _wave(body: Body) -> Gait:
    longest = max(body.ranks) + 1
    return metachronal(body, 1.0 - 0.5 / longest)


class _Named(NamedTuple):
    fits: Callable[[int, bool], bool]  # number of legs, whether both sides have as many
    make: Callable[[Body], Gait]


# By name. Duty factors are the classical ones, a little above where the legs of two groups would
# swap at the same instant.
_GAITS = {
    "trot": _Named(lambda legs, even: even and legs == 4, lambda body: _alternating(body, 0.6)),
    "pace": _Named(
        lambda legs, even: even and legs == 4, lambda body: _of_groups(body, 0.6, lambda rank, right: 0.5 * right)
    ),
    "bound": _Named(
        lambda legs, even: even and legs == 4, lambda body: _of_groups(body, 0.6, lambda rank, right: 0.5 * (rank % 2))
    ),
    "walk": _Named(lambda legs, even: even and legs == 4, lambda body: metachronal(body, 0.75)),
    "tripod": _Named(lambda legs, even: even and legs >= 6, lambda body: _alternating(body, 0.6)),
    "tetrapod": _Named(lambda legs, even: legs >= 6, lambda body: metachronal(body, 2.0 / 3.0)),
    "ripple": _Named(lambda legs, even: legs >= 5, lambda body: metachronal(body, 0.75)),
    "wave": _Named(lambda legs, even: True, _wave),
}

NAMES = tuple(_GAITS)


def fitting_gaits(body: Body) -> tuple[str, ...]:
    """Return the names of the gaits that fit the legs of a body."""
    sides = [leg.side for leg in body.legs]
    even = sides.count("left") == sides.count("right")
    return tuple(name for name, gait in _GAITS.items() if gait.fits(len(sides), even))


def gait(body: Body, name: str) -> Gait:
    """Return the gait of a body by name.

    Raises:
        ValueError: an unknown gait, or one that does not fit the legs.
    """
    checks.name(name, NAMES, "gait")
    valid = fitting_gaits(body)
    if name not in valid:
        raise ValueError(
            f"gait {name!r} does not fit {body.name} with its {len(body.legs)} legs (fit: {', '.join(valid)})"
        )
    return _GAITS[name].make(body)
