"""MuJoCo's height fields: a grid of nodes, two triangles in every cell."""

import numpy as np
from dm_control import mjcf


def shares(heights: np.ndarray) -> np.ndarray:
    """Return heights (rows, columns) from 0 to 1, rounded to MuJoCo's single precision, as doubles."""
    return heights.astype(np.float32).astype(float)


def add(root: mjcf.RootElement, nodes: np.ndarray, size, pos=(0.0, 0.0, 0.0), **contact) -> None:
    """Add a height field `floor` to a model.

    Args:
        root: the model.
        nodes: (rows, columns) from 0 to 1, with minimum 0 and maximum 1; rows along y, columns along x.
        size: (4,) m: half of the length and width, height of the value 1, thickness of the ground below the value 0.
        pos: (3,) m, of its middle.
        **contact: attributes of the geom.
    """
    rows, columns = nodes.shape
    elevation = nodes[::-1].ravel()  # MJCF lists rows from the far side in y
    root.asset.add("hfield", name="floor", nrow=rows, ncol=columns, size=tuple(size), elevation=elevation)
    root.worldbody.add("geom", name="floor", type="hfield", hfield="floor", pos=pos, conaffinity=1, **contact)


def height(nodes: np.ndarray, u, v):
    """Return the height (...) of MuJoCo's collision triangles, in units of the nodes.

    Args:
        nodes: (rows, columns)
        u: (...) coordinate along the columns, in cells; beyond the edge, the height is that of the edge.
        v: (...) coordinate along the rows, in cells; beyond the edge, the height is that of the edge.
    """
    xp = u.__array_namespace__()
    rows, columns = nodes.shape
    heights = xp.asarray(nodes).ravel()
    u = u.clip(0.0, columns - 1)
    v = v.clip(0.0, rows - 1)
    column = xp.floor(u).astype(int).clip(0, columns - 2)
    row = xp.floor(v).astype(int).clip(0, rows - 2)
    u_in_cell = u - column
    v_in_cell = v - row
    # A diagonal joins the corners of lowest and highest indices. The point lies in the triangle right or left of it.
    is_right = u_in_cell > v_in_cell
    first_corner = row * columns + column
    start = heights[first_corner]
    end = heights[first_corner + columns + 1]
    middle = heights[first_corner + xp.where(is_right, 1, columns)]
    larger = xp.where(is_right, u_in_cell, v_in_cell)
    smaller = xp.where(is_right, v_in_cell, u_in_cell)
    return start + larger * (middle - start) + smaller * (end - middle)
