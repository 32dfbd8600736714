"""The compiled model of a body in an arena that simulations step."""

import copy
import functools

import mujoco

from arc_suite import models
from arc_suite.arenas import FLAT, Arena
from arc_suite.robots.spec import Body


def compiled(body: Body, arena: Arena = FLAT) -> mujoco.MjModel:
    """Compile the undecorated model of a body in an arena.

    Args:
        body: the spec; what it leaves open is sized.
        arena: where it moves.

    Returns:
        The model; the caller's own, to write to.
    """
    return copy.copy(_compiled(body, arena))


@functools.lru_cache(maxsize=32)
def _compiled(body: Body, arena: Arena) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(models.assemble(body, arena).to_xml_string())
