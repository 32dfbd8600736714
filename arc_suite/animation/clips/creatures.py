"""Bodies and their clips as glTF: bones or rigid parts under the names of the MJCF, meshes, animations.

glTF's y axis points up and its z axis ahead: its (x, y, z) are MuJoCo's (y, z, x), a proper rotation.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import bones, keys, shapes
from arc_suite.animation.clips.clips import Clip
from arc_suite.animation.clips.gltf import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, Document
from arc_suite.animation.clips.meshes import body_meshes
from arc_suite.animation.clips.metadata import ROOT_MOTIONS, clip_metadata, name_animations
from arc_suite.animation.clips.shapes import Mesh
from arc_suite.animation.parts import Material, Part, describe_body, part_frames
from arc_suite.robots.spec import Body

RIGS = ("skin", "nodes")

_AXES = (1, 2, 0)  # the axes of MuJoCo that are glTF's x, y and z
_MAX_ANGLE_ERROR = math.radians(0.1)  # rad, of reduced keys
_MAX_POSITION_ERROR = 0.001  # standing heights, of reduced keys

_Meshes = Sequence[Mapping[str, Mesh]]  # of each part by material, in the part's frame


def glb(
    body: Body,
    clips: Sequence[Clip],
    rig: str = "skin",
    root_motion: str = "both",
    generator: str = "",
    triangles: int | None = None,
    uv: bool = False,
    reduced: bool = False,
) -> bytes:
    """Return a body and its clips as a binary glTF file.

    Its scene has the node `root`, on the ground below the torso, with the parts of the body under it as in the body
    tree, and bones of ornaments on the torso. With a skin, there is also a node with the mesh, and the parts are the
    bones of its skeleton; see `bones.align_bones`. The body is bound in the first pose of idle. An animation is called
    after its clip, with `_in_place` where the root stays although the clip moves, and `_loop` at the end where it
    loops. Its extras are those of the `sidecar`.

    Args:
        body: any body.
        clips: clips of the body.
        rig: skin, or nodes, each with the mesh of its part.
        root_motion: moving, in_place, or both, two animations of each clip that moves.
        generator: what the file says that it was made by.
        triangles: triangles that the mesh has at most; see `meshes.body_meshes`.
        uv: whether meshes have texture coordinates.
        reduced: whether keys are left out that lines between others replace within 0.1 degrees and 0.001 standing
            heights.

    Raises:
        ValueError: no mesh has so few triangles.
    """
    standing_height = body.torso.standing_height
    document = Document(generator)
    parts, material_of_name = describe_body(body)
    if rig == "skin":
        parts = bones.align_bones(parts)
    meshes = body_meshes(parts, standing_height, triangles, uv)
    bind_parts = _pose_for_binding(parts, meshes, clips)
    nodes = _add_nodes(document, bind_parts)
    materials = _add_materials(document, material_of_name, meshes)
    scene_nodes = [nodes.root]
    if rig == "skin":
        scene_nodes.append(_add_skin(document, body.name, bind_parts, meshes, nodes, materials))
    else:
        _add_part_meshes(document, bind_parts, meshes, nodes, materials)
    scene = document.add("scenes", {"name": body.name, "nodes": scene_nodes})
    document.json["scene"] = scene
    max_errors = None
    if reduced:
        max_errors = {"rotation": _MAX_ANGLE_ERROR, "translation": _MAX_POSITION_ERROR * standing_height}
    for clip in clips:
        _add_animations(document, clip, parts, nodes, ROOT_MOTIONS[root_motion], max_errors)
    return document.glb()


# Nodes, materials and meshes.


class _Nodes(NamedTuple):
    """Indices of nodes.

    Attributes:
        root: point on the ground below the torso.
        parts: one value for each part.
    """

    root: int
    parts: list[int]


def _pose_for_binding(parts: list[Part], meshes: _Meshes, clips: Sequence[Clip]) -> list[Part]:
    """Return the parts in the first pose of idle; without that clip, standing on the ground."""
    for clip in clips:
        if clip.name == "idle":
            return bones.pose_parts(parts, clip.motion.pose(0))
    positions, orientations = part_frames(parts)
    lowest = math.inf
    for part_meshes, position, orientation in zip(meshes, positions, orientations, strict=True):
        for mesh in part_meshes.values():
            points = position + mesh.points @ orientation.T
            lowest = min(lowest, points[:, 2].min())
    grounded_parts = []
    for part in parts:
        if part.parent is None:
            part = part._replace(place=part.place - (0.0, 0.0, lowest))
        grounded_parts.append(part)
    return grounded_parts


def _add_nodes(document: Document, parts: Sequence[Part]) -> _Nodes:
    """Add the nodes of the root and of parts."""
    root = document.add("nodes", {"name": "root"})
    nodes = _Nodes(root, [document.add("nodes", _node(part)) for part in parts])
    children_of_node: dict[int, list[int]] = {}
    for part, node in zip(parts, nodes.parts, strict=True):
        parent = root if part.parent is None else nodes.parts[part.parent]
        children_of_node.setdefault(parent, []).append(node)
    for node, children in children_of_node.items():
        document.json["nodes"][node]["children"] = children
    return nodes


def _node(part: Part) -> dict:
    node: dict[str, Any] = {"name": part.name, "translation": _to_float32(part.place[list(_AXES)]).tolist()}
    is_turned = part.quaternion[0] < 1.0
    if is_turned:
        node["rotation"] = _to_gltf_rotation(part.quaternion).tolist()
    return node


def _add_materials(document: Document, material_of_name: Mapping[str, Material], meshes: _Meshes) -> dict[str, int]:
    """Add the materials that meshes show, and return their indices by name."""
    visible_names = {name for part_meshes in meshes for name in part_meshes}
    index_of_name = {}
    for name, material in material_of_name.items():
        if name in visible_names:
            index_of_name[name] = document.add("materials", _material(name, material))
    return index_of_name


def _material(name: str, material: Material) -> dict:
    color = _to_linear(material.color)
    surface = {"baseColorFactor": [*color.tolist(), 1.0], "metallicFactor": 0.0, "roughnessFactor": material.roughness}
    properties = {"name": name, "pbrMetallicRoughness": surface}
    if material.emission > 0.0:
        properties["emissiveFactor"] = (material.emission * color).tolist()
    return properties


def _to_linear(color: np.ndarray) -> np.ndarray:
    """Return the linear intensities of an sRGB color (IEC 61966-2-1), rounded to what a screen can show."""
    linear = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    return linear.astype(float).round(6)


def _add_part_meshes(document: Document, parts: Sequence[Part], meshes: _Meshes, nodes: _Nodes, materials) -> None:
    """Give each node the mesh of its part; a link of an imported body may show nothing."""
    for part, part_meshes, node in zip(parts, meshes, nodes.parts, strict=True):
        if part_meshes:
            primitives = [_add_primitive(document, mesh, materials[name]) for name, mesh in part_meshes.items()]
            mesh_index = document.add("meshes", {"name": part.name, "primitives": primitives})
            document.json["nodes"][node]["mesh"] = mesh_index


class _BoundMesh(NamedTuple):
    """A mesh in the world, and the index of the bone that moves it, among the joints of the skin."""

    bone: int
    mesh: Mesh


def _add_skin(document: Document, name: str, parts, meshes: _Meshes, nodes: _Nodes, materials) -> int:
    """Add the mesh with its skin, and return its node."""
    joints = [nodes.root, *nodes.parts]
    part_positions, part_orientations = part_frames(parts)
    positions = [np.zeros(3), *part_positions]  # of the root first
    orientations = [np.eye(3), *part_orientations]

    meshes_of_material: dict[str, list[_BoundMesh]] = {}
    for bone, part_meshes in enumerate(meshes, start=1):  # 0 is the root
        for material, mesh in part_meshes.items():
            world_mesh = mesh.transform(positions[bone], orientations[bone])
            meshes_of_material.setdefault(material, []).append(_BoundMesh(bone, world_mesh))
    index_type = np.uint8 if len(joints) <= 256 else np.dtype("<u2")
    primitives = []
    for material, bound_meshes in meshes_of_material.items():
        primitives.append(_add_skinned_primitive(document, bound_meshes, materials[material], index_type))

    inverse_bind_matrices = np.tile(np.eye(4), (len(joints), 1, 1))
    for inverse, position, orientation in zip(inverse_bind_matrices, positions, orientations, strict=True):
        inverse_rotation = orientation[np.ix_(_AXES, _AXES)].T
        inverse[:3, :3] = inverse_rotation
        inverse[:3, 3] = -inverse_rotation @ position[list(_AXES)]
    skin = {
        "name": name,
        "joints": joints,
        "skeleton": nodes.root,
        "inverseBindMatrices": document.accessor(_to_float32(inverse_bind_matrices)),
    }
    mesh_index = document.add("meshes", {"name": name, "primitives": primitives})
    skin_index = document.add("skins", skin)
    return document.add("nodes", {"name": name, "mesh": mesh_index, "skin": skin_index})


def _add_skinned_primitive(document: Document, bound_meshes: list[_BoundMesh], material: int, index_type) -> dict:
    """Add meshes of one material as one, in which each point follows one bone."""
    point_counts = [len(bound_mesh.mesh.points) for bound_mesh in bound_meshes]
    # glTF has four bones and weights for each point; only the first is used.
    bone_indices = np.zeros((sum(point_counts), 4), index_type)
    bone_indices[:, 0] = np.repeat([bound_mesh.bone for bound_mesh in bound_meshes], point_counts)
    weights = np.zeros((sum(point_counts), 4), np.uint8)
    weights[:, 0] = 255
    joined_mesh = shapes.join_meshes([bound_mesh.mesh for bound_mesh in bound_meshes])
    primitive = _add_primitive(document, joined_mesh, material)
    primitive["attributes"]["JOINTS_0"] = document.accessor(bone_indices, ARRAY_BUFFER)
    primitive["attributes"]["WEIGHTS_0"] = document.accessor(weights, ARRAY_BUFFER, normalized=True)
    return primitive


def _add_primitive(document: Document, mesh: Mesh, material: int) -> dict:
    """Add the arrays of a mesh, and return its properties."""
    index_type = "<u2" if len(mesh.points) < 2**16 else "<u4"
    indices = mesh.triangles.astype(index_type).reshape(-1)
    attributes = {
        "POSITION": document.accessor(_to_float32(mesh.points[:, _AXES]), ARRAY_BUFFER, bounds=True),
        "NORMAL": document.accessor(_to_float32(mesh.normals[:, _AXES]), ARRAY_BUFFER),
    }
    if mesh.uv is not None:
        attributes["TEXCOORD_0"] = document.accessor(_to_float32(mesh.uv), ARRAY_BUFFER)
    return {
        "attributes": attributes,
        "indices": document.accessor(indices, ELEMENT_ARRAY_BUFFER),
        "material": material,
    }


# Animations.


class _Track(NamedTuple):
    """A property of a node over time.

    Attributes:
        node: its index.
        path: path of the property: translation or rotation.
        times: accessor of the times of keys.
        values: accessor of the values of keys.
    """

    node: int
    path: str
    times: int
    values: int


class _ClipTracks:
    """Adds tracks of one clip to a document."""

    def __init__(self, document: Document, clip: Clip, max_errors: Mapping[str, float] | None):
        """Begin without tracks.

        Args:
            document: document to add tracks to.
            clip: clip of the tracks.
            max_errors: largest errors of reduced tracks, by the path of the property; None for a key in each frame.
        """
        self._document = document
        self._clip = clip
        self._max_errors = max_errors
        self._times_of_frames: dict[bytes, int] = {}  # accessors of times, which tracks with the same keys share

    def add(self, node: int, path: str, values: np.ndarray) -> _Track:
        """Add a track with a key in each frame, or with the keys that a reduced track needs.

        Args:
            node: index.
            path: translation or rotation.
            values: (frames, 3 or 4) in MuJoCo's axes.
        """
        if self._max_errors is None:
            frames = np.arange(len(values))
        else:
            frames = keys.select_keys(values, self._max_errors[path])
        return self.add_keys(node, path, frames, values[frames])

    def add_keys(self, node: int, path: str, frames: np.ndarray, values: np.ndarray) -> _Track:
        """Add a track with keys of values (keys, 3 or 4) at frames (keys,)."""
        frames_key = frames.tobytes()
        if frames_key not in self._times_of_frames:
            times = _to_float32(self._clip.times[frames])
            self._times_of_frames[frames_key] = self._document.accessor(times, bounds=True)
        gltf_values = _to_float32(values[:, _AXES]) if path == "translation" else _to_gltf_rotation(values)
        return _Track(node, path, self._times_of_frames[frames_key], self._document.accessor(gltf_values))


def _add_animations(
    document: Document,
    clip: Clip,
    parts: Sequence[Part],
    nodes: _Nodes,
    roots_move: Sequence[bool],
    max_errors: Mapping[str, float] | None,
) -> None:
    """Add the animations of a clip, moving, in place or both, which share all tracks except those of the root.

    Args:
        document: document of the file.
        clip: clip to add.
        parts: parts of the body.
        nodes: nodes of the root and the parts.
        roots_move: whether the root moves, for each animation.
        max_errors: see `_ClipTracks`.
    """
    tracks = _ClipTracks(document, clip, max_errors)
    body_tracks = _add_body_tracks(tracks, clip, parts, nodes)
    for name, root_moves in name_animations(clip, roots_move).items():
        root_tracks = _add_root_tracks(tracks, clip, nodes.root, root_moves)
        metadata = clip_metadata(clip, root_moves)
        document.add("animations", _animation(name, metadata, [*root_tracks, *body_tracks]))


def _add_body_tracks(tracks: _ClipTracks, clip: Clip, parts: Sequence[Part], nodes: _Nodes) -> list[_Track]:
    motion = clip.motion
    body_tracks = []
    for part, node in zip(parts, nodes.parts, strict=True):
        if part.parent is None:
            body_tracks.append(tracks.add(node, "translation", motion.positions))
            body_tracks.append(tracks.add(node, "rotation", motion.quaternions))
        elif part.joint is not None:
            orientations = bones.hinge_orientations(part, motion.joints[:, part.joint])
            body_tracks.append(tracks.add(node, "rotation", orientations))
    swinging_nodes = [(part, node) for part, node in zip(parts, nodes.parts, strict=True) if part.swing is not None]
    for index, (part, node) in enumerate(swinging_nodes):
        if clip.swings is not None:
            body_tracks.append(tracks.add(node, "rotation", rotations.product(clip.swings[:, index], part.quaternion)))
    return body_tracks


def _add_root_tracks(tracks: _ClipTracks, clip: Clip, root: int, root_moves: bool) -> list[_Track]:
    """Add the tracks of the root.

    A root that stays has keys, too: players would otherwise leave it where the clip before did.
    """
    if root_moves:
        positions, orientations = _root_path(clip.motion.root)
        return [tracks.add(root, "translation", positions), tracks.add(root, "rotation", orientations)]
    both_ends = np.array((0, len(clip.motion.joints) - 1))
    positions, orientations = _root_path(np.zeros((2, 3)))
    return [
        tracks.add_keys(root, "translation", both_ends, positions),
        tracks.add_keys(root, "rotation", both_ends, orientations),
    ]


def _root_path(ground_poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (n, 3) and quaternions (n, 4) of a root at ground poses (n, 3), x, y, m, and yaw, rad."""
    positions = np.concatenate([ground_poses[:, :2], np.zeros((len(ground_poses), 1))], axis=-1)
    orientations = rotations.turn_about_z(np.array(rotations.NO_TURN), ground_poses[:, 2])
    return positions, orientations


def _animation(name: str, metadata: dict[str, Any], tracks: Sequence[_Track]) -> dict[str, Any]:
    channels = []
    samplers = []
    for index, track in enumerate(tracks):
        channels.append({"sampler": index, "target": {"node": track.node, "path": track.path}})
        samplers.append({"input": track.times, "output": track.values})
    return {"channels": channels, "name": name, "samplers": samplers, "extras": metadata}


def _to_gltf_rotation(quaternions: np.ndarray) -> np.ndarray:
    """Return orientations (..., 4), w first, as glTF has them: in its axes, w last, in 32 bits."""
    x, y, z = (1 + axis for axis in _AXES)
    w = 0
    return _to_float32(quaternions[..., [x, y, z, w]])


def _to_float32(values: np.ndarray) -> np.ndarray:
    return np.asarray(values, "<f4") + np.float32(0.0)  # the sum turns -0 into 0
