"""Bodies and their clips as glTF: bones or rigid parts under the names of the MJCF, meshes, animations.

glTF's y axis points up and its z axis ahead: its (x, y, z) are our (y, z, x), a proper rotation.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from arc_suite import rotations
from arc_suite.animation.clips import bones, shapes
from arc_suite.animation.clips.clips import Clip
from arc_suite.animation.clips.gltf import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, Document
from arc_suite.animation.clips.metadata import ROOT_MOTIONS, animations, metadata
from arc_suite.animation.clips.shapes import Mesh
from arc_suite.animation.parts import Material, Part, frames
from arc_suite.animation.parts import parts as described
from arc_suite.robots.spec import Body

RIGS = ("skin", "nodes")

_AXES = (1, 2, 0)  # of ours, that are glTF's x, y and z
_TOLERANCE = 0.004  # of the standing height, by which a face may cut into a round shape


def glb(body: Body, clips: Sequence[Clip], rig: str = "skin", root_motion: str = "both", generator: str = "") -> bytes:
    """Return a body and its clips as a binary glTF file.

    Its scene has the node `root`, on the ground below the torso, with the parts of the body under it as in the body
    tree; as a skin, also a node with the mesh, whose skeleton they are. An animation is called after its clip, with
    `_in_place` where the root stays although the clip moves, and `_loop` at the end where it loops; its extras are
    those of the `sidecar`.

    Args:
        body: any body.
        clips: of the body.
        rig: skin, or nodes, each with the mesh of its part.
        root_motion: moving, in_place, or both, two animations of each clip that moves.
        generator: what the file says that it was made by.
    """
    document, (parts, looks) = Document(generator), described(body)
    if rig == "skin":
        parts = bones.limbs(parts)
    meshes = [part_meshes(part, _TOLERANCE * body.torso.standing_height) for part in parts]
    bound = _bound(parts, meshes, clips)
    materials = {name: document.add("materials", _material(name, look)) for name, look in looks.items()}
    root = document.add("nodes", {"name": "root"})
    nodes = [document.add("nodes", _node(part)) for part in bound]
    children: dict[int, list[int]] = {}
    for part, node in zip(parts, nodes, strict=True):
        children.setdefault(root if part.parent is None else nodes[part.parent], []).append(node)
    for node, below in children.items():
        document.json["nodes"][node]["children"] = below
    scene = [root]
    if rig == "skin":
        scene.append(_skinned(document, body.name, bound, meshes, [root, *nodes], materials))
    else:
        for part, own, node in zip(parts, meshes, nodes, strict=True):
            if not own:  # a link of an imported body may show nothing
                continue
            primitives = [_primitive(document, mesh, materials[name]) for name, mesh in own.items()]
            mesh = document.add("meshes", {"name": part.name, "primitives": primitives})
            document.json["nodes"][node]["mesh"] = mesh
    document.json |= {"scene": document.add("scenes", {"name": body.name, "nodes": scene})}
    for clip in clips:
        _animations(document, clip, parts, root, nodes, ROOT_MOTIONS[root_motion])
    return document.glb()


def _bound(parts: list[Part], meshes: list[dict[str, Mesh]], clips: Sequence[Clip]) -> list[Part]:
    """Return the parts in the first pose of idle; without that clip, standing on the ground."""
    for clip in clips:
        if clip.name == "idle":
            return bones.posed(parts, clip.motion.pose(0))
    low = min(
        (place + mesh.points @ turn.T)[:, 2].min()
        for own, place, turn in zip(meshes, *frames(parts), strict=True)
        for mesh in own.values()
    )
    return [part if part.parent is not None else part._replace(place=part.place - (0.0, 0.0, low)) for part in parts]


def part_meshes(part: Part, tolerance: float) -> dict[str, Mesh]:
    """Return the shapes of a part by material, those of one as one mesh in the part's frame."""
    meshes: dict[str, list[Mesh]] = {}
    for shape in part.shapes:
        mesh = shapes.polyhedron(*shape.hull) if shape.hull else shapes.shape(shape.kind, shape.size, tolerance)
        meshes.setdefault(shape.material, []).append(mesh.moved(shape.place, rotations.matrix(shape.quaternion)))
    return {material: shapes.joined(several) for material, several in meshes.items()}


def _material(name: str, material: Material) -> dict:
    colour = _linear(material.colour)
    look = {"baseColorFactor": [*colour.tolist(), 1.0], "metallicFactor": 0.0, "roughnessFactor": material.roughness}
    properties = {"name": name, "pbrMetallicRoughness": look}
    if material.emission > 0.0:
        properties["emissiveFactor"] = (material.emission * colour).tolist()
    return properties


def _linear(colour: np.ndarray) -> np.ndarray:
    """Return the linear intensities of an sRGB colour (IEC 61966-2-1), rounded to what a screen can show."""
    linear = np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
    return linear.astype(float).round(6)


def _node(part: Part) -> dict:
    node: dict[str, Any] = {"name": part.name, "translation": _float32(part.place[list(_AXES)]).tolist()}
    if part.quaternion[0] < 1.0:
        node["rotation"] = _turn(part.quaternion).tolist()
    return node


def _skinned(document: Document, name: str, parts, meshes, joints: list[int], materials) -> int:
    """Add the mesh with its skin, and return its node."""
    places, turns = frames(parts)
    places, turns = [np.zeros(3), *places], [np.eye(3), *turns]  # of the root first
    by_material: dict[str, list[tuple[int, Mesh]]] = {}
    for joint, own in enumerate(meshes, start=1):
        for material, mesh in own.items():
            by_material.setdefault(material, []).append((joint, mesh.moved(places[joint], turns[joint])))
    kind = np.uint8 if len(joints) <= 256 else np.dtype("<u2")
    primitives = []
    for material, several in by_material.items():
        counts = [len(mesh.points) for _, mesh in several]
        bound = np.zeros((sum(counts), 4), kind)
        bound[:, 0] = np.repeat([joint for joint, _ in several], counts)
        weights = np.zeros((sum(counts), 4), np.uint8)
        weights[:, 0] = 255
        primitive = _primitive(document, shapes.joined([mesh for _, mesh in several]), materials[material])
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
    return {
        "attributes": {
            "POSITION": document.accessor(_float32(mesh.points[:, _AXES]), ARRAY_BUFFER, bounds=True),
            "NORMAL": document.accessor(_float32(mesh.normals[:, _AXES]), ARRAY_BUFFER),
        },
        "indices": document.accessor(indices, ELEMENT_ARRAY_BUFFER),
        "material": material,
    }


def _animations(document: Document, clip: Clip, parts, root: int, nodes: list[int], moving: Sequence[bool]) -> None:
    """Add a clip, moving, in place or both, which share all but the root."""
    motion = clip.motion
    times = document.accessor(_float32(clip.times), bounds=True)
    tracks = []
    for part, node in zip(parts, nodes, strict=True):
        if part.parent is None:
            tracks.append((node, "translation", _float32(motion.positions[:, _AXES])))
            tracks.append((node, "rotation", _turn(motion.quaternions)))
        elif part.joint is not None:
            tracks.append((node, "rotation", _turn(bones.hinged(part, motion.joints[:, part.joint]))))
    shared = [(node, target, times, document.accessor(values)) for node, target, values in tracks]
    for name, moves in animations(clip, moving).items():
        # A root that stays has keys too: in players it would otherwise be wherever the clip before left it.
        path = motion.root if moves else np.zeros((2, 3))
        own = times if moves else document.accessor(_float32(clip.times[[0, -1]]), bounds=True)
        ground = np.concatenate([path[:, :2], np.zeros((len(path), 1))], axis=-1)
        heading = rotations.turned(np.array((1.0, 0.0, 0.0, 0.0)), path[:, 2])
        channels = [
            (root, "translation", own, document.accessor(_float32(ground[:, _AXES]))),
            (root, "rotation", own, document.accessor(_turn(heading))),
            *shared,
        ]
        samplers = [{"input": keys, "output": output} for _, _, keys, output in channels]
        targets = [{"node": node, "path": target} for node, target, _, _ in channels]
        own = {"channels": [{"sampler": index, "target": target} for index, target in enumerate(targets)]}
        document.add("animations", own | {"name": name, "samplers": samplers, "extras": metadata(clip)})


def _turn(quaternions: np.ndarray) -> np.ndarray:
    """Return orientations (..., 4), w first, as glTF has them: in its axes, w last, of unit length in 32 bits."""
    return _float32(quaternions[..., [1 + axis for axis in _AXES] + [0]])


def _float32(values: np.ndarray) -> np.ndarray:
    return np.asarray(values, "<f4") + np.float32(0.0)  # of -0 it makes 0
