"""Pillars: a level floor with round pillars, placed anew in every episode.

They stand on a grid of square cells, one near the middle of each; goals are corners of cells. So no
pillar is near a goal, and a body fits between any two.
"""

import dataclasses

import numpy as np
from dm_control import mjcf

from arc_suite.arenas.flat import Flat

CELLS = 4  # along each side of the grid, about the start
COUNT = CELLS * CELLS
PITCH = 4.2  # width of a cell, in units, as are the next two; goals are at least this far apart
SHIFT = 0.25  # most that a pillar is off the middle of its cell, along either side
RADIUS = 0.35


@dataclasses.dataclass(frozen=True)
class Pillars(Flat):
    """The plane z = 0 with movable pillars; their bodies are the last of the model, in the order of `places`.

    Attributes:
        unit: m, the mean distance R of the feet of the body for which it is made from their center: lengths across
            are multiples of it.
        top: of the pillars, m.
    """

    unit: float
    top: float

    def add_to(self, root: mjcf.RootElement, **contact) -> None:
        """Add the plane `floor`, and the pillars `floor_pillar_<number>`, each a body that `mocap_pos` moves."""
        super().add_to(root, contype=0, **contact)
        for number, place in enumerate(self.places(np.zeros((COUNT, 2)))):
            name = f"floor_pillar_{number}"
            pillar = root.worldbody.add("body", name=name, mocap=True, pos=place)
            # A capsule whose ends' middles are at the floor and at the top: as a cylinder between them.
            size = (RADIUS * self.unit, 0.5 * self.top)
            pillar.add("geom", name=name, type="capsule", size=size, mass=0.0, contype=0, conaffinity=1, **contact)

    def places(self, shifts: np.ndarray) -> np.ndarray:
        """Return the centers of the pillars (COUNT, 3), m.

        Args:
            shifts: (COUNT, 2) off the middle of each one's cell, from -1 to 1.
        """
        middles = np.arange(CELLS) - 0.5 * (CELLS - 1)
        grid = np.stack(np.meshgrid(middles, middles, indexing="ij"), axis=-1).reshape(COUNT, 2)
        across = self.unit * (PITCH * grid + SHIFT * shifts)
        return np.concatenate([across, np.full((COUNT, 1), 0.5 * self.top)], axis=-1)

    @property
    def lists_contacts(self) -> bool:
        """Return False: pairs of pillars and parts are many, and few are near one another."""
        return False
