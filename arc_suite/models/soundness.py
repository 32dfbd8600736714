"""Flaws that keep a body from standing or walking, found in poses without simulation."""

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from arc_suite.models import sizing, stride
from arc_suite.models.outline import torso_box
from arc_suite.models.overlap import overlaps
from arc_suite.models.standing import PoseMechanics, by_leg, measure_standing
from arc_suite.robots.spec import Body, Leg, Link

# Shares of the standing height.
_GAP = 0.12  # of feet from the floor; feet of published robots hang by up to 0.25 and sink by up to 0.07
_HOPELESS_GAP = 0.6  # beyond which the torso settles outside of the healthy range of a walk
_LEAST_STRIDE = 0.03  # that the most able foot sweeps or is lifted, within a demonstrator's bounds
_HOPELESS_OVERHANG = 0.05  # of the center of mass beyond the feet

_LEAST_TILT = 0.15  # margin of stability as a share of the height of the center of mass; generated bodies have 0.7 to 2
_LARGEST_TURN = 0.5  # rad, of a joint

# A body walks about as fast, of the target speed, as its motors give of this many times the loads of a stride: medians
# of 16 `varied` bodies with 1, 2, 3, 4, 6 and 10 times the loads are 0.14, 0.25, 0.46, 0.61, 0.82 and 1.09. Over 161
# bodies with random motors the mean error is 0.21; 118 are called weak, and 76 % of these stay below 0.7 as they walk.
_BRISK = 7.0

_LEAST_LEGS = 3

_SPREADS = (1.1, 1.2, 1.3, 1.4, 1.5, 1.75, 2.0)  # of the legs' mounts, tried against overlaps


class Flaw(NamedTuple):
    """A reason why a body cannot stand or walk.

    Attributes:
        text: what is wrong, and a value that fits.
        hopeless: whether no body can walk with it.
        cure: the body with the value that fits; None where the text names none.
    """

    text: str
    hopeless: bool
    cure: Body | None = None


def flaws(body: Body) -> list[Flaw]:
    """Return the flaws of a body, none for one that should walk."""
    pose = measure_standing(body)
    return [flaw for check in (_height, _legs, _support, _motors, _joints, _parts) for flaw in check(body, pose)]


def hopeless_flaws(body: Body) -> list[Flaw]:
    """Return the flaws of a body with which none can walk; quicker than `flaws`, as neither motors nor overlaps are."""
    pose = measure_standing(body)
    found = [flaw for check in (_height, _support, _joints) for flaw in check(body, pose)]
    return [flaw for flaw in found if flaw.hopeless]


def _height(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find feet above or below the floor, and parts of the torso below the feet."""
    height, soles = pose.height, pose.soles[:, 2]
    gap = float(height + soles.min())
    fitting = float(f"{-soles.min():.3g}")
    fits = f"standing_height {fitting:.3g} fits"
    if abs(gap) > _GAP * height:
        where = "hang {:.3g} m above the floor" if gap > 0.0 else "stand {:.3g} m in the floor"
        cure = body.replace(torso=body.torso.replace(standing_height=fitting)) if fitting > 0.0 else None
        yield Flaw(f"feet {where.format(abs(gap))}: {fits}", abs(gap) > _HOPELESS_GAP * height, cure)
    short = [leg.name for leg, sole in zip(body.legs, soles, strict=True) if sole - soles.min() > _GAP * height]
    if short:
        missing = max(soles) - min(soles)
        names = ", ".join(short[:4]) + ", ..." * (len(short) > 4)
        text = f"feet of {names} end up to {missing:.3g} m above the lowest foot: legs longer by that fit"
        yield Flaw(text, False, _lengthened(body, soles - soles.min()))
    deeper = float(soles.min() - torso_box(body)[0][2])
    if deeper > 0.0:
        text = f"the torso reaches {deeper:.3g} m lower than the feet: legs longer by more than that fit"
        yield Flaw(text, deeper > _GAP * height)


def _support(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find a center of mass outside the polygon of the feet, or too near its edge."""
    if len(body.legs) < 3:
        yield Flaw(f"{len(body.legs)} feet span no area to stand on: 3 or more legs fit", False)
        return
    above = pose.center[2] - pose.soles[:, 2].min()
    if pose.margin < 0.0:
        outside = f"the center of mass lies {-pose.margin:.3g} m outside of the feet"
        sides = {leg.side for leg in body.legs}
        if len(sides) == 1:
            other, cure = "right" if sides == {"left"} else "left", None
            text = f"{outside}, all on the {sides.pop()}: legs mirrored to the {other} fit"
        else:
            middle = (pose.soles.min(axis=0) + pose.soles.max(axis=0)) / 2.0
            # Legs take the center of mass along with them.
            x, y, _ = (pose.center - middle) / (1.0 - _mass_of_legs(body) / pose.mass)
            text, cure = f"{outside}: legs {_displacement(x, y)} fit", _moved(body, [(x, y)] * len(body.legs))
        yield Flaw(text, pose.margin < -_HOPELESS_OVERHANG * pose.height, cure)
    elif pose.margin < _LEAST_TILT * above:
        tilt, missing = np.degrees(np.arctan2(pose.margin, above)), 1.05 * (_LEAST_TILT * above - pose.margin)
        tower = f"a tower that tips over when tilted by {tilt:.2g} degrees"
        outwards = missing * np.sign(pose.soles - pose.center)[:, :2]
        yield Flaw(f"{tower}: feet {missing:.2g} m further out all around fit", False, _moved(body, outwards))


def _mass_of_legs(body: Body) -> float:
    """Return the mass of all legs, kg: capsules and spheres."""
    volume = 0.0
    for leg in body.legs:
        balls = sum(part.radius**3 for part in leg.parts)
        rods = sum(link.radius**2 * math.hypot(*link.end) for link in leg.links)
        volume += math.pi * (4.0 / 3.0 * balls + rods)
    return body.density * volume


def _displacement(x: float, y: float) -> str:
    """Return in words a displacement on the floor, m."""
    parts = ((x, "forward", "backward"), (y, "to the left", "to the right"))
    return " and ".join(f"{abs(way):.2g} m {high if way > 0.0 else low}" for way, high, low in parts if abs(way) > 1e-6)


def _motors(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find motors too weak to hold the standing pose where no joint limit holds it, or too weak for a stride."""
    joints = body.joints
    given = np.array([joint.torque or np.inf for joint in joints])
    if np.isinf(given).all():
        return
    low, high = np.transpose([joint.range_deg for joint in joints])
    held = np.where(np.where(pose.loads > 0.0, low, high) == 0.0, 0.0, abs(pose.loads))
    if (given < held).any():
        yield _short(body, given, held, "hold the body up")
        return
    if body.source:  # whose servos walk with less: the share below was measured on torques
        return
    loads = _BRISK * sizing.sizing_loads(body)
    if (reached := _reached(body, (given / loads).clip(max=1.0))) < stride.MIN_SPEED_SHARE:
        slow = f"weak: reaches about {reached:.1f} of the target speed, as "
        yield _short(body, given, loads, "a brisk stride takes", slow)


def _legs(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find too few legs for any demonstrator."""
    if len(body.legs) < _LEAST_LEGS:
        yield Flaw(f"no demonstrator keeps its balance on {len(body.legs)} legs: 3 and more walk", False)


def _short(body: Body, given: np.ndarray, needed: np.ndarray, purpose: str, effect: str = "") -> Flaw:
    """Return the flaw of motors that give less than what is needed, (joints,) N m."""
    weak, worst = int((given < needed).sum()), int((needed / given).argmax())
    lacks = f"{needed[worst] - given[worst]:.3g} of the {needed[worst]:.3g} N m that {purpose}"
    others = f", as do those of {weak - 1} more joints" * (weak > 1)
    if body.source:
        return Flaw(f"{effect}the servo of {body.joint_names[worst]} lacks {lacks}{others}", False)
    cure = _unpowered(body, given < needed)
    fits = sizing.size_body(cure).joints[worst].motor.gear
    return Flaw(
        f"{effect}the motor of {body.joint_names[worst]} lacks {lacks}{others}: gear {fits:.3g} fits", False, cure
    )


def _reached(body: Body, shares: np.ndarray) -> float:
    """Return about which share of the target speed a body reaches whose motors give shares (joints,) of what it takes.

    In each leg the joint that bears most and the one that sweeps most decide; the others hardly matter.
    """
    moves = stride.strokes(body, stride.half_stroke(body, stride.fitted_gait(body)))
    legs = zip(by_leg(body, shares), by_leg(body, stride.stride_loads(body)), moves, strict=True)
    return float(np.mean([own[[borne.argmax(), abs(sweep).argmax()]].min() for own, borne, (sweep, _) in legs]))


def _unpowered(body: Body, joints: np.ndarray) -> Body:
    """Return the body with the motors of some of its joints, (joints,) booleans, left to be sized."""
    chosen = iter(joints)

    def unpowered(link: Link) -> Link:
        return link.replace(joint=link.joint.replace(motor=None)) if link.joint and next(chosen) else link

    return body.replace(legs=tuple(leg.replace(links=tuple(map(unpowered, leg.links))) for leg in body.legs))


def _moved(body: Body, displacements: Iterable) -> Body:
    """Return the body with its legs moved on the torso by displacements (legs, 2), m."""
    legs = (
        leg.replace(mount=(leg.mount[0] + float(x), leg.mount[1] + float(y), leg.mount[2]))
        for leg, (x, y) in zip(body.legs, displacements, strict=True)
    )
    return body.replace(legs=tuple(legs))


def _lengthened(body: Body, missing: np.ndarray) -> Body:
    """Return the body with the feet lower by (legs,) m: the last link of each leg reaches further down."""
    legs = []
    for leg, length in zip(body.legs, missing, strict=True):
        *others, last = leg.links
        x, y, z = last.end
        legs.append(leg.replace(links=(*others, last.replace(end=(x, y, z - float(length))))))
    return body.replace(legs=tuple(legs))


def _joints(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find legs that cannot take a step."""
    reaches = np.array([_reach(leg, jacobian) for leg, jacobian in zip(body.legs, pose.jacobians, strict=True)])
    forward, up = reaches.max(axis=0) / pose.height
    if forward < _LEAST_STRIDE:
        text = "no leg has a joint that sweeps its foot forward and back: a hip about axis [0, 0, 1], both ways, fits"
        yield Flaw(text, True)
    if up < _LEAST_STRIDE:
        yield Flaw("no joint lifts a foot: a second joint in each leg, about axis [-1, 0, 0], fits", False)


def _reach(leg: Leg, jacobian: np.ndarray) -> tuple[float, float]:
    """Return the largest stroke of a foot by one joint: forward and back, and up, m."""
    low, high = np.radians([joint.range_deg for joint in leg.joints]).clip(-_LARGEST_TURN, _LARGEST_TURN).T
    sweep = abs(jacobian[0]) * np.minimum(-low, high)
    return sweep.max(), np.maximum(jacobian[2] * low, jacobian[2] * high).max()


def _parts(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find legs that overlap, with each other or with the torso."""
    found = max(overlaps(body), key=lambda each: each.depth, default=None)
    if found is None:
        return
    text = f"{' and '.join(found.names)} overlap by {found.depth:.3g} m in {found.pose}"
    for spread in _SPREADS:
        if not any(overlaps(body, spread)):
            outwards = [(spread - 1.0) * np.array(leg.mount[:2]) for leg in body.legs]
            yield Flaw(f"{text}: legs mounted {spread:g} times as far out fit", False, _moved(body, outwards))
            return
    yield Flaw(f"{text}: shorter or thinner links fit", False)
