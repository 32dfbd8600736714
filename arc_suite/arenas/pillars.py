"""Pillars: a level floor with round pillars, at new positions in every episode.

The pillars stand on a grid of square cells, one near the middle of each cell. Goals are corners of cells, so that no
pillar is near a goal, and a body fits between any two pillars.
"""

import dataclasses
from typing import Any

import numpy as np
from dm_control import mjcf

from arc_suite.arenas.flat import Flat

CELLS = 4  # along each side of the grid, whose center is the start
COUNT = CELLS * CELLS
PITCH = 4.2  # width of a cell, R; goals are at least so far apart
SHIFT = 0.25  # largest displacement of a pillar from the middle of its cell along either side, R
RADIUS = 0.35  # of a pillar, R


@dataclasses.dataclass(frozen=True)
class Pillars(Flat):
    """The plane z = 0 with movable pillars; their bodies are the last of the model, in the order of `places`.

    Attributes:
        unit: R, the mean distance of the feet of the body from their center, m; horizontal lengths are multiples of it.
        top: height of the pillars, m.
    """

    unit: float
    top: float

    def add_to(self, root: mjcf.RootElement, **contact: Any) -> None:
        """Add the plane `floor`, and the pillars `floor_pillar_<number>`, each a body that `mocap_pos` moves."""
        super().add_to(root, contype=0, **contact)
        for number, place in enumerate(self.places(np.zeros((COUNT, 2)))):
            name = f"floor_pillar_{number}"
            pillar = root.worldbody.add("body", name=name, mocap=True, pos=place)
            # Between floor and top, the capsule is a cylinder: the centers of its caps are at the floor and at the top.
            size = (RADIUS * self.unit, 0.5 * self.top)
            pillar.add("geom", name=name, type="capsule", size=size, mass=0.0, contype=0, conaffinity=1, **contact)

    def places(self, shifts: np.ndarray) -> np.ndarray:
        """Return the centers of the pillars (COUNT, 3), m.

        Args:
            shifts: (COUNT, 2) displacement from the middle of the cell, from -1 to 1.
        """
        middles = np.arange(CELLS) - 0.5 * (CELLS - 1)
        grid = np.stack(np.meshgrid(middles, middles, indexing="ij"), axis=-1).reshape(COUNT, 2)
        centers = self.unit * (PITCH * grid + SHIFT * shifts)
        return np.concatenate([centers, np.full((COUNT, 1), 0.5 * self.top)], axis=-1)

    @property
    def lists_contacts(self) -> bool:
        """Return False, as pairs of pillars and parts are many, and few of them are near each other."""
        return False
