"""Axes of a map: what tells bodies apart, so that the best of every kind is kept."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import checks
from arc_suite.animation.design.genes import extent
from arc_suite.robots.spec import Body


class Axis(NamedTuple):
    """A property of bodies.

    Attributes:
        of: its value.
        edges: between the bins of any bodies; None for a count, which is its own bin.
    """

    of: Callable[[Body], float]
    edges: tuple[float, ...] | None = None


def _ratio(over: int, under: int) -> Callable[[Body], float]:
    """The ratio of two extents of the standing body."""

    def ratio(body: Body) -> float:
        extents = extent(body)
        return float(extents[over] / extents[under])

    return ratio


# Edges are rounded fifths of 500 random bodies.
AXES: Mapping[str, Axis] = {
    "legs": Axis(lambda body: len(body.legs)),
    "links": Axis(lambda body: max(len(leg.links) for leg in body.legs)),
    "height": Axis(_ratio(2, 0), (0.33, 0.37, 0.41, 0.47)),
    "width": Axis(_ratio(1, 0), (0.92, 1.0, 1.02, 1.07)),
}
HELP = "legs, links: their numbers; height, width: over the length, in five bins"
SPREAD = (-0.75, -0.25, 0.25, 0.75)  # edges of the bins around a body, standard deviations of its variants


class Map(NamedTuple):
    """Cells of bodies.

    Attributes:
        names: of the axes.
        edges: of the bins by axis; None for counts.
    """

    names: tuple[str, ...]
    edges: tuple[tuple[float, ...] | None, ...]

    @classmethod
    def of(cls, names: Sequence[str], around: Body | None = None, amount: float = 0.0) -> "Map":
        """Return the map of one or two axes, with bins about a body if there is one.

        Raises:
            ValueError: an unknown axis, a repeated one, or more than two.
        """
        names = tuple(checks.name(name, AXES, "axis") for name in names)
        if len(names) not in (1, 2) or len(set(names)) < len(names):
            raise ValueError(f"map: expected one or two different axes of {', '.join(AXES)}, got {','.join(names)}")
        return cls(names, tuple(_edges(AXES[name], around, amount) for name in names))

    def cell(self, body: Body) -> tuple[int, ...]:
        """Return the bin of a body on each axis; bins of ratios count from 1."""
        values = (AXES[name].of(body) for name in self.names)
        return tuple(
            int(value) if edges is None else 1 + int(np.searchsorted(edges, value))
            for value, edges in zip(values, self.edges, strict=True)
        )

    def label(self, cell: Sequence[int]) -> str:
        """Return the name of a cell's files: legs6_links3."""
        return "_".join(f"{name}{bin}" for name, bin in zip(self.names, cell, strict=True))


def _edges(axis: Axis, around: Body | None, amount: float) -> tuple[float, ...] | None:
    if axis.edges is None or around is None:
        return axis.edges
    value = axis.of(around)
    return tuple(round(value * math.exp(amount * deviation), 4) for deviation in SPREAD)
