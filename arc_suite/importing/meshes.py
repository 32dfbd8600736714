"""The meshes of colliders, as points and triangles in the text of the source.

The compiler turns a mesh into the frame of its inertia and moves its geom in return. So that it does the same again,
it gets the points of the file, and the geom's place in the file.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite.importing.tree import colliding_geoms, vertices
from arc_suite.robots.spec import MAX_SOURCE

_MESH = mujoco.mjtGeom.mjGEOM_MESH

MAX_TEXT = MAX_SOURCE - (1 << 17)  # characters of all meshes of a body; beyond, the largest are reduced to their hulls

_INERTIAS = {
    mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX: "convex",
    mujoco.mjtMeshInertia.mjMESH_INERTIA_EXACT: "exact",
    mujoco.mjtMeshInertia.mjMESH_INERTIA_LEGACY: "legacy",
    mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL: "shell",
}


class Mesh(NamedTuple):
    """The mesh of a geom.

    Attributes:
        name: of the mesh in the file.
        whole: whether it has all points of the file, and not only the corners of its hull.
        attributes: of the asset, as in MJCF.
        position: (3,) of the geom, before the compiler moves it.
        orientation: (4,) of it, a quaternion.
    """

    name: str
    whole: bool
    attributes: dict[str, str]
    position: np.ndarray
    orientation: np.ndarray


def meshes_of(spec: mujoco.MjSpec, model: mujoco.MjModel) -> dict[int, Mesh]:
    """Return the meshes of geoms that collide, by geom.

    Args:
        spec: of the file; nothing of it is changed.
        model: compiled from it.
    """
    geoms = [geom for geom in colliding_geoms(model) if model.geom_type[geom] == _MESH]
    if not geoms:
        return {}
    names = {geom: model.mesh(int(model.geom_dataid[geom])).name for geom in geoms}
    wholes = {name: _asset(spec, spec.mesh(name)) for name in dict.fromkeys(names.values())}
    hulls = {name: _hull(model, geom) for geom, name in names.items()}
    whole = _that_fit(wholes, hulls)
    places = _places(spec)
    return {
        geom: Mesh(name, True, wholes[name], places.geom_pos[geom], places.geom_quat[geom])
        if name in whole
        else Mesh(name, False, hulls[name], model.geom_pos[geom], model.geom_quat[geom])
        for geom, name in names.items()
    }


def file_of(spec: mujoco.MjSpec, mesh) -> Path:
    """Return the file of a mesh."""
    return Path(spec.modelfiledir) / spec.meshdir / mesh.file


def _text(numbers: Iterable) -> str:
    """Return numbers that are read back as the same bits; those of float32 have fewer digits."""
    return " ".join(map(str, numbers))


def _asset(spec: mujoco.MjSpec, mesh) -> dict[str, str]:
    """Return the attributes of a mesh with its points in place of its file."""
    read = mujoco.MjSpec.from_file(str(file_of(spec, mesh))).meshes[0] if mesh.file else mesh
    attributes = {
        "inertia": _INERTIAS[mesh.inertia],
        "vertex": _text(np.array(read.uservert, np.float32)),
        "face": _text(read.userface),
    }
    plain = {"scale": (1.0, 1.0, 1.0), "refpos": (0.0, 0.0, 0.0), "refquat": (1.0, 0.0, 0.0, 0.0)}
    attributes |= {
        name: _text(getattr(mesh, name).tolist()) for name in plain if any(getattr(mesh, name) != plain[name])
    }
    if mesh.maxhullvert > 0:
        attributes["maxhullvert"] = str(mesh.maxhullvert)
    return {name: text for name, text in attributes.items() if text}


def _that_fit(wholes: dict[str, dict[str, str]], hulls: dict[str, dict[str, str]]) -> set[str]:
    """Return the names of meshes that stay whole, so that the text is short enough: all but the largest."""
    whole, reduced = ({name: sum(map(len, mesh.values())) for name, mesh in kind.items()} for kind in (wholes, hulls))
    total = sum(whole.values())
    for name in sorted(whole, key=lambda name: -whole[name]):
        if total <= MAX_TEXT:
            break
        total += reduced[name] - whole.pop(name)
    return set(whole)


def _hull(model: mujoco.MjModel, geom: int) -> dict[str, str]:
    """Return a mesh of the corners of a compiled mesh's convex hull."""
    mesh = int(model.geom_dataid[geom])
    graph = int(model.mesh_graphadr[mesh])
    corners = slice(None)
    if graph >= 0:  # number of corners, of triangles, then of each corner its edges, then its vertex
        count = int(model.mesh_graph[graph])
        corners = np.sort(model.mesh_graph[graph + 2 + count : graph + 2 + 2 * count])
    return {"inertia": "convex", "vertex": _text(vertices(model, mesh)[corners].ravel())}


def _places(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Return the model with balls in place of meshes: they lie where the file puts the meshes."""
    spec = spec.copy()
    for geom in spec.geoms:
        if geom.type == _MESH:
            geom.type, geom.meshname = mujoco.mjtGeom.mjGEOM_SPHERE, ""
            geom.size[0] = 1.0
    for mesh in list(spec.meshes):
        spec.delete(mesh)
    return spec.compile()
