"""Terrain: lanes of rough ground, slopes, stairs, trenches and hurdles side by side, each level around the start.

Lanes lead along x. Rough ground and slopes are one height field with cells larger than feet. Other ground is made of
boxes, as feet sink into a steep height field. Lengths are in standing heights.
"""

import dataclasses
import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from dm_control import mjcf

from arc_suite import checks
from arc_suite.arenas import field
from arc_suite.arenas.arena import Arena, clearance_over_highest
from arc_suite.robots.spec import Body

DIFFICULTY = 2.0 / 3.0  # default
WIDTH = 24.0  # of a lane
BACK = 4.0  # level ground behind the start
RUNWAY = 3.0  # level ground ahead of the start
END_MARGIN = 1.0  # distance of the torso from either end of the lanes at which an episode is truncated
SIDE_MARGIN = 2.0  # distance of the torso from the edge of the outermost lanes at which an episode is truncated

# Size of an arena without a task: commands lead nowhere else in 1000 control steps.
_LENGTH_ALONE = 120.0  # of the lanes, ahead of the start
_BACK_ALONE = 60.0  # level ground behind the start
_LANES_ALONE = 5
_CELL = 0.5  # of the height field
_GRAIN = 1.0 / 16.0  # length of a cell of stairs and trenches; it is adapted so that a width is a multiple
_THICKNESS = 2.0  # of the ground; boxes that are higher over the plane below them reach down to it
_TRENCH_DEPTH = 0.6
_HURDLE_LENGTH = 0.25  # rounded to cells; points of a height scan are nearer to each other
_RUN_UP = (7.0, 9.0)  # level ground before a trench or hurdle to leap over


class Obstacle(NamedTuple):
    """Size of the obstacles of a lane.

    Attributes:
        rise: rise of a step or a hurdle, or the greatest height of rough ground.
        slope: tangent of a ramp.
        width: width of a tread or a trench.
    """

    rise: float = 0.0
    slope: float = 0.0
    width: float = 1.0


# Kind of ground -> the fields of its obstacles, for a difficulty from 0 to 1.
_DIFFICULTIES = {
    "rough": lambda difficulty: {"rise": 0.45 * difficulty},
    "slopes": lambda difficulty: {"slope": 0.3 * difficulty},
    "stairs": lambda difficulty: {"rise": 0.05 + 0.25 * difficulty, "width": 1.0},
    "gaps": lambda difficulty: {"width": round(1.0 + 9.0 * difficulty) * _GRAIN},
    "trenches": lambda difficulty: {"width": round(12.8 + 19.2 * difficulty) * _GRAIN},
    "hurdles": lambda difficulty: {"rise": 0.1 + 0.3 * difficulty},
}
# Bounds of sizes that a caller may set, m; of the slope, rad.
SIZES = {"rise": (0.0, 100.0), "slope": (0.0, 1.2), "width": (1e-9, 1000.0)}
_MIN_WIDTH = 0.125  # of a tread or trench: every step is a box, and boxes take time


def min_width(body: Body) -> float:
    """Return the least width of a tread or trench for a body, m."""
    return _MIN_WIDTH * body.torso.standing_height


def sizes(kinds: Sequence[str]) -> tuple[str, ...]:
    """Return the names of sizes that a caller may set for lanes of these kinds: none if two kinds share a size."""
    names = tuple(name for kind in kinds for name in _DIFFICULTIES[kind](0.0))
    are_distinct = len(set(names)) == len(names)
    return names if are_distinct else ()


def _rough(random: np.random.RandomState, obstacle: Obstacle, x: np.ndarray, rows: int) -> np.ndarray:
    """Return nodes of random height, which increases over the first two standing heights."""
    share = ((x - RUNWAY) / 2.0).clip(0.0, 1.0)
    return random.uniform(0.0, obstacle.rise, (rows, len(x))) * share


def _slopes(random: np.random.RandomState, obstacle: Obstacle, x: np.ndarray, rows: int) -> np.ndarray:
    """Return ramps: six up, three level, six down, three level, and again; they begin up to one further ahead."""
    position = (x - RUNWAY - random.randint(3) * _CELL) % 18.0 * (x > RUNWAY)
    ramp = np.minimum(position, 15.0 - position).clip(0.0, 6.0)
    return np.broadcast_to(obstacle.slope * ramp, (rows, len(x)))


def _stairs(random: np.random.RandomState, obstacle: Obstacle, cells: np.ndarray, grain: float) -> np.ndarray:
    """Return four steps up, a landing of three treads, four down, another landing; the start is shifted at random."""
    position = cells - random.randint(16)
    treads = position.clip(0) // round(obstacle.width / grain) % 14
    # Treads 0 to 3 lead up. The fourth one is also the first of the landing.
    steps_up = (treads + 1).clip(0, 4) - (treads - 6).clip(0, 4)
    return obstacle.rise * steps_up * (position >= 0)


def _gaps(random: np.random.RandomState, obstacle: Obstacle, cells: np.ndarray, grain: float) -> np.ndarray:
    """Return trenches with 1.5 to 3 of level ground between them."""
    width = round(obstacle.width / grain)
    distances = np.round(random.uniform(1.5, 3.0, int(len(cells) * grain)) / grain).astype(int)
    return _repeat_obstacle(cells, width, np.concatenate([[0], distances]), -_TRENCH_DEPTH)


def _trenches(random: np.random.RandomState, obstacle: Obstacle, cells: np.ndarray, grain: float) -> np.ndarray:
    """Return trenches with run-ups."""
    return _repeat_obstacle(cells, round(obstacle.width / grain), _run_ups(random, cells, grain), -_TRENCH_DEPTH)


def _hurdles(random: np.random.RandomState, obstacle: Obstacle, cells: np.ndarray, grain: float) -> np.ndarray:
    """Return thin bars with run-ups."""
    return _repeat_obstacle(cells, round(_HURDLE_LENGTH / grain), _run_ups(random, cells, grain), obstacle.rise)


def _run_ups(random: np.random.RandomState, cells: np.ndarray, grain: float) -> np.ndarray:
    """Return the cells of level ground before each obstacle, for more obstacles than there is space."""
    return np.round(random.uniform(*_RUN_UP, int(len(cells) * grain)) / grain).astype(int)


def _repeat_obstacle(cells: np.ndarray, width: int, distances: np.ndarray, height: float) -> np.ndarray:
    """Return heights of obstacles of a width, each after a distance of level ground, lengths in cells."""
    from_end = cells[:, None] - (distances + width).cumsum()  # of each obstacle
    is_on_obstacle = ((from_end >= -width) & (from_end < 0)).any(axis=-1)
    return np.where(is_on_obstacle, height, 0.0)


# Kind of ground -> a function that returns the heights of a lane, given a random generator and the obstacle: of nodes
# at coordinates x, or of cells, whose numbers count from the end of the level ground.
FIELDS = {"rough": _rough, "slopes": _slopes}
STEPS = {"stairs": _stairs, "gaps": _gaps, "trenches": _trenches, "hurdles": _hurdles}
KINDS = (*FIELDS, *STEPS)


@dataclasses.dataclass(frozen=True)
class Terrain(Arena):
    """Lanes side by side; a body starts in the middle of lane i, at y = `start(i)`.

    Outside the lanes there is only the plane below stairs and trenches; there, `height` returns that of the edge. So
    tasks truncate episodes before a torso gets there.

    Attributes:
        unit: the standing height of the body, m; other lengths are multiples of it.
        length: length of the lanes ahead of the start, in units.
        lanes: kind and obstacle of each, in the order of `KINDS`; widths of stairs and trenches are equal.
        seed: seed of the random ground; a lane does not depend on its neighbors.
        back: length of the level ground behind the start, in units.
    """

    unit: float
    length: float
    lanes: tuple[tuple[str, Obstacle], ...]
    seed: int = 0
    back: float = BACK

    def start(self, lane):
        """Return y (...) of the middle of lanes (...), m; x of the start is 0."""
        return (lane - len(self.lanes) // 2) * (WIDTH * self.unit)

    def add_to(self, root: mjcf.RootElement, **contact: Any) -> None:
        """Add the height field `floor`, the boxes `floor_<number>`, and under them the plane `floor_bottom`."""
        unit = self.unit
        if self._num_fields:
            nodes = self._nodes
            half_length = 0.5 * (nodes.shape[1] - 1) * _CELL
            half_width = 0.5 * WIDTH * self._num_fields
            size = np.array((half_length, half_width, self._highest, _THICKNESS)) * unit
            center = ((half_length - self.back) * unit, self.start(0.5 * (self._num_fields - 1)), 0.0)
            field.add(root, nodes, size, center, **contact)
        boxes = []
        for lane, heights in enumerate(self._profiles, self._num_fields):
            boxes += self._boxes(lane, heights)
        for number, (size, pos) in enumerate(boxes):
            root.worldbody.add("geom", name=f"floor_{number}", type="box", size=size, pos=pos, conaffinity=1, **contact)
        if len(self._profiles):
            bottom = (0.0, 0.0, self._bottom * unit)
            root.worldbody.add(
                "geom", name="floor_bottom", type="plane", size=(0.0, 0.0, 1.0), pos=bottom, conaffinity=1, **contact
            )

    def _boxes(self, lane: int, heights: np.ndarray):
        """Yield size and position, (3,) m each, of the boxes of stairs or trenches.

        A box extends over all ground that is at least as high as its top. So higher steps stand on lower ones, which
        needs fewer boxes and less time.
        """
        for top in np.unique(heights[heights > self._bottom]):
            thickness = max(_THICKNESS, top - self._bottom)
            edges = np.flatnonzero(np.diff(heights >= top, prepend=False, append=False))
            for first, last in edges.reshape(-1, 2) * self._grain:
                size = np.array((0.5 * (last - first), 0.5 * WIDTH, 0.5 * thickness)) * self.unit
                center = np.array((0.5 * (first + last) - self.back, 0.0, top - 0.5 * thickness)) * self.unit
                yield size, center + (0.0, self.start(lane), 0.0)

    def height(self, x, y):
        """Return the height (...) of the collision geometry under points, m."""
        xp = x.__array_namespace__()
        along = x / self.unit + self.back  # from the beginning of the lanes, in units
        across = y / self.unit + (len(self.lanes) // 2 + 0.5) * WIDTH  # from the edge of the first lane, in units
        if not self._num_fields:
            return self.unit * self._height_of_boxes(along, across)
        heights = self._highest * field.height(self._nodes, along / _CELL, across / _CELL)
        if self._num_fields < len(self.lanes):
            width_of_fields = self._num_fields * WIDTH
            box_heights = self._height_of_boxes(along, across - width_of_fields)
            heights = xp.where(across < width_of_fields, heights, box_heights)
        return self.unit * heights

    def _height_of_boxes(self, along, across):
        """Return heights (...) of stairs and trenches, in units, at distances from their first corner, in units."""
        xp = along.__array_namespace__()
        lanes, cells = self._profiles.shape
        lane = xp.floor(across / WIDTH).astype(int).clip(0, lanes - 1)
        cell = xp.floor(along / self._grain).astype(int).clip(0, cells - 1)
        return xp.asarray(self._profiles).ravel()[lane * cells + cell]

    def has_left(self, x, y):
        """Return whether (...) torsos over points x (...) and y (...), m, have left the lanes or are near an edge."""
        (lowest_x, highest_x), (lowest_y, highest_y) = self._bounds
        return (x < lowest_x) | (x > highest_x) | (y < lowest_y) | (y > highest_y)

    @functools.cached_property
    def _bounds(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Lowest and highest x, and lowest and highest y, that a torso may have, m."""
        half_width = (0.5 * WIDTH - SIDE_MARGIN) * self.unit  # of the outermost lanes, as far as a torso may go
        x_bounds = ((END_MARGIN - self.back) * self.unit, (self.length - END_MARGIN) * self.unit)
        y_bounds = (self.start(0) - half_width, self.start(len(self.lanes) - 1) + half_width)
        return x_bounds, y_bounds

    def torso_clearance(self, positions):
        """Return the heights (...) of torsos over the highest ground within half a standing height around them, m."""
        return clearance_over_highest(self, positions, self.unit)

    @property
    def lists_contacts(self) -> bool:
        """Return whether the ground is one height field, as boxes would have too many pairs."""
        return self._num_fields == len(self.lanes)

    @functools.cached_property
    def _num_fields(self) -> int:
        """The number of lanes that are a height field; these are the first ones."""
        return sum(kind in FIELDS for kind, _ in self.lanes)

    @functools.cached_property
    def _highest(self) -> float:
        """The height of the highest node of the height field, in units; 1 in place of 0, which MuJoCo refuses."""
        highest = max((heights.max() for heights in self._field_heights), default=0.0)
        return highest if highest > 0.0 else 1.0

    @functools.cached_property
    def _field_heights(self) -> list[np.ndarray]:
        """Heights of the height field's nodes, in units, (rows, columns) for each lane."""
        x = np.arange(0.0, self.back + self.length + _CELL, _CELL) - self.back
        rows = round(WIDTH / _CELL)
        return [
            FIELDS[kind](self._random(lane), obstacle, x, rows)
            for lane, (kind, obstacle) in enumerate(self.lanes[: self._num_fields])
        ]

    @functools.cached_property
    def _nodes(self) -> np.ndarray:
        """The height field's nodes (rows, columns) as shares of the highest; the last row is repeated as an edge."""
        lanes = self._field_heights
        if not lanes:
            return np.zeros((0, 0))
        last_row = lanes[-1][-1:]
        return field.shares(np.concatenate([*lanes, last_row]) / self._highest)

    @functools.cached_property
    def _profiles(self) -> np.ndarray:
        """Heights of stairs and trenches, in units, (lanes, cells)."""
        level_cells = math.ceil((self.back + RUNWAY) / self._grain)
        cells = np.arange(math.ceil((self.back + self.length) / self._grain)) - level_cells
        profiles = [
            STEPS[kind](self._random(lane), obstacle, cells, self._grain)
            for lane, (kind, obstacle) in enumerate(self.lanes[self._num_fields :], self._num_fields)
        ]
        return np.array(profiles).reshape(len(profiles), len(cells))

    @functools.cached_property
    def _grain(self) -> float:
        """Length of a cell of stairs and trenches, in units, such that their width is a multiple of it."""
        _, obstacle = self.lanes[-1]
        width = obstacle.width
        return width / round(width / _GRAIN)

    @functools.cached_property
    def _bottom(self) -> float:
        """Height of the plane below stairs and trenches, in units.

        It is their lowest ground, as a plane takes less time than boxes. Next to a height field it is lower, as feet
        would touch both.
        """
        return -_TRENCH_DEPTH if self._num_fields else self._profiles.min()

    def _random(self, lane: int) -> np.random.RandomState:
        """Return the random generator of a lane, by its kind and its number among lanes of that kind."""
        kind, _ = self.lanes[lane]
        kinds_before = [kind_before for kind_before, _ in self.lanes[:lane]]
        return np.random.RandomState((self.seed, KINDS.index(kind), kinds_before.count(kind)))


def make_lanes(
    body: Body,
    kinds: Mapping[str, int],
    length: float = _LENGTH_ALONE,
    levels=(DIFFICULTY,),
    seed: int = 0,
    sizes_in_meters: Mapping[str, float] | None = None,
    back: float = BACK,
) -> Terrain:
    """Return lanes of the size of a body.

    Args:
        body: any.
        kinds: number of lanes of each difficulty, by kind of ground.
        length: length of lanes ahead of the start, in standing heights.
        levels: difficulties, from 0 to 1.
        seed: seed of the random lanes.
        sizes_in_meters: sizes of obstacles by name, m and rad, in place of those of the difficulties.
        back: length of the level ground behind the start, in standing heights.

    Returns:
        The lanes, sorted by kind, in the order of `KINDS`, then by difficulty.

    Raises:
        ValueError: treads or trenches too narrow for the body's size.
    """
    unit = body.torso.standing_height
    fixed_sizes = {}
    for name, size in (sizes_in_meters or {}).items():
        fixed_sizes[name] = math.tan(size) if name == "slope" else size / unit
    if "width" in fixed_sizes:
        checks.number("width", sizes_in_meters["width"], min_width(body))
    lanes = []
    for kind in sorted(kinds, key=KINDS.index):
        for level in levels:
            obstacle = Obstacle(**(_DIFFICULTIES[kind](level) | fixed_sizes))
            lanes += [(kind, obstacle)] * kinds[kind]
    return Terrain(unit, length, tuple(lanes), seed, back)


def lanes_of_kind(kind: str):
    """Return a function that returns lanes of a kind for a body."""
    return lambda body: make_lanes(body, {kind: _LANES_ALONE}, back=_BACK_ALONE)
