"""The upper side of a mesh as heights on a grid."""

import numpy as np

_MAX_SAMPLES = 1 << 25  # of all triangles together; a mesh that covers a grid once has twice the grid's nodes
_CHUNK = 1 << 20  # samples at a time


def measure_heights(points: np.ndarray, triangles: np.ndarray, max_nodes: int) -> np.ndarray:
    """Return the heights of the highest triangles at the nodes of a grid, m; 0 where there is none.

    Args:
        points: (points, 3) corners, m; the least of each coordinate is 0.
        triangles: (triangles, 3) indices of corners.
        max_nodes: number of nodes along the longer side.

    Returns:
        (rows, columns); rows along y, columns along x, from the least to the greatest.

    Raises:
        ValueError: triangles that lie over each other too often.
    """
    length, width = points[:, :2].max(axis=0)
    cell = max(length, width) / (max_nodes - 1)
    columns = max(2, round(length / cell) + 1)
    rows = max(2, round(width / cell) + 1)
    scale = np.array((columns - 1, rows - 1)) / (length, width)  # nodes per m
    corners = points[triangles]
    corners[..., :2] *= scale
    # Nodes in the rectangle around a triangle; rounding must not lose those on its edges.
    first = np.ceil(corners[..., :2].min(axis=1) - 1e-6).astype(int)
    last = np.floor(corners[..., :2].max(axis=1) + 1e-6).astype(int).clip(max=(columns - 1, rows - 1))
    extents = (last - first + 1).clip(0)
    counts = extents.prod(axis=1)
    if counts.sum() > _MAX_SAMPLES:
        raise ValueError("expected ground: too many of its triangles lie over each other")
    heights = np.zeros((rows, columns))
    chunk_of_triangle = np.cumsum(counts) // _CHUNK
    edges = np.flatnonzero(np.diff(chunk_of_triangle, prepend=-1))
    for chunk in np.split(np.arange(len(triangles)), edges[1:]):
        _draw(heights, corners[chunk], first[chunk], extents[chunk])
    return heights


def _draw(heights: np.ndarray, corners: np.ndarray, first: np.ndarray, extents: np.ndarray) -> None:
    """Raise the heights (rows, columns) of nodes under triangles to these.

    Args:
        heights: heights of the grid.
        corners: (triangles, 3, 3) corners of triangles: x and y in nodes, z in m.
        first: (triangles, 2) least node around each triangle, along x and y.
        extents: (triangles, 2) numbers of nodes around each triangle, along x and y.
    """
    counts = extents.prod(axis=1)
    triangle = np.repeat(np.arange(len(corners)), counts)
    number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)  # within the triangle's rectangle
    column = first[triangle, 0] + number % extents[triangle, 0]
    row = first[triangle, 1] + number // extents[triangle, 0]
    sides = corners[:, 1:, :2] - corners[:, :1, :2]  # (triangles, 2, 2) from the first corner
    areas = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    with np.errstate(divide="ignore", invalid="ignore"):  # upright triangles have no area
        x = column - corners[triangle, 0, 0]
        y = row - corners[triangle, 0, 1]
        second = (x * sides[triangle, 1, 1] - y * sides[triangle, 1, 0]) / areas[triangle]
        third = (y * sides[triangle, 0, 0] - x * sides[triangle, 0, 1]) / areas[triangle]
        is_inside = (second >= -1e-6) & (third >= -1e-6) & (second + third <= 1.0 + 1e-6)
    z = corners[triangle, :, 2]
    height = z[:, 0] + second * (z[:, 1] - z[:, 0]) + third * (z[:, 2] - z[:, 0])
    np.maximum.at(heights, (row[is_inside], column[is_inside]), height[is_inside])
