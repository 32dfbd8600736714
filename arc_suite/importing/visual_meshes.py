"""What a robot's file shows of it, so that pictures, clips and pages show it: visual meshes, simplified, and shapes."""

import contextlib
import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from arc_suite import checks, rotations
from arc_suite.importing import bounds, mesh_colors, units, urdf
from arc_suite.importing.facing import LEVEL, Facing
from arc_suite.importing.meshes import compile_with_balls, file_of

_MAX_MESHES = 100  # with more, a robot shows its colliders
_MAX_FILE_BYTES = 1 << 25  # of all files; larger ones take too long to read
_MAX_POINTS = 8000  # of all meshes of a body, about 400 kB of its source
_MIN_POINTS = 60  # of one mesh
_FINEST_GRID = 256  # cells along the longest side of a mesh
_MAX_SHAPES = 500  # with more, a robot shows its colliders
_COMMON_SHARE = 0.1  # of the largest mesh's radius, m, that other meshes have
_MESH = mujoco.mjtGeom.mjGEOM_MESH
# Kinds of shapes: names in MJCF, and how many numbers give their size.
SHAPES = {
    mujoco.mjtGeom.mjGEOM_SPHERE: ("sphere", 1),
    mujoco.mjtGeom.mjGEOM_CAPSULE: ("capsule", 2),
    mujoco.mjtGeom.mjGEOM_CYLINDER: ("cylinder", 2),
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: ("ellipsoid", 3),
    mujoco.mjtGeom.mjGEOM_BOX: ("box", 3),
}


class Triangles(NamedTuple):
    """A mesh.

    Attributes:
        points: (n, 3), m.
        faces: (m, 3) indices of points, in the order that is seen from outside.
    """

    points: np.ndarray
    faces: np.ndarray


class Visual(NamedTuple):
    """A visual mesh.

    Attributes:
        body: body of the file's model that shows it.
        points: (n, 3) in the body's frame, m.
        faces: (m, 3) indices of points.
        color: (3,) sRGB, 0 to 1; None if the file gives none.
        is_of_obj: whether the color is that of an .obj file's material, and none of the robot's file.
    """

    body: int
    points: np.ndarray
    faces: np.ndarray
    color: np.ndarray | None = None
    is_of_obj: bool = False


class VisualShape(NamedTuple):
    """A visual sphere, capsule, cylinder, ellipsoid or box.

    Attributes:
        body: body of the file's model that shows it.
        kind: kind of its geom.
        size: (3,) as in MuJoCo, m.
        position: (3,) in the body's frame, m.
        orientation: (4,) in the body's frame, w first.
        color: (3,) sRGB, 0 to 1; None if the file gives none.
    """

    body: int
    kind: mujoco.mjtGeom
    size: np.ndarray
    position: np.ndarray
    orientation: np.ndarray
    color: np.ndarray | None = None


class Visuals(NamedTuple):
    """What a robot's file shows in place of its colliders.

    Attributes:
        meshes: simplified.
        shapes: all others.
        files: files that were read, with files of materials that are missing.
        point_count: number of points in these files.
        notes: a line if meshes were in other units.
    """

    meshes: tuple[Visual, ...] = ()
    shapes: tuple[VisualShape, ...] = ()
    files: tuple[Path, ...] = ()
    point_count: int = 0
    notes: tuple[str, ...] = ()

    @property
    def bodies(self) -> set[int]:
        """Bodies of the file's model that show a mesh or a shape."""
        return {visual.body for visual in self.meshes} | {shape.body for shape in self.shapes}


def read_visuals(
    path: Path, root_element: ElementTree.Element, model: mujoco.MjModel, torso: int, facing: Facing, scale: float
) -> Visuals:
    """Return the visual meshes and shapes of a file; none if any cannot be read.

    Args:
        path: path of the file.
        root_element: its root, as in the file; a URDF is changed.
        model: model of the file, in whose bodies they are.
        torso: body of the torso.
        facing: axes of the file's torso that point ahead and up.
        scale: factor of all lengths.
    """
    with contextlib.suppress(Exception):  # no robot is refused for what it looks like
        spec = _read_visual_urdf(root_element, path.parent) if root_element.tag == "robot" else _read_visual_mjcf(path)
        files = tuple(dict.fromkeys(file_of(spec, mesh) for mesh in spec.meshes if mesh.file))
        bounds.check_mesh_files(files)
        is_small = sum(file.stat().st_size for file in files) <= _MAX_FILE_BYTES
        are_few = len(spec.meshes) <= _MAX_MESHES and len(spec.geoms) <= _MAX_SHAPES
        if are_few and is_small:
            units.scale_lengths(spec, scale)
            materials = mesh_colors.read_materials(files)
            visuals = _collect_visuals(spec, model, torso, facing, materials)
            libraries = dict.fromkeys(material.path for material in materials.values())
            return visuals._replace(files=(*files, *libraries))
    return Visuals()


def _read_visual_urdf(robot: ElementTree.Element, folder: Path) -> mujoco.MjSpec:
    """Return the spec of a URDF with its visual shapes as its only shapes."""
    for link in robot.findall("link"):
        for collision in link.findall("collision"):
            link.remove(collision)
        for visual in link.findall("visual"):
            visual.tag = "collision"
    colors = mesh_colors.name_urdf_shapes(robot)
    text, *_ = urdf.repair_urdf(robot, folder)
    spec = mujoco.MjSpec.from_string(text)
    for geom in spec.geoms:
        if geom.name in colors:
            geom.rgba = colors[geom.name]
    return _keep_visuals(spec)


def _read_visual_mjcf(path: Path) -> mujoco.MjSpec:
    """Return the spec of an MJCF file with what it shows besides colliders as its only shapes.

    Shapes may decorate colliders, such as eyes of a trunk: such colliders are among them. Meshes take their place.
    """
    spec = mujoco.MjSpec.from_file(str(path))
    for body in spec.bodies:
        shown_geoms = [geom for geom in body.geoms if mesh_colors.is_shown(spec, geom)]
        visual_geoms = [geom for geom in shown_geoms if not can_touch(geom)]
        has_mesh = any(geom.type == _MESH for geom in visual_geoms)
        kept_geoms = shown_geoms if visual_geoms and not has_mesh else visual_geoms
        for geom in list(body.geoms):
            if geom not in kept_geoms:
                spec.delete(geom)
    return _keep_visuals(spec)


def can_touch(geom: mujoco.MjsGeom) -> bool:
    """Return whether a geom of an MJCF file is a collider."""
    return bool(geom.contype or geom.conaffinity)


def _keep_visuals(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """Return a spec with its bodies, their meshes and shapes alone; masses do not matter here."""
    for kind in (spec.actuators, spec.sensors, spec.tendons, spec.equalities, spec.pairs, spec.excludes, spec.keys):
        for element in list(kind):
            spec.delete(element)
    for geom in list(spec.geoms):
        geom.rgba = mesh_colors.find_rgba(spec, geom)
        geom.material = ""
        if geom.type != _MESH and geom.type not in SHAPES:
            spec.delete(geom)
    for element in (*spec.materials, *spec.textures, *spec.skins, *spec.hfields, *spec.cameras, *spec.lights):
        spec.delete(element)
    names = {geom.meshname for geom in spec.geoms}
    for mesh in list(spec.meshes):
        if mesh.name not in names:
            spec.delete(mesh)
    spec.compiler.discardvisual = False
    spec.compiler.boundmass = 1.0
    spec.compiler.boundinertia = 1.0
    return spec


def _collect_visuals(
    spec: mujoco.MjSpec,
    model: mujoco.MjModel,
    torso: int,
    facing: Facing,
    materials: Mapping[Path, mesh_colors.Material],
) -> Visuals:
    """Return the meshes and shapes of a spec whose bodies are those of the file's model, without the meshes' files."""
    triangles = {mesh.name: _read_mesh(spec, mesh) for mesh in spec.meshes}
    geoms = [(geom, geom.meshname) for geom in spec.geoms]
    file_of_mesh = {mesh.name: file_of(spec, mesh) for mesh in spec.meshes if mesh.file}
    colors = mesh_colors.find_colors(spec, file_of_mesh, materials)
    has_color = [mesh_colors.has_color(geom) for geom, _ in geoms]
    spec_model = compile_with_balls(spec)
    names = [spec_model.body(body).name for body in range(spec_model.nbody)]
    if names != [model.body(body).name for body in range(model.nbody)]:
        return Visuals()
    shown_names = {name for geom, name in geoms if name and _find_root(spec_model, geom.id) == torso}
    triangles, notes = _repair_units({name: triangles[name] for name in shown_names}, model, torso)
    whole_meshes = []
    shapes = []
    for (geom, mesh_name), color, is_of_file in zip(geoms, colors, has_color, strict=True):
        if _find_root(spec_model, geom.id) != torso:
            continue
        body = int(spec_model.geom_bodyid[geom.id])
        position, orientation = _find_place(spec_model, geom.id, facing if body == torso else LEVEL)
        if mesh_name:
            points, faces = triangles[mesh_name]
            placed_points = points @ rotations.matrix(orientation).T + position
            whole_meshes.append(Visual(body, placed_points, faces, color, is_of_obj=not is_of_file))
        else:
            kind = mujoco.mjtGeom(spec_model.geom_type[geom.id])
            shapes.append(VisualShape(body, kind, spec_model.geom_size[geom.id], position, orientation, color))
    point_count = sum(len(visual.points) for visual in whole_meshes)
    return Visuals(_simplify_meshes(whole_meshes, point_count), tuple(shapes), point_count=point_count, notes=notes)


def _find_root(model: mujoco.MjModel, geom: int) -> int:
    """Return the body of the world that carries a geom."""
    return int(model.body_rootid[model.geom_bodyid[geom]])


def _repair_units(
    triangles: Mapping[str, Triangles], model: mujoco.MjModel, torso: int
) -> tuple[Mapping[str, Triangles], tuple[str, ...]]:
    """Return meshes by name in the units of the robot's joints, and a note if they were in other units."""
    radii = {name: 0.5 * float(np.linalg.norm(np.ptp(points, axis=0))) for name, (points, _) in triangles.items()}
    largest = max(radii.values(), default=0.0)
    unit = units.find_mesh_unit(model, torso, largest)
    if unit is None:
        return triangles, ()
    factor = units.UNITS[unit]
    min_radius = _COMMON_SHARE * math.sqrt(factor) * largest  # midway from common meshes in m to those in the unit
    large_triangles = {name: triangles[name] for name, radius in radii.items() if radius > min_radius}
    small_triangles = {name: Triangles(points * factor, faces) for name, (points, faces) in large_triangles.items()}
    note = units.describe_repair(f"{len(small_triangles)} visual meshes", unit, largest)
    return {**triangles, **small_triangles}, (note,)


def _find_place(model: mujoco.MjModel, geom: int, facing: Facing) -> tuple[np.ndarray, np.ndarray]:
    """Return position (3,), m, and orientation (4,) of a geom in its body's frame, turned as by `turn_torso`."""
    orientation = rotations.product(facing.quaternion, model.geom_quat[geom])
    return facing.rotation @ model.geom_pos[geom], orientation


def _read_mesh(spec: mujoco.MjSpec, mesh) -> Triangles:
    """Return a mesh as the file places it."""
    whole_mesh = mujoco.MjSpec.from_file(str(file_of(spec, mesh))).meshes[0] if mesh.file else mesh
    points = np.array(whole_mesh.uservert, np.float32).reshape(-1, 3).astype(float)
    faces = np.array(whole_mesh.userface, np.int64).reshape(-1, 3)
    points = (points - mesh.refpos) @ rotations.matrix(mesh.refquat)
    if np.prod(mesh.scale) < 0.0:
        faces = faces[:, ::-1]  # a mirror image would show its inside
    return Triangles(points * mesh.scale, faces)


def _simplify_meshes(meshes: Sequence[Visual], point_count: int) -> tuple[Visual, ...]:
    """Return meshes that have `_MAX_POINTS` together, as far as each needs a few, without those that lose all faces.

    Args:
        meshes: meshes of a robot.
        point_count: number of their points.
    """
    share = min(1.0, _MAX_POINTS / max(point_count, 1))
    simplified_meshes = [_simplify(mesh, max(_MIN_POINTS, int(share * len(mesh.points)))) for mesh in meshes]
    return tuple(mesh for mesh in simplified_meshes if len(mesh.faces))


def _simplify(visual: Visual, max_points: int) -> Visual:
    """Return a mesh whose points in the same cell of a grid are one: the finest grid with few enough points."""
    corner = visual.points.min(axis=0)
    extent = max(float(np.ptp(visual.points, axis=0).max()), 1e-9)
    clusters = np.zeros(len(visual.points), np.int64)
    coarse_cells = 1
    fine_cells = _FINEST_GRID
    while fine_cells - coarse_cells > 1:
        cells = (coarse_cells + fine_cells) // 2
        finer_clusters = _cluster((visual.points - corner) * cells / extent)
        if finer_clusters.max() < max_points:
            clusters = finer_clusters
            coarse_cells = cells
        else:
            fine_cells = cells
    counts = np.bincount(clusters)
    points = np.stack([np.bincount(clusters, column) / counts for column in visual.points.T], axis=1)
    faces = clusters[visual.faces]
    is_flat = (faces == np.roll(faces, 1, axis=1)).any(axis=1)
    return visual._replace(points=points, faces=np.unique(faces[~is_flat], axis=0))


def _cluster(coordinates: np.ndarray) -> np.ndarray:
    """Return the index of the cell of each point (n, 3), in which a cell is 1 wide."""
    x, y, z = np.floor(coordinates).astype(np.int64).T
    width = 2 * _FINEST_GRID
    _, clusters = np.unique((x * width + y) * width + z, return_inverse=True)
    return clusters


def describe_lost_meshes(root_element: ElementTree.Element, folder: Path) -> Iterator[str]:
    """Yield a line on visual meshes of a URDF that are of other formats, and one on missing ones; none for MJCF."""
    other_formats, missing = urdf.find_lost_meshes(root_element, folder)
    if other_formats:
        text = f"looks: {len(other_formats)} visual meshes are of a format that is not read"
        yield f"{text} ({_shorten_names(other_formats)}): save them as STL or OBJ"
    if missing:
        yield f"looks: {len(missing)} files of visual meshes are missing ({_shorten_names(missing)})"


def _shorten_names(names: Sequence[str]) -> str:
    """Return the first names of files, without their folders."""
    return checks.join_first([checks.quote(name.rpartition("/")[2]) for name in names])


def describe_visuals(visuals: Visuals, colored_shapes: int, colored_colliders: int) -> str:
    """Return a line on what pictures show, and on colors that are left out.

    Args:
        visuals: the visual meshes and shapes.
        colored_shapes: number of shapes to which the robot's file gives a color or a material.
        colored_colliders: number of colliders that pictures show in a color of the file.
    """
    colored_meshes = [visual for visual in visuals.meshes if visual.color is not None]
    colored_by_obj = sum(visual.is_of_obj for visual in colored_meshes)
    colored = len(colored_meshes) + sum(shape.color is not None for shape in visuals.shapes) + colored_colliders
    lost = colored_shapes - (colored - colored_by_obj)
    lost_colors = f"; colors or textures of {lost} shapes are left out" if lost > 0 else ""
    if not visuals.meshes and not visuals.shapes:
        colors = f"{colored_colliders} of them in the file's color" if colored_colliders else "in colors of the suite"
        return f"looks: pictures show the colliders, {colors}{lost_colors}"
    counts = {
        "visual meshes": len(visuals.meshes),
        "visual shapes": len(visuals.shapes),
        "colliders": colored_colliders,
    }
    kinds = " and ".join(f"{count} {kind}" for kind, count in counts.items() if count)
    point_count = sum(len(visual.points) for visual in visuals.meshes)
    reduction = f", with {point_count} of {visuals.point_count} points" if point_count < visuals.point_count else ""
    colors = f", {colored} with the file's color" if colored else ""
    return f"looks: {kinds}{reduction}{colors}, for pictures, clips and pages{lost_colors}"
