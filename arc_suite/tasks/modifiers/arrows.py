"""Arrows that show what pushes a torso."""

import math
from collections.abc import Iterator

import numpy as np

from arc_suite.markers import Marker
from arc_suite.robots.spec import Body
from arc_suite.tasks.readings import Readings

_RED = (0.95, 0.1, 0.08, 1.0)
_LENGTH = 1.0  # h, for a push of sqrt(g h) or of the weight
_SHAFT = 0.07  # radius, h
_APART = 0.3  # distance from the torso's solids, which shells exceed, h


def draw_arrow(body: Body, readings: Readings, push) -> Iterator[Marker]:
    """Yield a red arrow against the torso, for a push (2,) in sqrt(g h) or in weights; none for no push."""
    size = math.hypot(*push)
    height = body.torso.standing_height
    if size > 0.0:
        direction = np.array((*push / size, 0.0))
        tip = readings.torso_position - _rim(body) * direction
        yield Marker("arrow", tip - _LENGTH * height * size * direction, tip, _SHAFT * height, _RED)


def _rim(body: Body) -> float:
    """Return the distance from the torso's middle at which arrows end, m."""
    reach = max(math.hypot(*solid.position[:2]) + max(solid.size) for solid in body.torso.solids)
    return reach + _APART * body.torso.standing_height
