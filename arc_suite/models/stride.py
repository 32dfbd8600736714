"""The gait that suits a body, and how its legs take a step, from its standing pose.

In stance a foot is to move straight back as fast as the body moves forward; in swing it is lifted.
Both are directions in a leg's joint space, found by damped least squares, without a search.
"""

import functools
import math
from collections.abc import Iterator

import numpy as np

from arc_suite.models.kinematics import damped_changes
from arc_suite.models.standing import measure_standing, mechanics_of_poses, time_unit
from arc_suite.robots import gaits
from arc_suite.robots.spec import Body, Leg

MIN_SPEED_SHARE = 0.7  # of the target speed; a body that moves at it heads within 45 degrees of the target's direction
TARGET_FROUDE = 0.2  # target speed of a walk, in sqrt(g h); published robots have 0.18 to 0.27

# Frequencies of gaits, in sqrt(g / h); published: 0.2 to 0.41. Real robots have quick motors, and fall in slow gaits.
_FREQUENCY = 0.27
_FREQUENCY_OF_SERVOS = 0.36  # for imported bodies

# Of every body; published: 0.6. A lower one leaves fewer feet on the ground, a higher one too little time to swing: of
# 0.55 to 0.8 this one lets the most bodies walk.
DUTY_FACTOR = 0.65

FOOT_LIFT = 0.12  # standing heights, of a foot in mid-swing; at 0.2 the cost of transport doubles

MAX_SWEEP = 0.5  # rad, of a joint to either side
MAX_LIFT = 0.9  # rad, of a joint to either side
_JOINT_RANGE_SHARE = 0.9  # of a joint's range, that targets may use
_SAMPLES_PER_CYCLE = 12  # poses in which loads are found

# Weights of a foot's error along x, y and z. In stance it is not to rise or sink; if it slips sideways, all of its
# friction points there and none of it brakes the body.
_SWEEP_WEIGHTS = (1.0, 0.1, 1.0)
_LIFT_WEIGHTS = (0.2, 0.2, 1.0)
_DAMPING = 0.1  # of the largest entry of the leg's Jacobian
_MIN_ANGLE = 1e-12  # rad, in divisions
_MIN_MOVEMENT = 1e-12  # of the squared length of the displacement, in divisions


@functools.lru_cache(maxsize=256)
def fitted_gait(body: Body) -> gaits.Gait:
    """Return the gait of a body: a trot on two pairs of legs, a tripod on servos, else the metachronal one.

    Four legs would have to lean over three feet in a metachronal gait; in a trot the body falls less far than that.
    """
    preferred_names = ("trot", "tripod") if body.source else ("trot",)
    available_gaits = gaits.fitting_gaits(body)
    for name in preferred_names:
        if name in available_gaits:
            return gaits.gait(body, name)._replace(duty_factor=DUTY_FACTOR)
    return gaits.metachronal(body, DUTY_FACTOR)


def gait_frequency(body: Body) -> float:
    """Return the frequency of the fitted gait, in sqrt(g / h)."""
    return _FREQUENCY_OF_SERVOS if body.source else _FREQUENCY


def half_stroke(body: Body, gait: gaits.Gait) -> float:
    """Return how far ahead of its position at rest a foot touches down at the target velocity, m."""
    return 0.5 * TARGET_FROUDE / gait_frequency(body) * gait.duty_factor * body.torso.standing_height


def stride_poses(body: Body) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield joint angles (joints,), rad, and which feet stand (legs,), at moments of a cycle of the fitted gait."""
    gait = fitted_gait(body)
    strokes_of_legs = strokes(body, half_stroke(body, gait))
    for time in np.arange(_SAMPLES_PER_CYCLE) / _SAMPLES_PER_CYCLE:  # in cycles
        phases = (time + np.array(gait.offsets)) % 1.0
        angles = [
            cycle_angles(phase, gait.duty_factor, sweep, lift)
            for phase, (sweep, lift) in zip(phases, strokes_of_legs, strict=True)
        ]
        yield np.concatenate(angles), phases < gait.duty_factor


def cycle_angles(cycle, duty_factor: float, sweep, lift):
    """Return how far joints (..., n) are from rest, rad, at phases (..., 1) of a leg's cycle.

    Args:
        cycle: phases, in cycles; a leg stands before the duty factor and swings after it.
        duty_factor: duty factor of the gait.
        sweep: (..., n) angles at touchdown, rad.
        lift: (..., n) angles added in mid-swing, rad.
    """
    xp = cycle.__array_namespace__()
    is_stance = cycle < duty_factor
    progress = xp.where(is_stance, cycle / duty_factor, (cycle - duty_factor) / (1.0 - duty_factor))  # of its half
    sweep_share = xp.where(is_stance, 1.0 - 2.0 * progress, 2.0 * progress - 1.0)
    lift_share = xp.where(is_stance, 0.0, xp.sin(np.pi * progress))
    return sweep_share * sweep + lift_share * lift


def stride_loads(body: Body) -> np.ndarray:
    """Return the largest torques (joints,) that hold the body in any pose of its stride, N m.

    The feet that stand carry it, and every leg hangs at its hip.
    """
    torques = [abs(pose.loads) for pose in mechanics_of_poses(body, stride_poses(body))]
    return np.max(torques, axis=0)


def swing_accelerations(body: Body) -> np.ndarray:
    """Return the largest angular accelerations (joints,) of a swing, rad/s^2.

    A foot is lifted as a sine of time, and turns from going back to going forward in half of the swing.
    """
    gait = fitted_gait(body)
    duration = (1.0 - gait.duty_factor) / gait_frequency(body) * time_unit(body)  # s, of a swing
    strokes_of_legs = strokes(body, half_stroke(body, gait))
    sweeps = np.concatenate([sweep for sweep, _ in strokes_of_legs])
    lifts = np.concatenate([lift for _, lift in strokes_of_legs])
    return (math.pi / duration) ** 2 * abs(lifts) + 4.0 / duration**2 * abs(sweeps)


def strokes(body: Body, ahead: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return, for each leg, the angles (joints of the leg,) by which it is swept and lifted, rad.

    Args:
        body: the spec.
        ahead: how far a foot is to be swept from its position at rest, m.
    """
    pose = measure_standing(body)
    angles_of_legs = []
    for leg, jacobian in zip(body.legs, pose.jacobians, strict=True):
        low, high = target_ranges(leg)
        sweep = sweep_angles(leg, jacobian, ahead)
        lift = lift_angles(jacobian, FOOT_LIFT * pose.height, below=-low, above=high)
        angles_of_legs.append((sweep, lift))
    return angles_of_legs


def sweep_angles(leg: Leg, jacobian, reach: float) -> np.ndarray:
    """Return the joint angles (joints of the leg,) that bring a leg's foot forward by `reach`, and back if negated."""
    low, high = target_ranges(leg)
    room = np.minimum(np.minimum(-low, high), MAX_SWEEP)  # to either side
    return _angles_towards(jacobian, (reach, 0.0, 0.0), _SWEEP_WEIGHTS, below=room, above=room)


def lift_angles(jacobian, height: float, below, above) -> np.ndarray:
    """Return the joint angles (joints of the leg,) that lift a leg's foot by a height, m.

    Args:
        jacobian: (3, joints of the leg) jacobian of the foot.
        height: m.
        below: (joints of the leg,) room that targets have below the pose, rad.
        above: the same above it.
    """
    room_below = np.minimum(below, MAX_LIFT)
    room_above = np.minimum(above, MAX_LIFT)
    return _angles_towards(jacobian, (0.0, 0.0, height), _LIFT_WEIGHTS, room_below, room_above)


def target_ranges(leg: Leg) -> np.ndarray:
    """Return the lower and upper bounds (2, joints of the leg) of targets, rad."""
    return _JOINT_RANGE_SHARE * np.radians([joint.range_deg for joint in leg.joints]).T


def _angles_towards(jacobian, displacement, weights, below, above) -> np.ndarray:
    """Return the joint angles (joints,) that move a foot by a displacement, to first order and within bounds.

    Damped least squares give the direction, and plain least squares give the length along it. The room below and above
    zero bounds the length.

    Args:
        jacobian: (3, joints) jacobian of the foot.
        displacement: (3,) m.
        weights: (3,) weights of its components.
        below: (joints,) room below zero, rad.
        above: (joints,) room above zero, rad.
    """
    weighted_displacement = np.array(weights) * displacement
    weighted_jacobian = np.diag(weights) @ jacobian
    damping = _DAMPING * abs(jacobian).max() or 1.0  # 1 for a leg that no joint moves
    pull = weighted_jacobian.T @ weighted_displacement
    angles = damped_changes(weighted_jacobian, pull, damping**2 * np.eye(jacobian.shape[1]))
    movement = weighted_jacobian @ angles
    least_square = _MIN_MOVEMENT * (weighted_displacement @ weighted_displacement)
    angles *= movement @ weighted_displacement / max(movement @ movement, least_square)

    room = np.where(angles > 0.0, above, below)
    is_stuck = (room <= 0.0) & (angles != 0.0)
    if is_stuck.any():  # a knee that bends one way only must not keep the other joints from moving
        free_jacobian = np.where(is_stuck, 0.0, jacobian)
        return _angles_towards(free_jacobian, displacement, weights, below, above)
    shares = np.where(angles == 0.0, 1.0, room) / np.maximum(abs(angles), _MIN_ANGLE)
    return angles * min(1.0, np.min(shares))
