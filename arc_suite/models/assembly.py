"""Whole models: a body in its arena, as PyMJCF, with or without visuals."""

from dm_control import mjcf

from arc_suite.arenas import FLAT, Arena
from arc_suite.models import builder, sizing, visuals
from arc_suite.robots.spec import Body


def assemble(body: Body, arena: Arena = FLAT, decorated: bool = False) -> mjcf.RootElement:
    """Assemble a body in an arena.

    Args:
        body: the spec; what it leaves open is sized.
        arena: where it moves.
        decorated: add visuals, which leave the dynamics unchanged but cost about a tenth of the speed.

    Returns:
        The model; `.to_xml_string()` loads in plain MuJoCo.
    """
    body = sizing.sized(body)
    root = builder.build(body)
    arena.add_to(root, **builder.contact(body.simulation))
    if decorated:
        visuals.decorate(root, body)
    return root
