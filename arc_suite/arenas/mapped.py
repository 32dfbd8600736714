"""Ground whose heights lie on a grid: that of height maps and scenes from files."""

import dataclasses
from abc import abstractmethod
from typing import NamedTuple

import numpy as np

from arc_suite.arenas import field
from arc_suite.arenas.arena import Arena, clearance_over_highest

EDGE = 2.0  # distance of the torso from the edge at which an episode is truncated, standing heights
MIN_SIDE = 6.0  # of ground with an edge, standing heights
MAX_SIDE = 1000.0  # m

_REACH = 20.0  # of a sampled surface from the start, standing heights
_CELL = 0.125  # of a sampled surface, standing heights
_MAX_CELLS = 400  # of a sampled surface along either side


class Surface(NamedTuple):
    """Heights of ground at the nodes of a grid; two triangles lie in every cell, as in MuJoCo's height fields.

    Attributes:
        low: x and y of the first node, m.
        cell: distance of nodes along x and y, m.
        heights: (rows, columns) heights of nodes, m; rows along y, columns along x.
    """

    low: tuple[float, float]
    cell: tuple[float, float]
    heights: np.ndarray

    def height(self, x, y):
        """Return the height (...) under points, m; beyond the edge that of the edge."""
        u = (x - self.low[0]) / self.cell[0]
        v = (y - self.low[1]) / self.cell[1]
        return field.height(self.heights, u, v)

    @property
    def high(self) -> tuple[float, float]:
        """The x and y of the last node, m."""
        rows, columns = self.heights.shape
        return self.low[0] + (columns - 1) * self.cell[0], self.low[1] + (rows - 1) * self.cell[1]

    def crop(self, low: np.ndarray, high: np.ndarray) -> "Surface":
        """Return the part between two corners (2,), m, at least one cell."""
        cells = np.array(self.heights.shape)[::-1] - 1  # along x and y
        first = np.floor((low - self.low) / self.cell).astype(int).clip(0, cells - 1)
        last = np.ceil((high - self.low) / self.cell).astype(int).clip(first + 1, cells)
        first_node = first * self.cell + self.low
        heights = self.heights[first[1] : last[1] + 1, first[0] : last[0] + 1]
        return Surface((float(first_node[0]), float(first_node[1])), self.cell, heights)


@dataclasses.dataclass(frozen=True)
class Mapped(Arena):
    """Ground from a file, moved up or down so that the start of a body has the height 0.

    Attributes:
        unit: the standing height of the body, m.
    """

    unit: float

    @property
    @abstractmethod
    def surface(self) -> Surface:
        """The heights of the ground."""

    @property
    def has_edge(self) -> bool:
        """Whether the ground ends where the surface does."""
        return True

    def height(self, x, y):
        """Return the height (...) of the ground under points, m; beyond the edge that of the edge."""
        return self.surface.height(x, y)

    def has_left(self, x, y):
        """Return whether (...) torsos over points x (...) and y (...), m, are nearer to an edge than 2 units."""
        if not self.has_edge:
            return super().has_left(x, y)
        edge = EDGE * self.unit
        low_x, low_y = self.surface.low
        high_x, high_y = self.surface.high
        return (x < low_x + edge) | (x > high_x - edge) | (y < low_y + edge) | (y > high_y - edge)

    def torso_clearance(self, positions):
        """Return the heights (...) of torsos over the highest ground within half a standing height around them, m."""
        return clearance_over_highest(self, positions, self.unit)


def check_sides(name: str, sides: tuple[float, float], unit: float) -> None:
    """Refuse ground with an edge that is too small for a body.

    Args:
        name: name of the ground.
        sides: its length and width, m.
        unit: the standing height of the body, m.

    Raises:
        ValueError: a side is shorter than `MIN_SIDE`.
    """
    if min(sides) < MIN_SIDE * unit:
        expected = f"{MIN_SIDE:g} standing heights of the body ({MIN_SIDE * unit:.3g} m)"
        raise ValueError(f"arena {name!r}: expected sides of at least {expected}, got {sides[0]:g} by {sides[1]:g} m")


def sample_surface(arena: Arena, unit: float) -> Surface:
    """Return the heights of any arena around the start, of a `Mapped` one at least where its surface is.

    Args:
        arena: the arena.
        unit: the standing height of the body, m.
    """
    reach = _REACH * unit
    if arena.surface is not None:
        reach = max(reach, *map(abs, (*arena.surface.low, *arena.surface.high)))
    cells = min(round(2.0 * reach / (_CELL * unit)), _MAX_CELLS)
    nodes = np.linspace(-reach, reach, cells + 1)
    x, y = np.meshgrid(nodes, nodes)
    cell = 2.0 * reach / cells
    return Surface((-reach, -reach), (cell, cell), arena.height(x, y))
