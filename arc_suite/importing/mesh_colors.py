"""Colors of what a robot shows: those that its file gives, else those of the materials next to an .obj file.

Colors of textures are not read.
"""

import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite import files

_NO_COLOR = (0.5, 0.5, 0.5, 1.0)  # MuJoCo's color of geoms without one
_MAX_SHOWN_GROUP = 2  # of geoms that MuJoCo's viewer shows unless it is asked for others
_MAX_OBJ_BYTES = 1 << 25
_MAX_MTL_BYTES = 1 << 20


def name_urdf_shapes(robot: ElementTree.Element) -> dict[str, np.ndarray]:
    """Take the materials from the colliders of a URDF, and return their colors (4,) by the name that colliders get."""
    shared_materials = {material.get("name"): material for material in robot.findall("material")}
    colors = {}
    for number, shape in enumerate(robot.iterfind("link/collision")):
        shape.set("name", f"look{number}")
        material = shape.find("material")
        if material is None:
            continue
        shape.remove(material)  # MuJoCo refuses a color that is none
        color = material.find("color")
        if color is None and material.get("name") in shared_materials:
            color = shared_materials[material.get("name")].find("color")
        if color is not None:
            colors[f"look{number}"] = _check_color([*color.get("rgba", "").split(), 1.0][:4])
    return {name: color for name, color in colors.items() if color is not None}


def count_colored_visuals(robot: ElementTree.Element) -> int:
    """Return how many visual shapes of a URDF have a material."""
    return len(robot.findall("link/visual/material"))


def count_colored_geoms(spec: mujoco.MjSpec) -> int:
    """Return how many geoms that an MJCF file shows have a color or a material, without those of the world."""
    geoms = [geom for geom in spec.geoms if geom.parent.name != "world" and is_shown(spec, geom)]
    return sum(bool(geom.material) or has_color(geom) for geom in geoms)


def has_color(geom: mujoco.MjsGeom) -> bool:
    """Return whether the `rgba` of a geom is not MuJoCo's default."""
    return is_color(geom.rgba)


def is_color(rgba: np.ndarray) -> bool:
    """Return whether a color (4,) is not MuJoCo's default."""
    return not np.allclose(rgba, _NO_COLOR)


def is_shown(spec: mujoco.MjSpec, geom: mujoco.MjsGeom) -> bool:
    """Return whether MuJoCo's viewer shows a geom of an MJCF file unless it is asked for others."""
    return geom.group <= _MAX_SHOWN_GROUP and find_rgba(spec, geom)[3] > 0.0


def color_geoms(spec: mujoco.MjSpec) -> None:
    """Give the geoms of an MJCF file the colors of their materials, and those that it does not show no color."""
    for geom in spec.geoms:
        geom.rgba = find_rgba(spec, geom) if is_shown(spec, geom) else _NO_COLOR


def find_rgba(spec: mujoco.MjSpec, geom: mujoco.MjsGeom) -> np.ndarray:
    """Return the color (4,) of a geom of an MJCF file, or of its material if that has no texture."""
    material = spec.material(geom.material) if geom.material and not has_color(geom) else None
    if material is None or any(material.textures):
        return np.array(geom.rgba)
    return np.array(material.rgba)


class Material(NamedTuple):
    """The material of most faces of an .obj file.

    Attributes:
        path: file of materials, which may be missing.
        name: name in this file; None for faces without a material.
    """

    path: Path
    name: str | None


def find_colors(
    spec: mujoco.MjSpec, file_of_mesh: Mapping[str, Path], materials: Mapping[Path, Material]
) -> list[np.ndarray | None]:
    """Return the color (3,) of each geom of a spec; None where neither the geom nor its mesh has one.

    Args:
        spec: the spec, whose geoms have colors in place of materials.
        file_of_mesh: files of meshes by name.
        materials: of these files; see `read_materials`.
    """
    color_of_file = {path: _find_material_color(material) for path, material in materials.items()}
    colors = []
    for geom in spec.geoms:
        color = _check_color(geom.rgba) if has_color(geom) else None
        if color is None and geom.meshname in file_of_mesh:
            color = color_of_file.get(file_of_mesh[geom.meshname])
        colors.append(None if color is None else color[:3])
    return colors


def read_materials(paths: Iterable[Path]) -> dict[Path, Material]:
    """Return the materials of .obj files that name a file of materials."""
    materials = {}
    for path in paths:
        if path.suffix.lower() == ".obj":
            material = _read_material(path)
            if material is not None:
                materials[path] = material
    return materials


def _read_material(path: Path) -> Material | None:
    """Return the material of most faces of an .obj file; None where it names no file of materials."""
    library = None
    material = None
    faces_of_material: Counter[str | None] = Counter()
    for keyword, value in _read_statements(path, _MAX_OBJ_BYTES):
        if keyword == "mtllib":
            library = path.with_name(Path(value.replace("\\", "/")).name)  # in the same folder alone
        elif keyword == "usemtl":
            material = value
        elif keyword == "f":
            faces_of_material[material] += 1
    if library is None:
        return None
    most_common = faces_of_material.most_common(1)
    return Material(library, most_common[0][0] if most_common else None)


def _find_material_color(material: Material) -> np.ndarray | None:
    """Return the color (4,) of a material; None without its file, or where this gives none."""
    if not material.path.is_file():
        return None
    return _read_mtl(material.path).get(material.name)


def _read_statements(path: Path, most_bytes: int) -> Iterator[tuple[str, str]]:
    """Yield keyword and value of each line of an .obj or .mtl file."""
    for line in files.read_bytes(path, most_bytes).decode("utf-8", "replace").splitlines():
        keyword, _, value = line.strip().partition(" ")
        yield keyword, value.strip()


def _read_mtl(path: Path) -> dict[str | None, np.ndarray | None]:
    """Return the diffuse colors (4,) of an .mtl file by the name of their material."""
    colors: dict[str | None, np.ndarray | None] = {}
    material = None
    for keyword, value in _read_statements(path, _MAX_MTL_BYTES):
        if keyword == "newmtl":
            material = value
        elif keyword == "Kd":
            colors[material] = _check_color([*value.split(), 1.0])
    return colors


def _check_color(values) -> np.ndarray | None:
    """Return a color (4,) with numbers from 0 to 1; None for anything else."""
    try:
        color = np.array(values, float)
    except ValueError:
        return None
    if color.shape != (4,) or not np.isfinite(color).all():
        return None
    return color.clip(0.0, 1.0)
