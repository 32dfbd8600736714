"""The gait that suits a body, and how its legs take a step, from its standing pose.

In stance a foot is to move straight back as fast as the body moves forward; in swing it is lifted.
Both are directions in a leg's joint space, found by damped least squares, without a search.
"""

import functools
import math
from collections.abc import Iterator

import numpy as np

from arc_suite.models.kinematics import damped_changes
from arc_suite.models.standing import GRAVITY, measure_standing, mechanics_of_poses
from arc_suite.robots import gaits
from arc_suite.robots.spec import Body, Leg

# Of the target speed; a body that moves at this speed heads within 45 degrees of the target's.
MIN_SPEED_SHARE = 0.7
TARGET_FROUDE = 0.2  # speed that a walk asks for, of sqrt(g h); published robots: 0.18 to 0.27

# Of sqrt(g / h), by the kind of motor; published: 0.2 to 0.41. Real robots have quick motors, and fall in slow gaits.
_FREQUENCY, _FREQUENCY_OF_SERVOS = 0.27, 0.36

# Of every body; published: 0.6. A lower one leaves fewer feet on the ground, a higher one too little time to swing: of
# 0.55 to 0.8 this one lets the most bodies walk.
DUTY_FACTOR = 0.65

FOOT_LIFT = 0.12  # of h: how far a foot is lifted in mid-swing; at 0.2 the cost of transport doubles
_MOMENTS = 12  # of a cycle, at which loads are found

MAX_SWEEP = 0.5  # rad, of a joint to either side
MAX_LIFT = 0.9  # rad
_USED = 0.9  # share of a joint's range that targets may use

# How much it matters that a foot moves as wanted along x, y and z. In stance it is not to rise or
# sink; if it slips sideways all of its friction points there and none of it brakes the body.
_SWEEP_WEIGHTS = (1.0, 0.1, 1.0)
_LIFT_WEIGHTS = (0.2, 0.2, 1.0)
_DAMPING = 0.1  # of the leg's largest Jacobian entry


@functools.lru_cache(maxsize=256)
def fitted_gait(body: Body) -> gaits.Gait:
    """Return the gait of a body: a trot on two pairs of legs, a tripod on servos, else the metachronal one.

    Four legs would have to lean over three feet in a metachronal gait; in a trot the body falls less far than that.
    """
    for name in ("trot", "tripod") if body.source else ("trot",):
        if name in gaits.fitting_gaits(body):
            return gaits.gait(body, name)._replace(duty_factor=DUTY_FACTOR)
    return gaits.metachronal(body, DUTY_FACTOR)


def gait_frequency(body: Body) -> float:
    """Return the frequency of the fitted gait, as a share of sqrt(g / h)."""
    return _FREQUENCY_OF_SERVOS if body.source else _FREQUENCY


def half_stroke(body: Body, gait: gaits.Gait) -> float:
    """Return how far ahead of its place at rest a foot touches down at the target velocity, m."""
    return 0.5 * TARGET_FROUDE / gait_frequency(body) * gait.duty_factor * body.torso.standing_height


def stride_poses(body: Body) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield joint angles (joints,), rad, and which feet stand (legs,), at moments of a cycle of the fitted gait."""
    gait = fitted_gait(body)
    moves = strokes(body, half_stroke(body, gait))
    for moment in np.arange(_MOMENTS) / _MOMENTS:
        cycle = (moment + np.array(gait.offsets)) % 1.0
        angles = [cycle_angles(place, gait.duty_factor, *move) for place, move in zip(cycle, moves, strict=True)]
        yield np.concatenate(angles), cycle < gait.duty_factor


def cycle_angles(cycle, duty_factor: float, sweep, lift):
    """Return how far joints (..., n) are from rest, rad, at phases (..., 1) of a leg's cycle.

    Args:
        cycle: in cycles; a leg swings from the duty factor on.
        duty_factor: of the gait.
        sweep: (..., n) angles at touchdown, rad.
        lift: (..., n) angles added in mid-swing, rad.
    """
    numpy, stands = cycle.__array_namespace__(), cycle < duty_factor
    progress = numpy.where(stands, cycle / duty_factor, (cycle - duty_factor) / (1.0 - duty_factor))
    angles = numpy.where(stands, 1.0 - 2.0 * progress, 2.0 * progress - 1.0) * sweep
    return angles + numpy.where(stands, 0.0, numpy.sin(np.pi * progress)) * lift


def stride_loads(body: Body) -> np.ndarray:
    """Return the largest torques (joints,) that hold the body in any pose of its stride, N m.

    The feet that stand carry it, and every leg hangs at its hip.
    """
    return np.max([abs(pose.loads) for pose in mechanics_of_poses(body, stride_poses(body))], axis=0)


def swing_accelerations(body: Body) -> np.ndarray:
    """Return the largest angular accelerations (joints,) of a swing, rad/s^2.

    A foot is lifted as a sine of time, and turns from going back to going forward in half of the swing.
    """
    gait = fitted_gait(body)
    duration = (1.0 - gait.duty_factor) / gait_frequency(body) * math.sqrt(body.torso.standing_height / GRAVITY)
    sweeps, lifts = map(np.concatenate, zip(*strokes(body, half_stroke(body, gait)), strict=True))
    return (math.pi / duration) ** 2 * abs(lifts) + 4.0 / duration**2 * abs(sweeps)


def strokes(body: Body, ahead: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return of each leg the angles (joints of the leg,) by which it is swept and lifted, rad.

    Args:
        body: the spec.
        ahead: how far a foot is to be swept from its place at rest, m.
    """
    pose, found = measure_standing(body), []
    for leg, jacobian in zip(body.legs, pose.jacobians, strict=True):
        low, high = target_ranges(leg)
        found.append((sweep_angles(leg, jacobian, ahead), lift_angles(jacobian, FOOT_LIFT * pose.height, -low, high)))
    return found


def sweep_angles(leg: Leg, jacobian, reach: float) -> np.ndarray:
    """Return the joint angles (joints of the leg,) that bring a leg's foot forward by `reach`, and back if negated."""
    low, high = target_ranges(leg)
    room = np.minimum(np.minimum(-low, high), MAX_SWEEP)
    return _towards(jacobian, (reach, 0.0, 0.0), _SWEEP_WEIGHTS, room, room)


def lift_angles(jacobian, height: float, below, above) -> np.ndarray:
    """Return the joint angles (joints of the leg,) that lift a leg's foot by a height, m.

    Args:
        jacobian: (3, joints of the leg) of the foot.
        height: m.
        below: (joints of the leg,) room that targets have below the pose, rad.
        above: the same above it.
    """
    below, above = np.minimum(below, MAX_LIFT), np.minimum(above, MAX_LIFT)
    return _towards(jacobian, (0.0, 0.0, height), _LIFT_WEIGHTS, below, above)


def target_ranges(leg: Leg) -> np.ndarray:
    """Return the lower and upper bounds (2, joints of the leg) of targets, rad."""
    return _USED * np.radians([joint.range_deg for joint in leg.joints]).T


def _towards(jacobian, displacement, weights, below, above) -> np.ndarray:
    """Return the joint angles (joints,) that move a foot by a displacement, to first order and within bounds.

    Damped least squares give the direction; along it, plain least squares give the length, which
    the room `below` and `above` zero bounds.
    """
    wanted = np.array(weights) * displacement
    weighted = np.diag(weights) @ jacobian
    damping = _DAMPING * abs(jacobian).max() or 1.0  # of a leg that nothing moves
    angles = damped_changes(weighted, weighted.T @ wanted, damping**2 * np.eye(jacobian.shape[1]))
    moved = weighted @ angles
    angles *= moved @ wanted / max(moved @ moved, 1e-12 * (wanted @ wanted))
    room = np.where(angles > 0.0, above, below)
    stuck = (room <= 0.0) & (angles != 0.0)
    if stuck.any():  # a knee that bends one way only must not hold the others up
        return _towards(np.where(stuck, 0.0, jacobian), displacement, weights, below, above)
    return angles * min(1.0, np.min(np.where(angles == 0.0, 1.0, room) / np.maximum(abs(angles), 1e-12)))
