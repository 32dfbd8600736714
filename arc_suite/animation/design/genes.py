"""Genes and bodies: vectors of numbers from 0 to 1, and the bodies that they stand for within budgets.

A body is the best that a goal has only if all bodies may spend the same. So a budget fixes what a body weighs and
bounds its extent. Shapes come first and sizes last: a shape is scaled until it keeps the budget.
"""

import math
from typing import NamedTuple

import numpy as np

from arc_suite.bodies import generator
from arc_suite.bodies.generator import Proportions
from arc_suite.models.outline import outline
from arc_suite.models.standing import standing
from arc_suite.robots.spec import Body

GENE_DEVIATIONS = 2.0  # standard deviations of a mutation that a gene spans to either side


class Budget(NamedTuple):
    """What a body may spend.

    Attributes:
        mass: of every body, kg; its density follows.
        span: greatest extent of the standing body along x, y or z, m.
        height: greatest standing height, m.
        power: greatest mean of the motors' positive power over a walk, W/kg.
    """

    mass: float
    span: float
    height: float = math.inf
    power: float = math.inf


# Ranges of proportions, those of `generator.random_body`; lengths of half of the torso's length where not said.
_RANGES = {
    "legs": (4.0, 13.0),  # rounded down, as are links
    "links": (2.0, 5.0),
    "layout": (0.0, 1.0),  # radial from `_RADIAL` on
    "height": (0.6, 1.4),
    "width": (0.35, 0.7),
    "thickness": (0.15, 0.3),  # of the height
    "fan": (15.0, 45.0),  # degrees
    "reach": (0.7, 1.2),  # of the height
    **{f"share_{link}": (0.8, 1.2) for link in range(1, 5)},
    **{f"elevation_{link}": (-8.0, 8.0) for link in range(1, 5)},  # degrees
    **{f"reach_{place}": (0.75, 1.3) for place in ("front", "middle", "rear")},
    "size": (0.5, 1.0),  # of the greatest within the budget
}
_RADIAL = 0.7


class ProportionGenes:
    """Bodies of all the proportions of `generator.random_body`, whose unequal legs change evenly along the body."""

    names = tuple(_RANGES)

    def shape(self, genes: np.ndarray) -> Body:
        """Return the body of genes (n,) from 0 to 1, with a torso of 1 m half-length.

        Raises:
            ValueError: a length out of range.
        """
        gene = self._numbers(genes)
        legs, links = (int(min(gene[name], _RANGES[name][1] - 1.0)) for name in ("legs", "links"))
        layout = "radial" if legs % 2 or gene["layout"] >= _RADIAL else "pairs"
        along = generator.places(legs, layout)
        unequal = np.interp(along, (-1.0, 0.0, 1.0), [gene[f"reach_{place}"] for place in ("rear", "middle", "front")])
        profile = [
            (share * gene[f"share_{link}"], elevation + gene[f"elevation_{link}"])
            for link, (share, elevation) in enumerate(generator.PROFILES[links], 1)
        ]
        proportions = Proportions(
            height=gene["height"],
            half_length=1.0,
            half_width=1.0 if layout == "radial" else gene["width"],
            thickness=gene["thickness"],
            fan=gene["fan"],
            profile=profile,
            reaches=(gene["reach"] * unequal).tolist(),
        )
        return generator.proportioned("design", legs, layout, proportions)

    def size(self, genes: np.ndarray) -> float:
        """Return the share of the greatest size within a budget."""
        return self._numbers(genes)["size"]

    def _numbers(self, genes: np.ndarray) -> dict[str, float]:
        low, high = np.transpose(list(_RANGES.values()))
        return dict(zip(_RANGES, (low + (high - low) * genes).tolist(), strict=True))


class VariantGenes:
    """Bodies like another one: legs of other lengths and headings, as those of `generator.mutated`."""

    def __init__(self, body: Body, amount: float):
        """Take the body, and the standard deviation of logarithms of lengths and of headings in rad."""
        self._body, self._amount = body, amount
        self.names = tuple(f"deformation_{number}" for number in range(1, generator.deformations(body) + 1))

    def shape(self, genes: np.ndarray) -> Body:
        """Return the deformed body; genes of 0.5 leave it as it is."""
        return generator.deformed(self._body, self._amount * GENE_DEVIATIONS * (2.0 * genes - 1.0))

    def size(self, genes: np.ndarray) -> None:
        """Return None: variants have the size of the body."""


Genes = ProportionGenes | VariantGenes


def extent(body: Body) -> np.ndarray:
    """Return the extent (3,) of the standing body along x, y and z, from the floor on, m."""
    points = outline(body)
    lowest = -body.torso.standing_height
    return points.max(axis=0) - np.append(points.min(axis=0)[:2], lowest)


def body_within_budget(budget: Budget, space: Genes, genes: np.ndarray, name: str) -> Body:
    """Return the body of genes, scaled and of the density that keeps a budget.

    Args:
        budget: to keep.
        space: of the bodies.
        genes: (n,) from 0 to 1.
        name: of the body.

    Raises:
        ValueError: a length or density out of range.
    """
    shape, share = space.shape(genes), space.size(genes)
    most = min(budget.span / float(extent(shape).max()), budget.height / shape.torso.standing_height)
    factor = min(most, 1.0) if share is None else share * most
    # The density comes first: small parts of a light body would be refused.
    ballast = sum(weight.mass for weight in shape.ballast)
    density = shape.density * (budget.mass / factor**3 - ballast) / (standing(shape).mass - ballast)
    body = shape.replace(density=density)
    return (generator.scaled(body, factor) if factor != 1.0 else body).replace(name=name)
