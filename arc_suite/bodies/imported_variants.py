"""Variants of imported bodies: links of other lengths, in each leg and its mirror images alike."""

from collections.abc import Iterator

import numpy as np

from arc_suite.models.imported_links import adjustable_links, change_link_ends
from arc_suite.robots.spec import Body, Leg

_SAME_PLACE = 0.01  # standing heights; legs of a file are mirror images up to this distance


def list_changes(body: Body) -> tuple[str, ...]:
    """Return what `deform_imported_legs` changes: links with a length, each the first of those that are alike."""
    return tuple(legs[0].part_names[part] for legs, parts in _groups_of_legs(body) for part in parts)


def deform_imported_legs(body: Body, changes: np.ndarray) -> Body:
    """Return an imported body with legs of other lengths, whose feet stand as level as before.

    Masses of links follow their lengths; motors, the torso and joint axes stay. Where legs grow by different factors,
    their links turn so that all feet reach the same floor: the mean of what the legs would reach.

    Args:
        body: with a source.
        changes: (deformations,) logarithms of the factors of links; see `list_changes`.

    Raises:
        ValueError: a length grown out of range.
    """
    factors = {}
    first = 0  # index of the changes of a group of legs
    for legs, parts in _groups_of_legs(body):
        for number, part_index in enumerate(parts):
            for leg in legs:
                factors[leg.part_names[part_index]] = float(np.exp(changes[first + number]))
        first += len(parts)
    depths = np.array([_adjustable_depth(leg, factors) for leg in body.legs])  # (legs, 2) before and after, m
    mean_growth = float((depths[:, 1] - depths[:, 0]).mean())
    ends = {}
    for leg, (depth, new_depth) in zip(body.legs, depths, strict=True):
        level_factor = (depth + mean_growth) / new_depth if depth * new_depth > 0.0 else 1.0
        for part, link in zip(leg.part_names, leg.links, strict=False):
            if part in factors:
                x, y, z = np.multiply(link.end, factors[part]).tolist()
                ends[part] = (x, y, level_factor * z)
    return change_link_ends(body, ends)


def _groups_of_legs(body: Body) -> Iterator[tuple[list[Leg], list[int]]]:
    """Yield legs with their mirror images, and the indices of their links that have lengths."""
    adjustable_parts = set(adjustable_links(body))
    remaining_legs = list(body.legs)
    while remaining_legs:
        first_leg = remaining_legs[0]
        tolerance = _SAME_PLACE * body.torso.standing_height
        legs = [leg for leg in remaining_legs if leg is first_leg or _are_mirror_images(first_leg, leg, tolerance)]
        remaining_legs = [leg for leg in remaining_legs if leg not in legs]
        indices = []
        for index in range(len(first_leg.links)):
            if all(leg.part_names[index] in adjustable_parts for leg in legs):
                indices.append(index)
        if indices:
            yield legs, indices


def _are_mirror_images(leg: Leg, candidate: Leg, tolerance: float) -> bool:
    """Return whether the links of two legs begin and end at mirrored places, up to a tolerance in m."""
    if len(leg.links) != len(candidate.links):
        return False
    mirrored_points = np.array(leg.mirrored(leg.name).points)
    return bool(np.abs(mirrored_points - np.array(candidate.points)).max() < tolerance)


def _adjustable_depth(leg: Leg, factors: dict[str, float]) -> tuple[float, float]:
    """Return how deep the links of a leg that change reach down together, before and after, m."""
    depth = 0.0
    new_depth = 0.0
    for part, link in zip(leg.part_names, leg.links, strict=False):
        if part in factors:
            depth -= link.end[2]
            new_depth -= factors[part] * link.end[2]
    return depth, new_depth
