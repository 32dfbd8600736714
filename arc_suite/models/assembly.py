"""Whole models: a body in its arena, as PyMJCF, with or without visuals."""

import xml.etree.ElementTree as ElementTree

import mujoco
import numpy as np
from dm_control import mjcf

from arc_suite.arenas import FLAT, Arena
from arc_suite.models import builder, mjcf_text, sizing, source, visuals
from arc_suite.models.outline import outline
from arc_suite.robots.spec import Body


def assemble(body: Body, arena: Arena | None = FLAT, decorated: bool = False) -> mjcf.RootElement:
    """Assemble a body in an arena.

    Args:
        body: the spec, without a source; what it leaves open is sized.
        arena: where it moves; None leaves free joint, ground, options, sky and light to the scene that takes the body.
        decorated: add visuals, which leave the dynamics unchanged but cost about a tenth of the speed.

    Returns:
        The model; `mjcf_text.to_mjcf` makes a text of it.

    Raises:
        ValueError: an imported body, which has no PyMJCF model; `text` returns its MJCF.
    """
    if body.source:
        raise ValueError(f"{body.name} was imported: `models.text` has its MJCF")
    sized_body = sizing.size_body(body)
    framed_points = None
    if decorated:
        framed_points = np.concatenate([outline(sized_body), visuals.outline_ornaments(sized_body)])
    root = builder.build(sized_body, framed_points)
    if arena is None:
        root.find("joint", "root").remove()
        root.option.remove()
    else:
        arena.add_to(root, **builder.contact(sized_body.simulation))
    if decorated:
        visuals.decorate(root, sized_body)
    return root


def text(body: Body, arena: Arena | None = FLAT, decorated: bool = False) -> str:
    """Return the MJCF of a body in an arena, as MuJoCo and dm_control's PyMJCF read it; see `assemble`."""
    if body.source:
        tree = source.mjcf_tree(sizing.size_body(body), arena, decorated)
        ElementTree.indent(tree)
        return ElementTree.tostring(tree, encoding="unicode") + "\n"
    return mjcf_text.to_mjcf(assemble(body, arena, decorated))


def model_spec(body: Body, arena: Arena = FLAT, decorated: bool = False) -> mujoco.MjSpec:
    """Assemble a body in an arena as `assemble` does, and return MuJoCo's own spec of the model.

    Heights of the ground go in as numbers, not as text: MuJoCo's parser reports "unknown error" for a long list
    when the heap cannot grow in place, although the memory is there.
    """
    if body.source:
        return source.model_spec(sizing.size_body(body), arena, decorated)
    root = assemble(body, arena, decorated)
    fields = root.find_all("hfield")
    elevations = [np.reshape(field.elevation, (field.nrow, field.ncol)) for field in fields]
    for field in fields:
        del field.elevation
    spec = mujoco.MjSpec.from_string(root.to_xml_string())
    for field, elevation in zip(spec.hfields, elevations, strict=True):
        field.userdata = elevation[::-1].ravel()  # MJCF lists rows from the far side in y
    return spec
