"""A decorated body as plain data: rigid parts, the shapes that they show, and materials."""

from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite import models
from arc_suite.models.standing import GEOMS
from arc_suite.robots.spec import Body

# Kinds of shapes by MuJoCo's number.
KINDS = {int(geom): name for name, geom in GEOMS.items()}


class Shape(NamedTuple):
    """Something to be seen.

    Attributes:
        kind: of `shapes.KINDS`.
        size: (3,) half-extents as MuJoCo has them for the kind, m.
        place: (3,) in the part's frame, m.
        quaternion: (4,) in the same frame, w first.
        material: name.
    """

    kind: str
    size: np.ndarray
    place: np.ndarray
    quaternion: np.ndarray
    material: str


class Part(NamedTuple):
    """A rigid body.

    Attributes:
        name: of the body in the MJCF.
        parent: index of the part above; None for the torso.
        place: (3,) in the frame of the part above, m; of the torso, of the standing one.
        quaternion: (4,) in the same frame, w first.
        joint: index of its joint; None for the torso and for rigid parts.
        axis: (3,) of the joint; None without one.
        shapes: that it shows.
    """

    name: str
    parent: int | None
    place: np.ndarray
    quaternion: np.ndarray
    joint: int | None
    axis: np.ndarray | None
    shapes: tuple[Shape, ...]


class Material(NamedTuple):
    """How a surface looks.

    Attributes:
        colour: (3,) sRGB, 0 to 1.
        emission: how much of the colour glows, 0 to 1.
        roughness: 0 to 1.
    """

    colour: np.ndarray
    emission: float
    roughness: float


def parts(body: Body) -> tuple[list[Part], dict[str, Material]]:
    """Return the parts of a body in the order of its `part_names`, and the materials of what they show by name."""
    model = models.parsed(body, decorated=True).compile()
    ids = [model.body(name).id for name in body.part_names]
    found = [_part(model, index, ids) for index in ids]
    names = sorted({shape.material for part in found for shape in part.shapes})
    return found, {name: _material(model, name) for name in names}


def _part(model: mujoco.MjModel, index: int, ids: list[int]) -> Part:
    parent = int(model.body_parentid[index])
    # The torso's joint is free; others have a hinge or none.
    joint = int(model.body_jntadr[index]) if parent and model.body_jntnum[index] else None
    geoms = range(model.body_geomadr[index], model.body_geomadr[index] + model.body_geomnum[index])
    return Part(
        name=model.body(index).name,
        parent=ids.index(parent) if parent else None,
        place=model.body_pos[index],
        quaternion=model.body_quat[index],
        joint=None if joint is None else int(model.jnt_qposadr[joint]) - 7,
        axis=None if joint is None else model.jnt_axis[joint],
        shapes=tuple(_shape(model, geom) for geom in geoms),
    )


def _shape(model: mujoco.MjModel, geom: int) -> Shape:
    kind, material = KINDS[int(model.geom_type[geom])], model.material(model.geom_matid[geom]).name
    return Shape(kind, model.geom_size[geom], model.geom_pos[geom], model.geom_quat[geom], material)


def _material(model: mujoco.MjModel, name: str) -> Material:
    index = model.material(name).id
    roughness = 1.0 - float(model.mat_shininess[index])
    return Material(model.mat_rgba[index, :3], float(model.mat_emission[index]), roughness)
