"""The meshes of colliders, as points and triangles in the text of the source.

The compiler turns a mesh into the frame of its inertia and moves its geom in return. So that it does the same again,
it gets the points of the file, and the geom's pose in the file.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite.importing.tree import colliding_geoms, vertices
from arc_suite.robots.spec import MAX_SOURCE

# Characters of all meshes of a body; beyond, the largest meshes are reduced to their hulls.
MAX_TEXT = MAX_SOURCE - (1 << 17)

_MESH = mujoco.mjtGeom.mjGEOM_MESH

_INERTIAS = {
    mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX: "convex",
    mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT: "exact",
    mujoco.mjtMeshInertia.mjMESH_INERTIA_LEGACY: "legacy",
    mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL: "shell",
}

# Attributes of a mesh, with the values that MuJoCo takes if they are left out.
_DEFAULTS = {"scale": (1.0, 1.0, 1.0), "refpos": (0.0, 0.0, 0.0), "refquat": (1.0, 0.0, 0.0, 0.0)}


class Mesh(NamedTuple):
    """The mesh of a geom.

    Attributes:
        name: name of the mesh in the file.
        whole: whether it has all points of the file, and not only the corners of its hull.
        attributes: attributes of the asset, as in MJCF.
        position: (3,) position of the geom, before the compiler moves it.
        orientation: (4,) orientation of the geom, a quaternion.
    """

    name: str
    whole: bool
    attributes: dict[str, str]
    position: np.ndarray
    orientation: np.ndarray


def meshes_of(spec: mujoco.MjSpec, model: mujoco.MjModel) -> dict[int, Mesh]:
    """Return the meshes of geoms that collide, by geom.

    Args:
        spec: spec of the file; it is not changed.
        model: compiled from it.
    """
    geoms = [geom for geom in colliding_geoms(model) if model.geom_type[geom] == _MESH]
    if not geoms:
        return {}
    name_of_geom = {geom: model.mesh(int(model.geom_dataid[geom])).name for geom in geoms}
    whole_meshes = {name: _whole_mesh(spec, spec.mesh(name)) for name in dict.fromkeys(name_of_geom.values())}
    hulls = {name: _hull(model, geom) for geom, name in name_of_geom.items()}
    whole_names = _choose_whole_meshes(whole_meshes, hulls)
    model_without_meshes = compile_with_balls(spec.copy())
    meshes = {}
    for geom, name in name_of_geom.items():
        is_whole = name in whole_names
        # The compiler moves the geoms of whole meshes again, but not those of hulls.
        poses = model_without_meshes if is_whole else model
        attributes = whole_meshes[name] if is_whole else hulls[name]
        meshes[geom] = Mesh(name, is_whole, attributes, poses.geom_pos[geom], poses.geom_quat[geom])
    return meshes


def text_length(meshes: Mapping[int, Mesh]) -> int:
    """Return how many characters meshes take in a source, each once."""
    attributes_by_mesh = {(mesh.name, mesh.whole): mesh.attributes for mesh in meshes.values()}
    return sum(_text_length(attributes) for attributes in attributes_by_mesh.values())


def file_of(spec: mujoco.MjSpec, mesh) -> Path:
    """Return the file of a mesh."""
    return Path(spec.modelfiledir) / spec.meshdir / mesh.file


def _whole_mesh(spec: mujoco.MjSpec, mesh) -> dict[str, str]:
    """Return the attributes of a mesh with its points in place of its file."""
    mesh_with_points = mesh
    if mesh.file:
        mesh_with_points = mujoco.MjSpec.from_file(str(file_of(spec, mesh))).meshes[0]
    attributes = {
        "inertia": _INERTIAS[mesh.inertia],
        "vertex": _format(np.array(mesh_with_points.uservert, np.float32)),
        "face": _format(mesh_with_points.userface),
    }
    for name, default in _DEFAULTS.items():
        value = getattr(mesh, name)
        if any(value != default):
            attributes[name] = _format(value.tolist())
    if mesh.maxhullvert > 0:
        attributes["maxhullvert"] = str(mesh.maxhullvert)
    return {name: text for name, text in attributes.items() if text}


def hull_points(model: mujoco.MjModel, geom: int) -> np.ndarray:
    """Return the corners (points, 3) of the convex hull of a geom's mesh, in the frame of the geom, m."""
    mesh = int(model.geom_dataid[geom])
    points = vertices(model, mesh)
    graph = int(model.mesh_graphadr[mesh])
    if graph >= 0:
        # The graph has the number of corners, that of triangles, an edge address and a vertex for each corner.
        count = int(model.mesh_graph[graph])
        first = graph + 2 + count
        corners = np.sort(model.mesh_graph[first : first + count])
        points = points[corners]
    return points


def _hull(model: mujoco.MjModel, geom: int) -> dict[str, str]:
    """Return the attributes of a mesh of the corners of a compiled mesh's convex hull."""
    return {"inertia": "convex", "vertex": _format(hull_points(model, geom).ravel())}


def _format(numbers: Iterable) -> str:
    """Return numbers as text that is read back as the same bits; float32 has fewer digits."""
    return " ".join(map(str, numbers))


def _choose_whole_meshes(
    whole_meshes: Mapping[str, Mapping[str, str]], hulls: Mapping[str, Mapping[str, str]]
) -> set[str]:
    """Return the names of meshes that stay whole: all except the largest, if the text would be too long."""
    whole_lengths = {name: _text_length(attributes) for name, attributes in whole_meshes.items()}
    hull_lengths = {name: _text_length(attributes) for name, attributes in hulls.items()}
    whole_names = set(whole_lengths)
    total = sum(whole_lengths.values())
    for name in sorted(whole_lengths, key=lambda name: -whole_lengths[name]):
        if total <= MAX_TEXT:
            break
        total += hull_lengths[name] - whole_lengths[name]
        whole_names.remove(name)
    return whole_names


def _text_length(attributes: Mapping[str, str]) -> int:
    return sum(len(text) for text in attributes.values())


def compile_with_balls(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Return the model of a spec, which is changed: balls in place of meshes lie where the file puts the meshes."""
    for geom in spec.geoms:
        if geom.meshname:
            geom.type = mujoco.mjtGeom.mjGEOM_SPHERE
            geom.meshname = ""
            geom.size[0] = 1.0
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    return spec.compile()
