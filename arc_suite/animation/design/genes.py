"""Genes and bodies: vectors of numbers from 0 to 1, and the bodies that they make within a budget.

Bodies can be compared only if all may spend the same. So a budget fixes the mass of a body and bounds its extent. Genes
make the shape of a body first. The shape is scaled then, so that the body keeps the budget.
"""

import math
from typing import NamedTuple

import numpy as np

from arc_suite.bodies import generator
from arc_suite.bodies.generator import Proportions
from arc_suite.models.outline import outline
from arc_suite.models.standing import measure_standing
from arc_suite.robots.spec import Body

GENE_DEVIATIONS = 2.0  # standard deviations of a variant's lengths, that a gene spans to either side of its middle


class Budget(NamedTuple):
    """What a body may spend.

    Attributes:
        mass: mass of every body, kg; its density follows. None: bodies weigh what their parts weigh.
        span: greatest extent of the standing body along x, y or z, m.
        height: greatest standing height, m.
        power: greatest mean power of a walk, W/kg: positive work of the motors and heat of their windings.
    """

    mass: float | None
    span: float = math.inf
    height: float = math.inf
    power: float = math.inf


# Lowest and highest proportions, those of `generator.random_body`. Lengths are in half-lengths of the torso, unless a
# comment says otherwise.
_RANGES = {
    "legs": (4.0, 13.0),  # rounded down
    "links": (2.0, 5.0),  # rounded down
    "layout": (0.0, 1.0),  # radial from `_MIN_RADIAL` on
    "height": (0.6, 1.4),
    "width": (0.35, 0.7),
    "thickness": (0.15, 0.3),  # of the height
    "fan": (15.0, 45.0),  # degrees
    "reach": (0.7, 1.2),  # of the height
    **{f"share_{link}": (0.8, 1.2) for link in range(1, 5)},  # factors of the lengths of links
    **{f"elevation_{link}": (-8.0, 8.0) for link in range(1, 5)},  # degrees
    **{f"reach_{part}": (0.75, 1.3) for part in ("front", "middle", "rear")},  # factors of the reach
    "size": (0.5, 1.0),  # of the largest size within the budget
}
_MIN_RADIAL = 0.7  # gene of the layout, from which legs stand around the torso


class ProportionGenes:
    """Genes of all proportions of `generator.random_body`, where the reach of legs changes evenly along the body."""

    names = tuple(_RANGES)

    def shape(self, genes: np.ndarray) -> Body:
        """Return the body of genes (n,) from 0 to 1, with a torso of 1 m half-length.

        Raises:
            ValueError: a length out of range.
        """
        numbers = self._numbers(genes)
        legs = self._whole_number(numbers, "legs")
        links = self._whole_number(numbers, "links")
        is_radial = legs % 2 == 1 or numbers["layout"] >= _MIN_RADIAL
        layout = "radial" if is_radial else "pairs"
        leg_positions = generator.mount_shares(legs, layout)  # along the body, from -1 at the rear to 1 in front
        reach_factors = np.interp(
            leg_positions,
            (-1.0, 0.0, 1.0),
            (numbers["reach_rear"], numbers["reach_middle"], numbers["reach_front"]),
        )
        profile = [  # share of the leg's length, and elevation in degrees, of each link
            (share * numbers[f"share_{link}"], elevation + numbers[f"elevation_{link}"])
            for link, (share, elevation) in enumerate(generator.PROFILES[links], 1)
        ]
        proportions = Proportions(
            height=numbers["height"],
            half_length=1.0,
            half_width=1.0 if is_radial else numbers["width"],
            thickness=numbers["thickness"],
            fan=numbers["fan"],
            profile=profile,
            reaches=(numbers["reach"] * reach_factors).tolist(),
        )
        return generator.assemble_body("design", legs, layout, proportions)

    def size_share(self, genes: np.ndarray) -> float:
        """Return the size of the body as a share of the largest size within a budget."""
        return self._numbers(genes)["size"]

    def _numbers(self, genes: np.ndarray) -> dict[str, float]:
        """Return the proportions of genes, by name."""
        lowest, highest = np.transpose(list(_RANGES.values()))
        numbers = lowest + (highest - lowest) * genes
        return dict(zip(_RANGES, numbers.tolist(), strict=True))

    @staticmethod
    def _whole_number(numbers: dict[str, float], name: str) -> int:
        """Return a number rounded down, and less than the end of its range."""
        _, end = _RANGES[name]
        return int(min(numbers[name], end - 1.0))


class VariantGenes:
    """Genes of the variants of a body, whose legs have other lengths and headings, as those of `generator.mutated`.

    Legs of imported robots keep their headings.
    """

    def __init__(self, body: Body, amount: float):
        """Take the body, and the standard deviation of logarithms of lengths and of headings in rad.

        Raises:
            ValueError: an imported body without a link that can change.
        """
        self.names = generator.list_deformations(body)
        if not self.names:
            raise ValueError(f"{body.name}: no link has a length that can change; loops close between them")
        self._body = body
        self._amount = amount

    def shape(self, genes: np.ndarray) -> Body:
        """Return the variant of genes (n,) from 0 to 1; genes of 0.5 leave the body as it is."""
        changes = self._amount * GENE_DEVIATIONS * (2.0 * genes - 1.0)
        return generator.deform_legs(self._body, changes)

    def size_share(self, genes: np.ndarray) -> None:
        """Return None: variants have the size of the body."""


Genes = ProportionGenes | VariantGenes


def extent(body: Body) -> np.ndarray:
    """Return the extent (3,) of the standing body along x, y and z, in z from the floor, m."""
    points = outline(body)
    lowest = points.min(axis=0)
    lowest[2] = -body.torso.standing_height
    return points.max(axis=0) - lowest


def body_within_budget(budget: Budget, space: Genes, genes: np.ndarray, name: str) -> Body:
    """Return the body of genes, with the scale and the density that keep a budget.

    Without a mass in the budget, the body keeps its scale and density: only links of imported robots change.

    Args:
        budget: budget to keep.
        space: space that makes bodies of genes.
        genes: (n,) from 0 to 1.
        name: name of the body.

    Raises:
        ValueError: a length or density out of range, or a body of given mass that exceeds the budget.
    """
    shape = space.shape(genes)
    if budget.mass is None:
        _check_within(budget, shape)
        return shape.replace(name=name)
    size_share = space.size_share(genes)
    largest_factor = min(budget.span / float(extent(shape).max()), budget.height / shape.torso.standing_height)
    factor = min(largest_factor, 1.0) if size_share is None else size_share * largest_factor
    # The density comes before the scale: small parts of the shape's own density could be too light to be allowed. The
    # scale multiplies masses by its third power.
    ballast = sum(weight.mass for weight in shape.ballast)  # kg, does not depend on the density
    density = shape.density * (budget.mass / factor**3 - ballast) / (measure_standing(shape).mass - ballast)
    body = shape.replace(density=density)
    if factor != 1.0:
        body = generator.scaled(body, factor)
    return body.replace(name=name)


def _check_within(budget: Budget, body: Body) -> None:
    """Raise ValueError for a body that is larger than the budget."""
    sizes = {"span": float(extent(body).max()), "height": body.torso.standing_height}
    for name, size in sizes.items():
        limit = getattr(budget, name)
        if size > limit:
            raise ValueError(f"{name}: {size:.4g} m, more than {limit:.4g}")
