"""Poses of the torso over its feet: where it rests in a walk, and how far it can move from there.

A pose is (..., 6): height, forward and left of the rest, in standing heights; roll, pitch and yaw from it, rad. The
feet stay where they are, and joint angles follow by inverse kinematics.
"""

import functools
import itertools
from typing import NamedTuple

import numpy as np

from arc_suite import robots
from arc_suite.models.kinematics import Legs
from arc_suite.models.outline import torso_box
from arc_suite.models.sizing import sized
from arc_suite.models.standing import standing
from arc_suite.robots.spec import Body

NAMES = ("height", "forward", "left", "roll", "pitch", "yaw")

# Heights of a torso at rest, in standing heights, where the standing pose leaves legs no room to stretch.
_RIDES = {"queen": 0.97, "bastion": 0.79, "tick": 0.71, "leaper": 0.63}

USED = 0.98  # share of a joint's range, about its middle, that targets may use
DAMPING = 0.02  # of inverse kinematics, in standing heights
_SLIDES = np.diag((0.1, 0.1, 1.0))  # weights of the error of a foot that may slide
_SETTLING, _STEPS = 50, 6  # of inverse kinematics, to the rest, and from pose to pose
_STEP = 0.03  # from pose to pose, standing heights or rad
_MISSES = 0.01  # standing heights, by which a foot may miss its place
_STARTS, _ASIDE = (0.1, 0.5, 0.9), 0.03  # of searches, shares of joints' ranges; weight of the error of a foot aside
_FARTHEST = 0.6  # that is tried, standing heights or rad


class Rest(NamedTuple):
    """A torso at rest over its feet.

    Attributes:
        ride: its height, in standing heights.
        legs: their kinematics.
        angles: (legs, links) of joints, rad.
        places: (legs, 3) of the soles in the torso's frame, m.
    """

    ride: float
    legs: Legs
    angles: np.ndarray
    places: np.ndarray


@functools.lru_cache(maxsize=64)
def rest(body: Body) -> Rest:
    """Return how a body rests: over the feet of its standing pose, at the standing height or, as some robots, lower.

    Raises:
        ValueError: a body of a robot's name that has other joints.
    """
    ride = robots.parameters(_RIDES, body, "ride") or 1.0
    legs, pose = Legs.of(sized(body), USED), standing(body)
    below = -ride * pose.height if ride < 1.0 else pose.soles[:, 2:]
    goals = np.concatenate([pose.soles[:, :2], np.broadcast_to(below, (len(pose.soles), 1))], axis=-1)
    # From stretched legs, or from bent ones where stretched ones are caught at the bounds of their joints.
    starts = np.stack([np.zeros(legs.low.shape), 0.5 * (legs.low + legs.high)])
    found = _reached(legs, starts, goals, _SLIDES, pose.height, _SETTLING)
    places = legs.soles(found)[0]
    missed = abs(places - goals)[..., 2].max(axis=-1)
    nearest = int(missed[1] < missed[0] - _MISSES * pose.height)
    return Rest(ride, legs, found[nearest], places[nearest])


@functools.lru_cache(maxsize=64)
def room(body: Body, planted: bool = True) -> np.ndarray:
    """Return how far each number of a pose can go, (6, 2): the lowest and the highest, others being 0.

    Args:
        body: any body.
        planted: whether feet stay in place. If not, they may slide as the torso sinks, rises or tilts.
    """
    _, legs, angles, places = rest(body)
    height, outward = body.torso.standing_height, np.concatenate([-np.eye(6), np.eye(6)])  # ways out of the rest
    slides = np.tile(not planted, 12) & (abs(outward[:, [0, 3, 4]]) > 0.0).any(axis=-1)
    weights = np.where(slides[:, None, None, None], _SLIDES, np.eye(3))
    counts = np.where(slides[:, None, None], (0.0, 0.0, 1.0), 1.0)
    angles, found, inside = np.tile(angles, (12, 1, 1)), np.zeros(12), np.ones(12, bool)
    for size in _STEP * np.arange(1, round(_FARTHEST / _STEP) + 1):
        goals = moved(places, size * outward, height)
        angles = _reached(legs, angles, goals, weights, height, _STEPS)
        misses = np.linalg.norm(counts * (legs.soles(angles)[0] - goals), axis=-1).max(axis=-1)
        inside &= misses <= _MISSES * height
        found[inside] = size
    return found.reshape(2, 6).T * (-1.0, 1.0)


@functools.lru_cache(maxsize=64)
def belly(body: Body) -> tuple[float, np.ndarray]:
    """Return the height, m, and joint angles (joints,), rad, of a torso that lies on the ground between its feet."""
    _, legs, _, places = rest(body)
    height = -float(torso_box(body)[0][2])
    goals = places * (1.0, 1.0, 0.0) - (0.0, 0.0, height)
    # Legs fold in many ways: of searches from all over their range, each leg keeps the one that gets nearest.
    shares = np.array(list(itertools.product(_STARTS, repeat=legs.low.shape[1])))
    starts = legs.low + shares[:, None] * (legs.high - legs.low)
    found = _reached(legs, starts, goals, np.diag((_ASIDE, _ASIDE, 1.0)), body.torso.standing_height, _SETTLING)
    missed = np.linalg.norm((legs.soles(found)[0] - goals) * (_ASIDE, _ASIDE, 1.0), axis=-1)
    return height, legs.by_joint(found[missed.argmin(axis=0), np.arange(len(goals))])


def turns(body: Body) -> np.ndarray:
    """Return by how much joints turn in a pose, (joints, 6) rad, to first order, with feet in place."""
    _, legs, angles, places = rest(body)
    height, small = body.torso.standing_height, 1e-6
    apart = (moved(places, small * np.eye(6), height) - places) / small  # (6, legs, 3)
    jacobians = legs.soles(angles)[1]
    across = jacobians.swapaxes(-1, -2)
    square = jacobians @ across + (DAMPING * height) ** 2 * np.eye(3)
    found = (across @ np.linalg.solve(square, apart[..., None]))[..., 0]
    return legs.by_joint(found).T


def _reached(legs: Legs, angles, goals, weights, height: float, steps: int) -> np.ndarray:
    weights = np.broadcast_to(weights, (*goals.shape[:-1], 3, 3))
    return legs.reached(angles, goals, weights, DAMPING * height, steps)


def moved(places, pose, height):
    """Return places (..., n, 3) of the ground, m, as a torso in a pose (..., 6) has them in its frame.

    Args:
        places: (..., n, 3) as the torso at rest has them.
        pose: (..., 6).
        height: the standing height, m.
    """
    numpy = pose.__array_namespace__()
    shift = height * numpy.stack([pose[..., 1], pose[..., 2], pose[..., 0]], axis=-1)
    return (places - shift[..., None, :]) @ attitude(pose[..., 3:])


def attitude(angles):
    """Return rotations (..., 3, 3) of a torso by roll, pitch and yaw (..., 3), rad: in this order, about fixed axes."""
    numpy = angles.__array_namespace__()
    (roll, pitch, yaw), (across, down, aside) = (
        [function(angles[..., i]) for i in range(3)] for function in (numpy.cos, numpy.sin)
    )
    rows = (
        (yaw * pitch, yaw * down * across - aside * roll, yaw * down * roll + aside * across),
        (aside * pitch, aside * down * across + yaw * roll, aside * down * roll - yaw * across),
        (-down, pitch * across, pitch * roll),
    )
    return numpy.stack([numpy.stack(row, axis=-1) for row in rows], axis=-2)


def tilt(up):
    """Return roll and pitch (..., 2), rad, of a torso in whose frame the vertical is (..., 3)."""
    numpy = up.__array_namespace__()
    roll, pitch = numpy.arctan2(up[..., 1], up[..., 2]), -numpy.arcsin(up[..., 0].clip(-1.0, 1.0))
    return numpy.stack([roll, pitch], axis=-1)
