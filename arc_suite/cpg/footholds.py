"""Footholds: where feet that are about to land find ground, by scans of the heights about the torso."""

from typing import NamedTuple

import numpy as np

from arc_suite.tasks.sensors import AHEAD, ASIDE

# By how much feet may land further ahead, in standing heights. Those ahead count half as much again as those behind,
# since a foot that has far to go comes late.
SHIFTS = np.array(sorted(0.08 * np.arange(-8, 9), key=lambda shift: 1.5 * shift if shift > 0.0 else -shift))
AROUND = np.array((-0.12, 0.0, 0.12))  # standing heights along the way: ground that a foot needs
DEEP = 0.25  # standing heights below the ground about the feet, at which ground is no foothold


class View(NamedTuple):
    """The latest scans of heights in rows of a batch.

    Attributes:
        heights: (rows, scans, points) of the ground, in standing heights, as a task's block `scan` gives them.
        moved: (rows, scans, 2) way of the torso since each scan, m, forward and left.
        reach: R, by which the points lie apart, m.
    """

    heights: np.ndarray
    moved: np.ndarray
    reach: float

    def ground(self, x, y) -> np.ndarray:
        """Return heights (rows, ...) of the ground at points that are sure to be no lower, in standing heights.

        Of a scan it is the lower of the two points before and behind, which meets every trench that is
        wider than their distance; of several scans it is the highest.

        Args:
            x: (rows, ...) forward of the torso, m.
            y: (rows, ...) to its left, m.
        """
        found = np.full(x.shape, -np.inf)
        for heights, moved in zip(self.heights.swapaxes(0, 1), self.moved.swapaxes(0, 1), strict=True):
            ahead, aside = (moved[:, i].reshape(-1, *[1] * (x.ndim - 1)) for i in (0, 1))
            column, row = _index((x + ahead) / self.reach, AHEAD), np.rint(_index((y + aside) / self.reach, ASIDE))
            rows = np.arange(len(heights)).reshape(ahead.shape)
            ends = (heights[rows, (end * len(ASIDE) + row).astype(int)] for end in (np.floor(column), np.ceil(column)))
            found = np.maximum(found, np.minimum(*ends))
        return found


def shifts(view: View, landing, along, places, height: float) -> np.ndarray:
    """Return by how much feet should land further ahead, (rows, feet) m: the least that finds ground, or 0.

    Args:
        view: of the ground.
        landing: (rows, feet, 2) where feet would land, m, forward and left of the torso.
        along: (rows, feet, 2) directions of their ways, unit vectors.
        places: (feet, 2) where feet stand at ease, m.
        height: the standing height, m.
    """
    level = np.median(view.ground(*np.broadcast_to(places, landing.shape).transpose(2, 0, 1)), axis=-1)
    tried = (SHIFTS[:, None] + AROUND).ravel() * height
    points = landing[..., None, :] + along[..., None, :] * tried[:, None]
    ground = view.ground(points[..., 0], points[..., 1]).reshape(*landing.shape[:2], len(SHIFTS), len(AROUND))
    safe = (ground > level[:, None, None, None] - DEEP).all(axis=-1)
    return height * np.where(safe.any(axis=-1), SHIFTS[safe.argmax(axis=-1)], 0.0)


def _index(place, places):
    """Where a place lies among evenly spaced ones, counted from the first."""
    return ((place - places[0]) / (places[1] - places[0])).clip(0.0, len(places) - 1)
