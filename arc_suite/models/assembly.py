"""Whole models: a body on its arena, as PyMJCF, with or without looks."""

from dm_control import mjcf

from arc_suite.arenas import flat
from arc_suite.models import builder, looks, sizing
from arc_suite.robots.spec import Body


def assemble(body: Body, decorated: bool = False) -> mjcf.RootElement:
    """The body on an endless floor.

    Args:
        body: the spec; what it leaves open is sized.
        decorated: add looks, which change nothing dynamic but cost about a tenth of the speed.

    Returns:
        The model; `.to_xml_string()` loads in plain MuJoCo.
    """
    body = sizing.sized(body)
    root = builder.build(body)
    flat.add_floor(root, body.simulation)
    if decorated:
        looks.decorate(root, body)
    return root
