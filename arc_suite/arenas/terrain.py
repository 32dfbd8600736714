"""Terrain: lanes of rough ground, slopes, stairs, trenches and hurdles side by side, each level where a body starts.

Lanes lead along x. Rough ground and slopes are one height field with cells larger than feet. All else is
of boxes, since feet sink into a steep height field.
"""

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from dm_control import mjcf

from arc_suite import checks
from arc_suite.arenas import field
from arc_suite.arenas.arena import Arena
from arc_suite.robots.spec import Body

DIFFICULTY = 2.0 / 3.0  # unless something else is asked for
WIDTH = 24.0  # of a lane, in standing heights, as are all lengths here
BACK = 4.0  # level ground behind the start
LEVEL = 3.0  # level ground ahead of the start, where nothing is said of it

_LENGTH = 80.0  # ahead of the start, of arenas that no task has made
_LANES = 3  # of these
_CELL = 0.5  # of the height field
_GRAIN = 1.0 / 16.0  # of stairs and trenches along x, as near as a width is a multiple of it
_THICKNESS = 2.0  # of the ground
_TRENCH = 0.6  # depth
_BAR = 4  # grains of a hurdle along x, which a height scan of legs as long as the body is high meets
_RUN_UP = (7.0, 9.0)  # level ground before a trench or hurdle that bodies leap
_NEAR = 0.5  # how far around its center the ground under a torso counts


class Obstacle(NamedTuple):
    """The size of what a lane puts in the way; lengths in standing heights.

    Attributes:
        rise: of a step, or the most of the nodes of rough ground.
        slope: tangent of a ramp.
        width: of a tread or a trench.
    """

    rise: float = 0.0
    slope: float = 0.0
    width: float = 1.0


# Kind of ground -> what of an obstacle belongs to it, and that for a difficulty from 0 to 1.
_DIFFICULTIES = {
    "rough": lambda difficulty: {"rise": 0.45 * difficulty},
    "slopes": lambda difficulty: {"slope": 0.3 * difficulty},
    "stairs": lambda difficulty: {"rise": 0.05 + 0.25 * difficulty, "width": 1.0},
    "gaps": lambda difficulty: {"width": round(1.0 + 9.0 * difficulty) * _GRAIN},
    "trenches": lambda difficulty: {"width": round(12.8 + 19.2 * difficulty) * _GRAIN},
    "hurdles": lambda difficulty: {"rise": 0.1 + 0.3 * difficulty},
}
# What a caller may give in meters, the slope in radians, with bounds.
SIZES = {"rise": (0.0, 100.0), "slope": (0.0, 1.2), "width": (1e-9, 1000.0)}
_NARROWEST = 0.125  # tread or trench: every step is a box, and boxes take time


def sizes(kinds: Sequence[str]) -> tuple[str, ...]:
    """Return the sizes that a caller may give where all lanes are of these kinds: none if kinds share one."""
    names = tuple(name for kind in kinds for name in _DIFFICULTIES[kind](0.0))
    return names if len(set(names)) == len(names) else ()


def _rough(random: np.random.RandomState, obstacle: Obstacle, x: np.ndarray, rows: int) -> np.ndarray:
    """Nodes of random height, ramped in over twice the standing height."""
    return random.uniform(0.0, obstacle.rise, (rows, len(x))) * ((x - LEVEL) / 2.0).clip(0.0, 1.0)


def _slopes(random: np.random.RandomState, obstacle: Obstacle, x: np.ndarray, rows: int) -> np.ndarray:
    """Ramps of six heights up, three level, six down, three level; lanes begin with up to a height more of level."""
    place = (x - LEVEL - random.randint(3) * _CELL) % 18.0 * (x > LEVEL)
    ramp = np.minimum(place, 15.0 - place).clip(0.0, 6.0)
    return np.broadcast_to(obstacle.slope * ramp, (rows, len(x)))


def _stairs(random: np.random.RandomState, obstacle: Obstacle, cells: np.ndarray, grain: float) -> np.ndarray:
    """Four steps up, a landing of three treads, four down, another; lanes are shifted by up to 16 cells."""
    place = cells - random.randint(16)
    steps = place.clip(0) // round(obstacle.width / grain) % 14
    up = (steps + 1).clip(0, 4) - (steps - 6).clip(0, 4)  # up at 0, 1, 2, 3; the fourth tread goes on as the landing
    return obstacle.rise * up * (place >= 0)


def _gaps(random: np.random.RandomState, obstacle: Obstacle, cells: np.ndarray, grain: float) -> np.ndarray:
    """Trenches across lands of 1.5 to 3."""
    width = round(obstacle.width / grain)
    lands = np.round(random.uniform(1.5, 3.0, int(len(cells) * grain)) / grain).astype(int)  # more than fit
    return _across(cells, width, np.concatenate([[0], lands]), -_TRENCH)


def _trenches(random: np.random.RandomState, obstacle: Obstacle, cells: np.ndarray, grain: float) -> np.ndarray:
    """Trenches with run-ups."""
    return _across(cells, round(obstacle.width / grain), _run_ups(random, cells, grain), -_TRENCH)


def _hurdles(random: np.random.RandomState, obstacle: Obstacle, cells: np.ndarray, grain: float) -> np.ndarray:
    """Thin bars with run-ups."""
    return _across(cells, _BAR, _run_ups(random, cells, grain), obstacle.rise)


def _run_ups(random: np.random.RandomState, cells: np.ndarray, grain: float) -> np.ndarray:
    """Cells of level ground before each of more obstacles than fit."""
    return np.round(random.uniform(*_RUN_UP, int(len(cells) * grain)) / grain).astype(int)


def _across(cells: np.ndarray, width: int, lands: np.ndarray, height: float) -> np.ndarray:
    """Heights of obstacles of a width, each behind a land, lengths in cells; 0 elsewhere."""
    place = cells[:, None] - (lands + width).cumsum()
    return np.where(((place >= -width) & (place < 0)).any(axis=-1), height, 0.0)


# Kind of ground -> heights, in standing heights, of a lane with its stream of random numbers and its obstacle, at
# places along x, or in cells of a length from where the level ground ends.
FIELDS = {"rough": _rough, "slopes": _slopes}
STEPS = {"stairs": _stairs, "gaps": _gaps, "trenches": _trenches, "hurdles": _hurdles}
KINDS = (*FIELDS, *STEPS)


@dataclasses.dataclass(frozen=True)
class Terrain(Arena):
    """Lanes side by side; in the middle of lane i a body starts at `start(i)`.

    Outside the lanes there is only the plane below stairs and trenches; `height` returns the edge's there.

    Attributes:
        unit: m, the standing height of the body; all lengths are multiples of it.
        length: of the lanes ahead of the start, in units.
        lanes: kind and obstacle of each, by the order of `KINDS`; stairs and trenches have widths of one grain.
        seed: of the random ground; a lane does not depend on its neighbors.
    """

    unit: float
    length: float
    lanes: tuple[tuple[str, Obstacle], ...]
    seed: int = 0

    def start(self, lane):
        """Return y (...) of the middle of lanes (...), m; x of the start is 0."""
        return (lane - len(self.lanes) // 2) * (WIDTH * self.unit)

    def add_to(self, root: mjcf.RootElement, **contact) -> None:
        """Add the height field `floor`, the boxes `floor_<number>`, and under them the plane `floor_bottom`."""
        unit, nodes = self.unit, self._nodes
        if self._fields:
            middle = self.start(0.5 * (self._fields - 1))
            halves = (0.5 * (nodes.shape[1] - 1) * _CELL, 0.5 * WIDTH * self._fields)
            size = np.array((*halves, self._highest, _THICKNESS)) * unit
            field.add(root, nodes, size, ((halves[0] - BACK) * unit, middle, 0.0), **contact)
        boxes = (box for lane, heights in enumerate(self._profiles, self._fields) for box in self._boxes(lane, heights))
        for number, (size, pos) in enumerate(boxes):
            root.worldbody.add("geom", name=f"floor_{number}", type="box", size=size, pos=pos, conaffinity=1, **contact)
        if len(self._profiles):
            bottom = (0.0, 0.0, self._bottom * unit)
            root.worldbody.add(
                "geom", name="floor_bottom", type="plane", size=(0.0, 0.0, 1.0), pos=bottom, conaffinity=1, **contact
            )

    def _boxes(self, lane: int, heights: np.ndarray):
        """Yield size and place, (3,) m each, of the boxes of stairs or trenches.

        A box is as long as the ground is nowhere lower than its top: higher steps stand in lower ones,
        since every box less is time saved.
        """
        for top in np.unique(heights[heights > self._bottom]):
            edges = np.flatnonzero(np.diff(heights >= top, prepend=False, append=False))
            for first, last in edges.reshape(-1, 2) * self._grain:
                size = np.array((0.5 * (last - first), 0.5 * WIDTH, 0.5 * _THICKNESS)) * self.unit
                middle = np.array((0.5 * (first + last) - BACK, 0.0, top - 0.5 * _THICKNESS)) * self.unit
                yield size, middle + (0.0, self.start(lane), 0.0)

    def height(self, x, y):
        """Return the height (...) of the collision geometry under points, m."""
        numpy = x.__array_namespace__()
        along, across = x / self.unit + BACK, y / self.unit + (len(self.lanes) // 2 + 0.5) * WIDTH
        if not self._fields:
            return self.unit * self._stepped(along, across)
        heights = self._highest * field.height(self._nodes, along / _CELL, across / _CELL)
        if self._fields < len(self.lanes):
            heights = numpy.where(
                across < self._fields * WIDTH, heights, self._stepped(along, across - self._fields * WIDTH)
            )
        return self.unit * heights

    def _stepped(self, along, across):
        """Heights (...) of stairs and trenches, in units, from the lanes' beginning and the first one's edge."""
        numpy, (lanes, cells) = along.__array_namespace__(), self._profiles.shape
        lane = numpy.floor(across / WIDTH).astype(int).clip(0, lanes - 1)
        cell = numpy.floor(along / self._grain).astype(int).clip(0, cells - 1)
        return numpy.asarray(self._profiles).ravel()[lane * cells + cell]

    def torso_clearance(self, positions):
        """Return the heights (...) of torsos over the highest ground within half a standing height about them, m."""
        around = positions.__array_namespace__().asarray(self._around)
        x = positions[..., None, 0] + around[:, 0]
        y = positions[..., None, 1] + around[:, 1]
        return positions[..., 2] - self.height(x, y).max(axis=-1)

    @functools.cached_property
    def _around(self) -> np.ndarray:
        """(9, 2) places about the torso, m."""
        return _NEAR * self.unit * np.array([(x, y) for x in (-1.0, 0.0, 1.0) for y in (-1.0, 0.0, 1.0)])

    @property
    def lists_contacts(self) -> bool:
        """Return whether the ground is one height field: boxes are many."""
        return self._fields == len(self.lanes)

    @functools.cached_property
    def _fields(self) -> int:
        """How many lanes, the first ones, are a height field."""
        return sum(kind in FIELDS for kind, _ in self.lanes)

    @functools.cached_property
    def _highest(self) -> float:
        """The height of the height field's highest node, in units; never 0, which MuJoCo refuses."""
        return max((heights.max() for heights in self._field_heights), default=0.0) or 1.0

    @functools.cached_property
    def _field_heights(self) -> list[np.ndarray]:
        """Heights of the height field's nodes, in units, (rows, columns) for each lane."""
        x, rows = np.arange(0.0, BACK + self.length + _CELL, _CELL) - BACK, round(WIDTH / _CELL)
        return [
            FIELDS[kind](self._random(lane), obstacle, x, rows)
            for lane, (kind, obstacle) in enumerate(self.lanes[: self._fields])
        ]

    @functools.cached_property
    def _nodes(self) -> np.ndarray:
        """The height field's nodes (rows, columns) as shares of the highest; the last lane's far edge repeats a row."""
        lanes = self._field_heights
        return field.shares(np.concatenate([*lanes, lanes[-1][-1:]]) / self._highest) if lanes else np.zeros((0, 0))

    @functools.cached_property
    def _profiles(self) -> np.ndarray:
        """Heights of stairs and trenches, in units, (lanes, cells)."""
        cells = np.arange(math.ceil((BACK + self.length) / self._grain)) - math.ceil((BACK + LEVEL) / self._grain)
        profiles = [
            STEPS[kind](self._random(lane), obstacle, cells, self._grain)
            for lane, (kind, obstacle) in enumerate(self.lanes[self._fields :], self._fields)
        ]
        return np.array(profiles).reshape(len(profiles), len(cells))

    @functools.cached_property
    def _grain(self) -> float:
        """Length of a cell of stairs and trenches, in units: every width is a multiple of it."""
        width = self.lanes[-1][1].width
        return width / round(width / _GRAIN)

    @functools.cached_property
    def _bottom(self) -> float:
        """Height of the plane below stairs and trenches, in units: their lowest, as a plane costs less than boxes.

        With a height field it is below that, or feet would touch both.
        """
        return -_TRENCH if self._fields else self._profiles.min()

    def _random(self, lane: int) -> np.random.RandomState:
        """The stream of random numbers of a lane, by its kind and by how many of that kind are before it."""
        kind = self.lanes[lane][0]
        before = sum(other == kind for other, _ in self.lanes[:lane])
        return np.random.RandomState((self.seed, KINDS.index(kind), before))


def made(
    body: Body,
    kinds: Mapping[str, int],
    length: float = _LENGTH,
    levels=(DIFFICULTY,),
    seed: int = 0,
    given: Mapping[str, float] | None = None,
) -> Terrain:
    """Return lanes of the size of a body.

    Args:
        body: any.
        kinds: how many lanes of each difficulty, by kind of ground.
        length: of lanes ahead of the start, in standing heights.
        levels: difficulties, from 0 to 1.
        seed: of the random lanes.
        given: sizes of obstacles by name, m and rad, in place of those of the difficulties.

    Returns:
        The lanes: by kind, in the order of `KINDS`, then by difficulty.

    Raises:
        ValueError: treads or trenches too narrow for the body's size.
    """
    unit = body.torso.standing_height
    shares = {name: math.tan(size) if name == "slope" else size / unit for name, size in (given or {}).items()}
    if "width" in shares:
        checks.number("width", given["width"], _NARROWEST * unit)
    lanes = [
        (kind, Obstacle(**(_DIFFICULTIES[kind](level) | shares)))
        for kind in KINDS
        if kind in kinds
        for level in levels
        for _ in range(kinds[kind])
    ]
    return Terrain(unit, length, tuple(lanes), seed)


def fitted(kind: str):
    """Return the function from a body to lanes of a kind."""
    return lambda body: made(body, {kind: _LANES})
