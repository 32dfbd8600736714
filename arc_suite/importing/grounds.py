"""Ground from files: height maps in PNG, meshes, and the geoms of a scene in MJCF."""

import struct
from collections.abc import Callable
from pathlib import Path

import imageio.v3 as imageio
import mujoco
import numpy as np

from arc_suite import files, parsers, rotations
from arc_suite.arenas import ground_text, height_map
from arc_suite.arenas.height_map import HeightMap
from arc_suite.arenas.mapped import MAX_SIDE
from arc_suite.arenas.solids import SIZES, Solid, Solids
from arc_suite.importing import bounds, opening, rasters
from arc_suite.importing.meshes import file_of, hull_points

_MAX_BYTES = 1 << 25  # of a picture or a mesh
_MAX_PIXELS = 8192  # of a picture along either side
_MAX_NAME = 40  # characters
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_HEADER_BYTES = 26  # of a PNG, to its kind of colors
_SIZE_BYTES = slice(16, 24)  # of a PNG: its columns and rows
_GRAY = 0  # PNG's number for pictures of one channel without opacity
_DIGITS = 6  # of lengths, m

_PLANE = mujoco.mjtGeom.mjGEOM_PLANE
_MESH = mujoco.mjtGeom.mjGEOM_MESH
_FIELD = mujoco.mjtGeom.mjGEOM_HFIELD
_KIND_OF_GEOM = {
    _PLANE: "plane",
    mujoco.mjtGeom.mjGEOM_BOX: "box",
    mujoco.mjtGeom.mjGEOM_SPHERE: "sphere",
    mujoco.mjtGeom.mjGEOM_CAPSULE: "capsule",
    mujoco.mjtGeom.mjGEOM_CYLINDER: "cylinder",
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: "ellipsoid",
    _MESH: "mesh",
}


def read(path: Path, scale: str | None) -> str:
    """Return the ground of a file as text.

    Args:
        path: path of the file.
        scale: of a picture its length, width and height as "20x20x1.5", m; of a mesh a factor; None without one.

    Raises:
        ValueError: the file contains no ground; the message is one line that names the file.
        OSError: the file cannot be read.
    """
    with parsers.guard(str(path), passes=(OSError,)):
        ground = _READERS[path.suffix.lower()](path, _parse_scale(scale))
        return ground_text.to_text(ground)


def _parse_scale(scale: str | None) -> tuple[float, ...]:
    """Return the numbers of a scale; none without one."""
    if scale is None:
        return ()
    return tuple(float(number) for number in scale.split("x"))


def _read_png(path: Path, scale: tuple[float, ...]) -> HeightMap:
    """Return the height map of a picture, whose top is the far side in y."""
    if len(scale) != 3:
        expected = f"{path.name}:20x20x1.5"
        raise ValueError(f"expected length, width and height of white over black, m, after its name: {expected}")
    pixels = _decode_png(_read_bytes(path))
    return _make_map(path, scale, pixels[::-1])


def _read_bytes(path: Path) -> bytes:
    content = files.read_bytes(path, _MAX_BYTES)
    if len(content) > _MAX_BYTES:
        raise ValueError(f"expected at most {_MAX_BYTES} bytes")
    return content


def _decode_png(content: bytes) -> np.ndarray:
    """Return the gray values (rows, columns) of a PNG, from 0 to 1."""
    header = content[:_HEADER_BYTES]
    if len(header) < _HEADER_BYTES or not header.startswith(_SIGNATURE):
        raise ValueError("expected a PNG")
    columns, rows, bits, kind = struct.unpack(">IIBB", header[16:])
    if kind != _GRAY or bits not in (8, 16):
        raise ValueError("expected a PNG in shades of gray of 16 bits, or of 8, without colors and opacity")
    _check_pixels(rows, columns)
    with parsers.guard("expected a PNG"):  # damaged ones raise errors of files that cannot be read
        pixels = imageio.imread(content, extension=".png", plugin="pillow")
    return pixels.astype(float) / (2**bits - 1)


def _make_map(path: Path, size: tuple[float, ...], nodes: np.ndarray) -> HeightMap:
    """Return the map of nodes (rows, columns) from 0 to 1; more than a map has are sampled."""
    rows, columns = (min(count, height_map.MAX_NODES) for count in nodes.shape)
    heights = height_map.encode(height_map.sample(nodes, (rows, columns)))
    length, width, height = size
    return HeightMap(_choose_name(path), (length, width, height), (rows, columns), heights)


def _read_mesh(path: Path, scale: tuple[float, ...]) -> HeightMap:
    """Return the upper side of a mesh as a height map; its middle is the start."""
    if len(scale) > 1:
        raise ValueError(f"expected one factor on lengths after its name, such as {path.name}:0.001")
    _read_bytes(path)  # raises an error for a file that is too large, or none
    mesh = mujoco.MjSpec.from_file(str(path)).meshes[0]
    points = np.array(mesh.uservert, float).reshape(-1, 3) * (scale or (1.0,))[0]
    triangles = np.array(mesh.userface, int).reshape(-1, 3)
    if not (len(triangles) and np.isfinite(points).all()):
        raise ValueError("expected triangles with finite corners")
    size = np.ptp(points, axis=0)
    if not 0.0 < size[:2].min() <= size.max() <= MAX_SIDE:
        sides = " x ".join(f"{side:g}" for side in size)
        hint = f"; lengths in mm? {path.name}:0.001" if size.max() > MAX_SIDE else ""
        raise ValueError(f"expected a mesh at most {MAX_SIDE:g} m long, z up, got {sides} m{hint}")
    nodes = rasters.measure_heights(points - points.min(axis=0), triangles, height_map.MAX_NODES)
    height = float(size[2]) or 1.0
    return _make_map(path, (float(size[0]), float(size[1]), height), nodes / height)


def _read_scene(path: Path, scale: tuple[float, ...]) -> HeightMap | Solids:
    """Return the colliding geoms of a scene, in which nothing moves, or its height field if it is all that collides."""
    if scale:
        raise ValueError("expected no scale: MJCF is in m")
    root_element, _ = bounds.parse(path)
    if root_element.tag != "mujoco":
        raise ValueError(f"expected MJCF (mujoco), got an element {root_element.tag[:_MAX_NAME]!r}")
    spec = mujoco.MjSpec.from_file(str(path))
    field_geoms = [geom for geom in spec.geoms if geom.type == _FIELD]
    if field_geoms:
        return _read_field(path, spec, field_geoms[0].hfieldname)
    opening.delete_visuals(spec)
    bounds.check_mesh_files([file_of(spec, mesh) for mesh in spec.meshes if mesh.file])
    model = spec.compile()
    if model.njnt:
        raise ValueError(f"joint {model.joint(0).name!r}: expected a scene without a robot, in which nothing moves")
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    geoms = [geom for geom in range(model.ngeom) if model.geom_contype[geom] or model.geom_conaffinity[geom]]
    if not geoms:
        raise ValueError("expected geoms that collide, got none")
    return Solids(_choose_name(path), tuple(_read_geom(model, data, geom) for geom in geoms))


def _read_field(path: Path, spec: mujoco.MjSpec, field_name: str) -> HeightMap:
    """Return the height field of a scene in which nothing else collides."""
    for geom in list(spec.geoms):
        if not (geom.contype or geom.conaffinity):
            spec.delete(geom)
        elif geom.type != _FIELD or geom.hfieldname != field_name:
            name = geom.name or "without a name"
            raise ValueError(f"geom {name[:_MAX_NAME]!r}: expected nothing next to a height field that collides")
        else:
            geom.material = ""
    for element in (*spec.meshes, *spec.materials, *spec.textures, *spec.skins):
        spec.delete(element)
    for field in list(spec.hfields):
        if field.name != field_name:
            spec.delete(field)
        elif field.file:
            _check_field_file(file_of(spec, field))
    model = spec.compile()
    if model.njnt or model.ngeom != 1:
        raise ValueError("hfield: expected a scene with one geom that collides, in which nothing moves")
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    is_level = np.allclose(data.geom_xmat[0].reshape(3, 3), np.eye(3), atol=1e-6)
    if not is_level or abs(data.geom_xpos[0, :2]).max() > 1e-6:
        raise ValueError("hfield: expected a height field that is not turned, with its middle at x = y = 0")
    half_length, half_width, height, _ = model.hfield_size[0]
    nodes = model.hfield_data.reshape(model.hfield_nrow[0], model.hfield_ncol[0])
    return _make_map(path, (2.0 * float(half_length), 2.0 * float(half_width), float(height)), nodes.astype(float))


def _check_field_file(path: Path) -> None:
    """Refuse a file of a height field that is too large; one that is no PNG has as many nodes as its bytes say."""
    content = _read_bytes(path)
    if content.startswith(_SIGNATURE):
        columns, rows = struct.unpack(">II", content[_SIZE_BYTES].ljust(8, b"\0"))
        _check_pixels(rows, columns)


def _check_pixels(rows: int, columns: int) -> None:
    if not (2 <= rows <= _MAX_PIXELS and 2 <= columns <= _MAX_PIXELS):
        raise ValueError(f"expected 2 to {_MAX_PIXELS} pixels along each side, got {columns} by {rows}")


def _read_geom(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> Solid:
    """Return a geom as a solid in the axes of the world; a mesh is its convex hull, as in collisions."""
    geom_type = mujoco.mjtGeom(model.geom_type[geom])
    name = model.geom(geom).name or str(geom)
    if geom_type not in _KIND_OF_GEOM:
        kinds = ", ".join(SIZES)
        raise ValueError(f"geom {name[:_MAX_NAME]!r}: expected one of {kinds}, got {geom_type.name[7:].lower()}")
    kind = _KIND_OF_GEOM[geom_type]
    axes = data.geom_xmat[geom].reshape(3, 3)
    if geom_type == _PLANE:
        if axes[2, 2] < 1.0 - 1e-9:
            raise ValueError(f"geom {name[:_MAX_NAME]!r}: expected a level plane; a tilted one can be a box")
        return Solid(kind, _round((0.0, 0.0, data.geom_xpos[geom, 2])), rotations.NO_TURN)
    if geom_type == _MESH:
        corners = hull_points(model, geom) @ axes.T + data.geom_xpos[geom]
        return Solid(kind, (0.0, 0.0, 0.0), rotations.NO_TURN, points=tuple(_round(corner) for corner in corners))
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, data.geom_xmat[geom])
    size = model.geom_size[geom, : SIZES[kind]]
    return Solid(kind, _round(data.geom_xpos[geom]), tuple(quat.tolist()), _round(size))


def _round(lengths) -> tuple[float, ...]:
    return tuple(round(float(length), _DIGITS) for length in lengths)


def _choose_name(path: Path) -> str:
    """Return the name of a file without its extension, in characters that can be printed."""
    name = "".join(character for character in path.stem if character.isprintable())
    return name[:_MAX_NAME] or "ground"


_READERS: dict[str, Callable[[Path, tuple[float, ...]], HeightMap | Solids]] = {
    ".png": _read_png,
    ".obj": _read_mesh,
    ".stl": _read_mesh,
    ".xml": _read_scene,
}
