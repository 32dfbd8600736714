"""Axes of a map: properties that tell bodies apart, so that a search keeps the best body of every kind."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import checks, registry
from arc_suite.animation.design.genes import extent
from arc_suite.robots.spec import Body


class Axis(NamedTuple):
    """A property of bodies.

    Attributes:
        measure: returns the value of a body.
        edges: between the bins of all bodies; None for a count, where each count is a bin.
    """

    measure: Callable[[Body], float]
    edges: tuple[float, ...] | None = None


def _count_legs(body: Body) -> int:
    return len(body.legs)


def _count_links(body: Body) -> int:
    return max(len(leg.links) for leg in body.legs)


def _relative_height(body: Body) -> float:
    length, _, height = extent(body)
    return float(height / length)


def _relative_width(body: Body) -> float:
    length, width, _ = extent(body)
    return float(width / length)


# Edges are rounded quintiles of 500 random bodies.
AXES: Mapping[str, Axis] = {
    "legs": Axis(_count_legs),
    "links": Axis(_count_links),
    "height": Axis(_relative_height, (0.33, 0.37, 0.41, 0.47)),
    "width": Axis(_relative_width, (0.92, 1.0, 1.02, 1.07)),
}
HELP = "legs, links: their numbers; height, width: over the length, in five bins; or module:name"
VARIANT_EDGES = (-0.75, -0.25, 0.25, 0.75)  # of the bins around a body, standard deviations of its variants


def axis_of(name: str) -> Axis:
    """Return the axis of a name, or of `module:name`, which another package registers.

    Raises:
        ValueError: an unknown name, or no axis.
    """
    return registry.find_instance("axis", name, AXES, Axis)


class Map(NamedTuple):
    """Cells of bodies.

    Attributes:
        names: names of the axes; see `axis_of`.
        edges: edges of the bins by axis; None for counts.
    """

    names: tuple[str, ...]
    edges: tuple[tuple[float, ...] | None, ...]

    @classmethod
    def of(cls, names: Sequence[str], around: Body | None = None, amount: float = 0.0) -> "Map":
        """Return the map of one or two axes.

        Args:
            names: names of the axes.
            around: a body whose variants are searched, with bins about it; None for bins of all bodies.
            amount: standard deviation of the logarithms of the variants' lengths.

        Raises:
            ValueError: an unknown axis, a repeated one, more than two, or one whose value of `around` is not above 0.
        """
        axes = {registry.bare_name(name): axis_of(name) for name in names}
        if len(names) not in (1, 2) or len(axes) < len(names):
            raise ValueError(f"map: expected one or two different axes of {', '.join(AXES)}, got {','.join(names)}")
        edges = tuple(_bin_edges(name, axis, around, amount) for name, axis in axes.items())
        return cls(tuple(names), edges)

    def cell(self, body: Body) -> tuple[int, ...]:
        """Return the bin of a body on each axis: its count, or the number of its bin, from 1.

        Raises:
            ValueError: an axis has no finite value of the body.
        """
        cell = []
        for name, edges in zip(self.names, self.edges, strict=True):
            value = checks.number(f"axis {registry.bare_name(name)}", axis_of(name).measure(body))
            cell.append(int(value) if edges is None else 1 + int(np.searchsorted(edges, value)))
        return tuple(cell)

    def label(self, cell: Sequence[int]) -> str:
        """Return the name of a cell's files, such as legs6_links3."""
        return "_".join(f"{registry.bare_name(name)}{number}" for name, number in zip(self.names, cell, strict=True))

    def describe(self, cell: Sequence[int]) -> str:
        """Return a cell in words, such as "6 legs, 3 links" or "height 2 of 5, width 4 of 5"."""
        texts = []
        for name, edges, number in zip(map(registry.bare_name, self.names), self.edges, cell, strict=True):
            texts.append(f"{number} {name}" if edges is None else f"{name} {number} of {len(edges) + 1}")
        return ", ".join(texts)


def _bin_edges(name: str, axis: Axis, around: Body | None, amount: float) -> tuple[float, ...] | None:
    """Return the edges of the bins of an axis; see `Map.of`."""
    if axis.edges is None or around is None:
        return axis.edges
    value = checks.number(f"axis {name}", axis.measure(around))
    if value <= 0.0:
        raise ValueError(f"axis {name}: expected a value above 0 of {around.name}, got {value:g}")
    return tuple(round(value * math.exp(amount * deviation), 4) for deviation in VARIANT_EDGES)
