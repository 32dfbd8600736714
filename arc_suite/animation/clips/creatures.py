"""Bodies and their clips as glTF: bones or rigid parts under the names of the MJCF, meshes, animations.

glTF's y axis points up and its z axis ahead: its (x, y, z) are our (y, z, x), a proper rotation.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import bones, keys, shapes
from arc_suite.animation.clips.clips import Clip
from arc_suite.animation.clips.gltf import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, Document
from arc_suite.animation.clips.meshes import body_meshes
from arc_suite.animation.clips.metadata import ROOT_MOTIONS, clip_metadata, name_animations
from arc_suite.animation.clips.shapes import Mesh
from arc_suite.animation.parts import Material, Part, part_frames
from arc_suite.animation.parts import describe_body as described
from arc_suite.robots.spec import Body

RIGS = ("skin", "nodes")

_AXES = (1, 2, 0)  # of ours, that are glTF's x, y and z
_ANGLE, _LENGTH = math.radians(0.1), 0.001  # rad, and standing heights, by which reduced keys may be off


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
    tree; as a skin, also a node with the mesh, whose skeleton they are. A bone of the skin lies in its limb; see
    `bones.align_bones`. The body is bound in the first pose of idle. An animation is called after its clip, with
    `_in_place` where the root stays although the clip moves, and `_loop` at the end where it loops; its extras are those of the
    `sidecar`.

    Args:
        body: any body.
        clips: of the body.
        rig: skin, or nodes, each with the mesh of its part.
        root_motion: moving, in_place, or both, two animations of each clip that moves.
        generator: what the file says that it was made by.
        triangles: that the mesh has at most; see `meshes.body_meshes`.
        uv: whether faces have places in a texture.
        reduced: whether keys are left out that lines between others replace within 0.1 degrees and 0.001 standing
            heights.

    Raises:
        ValueError: no mesh has so few triangles.
    """
    document, (parts, looks), height = Document(generator), described(body), body.torso.standing_height
    if rig == "skin":
        parts = bones.align_bones(parts)
    meshes = body_meshes(parts, height, triangles, uv)
    bound = _bound(parts, meshes, clips)
    root, nodes = _hierarchy(document, bound)
    shown = {name for own in meshes for name in own}
    materials = {
        name: document.add("materials", _material(name, look)) for name, look in looks.items() if name in shown
    }
    scene = [root]
    if rig == "skin":
        scene.append(_skinned(document, body.name, bound, meshes, [root, *nodes], materials))
    else:
        _add_meshes(document, bound, meshes, nodes, materials)
    document.json |= {"scene": document.add("scenes", {"name": body.name, "nodes": scene})}
    bounds = {"rotation": _ANGLE, "translation": _LENGTH * height} if reduced else None
    for clip in clips:
        _animations(document, clip, parts, root, nodes, ROOT_MOTIONS[root_motion], bounds)
    return document.glb()


def _hierarchy(document: Document, parts: Sequence[Part]) -> tuple[int, list[int]]:
    """Add the nodes of the root and of parts, and return them."""
    root = document.add("nodes", {"name": "root"})
    nodes = [document.add("nodes", _node(part)) for part in parts]
    children: dict[int, list[int]] = {}
    for part, node in zip(parts, nodes, strict=True):
        children.setdefault(root if part.parent is None else nodes[part.parent], []).append(node)
    for node, below in children.items():
        document.json["nodes"][node]["children"] = below
    return root, nodes


def _add_meshes(document: Document, parts: Sequence[Part], meshes, nodes: list[int], materials) -> None:
    """Give each node the mesh of its part; a link of an imported body may show nothing."""
    for part, own, node in zip(parts, meshes, nodes, strict=True):
        if own:
            primitives = [_primitive(document, mesh, materials[name]) for name, mesh in own.items()]
            mesh = document.add("meshes", {"name": part.name, "primitives": primitives})
            document.json["nodes"][node]["mesh"] = mesh


def _bound(parts: list[Part], meshes: list[dict[str, Mesh]], clips: Sequence[Clip]) -> list[Part]:
    """Return the parts in the first pose of idle; without that clip, standing on the ground."""
    for clip in clips:
        if clip.name == "idle":
            return bones.pose_parts(parts, clip.motion.pose(0))
    low = min(
        (place + mesh.points @ turn.T)[:, 2].min()
        for own, place, turn in zip(meshes, *part_frames(parts), strict=True)
        for mesh in own.values()
    )
    return [part if part.parent is not None else part._replace(place=part.place - (0.0, 0.0, low)) for part in parts]


def _material(name: str, material: Material) -> dict:
    color = _linear(material.color)
    look = {"baseColorFactor": [*color.tolist(), 1.0], "metallicFactor": 0.0, "roughnessFactor": material.roughness}
    properties = {"name": name, "pbrMetallicRoughness": look}
    if material.emission > 0.0:
        properties["emissiveFactor"] = (material.emission * color).tolist()
    return properties


def _linear(color: np.ndarray) -> np.ndarray:
    """Return the linear intensities of an sRGB color (IEC 61966-2-1), rounded to what a screen can show."""
    linear = np.where(color <= 0.04045, color / 12.92, ((color + 0.055) / 1.055) ** 2.4)
    return linear.astype(float).round(6)


def _node(part: Part) -> dict:
    node: dict[str, Any] = {"name": part.name, "translation": _float32(part.place[list(_AXES)]).tolist()}
    if part.quaternion[0] < 1.0:
        node["rotation"] = _turn(part.quaternion).tolist()
    return node


def _skinned(document: Document, name: str, parts, meshes, joints: list[int], materials) -> int:
    """Add the mesh with its skin, and return its node."""
    places, turns = part_frames(parts)
    places, turns = [np.zeros(3), *places], [np.eye(3), *turns]  # of the root first
    by_material: dict[str, list[tuple[int, Mesh]]] = {}
    for joint, own in enumerate(meshes, start=1):
        for material, mesh in own.items():
            by_material.setdefault(material, []).append((joint, mesh.transform(places[joint], turns[joint])))
    kind = np.uint8 if len(joints) <= 256 else np.dtype("<u2")
    primitives = []
    for material, several in by_material.items():
        counts = [len(mesh.points) for _, mesh in several]
        bound = np.zeros((sum(counts), 4), kind)
        bound[:, 0] = np.repeat([joint for joint, _ in several], counts)
        weights = np.zeros((sum(counts), 4), np.uint8)
        weights[:, 0] = 255
        primitive = _primitive(document, shapes.join_meshes([mesh for _, mesh in several]), materials[material])
        primitive["attributes"] |= {
            "JOINTS_0": document.accessor(bound, ARRAY_BUFFER),
            "WEIGHTS_0": document.accessor(weights, ARRAY_BUFFER, normalized=True),
        }
        primitives.append(primitive)
    inverses = np.tile(np.eye(4), (len(joints), 1, 1))
    for inverse, place, turn in zip(inverses, places, turns, strict=True):
        own = turn[np.ix_(_AXES, _AXES)].T
        inverse[:3, :3], inverse[:3, 3] = own, -own @ place[list(_AXES)]
    binding = document.accessor(_float32(inverses))
    skin = {"name": name, "joints": joints, "skeleton": joints[0], "inverseBindMatrices": binding}
    mesh = document.add("meshes", {"name": name, "primitives": primitives})
    return document.add("nodes", {"name": name, "mesh": mesh, "skin": document.add("skins", skin)})


def _primitive(document: Document, mesh: Mesh, material: int) -> dict:
    indices = mesh.triangles.astype("<u2" if len(mesh.points) < 2**16 else "<u4").reshape(-1)
    attributes = {
        "POSITION": document.accessor(_float32(mesh.points[:, _AXES]), ARRAY_BUFFER, bounds=True),
        "NORMAL": document.accessor(_float32(mesh.normals[:, _AXES]), ARRAY_BUFFER),
    }
    if mesh.uv is not None:
        attributes["TEXCOORD_0"] = document.accessor(_float32(mesh.uv), ARRAY_BUFFER)
    return {
        "attributes": attributes,
        "indices": document.accessor(indices, ELEMENT_ARRAY_BUFFER),
        "material": material,
    }


def _animations(
    document: Document,
    clip: Clip,
    parts: Sequence[Part],
    root: int,
    nodes: list[int],
    moving: Sequence[bool],
    bounds: Mapping[str, float] | None,
) -> None:
    """Add a clip, moving, in place or both, which share all but the root.

    Args:
        document: of the file.
        clip: to add.
        parts: of the body.
        root: its node.
        nodes: those of the parts.
        moving: whether the root moves, for each animation.
        bounds: by which tracks of each target may be off for fewer keys; None for a key in each frame.
    """
    motion, inputs = clip.motion, {}

    def track(node: int, target: str, values: np.ndarray, at: np.ndarray | None = None):
        """Add a track, and return its node and target, and the accessors of its times and values."""
        if at is None:
            at = np.arange(len(values)) if bounds is None else keys.select_keys(values, bounds[target])
            values = values[at]
        if (key := at.tobytes()) not in inputs:  # tracks with the same keys share them
            inputs[key] = document.accessor(_float32(clip.times[at]), bounds=True)
        stored = _float32(values[:, _AXES]) if target == "translation" else _turn(values)
        return node, target, inputs[key], document.accessor(stored)

    shared = []
    for part, node in zip(parts, nodes, strict=True):
        if part.parent is None:
            shared.append(track(node, "translation", motion.positions))
            shared.append(track(node, "rotation", motion.quaternions))
        elif part.joint is not None:
            shared.append(track(node, "rotation", bones.hinge_orientations(part, motion.joints[:, part.joint])))
    ends = np.array((0, len(motion.joints) - 1))
    for name, moves in name_animations(clip, moving).items():
        # A root that stays has keys too: in players it would otherwise be wherever the clip before left it.
        path, at = (motion.root, None) if moves else (np.zeros((2, 3)), ends)
        ground = np.concatenate([path[:, :2], np.zeros((len(path), 1))], axis=-1)
        heading = rotations.turn_about_z(np.array((1.0, 0.0, 0.0, 0.0)), path[:, 2])
        channels = [track(root, "translation", ground, at), track(root, "rotation", heading, at), *shared]
        samplers = [{"input": times, "output": output} for _, _, times, output in channels]
        targets = [{"node": node, "path": target} for node, target, _, _ in channels]
        own = {"channels": [{"sampler": index, "target": target} for index, target in enumerate(targets)]}
        document.add("animations", own | {"name": name, "samplers": samplers, "extras": clip_metadata(clip)})


def _turn(quaternions: np.ndarray) -> np.ndarray:
    """Return orientations (..., 4), w first, as glTF has them: in its axes, w last, of unit length in 32 bits."""
    return _float32(quaternions[..., [1 + axis for axis in _AXES] + [0]])


def _float32(values: np.ndarray) -> np.ndarray:
    return np.asarray(values, "<f4") + np.float32(0.0)  # of -0 it makes 0
