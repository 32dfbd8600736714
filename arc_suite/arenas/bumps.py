"""Bumps: a height field of gentle, rounded bumps."""

import dataclasses
import functools
import math

import numpy as np
from dm_control import mjcf

from arc_suite.arenas import field
from arc_suite.arenas.arena import Arena
from arc_suite.robots.spec import Body

_CELL = 0.5  # of the standing height; feet sink into smaller cells
_LENGTH, _WIDTH = 80.0, 40.0  # of the field, in standing heights: the way of 1000 steps, to either side
_BASE = 2.0  # thickness of the ground below its lowest point, in standing heights
_WAVE = 4.0  # from bump to bump, in standing heights
_HIGHEST = 0.15  # in standing heights


@dataclasses.dataclass(frozen=True)
class Bumps(Arena):
    """Bumps on a field about the start; beyond its edge the ground goes on at the edge's height.

    Attributes:
        unit: m, the standing height of the body; all lengths are multiples of it.
        highest: of the bumps, in units.
    """

    unit: float
    highest: float = _HIGHEST

    def add_to(self, root: mjcf.RootElement, **contact) -> None:
        """Add the height field `floor`."""
        field.add(root, self._shares, (*self._halves, self.highest * self.unit, _BASE * self.unit), **contact)

    def height(self, x, y):
        """Return the height (...) of MuJoCo's collision triangles under points, m."""
        shares, (half_x, half_y) = self._shares, self._halves
        rows, columns = shares.shape
        u = (x + half_x) / (2.0 * half_x) * (columns - 1)
        v = (y + half_y) / (2.0 * half_y) * (rows - 1)
        return self.highest * self.unit * field.height(shares, u, v)

    @property
    def _halves(self) -> tuple[float, float]:
        """Return half of the field's length and width, m."""
        return _LENGTH * self.unit, 0.5 * _WIDTH * self.unit

    @functools.cached_property
    def _shares(self) -> np.ndarray:
        """Return the height of every node as a share of the highest, (rows, columns), in single precision."""
        x = np.arange(-_LENGTH, _LENGTH + _CELL, _CELL)
        y = np.arange(-0.5 * _WIDTH, 0.5 * _WIDTH + _CELL, _CELL)
        turn = 2.0 * math.pi / _WAVE
        wave = 0.5 - 0.5 * np.cos(turn * x) * np.cos(turn * y)[:, None]
        wave *= (np.hypot(x, y[:, None]) / _WAVE - 0.5).clip(0.0, 1.0)  # level where a body stands at first
        return field.shares(wave)


def fitted(body: Body) -> Bumps:
    """Return bumps of the size of a body."""
    return Bumps(body.torso.standing_height)
