"""Bumps: a field of gentle, rounded bumps, as MuJoCo's height field with its triangles."""

import dataclasses
import functools
import math

import numpy as np
from dm_control import mjcf

from arc_suite.arenas.arena import Arena
from arc_suite.robots.spec import Body

_CELL = 0.5  # of the standing height; feet sink into cells that are small beside them
_LENGTH, _WIDTH = 80.0, 40.0  # of the field, in standing heights: the way of 1000 steps, to either side
_BASE = 2.0  # thickness of the ground below its lowest point, in standing heights
_WAVE = 4.0  # from bump to bump, in standing heights
_HIGHEST = 0.15  # in standing heights


@dataclasses.dataclass(frozen=True)
class Bumps(Arena):
    """Bumps on a field about the start; beyond its edge the ground goes on at the edge's height.

    Attributes:
        unit: m, the standing height of the body for which it is made: all lengths are multiples of it.
        highest: of the bumps, in units.
    """

    unit: float
    highest: float = _HIGHEST

    def add_to(self, root: mjcf.RootElement, **contact) -> None:
        """Add the height field `floor`."""
        shares = self._shares
        rows, columns = shares.shape
        root.asset.add(
            "hfield",
            name="floor",
            nrow=rows,
            ncol=columns,
            size=(*self._halves, self.highest * self.unit, _BASE * self.unit),
            elevation=shares[::-1].ravel(),  # MJCF lists rows from the far side in y
        )
        root.worldbody.add("geom", name="floor", type="hfield", hfield="floor", conaffinity=1, **contact)

    def height(self, x, y):
        """Return the height (...) of the triangles under points: those that MuJoCo's collisions meet, m."""
        numpy = x.__array_namespace__()
        shares, (half_x, half_y) = numpy.asarray(self._shares), self._halves
        rows, columns = shares.shape
        u = ((x + half_x) / (2.0 * half_x)).clip(0.0, 1.0) * (columns - 1)
        v = ((y + half_y) / (2.0 * half_y)).clip(0.0, 1.0) * (rows - 1)
        column = numpy.floor(u).astype(int).clip(0, columns - 2)
        row = numpy.floor(v).astype(int).clip(0, rows - 2)
        u, v = u - column, v - row
        low, high = shares[row, column], shares[row + 1, column + 1]
        # A cell is two triangles, on either side of the diagonal from its lowest to its highest indices.
        right = low + u * (shares[row, column + 1] - low) + v * (high - shares[row, column + 1])
        left = low + v * (shares[row + 1, column] - low) + u * (high - shares[row + 1, column])
        return self.highest * self.unit * numpy.where(u > v, right, left)

    @property
    def _halves(self) -> tuple[float, float]:
        """Return half of the field's length and width, m."""
        return _LENGTH * self.unit, 0.5 * _WIDTH * self.unit

    @functools.cached_property
    def _shares(self) -> np.ndarray:
        """Return the height of every node as a share of the highest, (rows, columns), in the precision MuJoCo keeps."""
        x = np.arange(-_LENGTH, _LENGTH + _CELL, _CELL)
        y = np.arange(-0.5 * _WIDTH, 0.5 * _WIDTH + _CELL, _CELL)
        turn = 2.0 * math.pi / _WAVE
        wave = 0.5 - 0.5 * np.cos(turn * x) * np.cos(turn * y)[:, None]
        wave *= (np.hypot(x, y[:, None]) / _WAVE - 0.5).clip(0.0, 1.0)  # level where a body stands at first
        return wave.astype(np.float32).astype(float)


def fitted(body: Body) -> Bumps:
    """Return the bumps that suit a body's size."""
    return Bumps(body.torso.standing_height)
