"""Height maps: a height field of the heights that a file has."""

import base64
import dataclasses
import functools
import zlib
from typing import Any, NamedTuple

import numpy as np
from dm_control import mjcf

from arc_suite.arenas import field
from arc_suite.arenas.mapped import Mapped, Surface, check_sides
from arc_suite.robots.spec import Body

MAX_NODES = 512  # along either side

_MIN_CELL = 1.0 / 16.0  # standing heights; smaller cells only take time
_THICKNESS = 2.0  # of the ground below its lowest point, standing heights
_LEVELS = np.dtype("<u2")  # of a text's heights
_HIGHEST = 65535


class HeightMap(NamedTuple):
    """A height map as data of a file.

    Attributes:
        name: name of its file.
        size: length along x, width along y, and height of 1 over 0, m.
        shape: number of rows along y, and of columns along x.
        heights: text of the nodes, see `encode`.
    """

    name: str
    size: tuple[float, float, float]
    shape: tuple[int, int]
    heights: str


@dataclasses.dataclass(frozen=True)
class MapGround(Mapped):
    """The height field of a map; its middle is the start. Beyond its edge is no ground.

    Attributes:
        map: the map.
    """

    map: HeightMap

    def add_to(self, root: mjcf.RootElement, **contact: Any) -> None:
        """Add the height field `floor`."""
        size = (0.5 * self.map.size[0], 0.5 * self.map.size[1], self._rise, _THICKNESS * self.unit)
        field.add(root, self._shares, size, pos=(0.0, 0.0, -self._start_height), **contact)

    @functools.cached_property
    def surface(self) -> Surface:
        """The heights of the height field."""
        length, width, _ = self.map.size
        rows, columns = self._shares.shape
        cell = (length / (columns - 1), width / (rows - 1))
        return Surface((-0.5 * length, -0.5 * width), cell, self._rise * self._shares - self._start_height)

    @functools.cached_property
    def _nodes(self) -> np.ndarray:
        """The heights (rows, columns) from 0 to 1, in cells that are not too small; 0 for a map of height 0."""
        rows, columns = self.map.shape
        length, width, height = self.map.size
        min_cell = _MIN_CELL * self.unit
        shape = (min(rows, int(width / min_cell) + 1), min(columns, int(length / min_cell) + 1))
        return sample(decode(self.map.heights, self.map.shape), shape) * (height > 0.0)

    @functools.cached_property
    def _shares(self) -> np.ndarray:
        """The heights of nodes over the lowest as shares of the rise, in single precision."""
        lowest = self._nodes.min()
        span = self._nodes.max() - lowest
        return field.shares((self._nodes - lowest) / (span or 1.0))

    @functools.cached_property
    def _rise(self) -> float:
        """The height of the highest node over the lowest, m; 1 for level ground, as MuJoCo refuses 0."""
        return float(np.ptp(self._nodes) * self.map.size[2]) or 1.0

    @functools.cached_property
    def _start_height(self) -> float:
        """The height of the middle over the lowest node, m."""
        rows, columns = self._shares.shape
        middle = field.height(self._shares, np.float64(0.5 * (columns - 1)), np.float64(0.5 * (rows - 1)))
        return float(self._rise * middle)


def fit(body: Body, height_map: HeightMap) -> MapGround:
    """Return the ground of a map for a body.

    Raises:
        ValueError: the map is too small for the body.
    """
    unit = body.torso.standing_height
    length, width, _ = height_map.size
    check_sides(height_map.name, (length, width), unit)
    return MapGround(unit, height_map)


def sample(nodes: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return the heights of nodes at as many places as a shape has, over the same rectangle."""
    if nodes.shape == shape:
        return nodes
    ends = np.array(nodes.shape) - 1.0
    v, u = np.meshgrid(np.linspace(0.0, ends[0], shape[0]), np.linspace(0.0, ends[1], shape[1]), indexing="ij")
    return field.height(nodes, u, v)


def encode(nodes: np.ndarray) -> str:
    """Return nodes (rows, columns) from 0 to 1 as text: base64 of packed steps from node to node, in 16 bits."""
    levels = np.round(nodes * _HIGHEST).astype(_LEVELS)
    steps = np.diff(levels, prepend=_LEVELS.type(0))  # smooth ground has small ones, which are packed well
    return base64.b64encode(zlib.compress(steps.tobytes(), 9)).decode()


def decode(text: str, shape: tuple[int, int]) -> np.ndarray:
    """Return the nodes of a text, as of `encode`, given the numbers of rows and columns.

    Raises:
        ValueError: a damaged text, or one of another number of nodes.
    """
    rows, columns = shape
    size = rows * columns * _LEVELS.itemsize
    content = zlib.decompressobj().decompress(base64.b64decode(text, validate=True), size + 1)
    if len(content) != size:
        raise ValueError(f"heights: expected {rows} rows of {columns}")
    steps = np.frombuffer(content, _LEVELS).reshape(rows, columns)
    return np.cumsum(steps, axis=1, dtype=_LEVELS) / _HIGHEST
