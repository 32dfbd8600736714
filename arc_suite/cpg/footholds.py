"""Footholds: where feet that are about to land find ground, by scans of the heights about the torso."""

from typing import NamedTuple

import numpy as np

from arc_suite.tasks.sensors import FORWARD, LEFT

# By how much feet may land further ahead, in standing heights. Those ahead count half as much again as those behind,
# since a foot that has far to go comes late.
LANDING_SHIFTS = np.array(sorted(0.08 * np.arange(-8, 9), key=lambda shift: 1.5 * shift if shift > 0.0 else -shift))
SUPPORT_POINTS = np.array((-0.12, 0.0, 0.12))  # standing heights along the path: ground that a foot needs
MAX_FOOTHOLD_DROP = 0.25  # standing heights below the ground about the feet, at which ground is no foothold


class View(NamedTuple):
    """The latest scans of heights in a number of environments.

    Attributes:
        heights: (environments, scans, points) of the ground, in standing heights, as a task's block `scan` gives them.
        moved: (environments, scans, 2) displacement of the torso since each scan, m, forward and left.
        reach: R, by which the points lie apart, m.
    """

    heights: np.ndarray
    moved: np.ndarray
    reach: float

    def ground(self, x, y):
        """Return lower bounds (environments, ...) of the heights of the ground at points, in standing heights.

        Of a scan it is the lower of the two points before and behind, which meets every trench that is
        wider than their distance; of several scans it is the highest.

        Args:
            x: (environments, ...) forward of the torso, m.
            y: (environments, ...) to its left, m.
        """
        numpy, axes = x.__array_namespace__(), [1] * (x.ndim - 1)
        environments, found = np.arange(len(x)).reshape(-1, *axes), numpy.full_like(x, -np.inf)
        for heights, moved in zip(self.heights.swapaxes(0, 1), self.moved.swapaxes(0, 1), strict=True):
            ahead, aside = (moved[:, i].reshape(-1, *axes) for i in (0, 1))
            column, row = _index((x + ahead) / self.reach, FORWARD), numpy.rint(_index((y + aside) / self.reach, LEFT))
            points = ((end * len(LEFT) + row).astype(int) for end in (numpy.floor(column), numpy.ceil(column)))
            found = numpy.maximum(found, numpy.minimum(*(heights[environments, point] for point in points)))
        return found


def find_shifts(view: View, landing, along, places, height: float):
    """Return by how much feet should land further ahead, (environments, feet) m: the least that finds ground, or 0.

    Args:
        view: of the ground.
        landing: (environments, feet, 2) where feet would land, m, forward and left of the torso.
        along: (environments, feet, 2) directions of their paths, unit vectors.
        places: (feet, 2) where feet stand at ease, m.
        height: the standing height, m.
    """
    return find_landings(view, landing, along, places, height)[0]


def find_landings(view: View, landing, along, places, height: float, around=SUPPORT_POINTS) -> tuple:
    """Return `shifts`, and whether there is ground to land on, (environments, feet), with ground around, in h."""
    numpy = landing.__array_namespace__()
    at_ease = numpy.broadcast_to(numpy.asarray(places), landing.shape)
    level = numpy.median(view.ground(at_ease[..., 0], at_ease[..., 1]), axis=-1)
    tried = (LANDING_SHIFTS[:, None] + around).ravel() * height
    points = landing[..., None, :] + along[..., None, :] * tried[:, None]
    ground = view.ground(points[..., 0], points[..., 1]).reshape(*landing.shape[:2], len(LANDING_SHIFTS), len(around))
    safe = (ground > level[:, None, None, None] - MAX_FOOTHOLD_DROP).all(axis=-1)
    found = safe.any(axis=-1)
    return height * numpy.where(found, numpy.asarray(LANDING_SHIFTS)[safe.argmax(axis=-1)], 0.0), found


def _index(place, places):
    """Where a place lies among evenly spaced ones, counted from the first."""
    return ((place - places[0]) / (places[1] - places[0])).clip(0.0, len(places) - 1)
