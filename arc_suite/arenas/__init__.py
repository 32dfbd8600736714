"""Where bodies move: name -> the arena that suits a body."""

from arc_suite.arenas import bumps, terrain
from arc_suite.arenas.arena import Arena
from arc_suite.arenas.flat import Flat

FLAT = Flat()

ARENAS = {
    "flat": lambda body: FLAT,
    "bumps": bumps.fitted,
    **{kind: terrain.fitted(kind) for kind in terrain.KINDS},
}

__all__ = ["ARENAS", "FLAT", "Arena"]
