"""Flaws that keep a body from standing or walking, found in poses without simulation."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import checks
from arc_suite.models import sizing, stride
from arc_suite.models.outline import torso_box
from arc_suite.models.overlap import measure_gaps, overlaps
from arc_suite.models.standing import PoseMechanics, by_leg, measure_standing
from arc_suite.robots.spec import Body, Leg

# Lengths in standing heights.
_MAX_GAP = 0.12  # of feet from the floor; feet of published robots hang by up to 0.25 and sink by up to 0.07
_HOPELESS_GAP = 0.6  # beyond which the torso settles outside of the healthy range of a walk
_MIN_STROKE = 0.03  # that the most able foot sweeps or is lifted, within a demonstrator's bounds
_HOPELESS_OVERHANG = 0.05  # of the center of mass beyond the feet

_MIN_MARGIN = 0.15  # of stability, in heights of the center of mass; generated bodies have 0.7 to 2
_MARGIN_SPARE = 1.05  # factor on the displacement of feet that a flaw names
_MAX_TURN = 0.5  # rad, of a joint in a stroke
_MIN_WALKING_LEGS = 3
_MIN_DISPLACEMENT = 1e-6  # m, that a text names

# A body walks about as fast, of the target speed, as its motors give of this many times the loads of a stride: medians
# of 16 `varied` bodies with 1, 2, 3, 4, 6 and 10 times the loads are 0.14, 0.25, 0.46, 0.61, 0.82 and 1.09. Over 161
# bodies with random motors the mean error is 0.21; 118 are called weak, and 76 % of these stay below 0.7 as they walk.
_LOADS_OF_BRISK_STRIDE = 7.0

_SPREADS = (1.1, 1.2, 1.3, 1.4, 1.5, 1.75, 2.0)  # factors of the legs' mounts, tried against overlaps
_SHARES_OF_MOUNTS = np.arange(0.95, 0.0, -0.05)  # factors of mounts that are apart from the torso


class Flaw(NamedTuple):
    """A reason why a body cannot stand or walk.

    Attributes:
        text: what is wrong, and a value that fits.
        hopeless: whether no body can walk with it.
        cure: the body with the value that fits; None if the text names none.
    """

    text: str
    hopeless: bool
    cure: Body | None = None


def flaws(body: Body) -> list[Flaw]:
    """Return the flaws of a body, none for one that should walk.

    Where the standing height is far off, it is the only flaw: strokes and strides are compared with it.
    """
    pose = measure_standing(body)
    height_flaws = [*_check_height(body, pose)]
    if any(flaw.hopeless for flaw in height_flaws):
        return height_flaws
    return [*height_flaws, *_check_legs_and_joints(body, pose), *_check_overlaps(body)]


def has_flaws(body: Body) -> bool:
    """Return whether a body has flaws; it is quicker than `flaws`, as it looks for no second one and for no cure."""
    pose = measure_standing(body)
    return any(_check_height(body, pose)) or any(_check_legs_and_joints(body, pose)) or any(overlaps(body))


def hopeless_flaws(body: Body) -> list[Flaw]:
    """Return the flaws of a body with which none can walk.

    It is quicker than `flaws`, as motors and overlaps are not checked: their flaws are never hopeless.
    """
    pose = measure_standing(body)
    body_flaws = []
    for check in (_check_feet, _check_torso, _check_support, _check_joints):
        body_flaws.extend(flaw for flaw in check(body, pose) if flaw.hopeless)
    return body_flaws


def _check_height(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find feet and parts of the torso at a wrong height above the floor."""
    yield from _check_feet(body, pose)
    yield from _check_torso(body, pose)


def _check_legs_and_joints(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find all other flaws except overlaps, which take the longest to find."""
    for check in (_check_legs, _check_mounts, _check_support, _check_motors, _check_joints):
        yield from check(body, pose)


def _check_feet(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find feet above or below the floor."""
    soles = pose.soles[:, 2]  # heights in the torso's frame, m
    lowest_sole = soles.min()
    max_gap = _MAX_GAP * pose.height
    gap = float(pose.height + lowest_sole)
    floor_heights = pose.height + soles
    is_deep = floor_heights < -max_gap
    few_legs_are_deep = is_deep.any() and 2 * (abs(floor_heights) <= max_gap).sum() >= len(body.legs)
    if few_legs_are_deep:
        text = f"feet of {_join_names(body, is_deep)} stand {-gap:.3g} m in the floor: legs shorter by that fit"
        yield Flaw(text, abs(gap) > _HOPELESS_GAP * pose.height, _lengthen_legs(body, floor_heights * is_deep))
    elif abs(gap) > max_gap:
        fitting_height = float(f"{-lowest_sole:.3g}")
        cure = None
        if fitting_height > 0.0:
            cure = body.replace(torso=body.torso.replace(standing_height=fitting_height))
        error = f"hang {gap:.3g} m above the floor" if gap > 0.0 else f"stand {-gap:.3g} m in the floor"
        text = f"feet {error}: standing_height {fitting_height:.3g} fits"
        yield Flaw(text, abs(gap) > _HOPELESS_GAP * pose.height, cure)

    heights_above_lowest = soles - lowest_sole
    is_high = heights_above_lowest > max_gap
    if is_high.any() and not few_legs_are_deep:
        names = _join_names(body, is_high)
        largest = max(soles) - min(soles)
        most_are_high = 2 * is_high.sum() > len(body.legs)
        alternative = f", or {_join_names(body, ~is_high)} shorter" if most_are_high else ""
        text = f"feet of {names} end up to {largest:.3g} m above the lowest foot: legs longer by that fit{alternative}"
        yield Flaw(text, False, _lengthen_legs(body, heights_above_lowest))


def _check_torso(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find parts of the torso below the feet."""
    lowest_corner, _ = torso_box(body)
    depth = float(pose.soles[:, 2].min() - lowest_corner[2])
    if depth > 0.0:
        text = f"the torso reaches {depth:.3g} m lower than the feet: legs longer by more than that fit"
        yield Flaw(text, depth > _MAX_GAP * pose.height)


def _check_legs(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find too few legs for any demonstrator."""
    if len(body.legs) < _MIN_WALKING_LEGS:
        yield Flaw(f"no demonstrator keeps its balance on {len(body.legs)} legs: 3 and more walk", False)


def _check_mounts(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find legs that begin apart from the torso."""
    gaps = measure_gaps(body)
    is_apart = gaps > 0.0
    if is_apart.any():
        names = _join_names(body, is_apart)
        text = f"{names} begin up to {gaps.max():.3g} m away from the torso: legs mounted nearer to its middle fit"
        yield Flaw(text, False, _mount_in_torso(body, is_apart))


def _mount_in_torso(body: Body, is_apart: np.ndarray) -> Body | None:
    """Return the body with legs that are apart from the torso mounted nearer to its middle; None if none touches it."""
    for share in _SHARES_OF_MOUNTS:
        attached_body = _keep_if_whole(_spread_mounts(body, np.where(is_apart, share, 1.0)))
        if attached_body is not None:
            return attached_body
    return None


def _check_support(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find a center of mass outside the polygon of the feet, or too near its edge."""
    if len(body.legs) < 3:
        yield Flaw(f"{len(body.legs)} feet span no area to stand on: 3 or more legs fit", False)
        return
    center_height = pose.center[2] - pose.soles[:, 2].min()  # of mass, m above the feet
    if pose.margin < 0.0:
        yield _overhang_flaw(body, pose)
    elif pose.margin < _MIN_MARGIN * center_height:
        tilt = np.degrees(np.arctan2(pose.margin, center_height))
        distance = _MARGIN_SPARE * (_MIN_MARGIN * center_height - pose.margin)
        outwards = distance * np.sign(pose.soles - pose.center)[:, :2]
        text = (
            f"a tower that tips over when tilted by {tilt:.2g} degrees: "
            f"feet {distance:.2g} m further out all around fit"
        )
        yield Flaw(text, False, _keep_if_whole(_move_legs(body, outwards)))


def _overhang_flaw(body: Body, pose: PoseMechanics) -> Flaw:
    """Return the flaw of a center of mass outside of the feet."""
    error = f"the center of mass lies {-pose.margin:.3g} m outside of the feet"
    is_hopeless = pose.margin < -_HOPELESS_OVERHANG * pose.height
    sides = {leg.side for leg in body.legs}
    if len(sides) == 1:
        (side,) = sides
        missing_side = "right" if side == "left" else "left"
        return Flaw(f"{error}, all on the {side}: legs mirrored to the {missing_side} fit", is_hopeless)
    middle = (pose.soles.min(axis=0) + pose.soles.max(axis=0)) / 2.0
    # Legs that move take their share of the center of mass along.
    share_of_rest = 1.0 - _mass_of_legs(body) / pose.mass
    x, y, _ = (pose.center - middle) / share_of_rest
    cure = _move_legs(body, [(x, y)] * len(body.legs))
    return Flaw(f"{error}: legs {_describe_displacement(x, y)} fit", is_hopeless, _keep_if_whole(cure))


def _mass_of_legs(body: Body) -> float:
    """Return the mass of all legs, kg: capsules and spheres."""
    volume = 0.0
    for leg in body.legs:
        cubed_radii = sum(part.radius**3 for part in leg.parts)
        rods = sum(link.radius**2 * math.hypot(*link.end) for link in leg.links)
        volume += math.pi * (4.0 / 3.0 * cubed_radii + rods)
    return body.density * volume


def _describe_displacement(x: float, y: float) -> str:
    """Return a displacement on the floor, m, in words."""
    parts = []
    if abs(x) > _MIN_DISPLACEMENT:
        parts.append(f"{abs(x):.2g} m {'forward' if x > 0.0 else 'backward'}")
    if abs(y) > _MIN_DISPLACEMENT:
        parts.append(f"{abs(y):.2g} m {'to the left' if y > 0.0 else 'to the right'}")
    return " and ".join(parts)


def _check_motors(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find motors too weak to hold the standing pose where no joint limit holds it, or too weak for a stride."""
    joints = body.joints
    torques = np.array([joint.torque or np.inf for joint in joints])  # inf for motors that are to be sized
    if np.isinf(torques).all():
        return
    low, high = np.transpose([joint.range_deg for joint in joints])
    limit_under_load = np.where(pose.loads > 0.0, low, high)
    is_held_by_limit = limit_under_load == 0.0
    standing_loads = np.where(is_held_by_limit, 0.0, abs(pose.loads))
    if (torques < standing_loads).any():
        yield _weak_motor_flaw(body, torques, standing_loads, "hold the body up")
        return
    if body.source:  # the number of loads was measured on motors; servos walk with less
        return
    stride_loads = _LOADS_OF_BRISK_STRIDE * sizing.sizing_loads(body)
    speed_share = _estimate_speed_share(body, (torques / stride_loads).clip(max=1.0))
    if speed_share < stride.MIN_SPEED_SHARE:
        effect = f"weak: reaches about {speed_share:.1f} of the target speed, as "
        yield _weak_motor_flaw(body, torques, stride_loads, "a brisk stride takes", effect)


def _weak_motor_flaw(body: Body, torques: np.ndarray, loads: np.ndarray, purpose: str, effect: str = "") -> Flaw:
    """Return the flaw of motors that give less than their loads.

    Args:
        body: body of the motors.
        torques: (joints,) torques that motors give, N m.
        loads: (joints,) loads that they should give, N m.
        purpose: purpose of the loads, which ends the text.
        effect: begins the text.
    """
    is_weak = torques < loads
    weak_count = int(is_weak.sum())
    worst = int((loads / torques).argmax())
    shortage = f"{loads[worst] - torques[worst]:.3g} of the {loads[worst]:.3g} N m that {purpose}"
    more_joints = f", as do those of {weak_count - 1} more joints" if weak_count > 1 else ""
    name = body.joint_names[worst]
    if body.source:
        return Flaw(f"{effect}the servo of {name} lacks {shortage}{more_joints}", False)
    cure = _remove_motors(body, is_weak.tolist())
    gear = sizing.size_body(cure).joints[worst].motor.gear
    return Flaw(f"{effect}the motor of {name} lacks {shortage}{more_joints}: gear {gear:.3g} fits", False, cure)


def _estimate_speed_share(body: Body, torque_shares: np.ndarray) -> float:
    """Return about which share of the target speed a body reaches.

    In each leg the joint that bears most and the one that sweeps most decide; the others hardly matter.

    Args:
        body: any body.
        torque_shares: (joints,) shares that motors give of the torque for the target speed.
    """
    strokes_of_legs = stride.strokes(body, stride.half_stroke(body, stride.fitted_gait(body)))
    shares_of_legs = by_leg(body, torque_shares)
    loads_of_legs = by_leg(body, stride.stride_loads(body))
    least_shares = []
    for shares, loads, (sweep, _) in zip(shares_of_legs, loads_of_legs, strokes_of_legs, strict=True):
        decisive_joints = [loads.argmax(), abs(sweep).argmax()]
        least_shares.append(shares[decisive_joints].min())
    return float(np.mean(least_shares))


def _remove_motors(body: Body, is_removed: Sequence[bool]) -> Body:
    """Return the body with the motors of some of its joints (joints,) left to be sized."""
    removals = iter(is_removed)
    legs = []
    for leg in body.legs:
        links = []
        for link in leg.links:
            if link.joint and next(removals):
                link = link.replace(joint=link.joint.replace(motor=None))
            links.append(link)
        legs.append(leg.replace(links=tuple(links)))
    return body.replace(legs=tuple(legs))


def _keep_if_whole(body: Body) -> Body | None:
    """Return the body, or None if legs of it begin apart from the torso."""
    return body if (measure_gaps(body) <= 0.0).all() else None


def _move_legs(body: Body, displacements: Iterable) -> Body:
    """Return the body with its legs moved on the torso by displacements (legs, 2), m."""
    legs = []
    for leg, (x, y) in zip(body.legs, displacements, strict=True):
        mount_x, mount_y, mount_z = leg.mount
        legs.append(leg.replace(mount=(mount_x + float(x), mount_y + float(y), mount_z)))
    return body.replace(legs=tuple(legs))


def _join_names(body: Body, is_named: np.ndarray) -> str:
    """Return the names of the first legs among those of a mask (legs,), with dots if there are more."""
    return checks.join_first([body.legs[index].name for index in np.flatnonzero(is_named)])


def _lengthen_legs(body: Body, lengths: np.ndarray) -> Body:
    """Return the body with the feet lower by lengths (legs,), m, or higher if they are negative, by the last links."""
    legs = []
    for leg, length in zip(body.legs, lengths, strict=True):
        *first_links, last_link = leg.links
        x, y, z = last_link.end
        longer_link = last_link.replace(end=(x, y, z - float(length)))
        legs.append(leg.replace(links=(*first_links, longer_link)))
    return body.replace(legs=tuple(legs))


def _check_joints(body: Body, pose: PoseMechanics) -> Iterator[Flaw]:
    """Find legs that cannot take a step."""
    legs_and_jacobians = zip(body.legs, pose.jacobians, strict=True)
    leg_strokes = np.array([_largest_strokes(leg, jacobian) for leg, jacobian in legs_and_jacobians])  # (legs, 2) m
    forward, up = leg_strokes.max(axis=0) / pose.height
    if forward < _MIN_STROKE:
        text = "no leg has a joint that sweeps its foot forward and back: a hip about axis [0, 0, 1], both ways, fits"
        yield Flaw(text, True)
    if body.source:  # straight legs lift feet only by turning far; families of generated bodies stay as they are
        up = max(up, *(_largest_lift(leg) / pose.height for leg in body.legs))
    if up < _MIN_STROKE:
        yield Flaw("no joint lifts a foot: a second joint in each leg, about axis [-1, 0, 0], fits", False)


def _largest_strokes(leg: Leg, jacobian: np.ndarray) -> tuple[float, float]:
    """Return the largest stroke of a foot by one joint: forward and back, and up, m."""
    ranges = np.radians([joint.range_deg for joint in leg.joints]).clip(-_MAX_TURN, _MAX_TURN)
    low, high = ranges.T
    sweeps = abs(jacobian[0]) * np.minimum(-low, high)
    lifts = np.maximum(jacobian[2] * low, jacobian[2] * high)
    return sweeps.max(), lifts.max()


def _largest_lift(leg: Leg) -> float:
    """Return the largest height by which one joint lifts a foot from the standing pose, m."""
    lifts = []
    for joint, anchor in zip(leg.joints, leg.points, strict=False):
        axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
        arm = np.subtract(leg.foot_position, anchor)
        for angle in np.radians(joint.range_deg).clip(-_MAX_TURN, _MAX_TURN):
            sideways = np.sin(angle) * np.cross(axis, arm)
            inwards = (np.cos(angle) - 1.0) * (arm - axis * (axis @ arm))
            lifts.append(float((sideways + inwards)[2]))
    return max(lifts)


def _check_overlaps(body: Body) -> Iterator[Flaw]:
    """Find legs that overlap, with each other or with the torso."""
    deepest = max(overlaps(body), key=lambda overlap: overlap.depth, default=None)
    if deepest is None:
        return
    text = f"{' and '.join(deepest.names)} overlap by {deepest.depth:.3g} m in {deepest.pose}"
    largest_spreads = np.ones(len(body.legs))  # at which legs still touch the torso
    for spread in _SPREADS:
        is_attached = measure_gaps(_spread_mounts(body, np.full(len(body.legs), spread))) <= 0.0
        largest_spreads[is_attached] = spread
        wider_body = _spread_mounts(body, largest_spreads)
        if not any(overlaps(wider_body)):
            at_most = "" if is_attached.all() else "up to "
            yield Flaw(f"{text}: legs mounted {at_most}{spread:g} times as far out fit", False, wider_body)
            return
    yield Flaw(f"{text}: shorter or thinner links fit", False)


def _spread_mounts(body: Body, spreads: np.ndarray) -> Body:
    """Return the body with the distances of its legs' mounts from the middle, seen from above, times (legs,)."""
    displacements = [(spread - 1.0) * np.array(leg.mount[:2]) for leg, spread in zip(body.legs, spreads, strict=True)]
    return _move_legs(body, displacements)
