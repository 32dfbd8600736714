"""Debug markers: arrows and cylinders that show a task's command in pictures."""

from typing import NamedTuple

import numpy as np


class Marker(NamedTuple):
    """A solid in pictures, absent from the simulation.

    Attributes:
        shape: "arrow" or "cylinder".
        start: (3,) of its axis in the world, m.
        end: (3,) of its axis, or of an arrow's tip, in the world, m.
        radius: m; of an arrow's shaft.
        color: red, green, blue and opacity, 0 to 1.
    """

    shape: str
    start: np.ndarray
    end: np.ndarray
    radius: float
    color: tuple[float, float, float, float]
