"""Footholds: where feet that are about to land find ground, by scans of the heights about the torso."""

from typing import Any, NamedTuple

import numpy as np

from arc_suite.tasks.sensors import FORWARD, LEFT

_SHIFT_SPACING = 0.08  # standing heights
_SHIFTS_EACH_WAY = 8
_FORWARD_COST = 1.5  # of a shift forward, against 1 backward: a foot that has far to go comes late


def _shift_cost(shift: float) -> float:
    return _FORWARD_COST * shift if shift > 0.0 else -shift


# By how much feet may land further ahead along their paths, standing heights, the cheapest first.
LANDING_SHIFTS = np.array(sorted(_SHIFT_SPACING * np.arange(-_SHIFTS_EACH_WAY, _SHIFTS_EACH_WAY + 1), key=_shift_cost))
# Points along a foot's path, from its foothold, that must have ground, standing heights.
SUPPORT_POINTS = np.array((-0.12, 0.0, 0.12))
# Ground that is further below the ground about the feet is no foothold, standing heights.
MAX_FOOTHOLD_DROP = 0.25


class View(NamedTuple):
    """The latest scans of heights in a number of environments.

    Attributes:
        heights: (environments, scans, points) heights of the ground, in standing heights, as a task's block `scan`
            gives them.
        moved: (environments, scans, 2) displacement of the torso since each scan, m, forward and left.
        reach: R, the mean distance of the feet from their center, m: the points of a scan are multiples of it.
    """

    heights: np.ndarray
    moved: np.ndarray
    reach: float

    def ground(self, x, y):
        """Return lower bounds (environments, ...) of the heights of the ground at points, in standing heights.

        The bound of a scan is the lower of its two nearest points, before and behind. So it meets every trench that
        is wider than their distance. The bound of several scans is the highest of theirs.

        Args:
            x: (environments, ...) forward of the torso, m.
            y: (environments, ...) to its left, m.
        """
        xp = x.__array_namespace__()
        extra_axes = [1] * (x.ndim - 1)
        environments = np.arange(len(x)).reshape(-1, *extra_axes)
        ground = xp.full_like(x, -np.inf)
        for scan in range(self.heights.shape[1]):
            heights = self.heights[:, scan]
            moved_forward = self.moved[:, scan, 0].reshape(-1, *extra_axes)
            moved_left = self.moved[:, scan, 1].reshape(-1, *extra_axes)
            points = find_scan_points((x + moved_forward) / self.reach, (y + moved_left) / self.reach)
            bound = xp.minimum(heights[environments, points.before], heights[environments, points.behind])
            ground = xp.maximum(ground, bound)
        return ground


def find_landings(view: View, landing, along, places, height: float, support_points=SUPPORT_POINTS) -> tuple:
    """Return by how much feet should land further ahead, m, and whether that finds ground, both (environments, feet).

    It is the least shift that finds ground, or 0.

    Args:
        view: view of the ground.
        landing: (environments, feet, 2) where feet would land, m, forward and left of the torso.
        along: (environments, feet, 2) directions of their paths, unit vectors.
        places: (feet, 2) positions of the feet at rest, m.
        height: the standing height, m.
        support_points: (n,) along a foot's path, from its foothold, that must have ground, standing heights.
    """
    xp = landing.__array_namespace__()
    rest_positions = xp.broadcast_to(xp.asarray(places), landing.shape)
    level = xp.median(view.ground(rest_positions[..., 0], rest_positions[..., 1]), axis=-1)

    # Distances of all support points of all shifts from the landing, along the path, m.
    distances = (LANDING_SHIFTS[:, None] + support_points).ravel() * height
    points = landing[..., None, :] + along[..., None, :] * distances[:, None]
    ground = view.ground(points[..., 0], points[..., 1])
    ground = ground.reshape(*landing.shape[:2], len(LANDING_SHIFTS), len(support_points))
    is_safe = (ground > level[:, None, None, None] - MAX_FOOTHOLD_DROP).all(axis=-1)  # (environments, feet, shifts)
    has_ground = is_safe.any(axis=-1)
    first_safe = is_safe.argmax(axis=-1)
    shifts = height * xp.where(has_ground, xp.asarray(LANDING_SHIFTS)[first_safe], 0.0)
    return shifts, has_ground


class ScanPoints(NamedTuple):
    """Points of a scan next to places: those before and behind each, in the nearest column.

    Attributes:
        before: (...) index of the point before, or of that at the place.
        behind: (...) index of the point behind, or of that at the place.
        share: (...) of the way from the first to the second at which the place is.
    """

    before: Any
    behind: Any
    share: Any


def find_scan_points(x, y) -> ScanPoints:
    """Return the points of a scan next to places forward (...) and left (...) of the torso, in R.

    The points lie on a grid, in rows by `FORWARD` and columns by `LEFT`, as one list.
    """
    xp = x.__array_namespace__()
    row = grid_index(x, FORWARD)
    column = xp.rint(grid_index(y, LEFT))
    row_before = xp.floor(row)
    return ScanPoints(
        before=(row_before * len(LEFT) + column).astype(int),
        behind=(xp.ceil(row) * len(LEFT) + column).astype(int),
        share=row - row_before,
    )


def grid_index(coordinate, grid):
    """Return where a coordinate lies among evenly spaced ones, as a number of steps from the first."""
    return ((coordinate - grid[0]) / (grid[1] - grid[0])).clip(0.0, len(grid) - 1)
