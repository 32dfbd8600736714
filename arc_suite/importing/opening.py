"""From the file of a robot to a compiled model with a free torso, whatever meshes the file names."""

import copy
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple, TypeVar

import mujoco
import numpy as np

from arc_suite import parsers
from arc_suite.importing import bounds, inertias, kinds, mesh_colors, missing_masses, references, units, urdf
from arc_suite.importing.facing import LEVEL, Facing, turn_torso
from arc_suite.importing.meshes import Mesh, file_of, meshes_of, text_length
from arc_suite.importing.tree import FREE
from arc_suite.importing.visual_meshes import Visuals, can_touch, describe_lost_meshes, read_visuals
from arc_suite.robots.spec import MAX_SOURCE, SpecError

_MESH = mujoco.mjtGeom.mjGEOM_MESH
_HEIGHT_FIELD = mujoco.mjtGeom.mjGEOM_HFIELD
# Errors of MuJoCo in words of ours, in which a name takes the place of {}.
_REASONS = (
    (r"mass and inertia of moving bodies.*?Element name '([^']*)'", "body {!r} moves, and has no mass or no inertia"),
    (r"repeated name '(world)' in body", "a body has the name {!r}, which is that of the scene; rename it"),
)
_MAX_TEXT_WITH_VISUALS = MAX_SOURCE // 2  # characters of the meshes of colliders, next to which visual ones have room
_LINE_NUMBER = re.compile(r",? line \d+")  # in MuJoCo's errors

_Result = TypeVar("_Result")


class RobotFile(NamedTuple):
    """A robot's file.

    Attributes:
        model: compiled, with a free joint at the torso.
        root: body of the torso.
        meshes: meshes of geoms whose shape is a mesh, by geom.
        visuals: visual meshes and shapes.
        colored_shapes: number of shapes to which the file gives a color or a material.
        order: names of joints in the order of the file; empty if the model has that order.
        driven: names of the joints that a URDF drives; empty if it does not say.
        speeds: speeds, rad/s, that a URDF gives as the limits of joints, by name.
        notes: one line for each thing that is left out or repaired.
        parts: all files that it depends on, with those that were looked for and are missing.
        facing: axes of the file's torso that are x and z in the model.
        is_urdf: whether it is a URDF; else it is MJCF.
        carriers: of each link of a URDF that is fixed to another one, the link that moves with it, by name.
    """

    model: mujoco.MjModel
    root: int
    meshes: dict[int, Mesh]
    visuals: Visuals
    colored_shapes: int
    order: tuple[str, ...]
    driven: frozenset[str]
    speeds: dict[str, float]
    notes: tuple[str, ...]
    parts: tuple[Path, ...]
    facing: Facing
    is_urdf: bool
    carriers: dict[str, str]


class _Spec(NamedTuple):
    """A file as a spec that is not compiled yet.

    Attributes:
        spec: spec of MuJoCo.
        order: as in `RobotFile`.
        notes: as in `RobotFile`.
        mesh_files: files of meshes, with those that were looked for and are missing.
        colored_shapes: as in `RobotFile`.
    """

    spec: mujoco.MjSpec
    order: tuple[str, ...]
    notes: tuple[str, ...]
    mesh_files: tuple[Path, ...]
    colored_shapes: int


def open_robot(path: Path, facing: Facing = LEVEL, scale: float = 1.0) -> RobotFile:
    """Return the robot of an MJCF or a URDF file.

    Args:
        path: path of the file.
        facing: axes of the file's torso that point ahead and up.
        scale: factor of all lengths.

    Raises:
        SpecError: the file is neither, or MuJoCo cannot compile it.
        OSError: the file cannot be read.
    """
    root_element, parts = bounds.parse(path)
    if root_element.tag not in ("mujoco", "robot"):
        raise SpecError(f"expected MJCF (mujoco) or URDF (robot), got an element {root_element.tag[:40]!r}")
    lost_mesh_notes = tuple(describe_lost_meshes(root_element, path.parent))
    visual_element = copy.deepcopy(root_element)  # a URDF is changed as it is read
    is_urdf = root_element.tag == "robot"
    driven = urdf.find_driven_joints(root_element) if is_urdf else frozenset()
    speeds = urdf.find_speeds(root_element) if is_urdf else {}
    carriers = urdf.find_carriers(root_element) if is_urdf else {}
    spec, order, notes, mesh_files, colored_shapes = _read_spec(path, root_element)
    bounds.check_mesh_files(mesh_files)
    if scale != 1.0:
        units.scale_lengths(spec, scale)
    model, mesh_notes = _compile(spec)
    model, torso, torso_notes = _free_torso(spec, model)
    mass_notes = () if is_urdf else missing_masses.describe_bodies(spec, model, torso)
    model, unit_notes = units.repair_meshes(spec, model, torso)
    model = units.scale_inertias(spec, model, torso, scale)
    model, inertia_notes = inertias.correct_inertias(spec, model, torso)
    model = turn_torso(spec, model, torso, facing)
    meshes = meshes_of(spec, model)
    visuals = Visuals()
    if text_length(meshes) < _MAX_TEXT_WITH_VISUALS:
        visuals = read_visuals(path, visual_element, model, torso, facing, scale)
    repair_notes = (*unit_notes, *visuals.notes, *inertia_notes)
    all_notes = (*notes, *mesh_notes, *torso_notes, *mass_notes, *repair_notes, *lost_mesh_notes)
    all_parts = tuple(dict.fromkeys((*parts, *mesh_files, *visuals.files)))
    return RobotFile(
        model=model,
        root=torso,
        meshes=meshes,
        visuals=visuals,
        colored_shapes=colored_shapes,
        order=order,
        driven=driven,
        speeds=speeds,
        notes=all_notes,
        parts=all_parts,
        facing=facing,
        is_urdf=is_urdf,
        carriers=carriers,
    )


def _read_spec(path: Path, root_element: ElementTree.Element) -> _Spec:
    """Return the spec of a file."""
    if root_element.tag == "robot":
        colored_shapes = mesh_colors.count_colored_visuals(root_element)
        text, order, notes, mesh_files = urdf.repair_urdf(root_element, path.parent)
        # The text is not the file: numbers of its lines would mislead.
        spec = _with_short_errors(lambda: mujoco.MjSpec.from_string(text), shows_line_numbers=False)
        return _Spec(spec, order, notes, mesh_files, colored_shapes)
    spec = _with_short_errors(lambda: mujoco.MjSpec.from_file(str(path)))
    notes = references.delete_references(spec)
    colored_shapes = mesh_colors.count_colored_geoms(spec)
    mesh_colors.color_geoms(spec)
    delete_visuals(spec)
    mesh_files = tuple(file_of(spec, mesh) for mesh in spec.meshes if mesh.file)
    return _Spec(spec, order=(), notes=notes, mesh_files=mesh_files, colored_shapes=colored_shapes)


def _with_short_errors(function: Callable[[], _Result], shows_line_numbers: bool = True) -> _Result:
    """Return what a function of MuJoCo returns; its errors become a SpecError of one line.

    Args:
        function: takes no arguments.
        shows_line_numbers: whether the numbers of lines in MuJoCo's errors are shown.
    """
    try:
        return function()
    except Exception as error:  # MuJoCo has errors of its own, besides those of Python
        reason = _describe(error)
        if not shows_line_numbers:
            reason = _LINE_NUMBER.sub("", reason)
        raise SpecError(f"MuJoCo cannot read it: {reason}") from None


def _describe(error: Exception) -> str:
    """Return the reason of an error of MuJoCo as one line."""
    for pattern, reason in _REASONS:
        match = re.search(pattern, str(error), re.DOTALL)
        if match:
            return reason.format(match[1])
    return parsers.describe(error)


def delete_visuals(spec: mujoco.MjSpec) -> None:
    """Delete textures, materials, skins, height fields and visual meshes, so that no file is read for them."""
    for geom in list(spec.geoms):
        if geom.type == _HEIGHT_FIELD:
            spec.delete(geom)
    for field in list(spec.hfields):
        spec.delete(field)
    for element in (*spec.geoms, *spec.sites, *spec.skins):
        element.material = ""
    for element in (*spec.materials, *spec.textures, *spec.skins):
        spec.delete(element)
    if spec.compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        for geom in list(spec.geoms):
            if _is_visual_mesh(geom) and geom.name not in _names_in_contact_pairs(spec):
                spec.delete(geom)
    mesh_names = {geom.meshname for geom in spec.geoms}
    for mesh in list(spec.meshes):
        if mesh.name not in mesh_names:
            spec.delete(mesh)


def _is_visual_mesh(geom) -> bool:
    """Return whether a geom is a mesh that neither touches anything nor adds to the inertia of its body."""
    return bool(geom.type == _MESH and not can_touch(geom) and geom.parent.explicitinertial)


def _names_in_contact_pairs(spec: mujoco.MjSpec) -> set[str]:
    names = set()
    for pair in spec.pairs:
        names.update((pair.geomname1, pair.geomname2))
    return names


def _compile(spec: mujoco.MjSpec) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """Return the compiled model, and notes; meshes that cannot be read are deleted from the spec."""
    try:
        return spec.compile(), ()
    except Exception as error:
        unreadable_meshes = sorted(mesh.name for mesh in spec.meshes if not _compiles_alone(spec, mesh))
        if not unreadable_meshes:
            raise SpecError(f"MuJoCo cannot compile it: {_describe(error)}") from None
    for geom in list(spec.geoms):
        if geom.meshname in unreadable_meshes:
            spec.delete(geom)
    for mesh in list(spec.meshes):
        if mesh.name in unreadable_meshes:
            spec.delete(mesh)
    count = len(unreadable_meshes)
    note = f"left out: {count} meshes that cannot be read, such as {unreadable_meshes[0]}"
    place = f"MuJoCo cannot compile it without {count} meshes that cannot be read ({unreadable_meshes[0]})"
    with parsers.guard(place, raises=SpecError):
        return spec.compile(), (note,)


def _compiles_alone(spec: mujoco.MjSpec, mesh) -> bool:
    """Return whether a model of one mesh compiles."""
    try:
        spec_of_mesh = mujoco.MjSpec.from_file(str(file_of(spec, mesh)))
        spec_of_mesh.meshes[0].name = mesh.name
        spec_of_mesh.meshes[0].inertia = mesh.inertia
        spec_of_mesh.worldbody.add_geom(type=_MESH, meshname=mesh.name)
        spec_of_mesh.compile()
    except Exception:
        return False
    return True


def _free_torso(spec: mujoco.MjSpec, model: mujoco.MjModel) -> tuple[mujoco.MjModel, int, tuple[str, ...]]:
    """Return the model with a free torso, the torso, and a note if it is not free in the file.

    The torso is the first free body with joints, else the heaviest body in the world that has joints.
    """
    bodies_in_world = [body for body in range(1, model.nbody) if model.body_parentid[body] == 0]
    robots = [body for body in bodies_in_world if _count_joints_below(model, body) > 1]
    free_robots = [body for body in robots if _has_free_joint(model, body)]
    if free_robots:
        return model, free_robots[0], ()
    if not robots:
        joints = "one joint" if model.njnt else "no joint"
        raise SpecError(f"a body with {joints}; {kinds.EXPECTED}")
    torso = max(robots, key=lambda body: model.body_subtreemass[body])
    name = model.body(torso).name
    if model.body_jntnum[torso]:
        kind = kinds.describe_kind(model, torso)
        if kind:
            raise SpecError(f"{kind}; {kinds.EXPECTED}")
        joint = model.joint(model.body_jntadr[torso])
        raise SpecError(f"the torso {name!r} moves by the joint {joint.name!r} alone; expected a free or a fixed torso")
    body_of_spec = spec.body(name) if name else spec.bodies[torso]
    body_of_spec.add_freejoint()
    _insert_torso_pose(spec, model, torso)
    note = f"the torso {name} is fixed to the world in the file: it has a free joint now"
    return _with_short_errors(spec.compile), torso, (note,)


def _insert_torso_pose(spec: mujoco.MjSpec, model: mujoco.MjModel, torso: int) -> None:
    """Give the keyframes of a spec the pose of a torso that is free now; they would move by seven numbers without it.

    Args:
        spec: spec of the file, which is changed.
        model: compiled from it while the torso was fixed.
        torso: body of the torso.
    """
    pose = (*model.body_pos[torso], *model.body_quat[torso])
    later_joints = np.flatnonzero(model.jnt_bodyid > torso)
    index = model.jnt_qposadr[later_joints[0]]
    for key, qpos in zip(spec.keys, model.key_qpos, strict=True):
        key.qpos = np.insert(qpos, index, pose)


def _count_joints_below(model: mujoco.MjModel, body: int) -> int:
    """Return how many joints move a body of the world and the bodies that it carries."""
    return int((model.body_rootid[model.jnt_bodyid] == body).sum())


def _has_free_joint(model: mujoco.MjModel, body: int) -> bool:
    return bool(model.body_jntnum[body] and model.jnt_type[model.body_jntadr[body]] == FREE)
