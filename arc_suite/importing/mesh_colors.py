"""Colors of visual meshes: those that the robot's file gives, else those of the materials next to an .obj file.

Colors of textures are not read.
"""

import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import mujoco
import numpy as np

from arc_suite import files

_NO_COLOR = (0.5, 0.5, 0.5, 1.0)  # MuJoCo's color of geoms without one
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


def find_rgba(spec: mujoco.MjSpec, geom: mujoco.MjsGeom) -> np.ndarray:
    """Return the color (4,) of a geom of an MJCF file, or of its material if that has no texture."""
    material = spec.material(geom.material) if geom.material and np.allclose(geom.rgba, _NO_COLOR) else None
    if material is None or any(material.textures):
        return np.array(geom.rgba)
    return np.array(material.rgba)


def find_colors(spec: mujoco.MjSpec, file_of_mesh: Mapping[str, Path]) -> list[np.ndarray | None]:
    """Return the color (3,) of each geom of a spec; None where neither the geom nor its mesh has one.

    Args:
        spec: the spec, whose geoms have colors in place of materials.
        file_of_mesh: files of meshes by name.
    """
    color_of_file: dict[Path, np.ndarray | None] = {}
    colors = []
    for geom in spec.geoms:
        color = None if np.allclose(geom.rgba, _NO_COLOR) else _check_color(geom.rgba)
        path = file_of_mesh.get(geom.meshname)
        if color is None and path is not None and path.suffix.lower() == ".obj":
            if path not in color_of_file:
                color_of_file[path] = _read_obj_color(path)
            color = color_of_file[path]
        colors.append(None if color is None else color[:3])
    return colors


def find_libraries(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return the files of materials that .obj files name, with those that are missing."""
    libraries = [_find_library(path) for path in paths if path.suffix.lower() == ".obj"]
    return tuple(dict.fromkeys(library for library in libraries if library is not None))


def _find_library(path: Path) -> Path | None:
    """Return the file of materials of an .obj file, which lies in the same folder; None where it names none."""
    library = None
    for keyword, value in _read_statements(path, _MAX_OBJ_BYTES):
        if keyword == "mtllib":
            library = path.with_name(Path(value.replace("\\", "/")).name)
    return library


def _read_statements(path: Path, most_bytes: int) -> Iterator[tuple[str, str]]:
    """Yield keyword and value of each line of an .obj or .mtl file."""
    for line in files.read_bytes(path, most_bytes).decode("utf-8", "replace").splitlines():
        keyword, _, value = line.strip().partition(" ")
        yield keyword, value.strip()


def _read_obj_color(path: Path) -> np.ndarray | None:
    """Return the color of the material of most faces of an .obj file; None without a file of materials."""
    library = _find_library(path)
    material = None
    faces_of_material: Counter[str | None] = Counter()
    for keyword, value in _read_statements(path, _MAX_OBJ_BYTES):
        if keyword == "usemtl":
            material = value
        elif keyword == "f":
            faces_of_material[material] += 1
    if library is None or not faces_of_material or not library.is_file():
        return None
    return _read_mtl(library).get(faces_of_material.most_common(1)[0][0])


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
