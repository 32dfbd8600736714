"""A decorated body as plain data: rigid parts, the shapes that they show, and materials.

The parts of an imported body are those of its spec: torso, links and feet. Its other joints, which servos hold, stay as
in the standing pose.
"""

import itertools
from collections.abc import Collection, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite import models, rotations
from arc_suite.models import visuals
from arc_suite.models.direct import GEOMS
from arc_suite.models.standing import standing_qpos
from arc_suite.models.swinging import Swing, SwingingBone, list_bones
from arc_suite.robots.spec import Body, Link

KINDS = {int(geom): name for name, geom in GEOMS.items()}  # kinds of shapes by MuJoCo's number

_MESH = int(mujoco.mjtGeom.mjGEOM_MESH)
_FIRST_HIDDEN_GROUP = 3  # of geoms; MuJoCo draws those below
_TORSO_POSITIONS = 7  # numbers of the torso in qpos; those of the joints follow


class Hull(NamedTuple):
    """A convex polyhedron.

    Attributes:
        points: (n, 3) m.
        triangles: (m, 3) indices of points, counter-clockwise as seen from outside.
    """

    points: np.ndarray
    triangles: np.ndarray


class Shape(NamedTuple):
    """A visible shape.

    Attributes:
        kind: kind of `shapes.KINDS`, or hull.
        size: (3,) half-extents as MuJoCo has them for the kind, m.
        place: (3,) position in the part's frame, m.
        quaternion: (4,) orientation in the same frame, w first.
        material: name.
        hull: polyhedron of the kind hull; else None.
    """

    kind: str
    size: np.ndarray
    place: np.ndarray
    quaternion: np.ndarray
    material: str
    hull: Hull | None = None


class Part(NamedTuple):
    """A rigid body, or a bone of ornaments.

    Attributes:
        name: name of the body in the MJCF, or of the bone.
        parent: index of the part above; None for the torso.
        place: (3,) position in the frame of the part above, m; that of the torso is in the world, as the body stands.
        quaternion: (4,) orientation in the same frame, w first.
        joint: index of its joint; None for the torso and for rigid parts.
        axis: (3,) axis of the joint; None without one.
        shapes: shapes that it shows.
        swing: how it swings; None for a part of the simulation.
    """

    name: str
    parent: int | None
    place: np.ndarray
    quaternion: np.ndarray
    joint: int | None
    axis: np.ndarray | None
    shapes: tuple[Shape, ...]
    swing: Swing | None = None


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
    """Return the parts of a body, and the materials of what they show by name.

    Parts are in the order of its `part_names`, followed by bones of ornaments, which swing on the torso.
    """
    model = models.model_spec(body, decorated=True).compile()
    is_imported = bool(body.source)
    parts = _sketched_parts(model, body) if is_imported else _model_parts(model, body)
    materials = sorted({shape.material for part in parts for shape in part.shapes})
    return parts, {name: _material(model, name) for name in materials}


def part_frames(parts: Sequence[Part]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the positions (..., 3) and rotation matrices (..., 3, 3) of parts in the world, as they stand."""
    positions = []
    orientations = []
    for part in parts:
        position = part.place
        orientation = rotations.matrix(part.quaternion)
        if part.parent is not None:
            parent_orientation = orientations[part.parent]
            position = positions[part.parent] + parent_orientation @ position
            orientation = parent_orientation @ orientation
        positions.append(position)
        orientations.append(orientation)
    return positions, orientations


def simplify_hull(hull: Hull, max_points: int) -> Hull:
    """Return the hull of the outermost of a hull's points, at most a number of them."""
    if len(hull.points) <= max_points:
        return hull
    spec = mujoco.MjSpec()
    spec.add_mesh(name="hull", uservert=hull.points.ravel(), maxhullvert=max_points)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="hull")
    model = spec.compile()
    simple_hull = _hull(model, 0)
    # MuJoCo moves a mesh into the frame of its inertia.
    points = simple_hull.points @ rotations.matrix(model.mesh_quat[0]).T + model.mesh_pos[0]
    return simple_hull._replace(points=points)


# Parts of a model.


def _model_parts(model: mujoco.MjModel, body: Body) -> list[Part]:
    """Return the parts of a model that was made from a body's spec."""
    body_ids = [model.body(name).id for name in body.part_names]
    bone_of_geom = {model.geom(name).id: bone for name, bone in visuals.geoms_of_bones(body).items()}
    parts = [_model_part(model, body_id, body_ids, swinging_geoms=bone_of_geom.keys()) for body_id in body_ids]
    for bone in list_bones(body):
        geoms = [geom for geom, bone_name in bone_of_geom.items() if bone_name == bone.name]
        parts.append(_bone_part(model, bone, geoms))
    return parts


def _bone_part(model: mujoco.MjModel, bone: SwingingBone, geoms: list[int]) -> Part:
    """Return a bone of the torso, whose frame is turned as the torso's, with the shapes of geoms."""
    shapes = [_shape(model, geom) for geom in geoms]
    return Part(
        name=bone.name,
        parent=0,
        place=bone.place,
        quaternion=np.array(rotations.NO_TURN),
        joint=None,
        axis=None,
        shapes=tuple(shape._replace(place=shape.place - bone.place) for shape in shapes),
        swing=bone.swing,
    )


def _model_part(model: mujoco.MjModel, body_id: int, body_ids: list[int], swinging_geoms: Collection[int]) -> Part:
    """Return one part, given the ids of all of them, without geoms that swing."""
    parent_id = int(model.body_parentid[body_id])
    is_torso = parent_id == 0  # its parent is the world
    has_hinge = not is_torso and model.body_jntnum[body_id] > 0
    joint = None
    axis = None
    if has_hinge:
        joint_id = int(model.body_jntadr[body_id])
        joint = int(model.jnt_qposadr[joint_id]) - _TORSO_POSITIONS
        axis = model.jnt_axis[joint_id]
    first_geom = model.body_geomadr[body_id]
    geoms = range(first_geom, first_geom + model.body_geomnum[body_id])
    return Part(
        name=model.body(body_id).name,
        parent=None if is_torso else body_ids.index(parent_id),
        place=model.body_pos[body_id],
        quaternion=model.body_quat[body_id],
        joint=joint,
        axis=axis,
        shapes=tuple(_shape(model, geom) for geom in geoms if geom not in swinging_geoms),
    )


def _shape(model: mujoco.MjModel, geom: int) -> Shape:
    kind = "hull"
    hull = None
    if model.geom_type[geom] == _MESH:
        mesh = model.geom_dataid[geom]
        hull = _hull(model, mesh) if model.mesh_graphadr[mesh] >= 0 else _whole_mesh(model, mesh)
    else:
        kind = KINDS[int(model.geom_type[geom])]
    return Shape(
        kind=kind,
        size=model.geom_size[geom],
        place=model.geom_pos[geom],
        quaternion=model.geom_quat[geom],
        material=model.material(model.geom_matid[geom]).name,
        hull=hull,
    )


def _hull(model: mujoco.MjModel, mesh: int) -> Hull:
    """Return the convex hull of a mesh, which is what touches; the mesh itself may have thirty times the points.

    MuJoCo's graph of a hull has the numbers of its points and faces, where the edges of each point begin, the points'
    indices in the mesh, the edges, and the corners of its faces as indices in the mesh.
    """
    graph = model.mesh_graph[model.mesh_graphadr[mesh] :]
    point_count, face_count = graph[:2]
    first_corner = 2 + 3 * point_count + 3 * face_count
    corners = graph[first_corner : first_corner + 3 * face_count]
    mesh_indices, triangles = np.unique(corners, return_inverse=True)
    points = model.mesh_vert[model.mesh_vertadr[mesh] + mesh_indices].astype(float)
    return Hull(points, triangles.reshape(-1, 3))


def _whole_mesh(model: mujoco.MjModel, mesh: int) -> Hull:
    """Return all triangles of a mesh that touches nothing, and hence has no hull."""
    first_point = model.mesh_vertadr[mesh]
    first_face = model.mesh_faceadr[mesh]
    points = model.mesh_vert[first_point : first_point + model.mesh_vertnum[mesh]].astype(float)
    return Hull(points, model.mesh_face[first_face : first_face + model.mesh_facenum[mesh]])


def _material(model: mujoco.MjModel, name: str) -> Material:
    index = model.material(name).id
    return Material(
        color=model.mat_rgba[index, :3],
        emission=float(model.mat_emission[index]),
        roughness=1.0 - float(model.mat_shininess[index]),
    )


# Parts of an imported body.


def _sketched_parts(model: mujoco.MjModel, body: Body) -> list[Part]:
    """Return the parts of an imported body, with the shapes of its model as it stands.

    A shape belongs to the nearest part above it.
    """
    data = mujoco.MjData(model)
    data.qpos[:] = standing_qpos(model)
    mujoco.mj_kinematics(model, data)  # of sites, too
    bare_parts = _parts_without_shapes(body, data.site("torso").xpos, data.body("torso").xquat)
    part_of_body = _nearest_parts(model, body)
    positions, orientations = part_frames(bare_parts)
    shapes_of_part: list[list[Shape]] = [[] for _ in bare_parts]
    is_shown = (model.geom_bodyid > 0) & (model.geom_group < _FIRST_HIDDEN_GROUP)  # those of the world are the ground's
    for geom in np.flatnonzero(is_shown).tolist():
        part = part_of_body[int(model.geom_bodyid[geom])]
        to_part = orientations[part].T
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, (to_part @ data.geom_xmat[geom].reshape(3, 3)).ravel())
        position = to_part @ (data.geom_xpos[geom] - positions[part])
        shapes_of_part[part].append(_shape(model, geom)._replace(place=position, quaternion=quaternion))
    return [part._replace(shapes=tuple(shapes)) for part, shapes in zip(bare_parts, shapes_of_part, strict=True)]


def _nearest_parts(model: mujoco.MjModel, body: Body) -> dict[int, int]:
    """Return the index of the part that each body of a model belongs to: its own, or that of the nearest one above."""
    part_of_body = {model.body(name).id: part for part, name in enumerate(body.part_names)}
    for body_id in range(1, model.nbody):  # parents come first
        if body_id not in part_of_body:
            part_of_body[body_id] = part_of_body.get(int(model.body_parentid[body_id]))
    return part_of_body


def _parts_without_shapes(body: Body, torso_position: np.ndarray, torso_quaternion: np.ndarray) -> list[Part]:
    """Return the parts of a body's spec, given where the torso is in the world."""
    torso = Part(
        name="torso",
        parent=None,
        place=torso_position.copy(),
        quaternion=torso_quaternion.copy(),
        joint=None,
        axis=None,
        shapes=(),
    )
    parts = [torso]
    joint_numbers = itertools.count()
    for leg in body.legs:
        parent = 0  # the torso
        position = leg.mount
        quaternion = rotations.turn_about_z(np.array(rotations.NO_TURN), np.radians(leg.yaw_deg))
        for link in leg.parts:  # the last one is a foot
            hinge = link.joint if isinstance(link, Link) else None
            joint = None
            axis = None
            if hinge:
                joint = next(joint_numbers)
                axis = np.array(hinge.axis) / np.linalg.norm(hinge.axis)
            parts.append(
                Part(
                    name=leg.full_name(link),
                    parent=parent,
                    place=np.array(position),
                    quaternion=quaternion,
                    joint=joint,
                    axis=axis,
                    shapes=(),
                )
            )
            parent = len(parts) - 1
            position = link.end if isinstance(link, Link) else None
            quaternion = np.array(rotations.NO_TURN)
    return parts
