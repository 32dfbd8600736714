"""From the file of a robot to a compiled model with a free torso, whatever meshes the file names."""

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import mujoco

from arc_suite import checks, files
from arc_suite.importing import urdf
from arc_suite.importing.meshes import Mesh, file_of, meshes_of
from arc_suite.robots import sources
from arc_suite.robots.spec import SpecError

MAX_BYTES = 1 << 24  # of a file; the largest of 45 has 200 kB

_MESH = mujoco.mjtGeom.mjGEOM_MESH
_LINE = re.compile(r",? line \d+")
_DECLARATION = re.compile(r"^\s*<\?xml[^>]*\?>")


class RobotFile(NamedTuple):
    """A robot's file.

    Attributes:
        model: compiled, with a free joint at the torso.
        root: body of the torso.
        meshes: of geoms that are one, by geom.
        order: names of joints in the order of the file; none where the model has that order.
        notes: one line for each thing that is left out or repaired.
    """

    model: mujoco.MjModel
    root: int
    meshes: dict[int, Mesh]
    order: tuple[str, ...]
    notes: tuple[str, ...]


def open_robot(path: Path, turn: str = urdf.LEVEL) -> RobotFile:
    """Return the robot of an MJCF or a URDF file.

    Args:
        path: of the file.
        turn: roll, pitch and yaw of a URDF's base in the torso's frame.

    Raises:
        SpecError: it is neither, or MuJoCo cannot compile it.
        OSError: it cannot be read.
    """
    element = _parsed(content(path))
    spec, order, notes = _read(path, element, turn)
    model, left_out = _compiled(spec)
    model, root, freed = _freed(spec, model)
    return RobotFile(model, root, meshes_of(spec, model), order, (*notes, *left_out, *freed))


def content(path: Path) -> bytes:
    """Return the bytes of a file, at most one more than it may have.

    Raises:
        OSError: it cannot be read.
    """
    with files.reading(path), path.open("rb") as file:
        return file.read(MAX_BYTES + 1)


def _parsed(data: bytes) -> ElementTree.Element:
    """Return the top element of XML that names no entities."""
    if len(data) > MAX_BYTES:
        raise SpecError(f"expected at most {MAX_BYTES} bytes")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        raise SpecError("expected text in UTF-8") from None
    if sources.ENTITY.search(text):
        raise SpecError("expected XML without a document type and entities")
    try:
        # Some exporters write an empty line before the declaration, which XML forbids.
        element = ElementTree.fromstring(_DECLARATION.sub("", text))
    except ElementTree.ParseError as error:
        raise SpecError(f"expected XML: {error}") from None
    if element.tag not in ("mujoco", "robot"):
        raise SpecError(f"expected MJCF (mujoco) or URDF (robot), got an element {element.tag[:40]!r}")
    return element


def _read(
    path: Path, element: ElementTree.Element, turn: str
) -> tuple[mujoco.MjSpec, tuple[str, ...], tuple[str, ...]]:
    """Return the file as a spec that is not compiled, its joints in its order, and notes."""
    if element.tag == "robot":
        cured, order, notes = urdf.repair_urdf(element, path.parent, turn)
        return _said(lambda: mujoco.MjSpec.from_string(cured), lines=False), order, notes
    spec = _said(lambda: mujoco.MjSpec.from_file(str(path)))
    _drop_looks(spec)
    return spec, (), ()


def _said(work, lines: bool = True):
    """Return what `work` returns; MuJoCo's errors become a line.

    Args:
        work: takes nothing.
        lines: whether the numbers of lines in MuJoCo's errors are those of the file.
    """
    try:
        return work()
    except ValueError as error:
        reason = checks.quote(error)
        raise SpecError(f"MuJoCo cannot read it: {reason if lines else _LINE.sub('', reason)}") from None


def _drop_looks(spec: mujoco.MjSpec) -> None:
    """Delete what is only seen, so that no file is read for it: pictures, and meshes that weigh and touch nothing."""
    for element in (*spec.geoms, *spec.sites, *spec.skins):
        element.material = ""
    for element in (*spec.materials, *spec.textures, *spec.skins):
        spec.delete(element)
    if spec.compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE:
        for geom in list(spec.geoms):
            seen = geom.type == _MESH and not (geom.contype or geom.conaffinity) and geom.parent.explicitinertial
            if seen and geom.name not in _paired(spec):
                spec.delete(geom)
    used = {geom.meshname for geom in spec.geoms}
    for mesh in list(spec.meshes):
        if mesh.name not in used:
            spec.delete(mesh)


def _paired(spec: mujoco.MjSpec) -> set[str]:
    return {name for pair in spec.pairs for name in (pair.geomname1, pair.geomname2)}


def _compiled(spec: mujoco.MjSpec) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """Return the compiled model, without the meshes that cannot be read, and a note of these."""
    try:
        return spec.compile(), ()
    except ValueError as error:
        unread = sorted(_unread(spec))
        if not unread:
            raise SpecError(f"MuJoCo cannot compile it: {checks.quote(error)}") from None
    for geom in list(spec.geoms):
        if geom.meshname in unread:
            spec.delete(geom)
    for mesh in list(spec.meshes):
        if mesh.name in unread:
            spec.delete(mesh)
    try:
        note = f"left out: {len(unread)} meshes that cannot be read, such as {unread[0]}"
        return spec.compile(), (note,)
    except ValueError as error:
        raise SpecError(
            f"MuJoCo cannot compile it without {len(unread)} meshes that cannot be read ({unread[0]}): "
            f"{checks.quote(error)}"
        ) from None


def _unread(spec: mujoco.MjSpec) -> Iterator[str]:
    """Yield the names of meshes that do not compile alone."""
    for mesh in spec.meshes:
        try:
            alone = mujoco.MjSpec.from_file(str(file_of(spec, mesh)))
            alone.meshes[0].name, alone.meshes[0].inertia = mesh.name, mesh.inertia
            alone.worldbody.add_geom(type=_MESH, meshname=mesh.name)
            alone.compile()
        except (ValueError, IndexError):
            yield mesh.name


def _freed(spec: mujoco.MjSpec, model: mujoco.MjModel) -> tuple[mujoco.MjModel, int, tuple[str, ...]]:
    """Return the model with a free torso, its body, and a note if the file has none that is free.

    The torso is the first free body with joints, else the heaviest body in the world.
    """
    tops = [body for body in range(1, model.nbody) if model.body_parentid[body] == 0]
    moving = [body for body in tops if (model.body_rootid[model.jnt_bodyid] == body).sum() > 1]
    free = [body for body in moving if model.body_jntnum[body] and model.jnt_type[model.body_jntadr[body]] == 0]
    if free:
        return model, free[0], ()
    if not moving:
        raise SpecError("no body in the world has two joints; expected a robot with legs")
    root = max(moving, key=lambda body: model.body_subtreemass[body])
    name = model.body(root).name
    if model.body_jntnum[root]:
        joint = model.joint(model.body_jntadr[root])
        raise SpecError(f"the torso {name!r} moves by the joint {joint.name!r} alone; expected a free or a fixed torso")
    body = spec.body(name) if name else spec.bodies[root]
    body.add_freejoint()
    return _said(spec.compile), root, (f"the torso {name} is fixed to the world in the file: it has a free joint now",)
