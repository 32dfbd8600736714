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
        u: (...) place along the columns, in cells; beyond the edge, the edge's height.
        v: (...) place along the rows, in cells; beyond the edge, the edge's height.
    """
    numpy = u.__array_namespace__()
    rows, columns = nodes.shape
    nodes = numpy.asarray(nodes).ravel()
    u, v = u.clip(0.0, columns - 1), v.clip(0.0, rows - 1)
    column = numpy.floor(u).astype(int).clip(0, columns - 2)
    row = numpy.floor(v).astype(int).clip(0, rows - 2)
    u, v = u - column, v - row
    first = row * columns + column
    low, high = nodes[first], nodes[first + columns + 1]
    # The diagonal joins the corners of lowest and highest indices; (u, v) lies right or left of it.
    right = u > v
    corner = nodes[first + numpy.where(right, 1, columns)]
    along, across = numpy.where(right, u, v), numpy.where(right, v, u)
    return low + along * (corner - low) + across * (high - corner)
