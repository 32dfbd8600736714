"""Arrows on the ground that show a commanded velocity. R is the mean distance of the feet from their center."""

import math

import numpy as np

from arc_suite.arenas import Arena
from arc_suite.markers import Marker

_START_DISTANCE = 0.8  # of the start of the arrows from the torso, R
_RADIUS = 0.06  # R
_SAMPLES = np.linspace(0.0, 1.0, 9)  # points of an arrow that must lie over the ground
_VELOCITY_COLOR = (1.0, 0.75, 0.1, 1.0)
_TURNING_COLOR = (0.2, 0.8, 1.0, 1.0)


def draw_velocity(arena: Arena, reach: float, place: np.ndarray, velocity: np.ndarray) -> list[Marker]:
    """Return arrows ahead of the torso: the velocity, and from its tip the turning; a disk marks their start.

    The arrow of turning is the sideways velocity of a point R ahead. At the target velocity an arrow is R long.

    Args:
        arena: with the ground.
        reach: R, m.
        place: (3,) of the torso: x and y, m, and yaw, rad.
        velocity: (3,) forward, left and turning, in units of the command.
    """
    radius = _RADIUS * reach
    x, y, heading = place
    forward, left, turn = (reach * share for share in velocity)
    ahead = np.array((math.cos(heading), math.sin(heading)))
    leftward = np.array((-ahead[1], ahead[0]))
    start = np.array((x, y)) + _START_DISTANCE * reach * ahead
    tip = start + forward * ahead + left * leftward
    tip_of_turning = tip + turn * leftward
    base = np.array((*start, arena.height(*start)))
    markers = [Marker("cylinder", base, base + (0.0, 0.0, radius), 2.0 * radius, _VELOCITY_COLOR)]
    if (start != tip).any():
        markers.append(_draw_arrow(arena, start, tip, radius, _VELOCITY_COLOR))
    if (tip != tip_of_turning).any():
        markers.append(_draw_arrow(arena, tip, tip_of_turning, radius, _TURNING_COLOR))
    return markers


def _draw_arrow(arena: Arena, start: np.ndarray, end: np.ndarray, radius: float, color) -> Marker:
    """Return an arrow between two points (2,), so far above the ground that nothing between them covers it."""
    points = start + _SAMPLES[:, None] * (end - start)
    ground_heights = arena.height(*points.T)
    chord = ground_heights[0] + _SAMPLES * (ground_heights[-1] - ground_heights[0])  # between both ends
    clearance = (ground_heights - chord).max()  # by which the ground rises over the chord
    heights = chord + clearance + radius
    first_point = np.array((*points[0], heights[0]))
    last_point = np.array((*points[-1], heights[-1]))
    return Marker("arrow", first_point, last_point, radius, color)
