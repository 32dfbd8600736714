"""Arrows that show what pushes a torso."""

import math
from collections.abc import Iterator

import numpy as np

from arc_suite.markers import Marker
from arc_suite.robots.spec import Body
from arc_suite.tasks.readings import Readings

_COLOR = (0.95, 0.1, 0.08, 1.0)  # red
_LENGTH = 1.0  # standing heights, for a push of sqrt(g h) or of the body's weight
_RADIUS = 0.07  # standing heights
_TORSO_CLEARANCE = 0.3  # standing heights, between a tip and the torso's solids; shells reach beyond the solids


def draw_arrow(body: Body, readings: Readings, push) -> Iterator[Marker]:
    """Yield a red arrow that points at the torso; no arrow for a push of 0.

    Args:
        body: the body that is pushed.
        readings: the readings of one environment.
        push: (2,) world x and y, in sqrt(g h) or in body weights.
    """
    size = math.hypot(*push)
    height = body.torso.standing_height
    if size > 0.0:
        direction = np.array((*push / size, 0.0))
        tip = readings.torso_position - _tip_distance(body) * direction
        yield Marker("arrow", tip - _LENGTH * height * size * direction, tip, _RADIUS * height, _COLOR)


def _tip_distance(body: Body) -> float:
    """Return the horizontal distance from the torso's middle at which arrows end, m."""
    torso_radius = max(math.hypot(*solid.position[:2]) + max(solid.size) for solid in body.torso.solids)
    return torso_radius + _TORSO_CLEARANCE * body.torso.standing_height
