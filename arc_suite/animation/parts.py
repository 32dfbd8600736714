"""A decorated body as plain data: rigid parts, the shapes that they show, and materials.

The parts of an imported body are those of its kinematic sketch. Joints that are held stay as they stand.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite import models, rotations
from arc_suite.models.direct import GEOMS
from arc_suite.models.standing import standing_qpos
from arc_suite.robots.spec import Body, Link

# Kinds of shapes by MuJoCo's number.
KINDS = {int(geom): name for name, geom in GEOMS.items()}
_MESH = int(mujoco.mjtGeom.mjGEOM_MESH)

_AS_ABOVE = np.array((1.0, 0.0, 0.0, 0.0))


class Hull(NamedTuple):
    """A convex polyhedron.

    Attributes:
        points: (n, 3) m.
        triangles: (m, 3) indices of points, counter-clockwise as seen from outside.
    """

    points: np.ndarray
    triangles: np.ndarray


class Shape(NamedTuple):
    """Something to be seen.

    Attributes:
        kind: of `shapes.KINDS`, or hull.
        size: (3,) half-extents as MuJoCo has them for the kind, m.
        place: (3,) in the part's frame, m.
        quaternion: (4,) in the same frame, w first.
        material: name.
        hull: of the kind hull; else None.
    """

    kind: str
    size: np.ndarray
    place: np.ndarray
    quaternion: np.ndarray
    material: str
    hull: Hull | None = None


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
        color: (3,) sRGB, 0 to 1.
        emission: how much of the color glows, 0 to 1.
        roughness: 0 to 1.
    """

    color: np.ndarray
    emission: float
    roughness: float


def describe_body(body: Body) -> tuple[list[Part], dict[str, Material]]:
    """Return the parts of a body in the order of its `part_names`, and the materials of what they show by name."""
    model = models.model_spec(body, decorated=True).compile()
    ids = [model.body(name).id for name in body.part_names]
    found = _sketched(model, body) if body.source else [_part(model, index, ids) for index in ids]
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
    material, place = model.material(model.geom_matid[geom]).name, (model.geom_pos[geom], model.geom_quat[geom])
    if model.geom_type[geom] == _MESH:
        return Shape("hull", model.geom_size[geom], *place, material, _hull(model, model.geom_dataid[geom]))
    return Shape(KINDS[int(model.geom_type[geom])], model.geom_size[geom], *place, material)


def _hull(model: mujoco.MjModel, index: int) -> Hull:
    """Return the convex hull of a mesh, which is what touches; the mesh itself may have thirty times the points.

    MuJoCo's graph of a hull has the numbers of its points and faces, where the edges of each point begin, the points'
    indices in the mesh, the edges, and the corners of its faces as indices in the mesh.
    """
    graph = model.mesh_graph[model.mesh_graphadr[index] :]
    points, faces = graph[:2]
    corners = graph[2 + 3 * points + 3 * faces :][: 3 * faces]
    used, triangles = np.unique(corners, return_inverse=True)
    points = model.mesh_vert[model.mesh_vertadr[index] + used].astype(float)
    return Hull(points, triangles.reshape(-1, 3))


def simplify_hull(hull: Hull, most: int) -> Hull:
    """Return the hull of the outermost of a hull's points, at most a number of them."""
    if len(hull.points) <= most:
        return hull
    spec = mujoco.MjSpec()
    spec.add_mesh(name="hull", uservert=hull.points.ravel(), maxhullvert=most)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="hull")
    model = spec.compile()
    found = _hull(model, 0)
    # MuJoCo moves a mesh into the frame of its inertia.
    return found._replace(points=found.points @ rotations.matrix(model.mesh_quat[0]).T + model.mesh_pos[0])


def _sketched(model: mujoco.MjModel, body: Body) -> list[Part]:
    """Return the parts of an imported body, with the shapes of its model as it stands.

    A shape belongs to the nearest part above it.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = standing_qpos(model)
    mujoco.mj_kinematics(model, data)
    owners = {model.body(name).id: part for part, name in enumerate(body.part_names)}
    for index in range(1, model.nbody):
        owners.setdefault(index, owners.get(int(model.body_parentid[index])))
    shapes: list[list[Shape]] = [[] for _ in body.part_names]
    bones = _bones(body, *(data.body("torso").xpos, data.body("torso").xquat))
    places, turns = part_frames(bones)
    for geom in np.flatnonzero(model.geom_bodyid).tolist():  # those of the world are the ground's
        part, turn = owners[int(model.geom_bodyid[geom])], np.empty(4)
        mujoco.mju_mat2Quat(turn, (turns[part].T @ data.geom_xmat[geom].reshape(3, 3)).ravel())
        place = turns[part].T @ (data.geom_xpos[geom] - places[part])
        shapes[part].append(_shape(model, geom)._replace(place=place, quaternion=turn))
    return [bone._replace(shapes=tuple(own)) for bone, own in zip(bones, shapes, strict=True)]


def _bones(body: Body, place: np.ndarray, quaternion: np.ndarray) -> list[Part]:
    """Return the parts of a body's spec without shapes, given where the torso is."""
    found, joints = [Part("torso", None, place.copy(), quaternion.copy(), None, None, ())], itertools.count()
    for leg in body.legs:
        parent, end, turn = 0, leg.mount, rotations.turn_about_z(_AS_ABOVE, np.radians(leg.yaw_deg))
        for part in leg.parts:
            hinge = part.joint if isinstance(part, Link) else None
            joint, axis = (next(joints), np.array(hinge.axis) / np.linalg.norm(hinge.axis)) if hinge else (None, None)
            found.append(Part(leg.full_name(part), parent, np.array(end), turn, joint, axis, ()))
            parent, end, turn = len(found) - 1, part.end if isinstance(part, Link) else None, _AS_ABOVE
    return found


def part_frames(parts: Sequence[Part]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the places (3,) and rotation matrices (3, 3) of parts in the standing pose."""
    places, turns = [], []
    for part in parts:
        place, turn = (np.zeros(3), np.eye(3)) if part.parent is None else (places[part.parent], turns[part.parent])
        places.append(place + turn @ part.place)
        turns.append(turn @ rotations.matrix(part.quaternion))
    return places, turns


def _material(model: mujoco.MjModel, name: str) -> Material:
    index = model.material(name).id
    roughness = 1.0 - float(model.mat_shininess[index])
    return Material(model.mat_rgba[index, :3], float(model.mat_emission[index]), roughness)
