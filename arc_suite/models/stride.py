"""The gait that suits a body, and how its legs take a step, from its standing pose.

In stance a foot is to move straight back as fast as the body moves forward; in swing it is lifted.
Both are directions in a leg's joint space, found by damped least squares, without a search.
"""

import functools

import numpy as np

from arc_suite.models.standing import stability_margin, standing
from arc_suite.robots import gaits
from arc_suite.robots.spec import Body, Leg

TARGET_FROUDE = 0.2  # speed that a walk asks for, of sqrt(g h); published robots: 0.18 to 0.27
GAIT_FREQUENCY = 0.18  # of sqrt(g / h); published: 0.2 to 0.41, with feet that slip

# Duty factors to choose from: the smallest is the published one, and the fastest.
_DUTY_FACTORS = (0.6, 0.65, 0.7, 0.75, 0.8)
_STABLE = 0.05  # of h: static stability margin that is enough throughout a cycle

LARGEST_SWEEP = 0.5  # rad, of a joint to either side
LARGEST_LIFT = 0.9  # rad
_USED = 0.9  # share of a joint's range that targets may use

# How much it matters that a foot moves as wanted along x, y and z. In stance it must not rise or
# sink; if it slips sideways all of its friction points there and none of it brakes the body.
_SWEEP_WEIGHTS = (1.0, 0.1, 4.0)
_LIFT_WEIGHTS = (0.2, 0.2, 1.0)
_DAMPING = 0.1  # of the leg's largest Jacobian entry


@functools.lru_cache(maxsize=256)
def fitted_gait(body: Body) -> gaits.Gait:
    """The metachronal gait of least duty factor that is statically stable all through its cycle.

    If none is, the one whose worst moment is the most stable.
    """
    enough, margins = _STABLE * body.torso.standing_height, {}
    for duty_factor in _DUTY_FACTORS:
        gait = gaits.metachronal(body, duty_factor)
        margins[gait] = least_margin(body, gait)
        if margins[gait] >= enough:
            return gait
    return max(margins, key=margins.get)


def least_margin(body: Body, gait: gaits.Gait) -> float:
    """Static stability margin (m) at the worst moment of a gait at the target velocity.

    Feet on the ground pass from ahead of where they stand at rest to as far behind while the
    torso moves over them; the centre of mass is taken to rest in the torso.
    """
    pose = standing(body)
    ahead = 0.5 * TARGET_FROUDE / GAIT_FREQUENCY * gait.duty_factor * pose.height
    margins = []
    for time in np.arange(40) / 40.0:
        cycle = (time + np.array(gait.offsets)) % 1.0
        feet = cycle < gait.duty_factor
        soles = pose.soles[feet, :2]
        soles[:, 0] += ahead * (1.0 - 2.0 * cycle[feet] / gait.duty_factor)
        margins.append(stability_margin(pose.centre, soles))
    return min(margins)


def swept(leg: Leg, jacobian, reach: float) -> np.ndarray:
    """Return the joint angles (joints of the leg,) that bring a leg's foot forward by `reach`, and back if negated."""
    low, high = target_ranges(leg)
    room = np.minimum(np.minimum(-low, high), LARGEST_SWEEP)
    return _towards(jacobian, (reach, 0.0, 0.0), _SWEEP_WEIGHTS, room, room)


def lifted(jacobian, height: float, below, above) -> np.ndarray:
    """Return the joint angles (joints of the leg,) that lift a leg's foot by a height, m.

    Args:
        jacobian: (3, joints of the leg) of the foot.
        height: m.
        below: (joints of the leg,) room that targets have below the pose, rad.
        above: the same above it.
    """
    below, above = np.minimum(below, LARGEST_LIFT), np.minimum(above, LARGEST_LIFT)
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
    square = weighted.T @ weighted + damping**2 * np.eye(jacobian.shape[1])
    angles = np.linalg.solve(square, weighted.T @ wanted)
    moved = weighted @ angles
    angles *= moved @ wanted / max(moved @ moved, 1e-12 * (wanted @ wanted))
    room = np.where(angles > 0.0, above, below)
    stuck = (room <= 0.0) & (angles != 0.0)
    if stuck.any():  # a knee that bends one way only must not hold the others up
        return _towards(np.where(stuck, 0.0, jacobian), displacement, weights, below, above)
    return angles * min(1.0, np.min(np.where(angles == 0.0, 1.0, room) / np.maximum(abs(angles), 1e-12)))
