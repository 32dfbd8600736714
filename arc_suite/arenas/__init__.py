"""Arenas: name -> function from a body to its arena."""

from arc_suite.arenas import bumps, terrain
from arc_suite.arenas.arena import Arena
from arc_suite.arenas.flat import Flat

FLAT = Flat()

ARENAS = {
    "flat": lambda body: FLAT,
    "bumps": bumps.fit_bumps,
    **{kind: terrain.lanes_of_kind(kind) for kind in terrain.KINDS},
}

__all__ = ["ARENAS", "FLAT", "Arena"]
