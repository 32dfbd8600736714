"""Repairs of URDF: what MuJoCo refuses, and what gets lost when MuJoCo reads it."""

import collections
import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from arc_suite.importing import inertias, missing_masses, world_link
from arc_suite.importing.world_link import Elements
from arc_suite.robots.spec import SpecError

_ADDED_PREFIX = "arc_suite_"  # begins the names of links that are added
_IGNORED_ELEMENTS = ("gazebo", "transmission", "ros2_control", "mujoco")
_REDUCTIONS = ("mechanicalReduction", "mechanical_reduction")
_MESH_EXTENSIONS = (".stl", ".obj", ".msh")
_MESH_SCHEMES = ("package://", "file://", "model://")
_JOINT_TYPES = ("revolute", "continuous", "prismatic", "fixed", "floating")

# Attributes of a joint's elements, with how many numbers each has.
_JOINT_ATTRIBUTES = {
    "axis": {"xyz": 3},
    "limit": dict.fromkeys(("lower", "upper", "effort", "velocity"), 1),
    "dynamics": dict.fromkeys(("damping", "friction"), 1),
}

_MOMENTS = ("ixx", "iyy", "izz")  # of inertia, the diagonal of the matrix
_PRODUCTS = ("ixy", "ixz", "iyz")
_INERTIA_ROWS = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))
_MIN_MOMENT = 1e-6  # of the moment of that ball; a smaller one counts as none
_LEAST_MASS = 1e-12  # kg, of a link that weighs anything
_LEAST_MOMENT = 1e-15  # kg m^2; MuJoCo refuses smaller ones
_MIN_BALL_MOMENT = 1e-14  # kg m^2, of the ball of a link that weighs anything
_ROUNDING = 1e-9  # of inertias in files, as a share of the largest moment
_LIGHT_LINK = 1e-4  # of the robot's mass, of a link that moves and has no mass
_LIGHT_MASS = 1e-3  # kg, of the same where no link has a mass

_COMPILER = {
    "strippath": "false",
    "fusestatic": "true",
    "balanceinertia": "true",  # of links that break the triangle rule
    "discardvisual": "true",
    "boundmass": "0",
    "boundinertia": "0",
}


def repair_urdf(
    robot: ElementTree.Element, folder: Path
) -> tuple[str, tuple[str, ...], tuple[str, ...], tuple[Path, ...]]:
    """Return a URDF that MuJoCo reads, its moving joints in the order of the file, notes, and files of meshes.

    The files of meshes are those that it names, with those that were looked for and are missing.

    Args:
        robot: the root element, which is changed.
        folder: folder of the file; meshes are searched there and upwards.

    Raises:
        SpecError: it is no URDF; the message names the link or joint.
    """
    if any("xacro" in str(element.tag) for element in robot.iter()):
        raise SpecError("has xacro macros; write the URDF with xacro first")
    reduction_notes = tuple(_reduction_notes(robot))
    for tag in _IGNORED_ELEMENTS:
        for element in robot.findall(tag):
            robot.remove(element)
    links = _elements_by_name(robot, "link")
    joints = _elements_by_name(robot, "joint")
    for name, joint in joints.items():
        _check_joint(name, joint, links)
    world_notes = world_link.replace_world(robot, links, joints)
    mesh_files: list[Path] = []
    notes = (
        *world_notes,
        *_repair_shapes(links, folder, mesh_files),
        *_repair_inertias(links),
        *_add_missing_masses(links, joints),
        *reduction_notes,
    )
    _add_floating_root(robot, links, joints)
    ElementTree.SubElement(ElementTree.SubElement(robot, "mujoco"), "compiler", _COMPILER)
    order = tuple(name for name, joint in joints.items() if joint.get("type") not in ("fixed", "floating"))
    return ElementTree.tostring(robot, encoding="unicode"), order, notes, tuple(mesh_files)


def find_speeds(robot: ElementTree.Element) -> dict[str, float]:
    """Return the `velocity`, rad/s, of hinges that have one above 0, by name."""
    speeds = {}
    for joint in robot.findall("joint"):
        limit = joint.find("limit")
        if limit is None or joint.get("type") not in ("revolute", "continuous"):
            continue
        (speed,) = _parse_numbers(f"joint {joint.get('name')!r}: limit velocity", limit.get("velocity", "0"), 1)
        if speed > 0.0:
            speeds[joint.get("name", "")] = speed
    return speeds


def find_driven_joints(robot: ElementTree.Element) -> frozenset[str]:
    """Return the names of the joints that a URDF drives; none if it does not say.

    Joints have motors by `transmission` or by a command of `ros2_control`; else by an effort above 0, if some have 0.
    """
    joints = {*robot.findall("transmission/joint")}
    for joint in robot.findall("ros2_control/joint"):
        if joint.find("command_interface") is not None:
            joints.add(joint)
    if joints:
        return frozenset(joint.get("name", "") for joint in joints)
    efforts = {}
    for joint in robot.findall("joint"):
        limit = joint.find("limit")
        if limit is not None and joint.get("type") not in ("fixed", "floating"):
            efforts[joint.get("name", "")] = limit.get("effort", "").strip()
    has_zero = any(_is_number(effort) and float(effort) == 0.0 for effort in efforts.values())
    if not has_zero:
        return frozenset()
    return frozenset(name for name, effort in efforts.items() if _is_positive(effort))


def find_carriers(robot: ElementTree.Element) -> dict[str, str]:
    """Return, for each link that is fixed to another one, the link that it moves with, by name."""
    parents = {}
    for joint in robot.findall("joint"):
        parent = joint.find("parent")
        child = joint.find("child")
        if joint.get("type") == "fixed" and parent is not None and child is not None:
            parents[child.get("link", "")] = parent.get("link", "")
    carriers = {}
    for link in parents:
        carrier = link
        for _ in parents:  # at most so many joints lie in between, also where a broken file has a circle
            carrier = parents.get(carrier, carrier)
        carriers[link] = carrier
    return carriers


def _reduction_notes(robot: ElementTree.Element) -> Iterator[str]:
    """Yield a note on the reductions of gears."""
    texts = [element.text or "" for element in robot.iter() if element.tag in _REDUCTIONS]
    reductions = [float(text) for text in texts if _is_number(text) and float(text) != 1.0]
    if reductions:
        yield (
            f"reductions: {len(reductions)} transmissions have gears, such as {reductions[0]:g}; "
            "effort is the torque at the joint, behind them"
        )


def _elements_by_name(robot: ElementTree.Element, tag: str) -> Elements:
    """Return the links or joints by name, with the numbers of their poses checked."""
    elements = {}
    for element in robot.findall(tag):
        name = element.get("name")
        if not name:
            raise SpecError(f"a {tag} has no name")
        if name in elements:
            raise SpecError(f"{tag} {name!r}: the name occurs twice")
        elements[name] = element
        for origin in element.iter("origin"):
            for key in ("xyz", "rpy"):
                _parse_numbers(f"{tag} {name!r}: origin {key}", origin.get(key, "0 0 0"), 3)
    if not elements:
        raise SpecError(f"expected a URDF, got one without a {tag}")
    return elements


def _parse_numbers(label: str, text: str, count: int) -> list[float]:
    """Return so many finite numbers of a text; the label begins the error."""
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        plural = "s" if count > 1 else ""
        raise SpecError(f"{label}: expected {count} number{plural}, got {text[:60]!r}")
    return numbers


def _check_joint(name: str, joint: ElementTree.Element, links: Elements) -> None:
    """Refuse an unknown type, a missing link, an element that occurs twice, and wrong numbers."""
    if joint.get("type") not in _JOINT_TYPES:
        raise SpecError(f"joint {name!r}: expected a type out of {', '.join(_JOINT_TYPES)}, got {joint.get('type')!r}")
    for end in ("parent", "child"):
        element = joint.find(end)
        link = None if element is None else element.get("link")
        if link not in links:
            raise SpecError(f"joint {name!r}: its {end} is no link of the file: {link!r}")
    tags = [element.tag for element in joint]
    for tag in tags:
        if tags.count(tag) > 1:
            raise SpecError(f"joint {name!r}: expected one element {tag!r}, got {tags.count(tag)}")
    for tag, number_counts in _JOINT_ATTRIBUTES.items():
        element = joint.find(tag)
        if element is None:
            continue
        default = "1 0 0" if tag == "axis" else "0"
        for key, count in number_counts.items():
            _parse_numbers(f"joint {name!r}: {tag} {key}", element.get(key, default), count)


def _repair_shapes(links: Elements, folder: Path, mesh_files: list[Path]) -> Iterator[str]:
    """Remove visual shapes, and colliders that cannot be read; yield a note on these colliders.

    The files of meshes are added to `mesh_files`, with those that were looked for and are missing.
    """
    links_with_losses = []
    for name, link in links.items():
        for visual in link.findall("visual"):
            link.remove(visual)
        for collision in link.findall("collision"):
            mesh = collision.find("geometry/mesh")
            sphere = collision.find("geometry/sphere")
            is_readable = True
            if mesh is not None:
                candidates = _mesh_file_candidates(mesh.get("filename", ""), folder)
                file = next((candidate for candidate in candidates if candidate.is_file()), None)
                last = len(candidates) if file is None else candidates.index(file) + 1
                mesh_files += candidates[:last]
                mesh.set("filename", str(file))
                is_readable = file is not None
            if sphere is not None and not _is_positive(sphere.get("radius")):
                is_readable = False
            if not is_readable:
                link.remove(collision)
                links_with_losses.append(name)
    if links_with_losses:
        yield f"left out: {len(links_with_losses)} colliders that cannot be read, such as of {links_with_losses[0]}"


def find_lost_meshes(robot: ElementTree.Element, folder: Path) -> tuple[list[str], list[str]]:
    """Return the visual meshes of a URDF that cannot be shown: those of other formats, and those that are missing.

    Args:
        robot: the root element, as in the file.
        folder: folder of the file.
    """
    names = dict.fromkeys(mesh.get("filename", "") for mesh in robot.iterfind("link/visual/geometry/mesh"))
    other_formats = [name for name in names if not name.lower().endswith(_MESH_EXTENSIONS)]
    missing = []
    for name in names:
        files = _mesh_file_candidates(name, folder)
        if name not in other_formats and not any(file.is_file() for file in files):
            missing.append(name)
    return other_formats, missing


def _is_positive(text: str | None) -> bool:
    return text is not None and _is_number(text) and float(text) > 0.0


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False


def _mesh_file_candidates(name: str, folder: Path) -> list[Path]:
    """Return where the file of a mesh may lie: below the folder of the URDF or one above it.

    Nowhere if MuJoCo cannot read files of this kind.
    """
    path = name
    for scheme in _MESH_SCHEMES:
        path = path.removeprefix(scheme)
    if not path.lower().endswith(_MESH_EXTENSIONS) or "\0" in path:
        return []
    _, _, path_in_package = path.partition("/")  # the name of a package need not be that of its folder
    bases = (folder.absolute(), *folder.absolute().parents)
    relative_paths = [relative_path for relative_path in (path, path_in_package) if relative_path]
    return [base / relative_path for base in bases for relative_path in relative_paths]


def _repair_inertias(links: Elements) -> Iterator[str]:
    """Repair inertias that no solid has, and remove those without a mass; yield a note on the repaired ones."""
    repaired_links = []
    for name, link in links.items():
        inertial = link.find("inertial")
        if inertial is None:
            continue
        mass_element = inertial.find("mass")
        inertia_element = inertial.find("inertia")
        if mass_element is None or inertia_element is None:
            raise SpecError(f"link {name!r}: inertial: expected a mass and an inertia")
        texts = {key: inertia_element.get(key, "0") for key in _MOMENTS + _PRODUCTS}
        inertia = {key: _parse_numbers(f"link {name!r}: inertia {key}", text, 1)[0] for key, text in texts.items()}
        (mass,) = _parse_numbers(f"link {name!r}: mass value", mass_element.get("value", ""), 1)
        is_vanishing = _has_vanishing_moment(inertia, mass)
        if mass < _LEAST_MASS or (is_vanishing and inertias.ball_moment(mass) < _MIN_BALL_MOMENT):
            link.remove(inertial)
            continue
        if _breaks_triangle_rule(inertia):  # MuJoCo's compiler balances the moments
            repaired_links.append(name)
        if is_vanishing:
            repaired_links.append(name)
            texts = _replace_vanishing_moments(inertia, mass)
        for key, text in texts.items():
            inertia_element.set(key, text)
    if repaired_links:
        count = len(set(repaired_links))
        yield f"repaired: inertias of {count} links that no solid has, such as of {repaired_links[0]}"


def _breaks_triangle_rule(inertia: Mapping[str, float]) -> bool:
    """Return whether one principal moment is larger than the sum of the other two."""
    smallest, middle, largest = _principal_moments(inertia)
    return smallest + middle < (1.0 - _ROUNDING) * largest


def _has_vanishing_moment(inertia: Mapping[str, float], mass: float) -> bool:
    """Return whether the smallest principal moment is nothing for a link of this mass, kg."""
    smallest, _, largest = _principal_moments(inertia)
    return smallest <= max(_ROUNDING * largest, _MIN_MOMENT * inertias.ball_moment(max(mass, 0.0)), _LEAST_MOMENT)


def _replace_vanishing_moments(inertia: Mapping[str, float], mass: float) -> dict[str, str]:
    """Return the texts of an inertia without products, and with the moment of a ball where a moment is nothing."""
    ball_moment = inertias.ball_moment(mass)
    texts = dict.fromkeys(_PRODUCTS, "0")
    for key in _MOMENTS:
        is_enough = inertia[key] > _MIN_MOMENT * ball_moment
        texts[key] = repr(inertia[key] if is_enough else ball_moment)
    return texts


def _principal_moments(inertia: Mapping[str, float]) -> np.ndarray:
    """Return the principal moments (3,) of an inertia, kg m^2, the smallest first."""
    matrix = np.array([[inertia[key] for key in row] for row in _INERTIA_ROWS])
    return np.linalg.eigvalsh(matrix)


def _add_missing_masses(links: Elements, joints: Elements) -> Iterator[str]:
    """Give links that move without mass, also in links fixed to them, a small mass; yield notes on missing masses."""
    masses = {}
    for name, link in links.items():
        if link.find("inertial") is not None:
            masses[name] = float(link.find("inertial/mass").get("value"))
    solid_links = {name for name, link in links.items() if link.find("collision") is not None}
    if not masses:
        yield "masses: none in the file; colliders get 1000 kg/m^3"
    fixed_children = collections.defaultdict(list)
    moving_links = []
    for joint in joints.values():
        child = joint.find("child").get("link")
        if joint.get("type") == "fixed":
            fixed_children[joint.find("parent").get("link")].append(child)
        else:
            moving_links.append(child)

    light_links = []
    for name in moving_links:
        rigid_part = _links_fixed_to(name, fixed_children)
        has_mass = any(masses.get(link) for link in rigid_part)
        if not has_mass and (masses or not solid_links.intersection(rigid_part)):
            light_links.append(name)
    mass = _LIGHT_LINK * sum(masses.values()) or _LIGHT_MASS
    for name in light_links:
        inertial = ElementTree.SubElement(links[name], "inertial")
        ElementTree.SubElement(inertial, "mass", value=repr(mass))
        texts = dict.fromkeys(_MOMENTS, repr(inertias.ball_moment(mass))) | dict.fromkeys(_PRODUCTS, "0")
        ElementTree.SubElement(inertial, "inertia", texts)
    if light_links:
        count = len(light_links)
        yield f"repaired: {count} links that move and weigh nothing get {mass:.2g} kg, such as {light_links[0]}"
    if masses:
        yield from missing_masses.describe_links(links)


def _links_fixed_to(name: str, fixed_children: Mapping[str, list[str]]) -> list[str]:
    """Return a link and all links that are fixed to it, directly or by others."""
    links = [name]
    for link in links:  # which grows on the way
        links += [child for child in fixed_children[link] if child not in links]
    return links


def _add_floating_root(robot: ElementTree.Element, links: Elements, joints: Elements) -> None:
    """Let the base float on an empty link, unless it floats: MuJoCo welds the base of a URDF to the world."""
    if any(joint.get("type") == "floating" for joint in joints.values()):
        return
    children = {joint.find("child").get("link") for joint in joints.values()}
    bases = [name for name in links if name not in children]
    if len(bases) != 1:
        raise SpecError(f"expected one link without a parent, got {len(bases)}: {', '.join(bases[:4]) or 'a loop'}")
    (base,) = bases
    world = f"{_ADDED_PREFIX}world"
    ElementTree.SubElement(robot, "link", name=world)
    joint = ElementTree.SubElement(robot, "joint", name=f"{world}_joint", type="floating")
    ElementTree.SubElement(joint, "parent", link=world)
    ElementTree.SubElement(joint, "child", link=base)
