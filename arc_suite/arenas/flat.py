"""Flat: an endless level floor."""

import dataclasses
from typing import Any, ClassVar

from dm_control import mjcf

from arc_suite.arenas.arena import Arena

PLANE = {"name": "floor", "type": "plane", "size": (0.0, 0.0, 1.0), "conaffinity": 1}


@dataclasses.dataclass(frozen=True)
class Flat(Arena):
    """The plane z = 0."""

    is_level: ClassVar[bool] = True

    def add_to(self, root: mjcf.RootElement, **contact: Any) -> None:
        """Add the plane `floor`."""
        root.worldbody.add("geom", **PLANE, **contact)

    def height(self, x, y):
        """Return 0 for every point."""
        return 0.0 * x
