"""Bumps: a height field of gentle, rounded bumps."""

import dataclasses
import functools
import math
from typing import Any

import numpy as np
from dm_control import mjcf

from arc_suite.arenas import field
from arc_suite.arenas.arena import Arena
from arc_suite.robots.spec import Body

# Lengths in standing heights.
_CELL = 0.5  # feet sink into smaller cells
_LENGTH = 120.0  # of the field, to the front and to the back: more than the way of 1000 control steps
_WIDTH = 120.0  # of the field: more than commands lead to the sides in 1000 control steps
_EDGE = 2.0  # distance of the torso from the edge at which an episode is truncated
_THICKNESS = 2.0  # of the ground below its lowest point
_WAVELENGTH = 4.0  # from bump to bump
_MAX_HEIGHT = 0.15


@dataclasses.dataclass(frozen=True)
class Bumps(Arena):
    """Bumps on a field around the start. Beyond its edge is no ground; `height` returns the height of the edge there.

    Attributes:
        unit: the standing height of the body, m; other lengths are multiples of it.
        highest: height of the highest bump, in units.
    """

    unit: float
    highest: float = _MAX_HEIGHT

    def add_to(self, root: mjcf.RootElement, **contact: Any) -> None:
        """Add the height field `floor`."""
        field.add(root, self._shares, (*self._halves, self.highest * self.unit, _THICKNESS * self.unit), **contact)

    def height(self, x, y):
        """Return the height (...) of MuJoCo's collision triangles under points, m."""
        half_x, half_y = self._halves
        rows, columns = self._shares.shape
        u = (x + half_x) / (2.0 * half_x) * (columns - 1)
        v = (y + half_y) / (2.0 * half_y) * (rows - 1)
        return self.highest * self.unit * field.height(self._shares, u, v)

    def has_left(self, x, y):
        """Return whether (...) torsos over points x (...) and y (...), m, are nearer to an edge than 2 units."""
        half_x, half_y = self._halves
        edge = _EDGE * self.unit
        return (abs(x) > half_x - edge) | (abs(y) > half_y - edge)

    @property
    def _halves(self) -> tuple[float, float]:
        """Return half of the field's length and width, m."""
        return _LENGTH * self.unit, 0.5 * _WIDTH * self.unit

    @functools.cached_property
    def _shares(self) -> np.ndarray:
        """Return the height of every node as a share of the highest, (rows, columns), in single precision."""
        x = np.arange(-_LENGTH, _LENGTH + _CELL, _CELL)
        y = np.arange(-0.5 * _WIDTH, 0.5 * _WIDTH + _CELL, _CELL)
        wave_number = 2.0 * math.pi / _WAVELENGTH
        heights = 0.5 - 0.5 * np.cos(wave_number * x) * np.cos(wave_number * y)[:, None]
        distance = np.hypot(x, y[:, None])
        heights *= (distance / _WAVELENGTH - 0.5).clip(0.0, 1.0)  # level around the start
        return field.shares(heights)


def fit_bumps(body: Body) -> Bumps:
    """Return bumps of the size of a body."""
    return Bumps(body.torso.standing_height)
