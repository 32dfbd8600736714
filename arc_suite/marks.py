"""Marks: what a task asks for, as pictures show it beside the simulation."""

from typing import NamedTuple

import numpy as np


class Mark(NamedTuple):
    """A solid that is only there to be seen.

    Attributes:
        shape: "arrow" or "cylinder".
        start: (3,) of its axis in the world, m.
        end: (3,) likewise; an arrow's tip.
        radius: m; of an arrow's shaft.
        colour: red, green, blue and opacity, 0 to 1.
    """

    shape: str
    start: np.ndarray
    end: np.ndarray
    radius: float
    colour: tuple[float, float, float, float]
