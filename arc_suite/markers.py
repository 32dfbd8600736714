"""Debug markers: arrows and cylinders in pictures that show a task's command, for example."""

from typing import NamedTuple

import numpy as np


class Marker(NamedTuple):
    """A shape that only pictures contain, not the simulation.

    Attributes:
        shape: "arrow" or "cylinder".
        start: (3,) position in the world where its axis starts, m.
        end: (3,) position in the world where its axis ends, m; an arrow's tip.
        radius: radius of a cylinder or of an arrow's shaft, m.
        color: red, green, blue and opacity, 0 to 1.
    """

    shape: str
    start: np.ndarray
    end: np.ndarray
    radius: float
    color: tuple[float, float, float, float]
