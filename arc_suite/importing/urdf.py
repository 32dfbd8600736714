"""Cures of URDF: what MuJoCo refuses, and what gets lost on the way into it."""

import collections
import itertools
import math
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from arc_suite.robots.spec import SpecError

LEVEL = "0 0 0"
TURNS = (f"{math.pi / 2} 0 {math.pi / 2}", f"{math.pi / 2} 0 0")  # y points up, and z or x ahead

_OWN = "arc_suite_"  # begins the names of links that are added
_READABLE = (".stl", ".obj", ".msh")
_KINDS = ("revolute", "continuous", "prismatic", "fixed", "floating")
_LEAST = 1e-6  # of the inertia of a ball of the link's mass; a smaller one is none
_LIGHT = 1e-4  # of the robot's mass, of a link that moves and has none
_DENSITY = 1000.0  # kg/m^3, of the ball that a link without inertia is taken for
_JOINT_NUMBERS = {
    "axis": {"xyz": 3},
    "limit": dict.fromkeys(("lower", "upper", "effort", "velocity"), 1),
    "dynamics": dict.fromkeys(("damping", "friction"), 1),
}
_SCHEMES = ("package://", "file://", "model://")
_DIAGONAL, _PRODUCTS = ("ixx", "iyy", "izz"), ("ixy", "ixz", "iyz")
_ROUNDING = 1e-9  # of inertias in files, as a share of the largest

_COMPILER = {
    "strippath": "false",
    "fusestatic": "true",
    "balanceinertia": "true",  # of links that break the triangle rule
    "discardvisual": "true",
    "boundmass": "0",
    "boundinertia": "0",
}


def repair_urdf(
    robot: ElementTree.Element, folder: Path, turn: str = LEVEL
) -> tuple[str, tuple[str, ...], tuple[str, ...]]:
    """Return a URDF that MuJoCo reads, its moving joints in the order of the file, and notes.

    Args:
        robot: the top element, which is changed.
        folder: of the file; meshes are searched there and upwards.
        turn: roll, pitch and yaw of the base in the torso's frame, for files whose z axis does not point up.

    Raises:
        SpecError: it is no URDF; the message names the link or joint.
    """
    if any("xacro" in str(element.tag) for element in robot.iter()):
        raise SpecError("has xacro macros; write the URDF with xacro first")
    for tag in ("gazebo", "transmission", "mujoco"):
        for element in robot.findall(tag):
            robot.remove(element)
    links, joints = _named(robot, "link"), _named(robot, "joint")
    for name, joint in joints.items():
        _check_joint(name, joint, links)
    notes = [*_cure_shapes(links, folder), *_cure_inertias(links), *_cure_masses(links, joints), *_mimics(joints)]
    _add_root(robot, links, joints, turn)
    ElementTree.SubElement(ElementTree.SubElement(robot, "mujoco"), "compiler", _COMPILER)
    order = tuple(name for name, joint in joints.items() if joint.get("type") not in ("fixed", "floating"))
    return ElementTree.tostring(robot, encoding="unicode"), order, tuple(notes)


def _named(robot: ElementTree.Element, tag: str) -> dict[str, ElementTree.Element]:
    """Return the links or joints by name, in the order of the file."""
    found = {}
    for element in robot.findall(tag):
        name = element.get("name")
        if not name or name in found:
            raise SpecError(f"{tag} {name!r}: the name occurs twice" if name else f"a {tag} has no name")
        found[name] = element
        for child in element.iter("origin"):
            for key in ("xyz", "rpy"):
                _numbers(f"{tag} {name!r}: origin {key}", child.get(key, "0 0 0"), 3)
    if not found:
        raise SpecError(f"expected a URDF, got one without a {tag}")
    return found


def _numbers(what: str, text: str, size: int) -> list[float]:
    try:
        numbers = [float(word) for word in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != size or not all(map(math.isfinite, numbers)):
        raise SpecError(f"{what}: expected {size} number{'s' * (size > 1)}, got {text[:60]!r}")
    return numbers


def _cure_shapes(links: dict[str, ElementTree.Element], folder: Path) -> Iterator[str]:
    """Drop visual shapes, and colliders that cannot be read; yield a note of these."""
    dropped = []
    for name, link in links.items():
        for visual in link.findall("visual"):
            link.remove(visual)
        for collision in link.findall("collision"):
            mesh, sphere = collision.find("geometry/mesh"), collision.find("geometry/sphere")
            if mesh is not None:
                file = _resolved(mesh.get("filename", ""), folder)
                mesh.set("filename", str(file))
            if (mesh is not None and file is None) or (sphere is not None and not _positive(sphere.get("radius"))):
                link.remove(collision)
                dropped.append(name)
    if dropped:
        yield f"left out: {len(dropped)} colliders that cannot be read, such as of {dropped[0]}"


def _positive(text: str | None) -> bool:
    try:
        return float(text or "0") > 0.0
    except ValueError:
        return False


def _resolved(name: str, folder: Path) -> Path | None:
    """Return the file of a mesh: below the folder of the URDF or one above it; None if MuJoCo cannot read it."""
    for scheme in _SCHEMES:
        name = name.removeprefix(scheme)
    if not name.lower().endswith(_READABLE):
        return None
    _, _, inner = name.partition("/")  # a package's name need not be its folder's
    bases = [folder.absolute(), *folder.absolute().parents]
    return next((base / part for base in bases for part in (name, inner) if part and (base / part).is_file()), None)


def _cure_inertias(links: dict[str, ElementTree.Element]) -> Iterator[str]:
    """Drop the products of inertias that no solid has, and inertias without a mass; yield a note of these."""
    repaired = []
    for name, link in links.items():
        inertial = link.find("inertial")
        if inertial is None:
            continue
        mass, inertia = inertial.find("mass"), inertial.find("inertia")
        if mass is None or inertia is None:
            raise SpecError(f"link {name!r}: inertial: expected a mass and an inertia")
        values = {key: inertia.get(key, "0") for key in _DIAGONAL + _PRODUCTS}
        numbers = {key: _numbers(f"link {name!r}: inertia {key}", text, 1)[0] for key, text in values.items()}
        (weight,) = _numbers(f"link {name!r}: mass value", mass.get("value", ""), 1)
        if weight <= 0.0:
            link.remove(inertial)
            continue
        least, middle, most = np.linalg.eigvalsh(_matrix(numbers))
        if least + middle < (1.0 - _ROUNDING) * most:  # the compiler then balances them
            repaired.append(name)
        ball = _ball(weight)
        if least <= max(_ROUNDING * most, _LEAST * ball):
            repaired.append(name)
            values = dict.fromkeys(_PRODUCTS, "0")
            values |= {key: repr(numbers[key] if numbers[key] > _LEAST * ball else ball) for key in _DIAGONAL}
        for key, text in values.items():
            inertia.set(key, text)
    if repaired:
        yield f"repaired: inertias of {len(set(repaired))} links that no solid has, such as of {repaired[0]}"


def _ball(mass: float) -> float:
    """Return the moment of inertia of a ball, kg m^2."""
    return 0.4 * mass * (0.75 * mass / (math.pi * _DENSITY)) ** (2.0 / 3.0)


def _matrix(numbers: dict[str, float]) -> np.ndarray:
    rows = (("ixx", "ixy", "ixz"), ("ixy", "iyy", "iyz"), ("ixz", "iyz", "izz"))
    return np.array([[numbers[key] for key in row] for row in rows])


def _mimics(joints: dict[str, ElementTree.Element]) -> Iterator[str]:
    found = [name for name, joint in joints.items() if joint.find("mimic") is not None]
    if found:
        yield f"left out: {len(found)} mimic joints move on their own, such as {found[0]}"


def _cure_masses(links: dict[str, ElementTree.Element], joints: dict[str, ElementTree.Element]) -> Iterator[str]:
    """Give links that move and weigh nothing, fixed ones included, a small mass; yield a note of these."""
    masses = {name: float(link.find("inertial/mass").get("value")) for name, link in _weighed(links)}
    fixed, moving = collections.defaultdict(list), []
    for joint in joints.values():
        parent, child = (joint.find(end).get("link") for end in ("parent", "child"))
        fixed[parent] += [child] if joint.get("type") == "fixed" else []
        moving += [child] if joint.get("type") != "fixed" else []
    light = [name for name in moving if not any(masses.get(link) for link in _cluster(name, fixed))]
    for name in light:
        mass = _LIGHT * sum(masses.values())
        inertial = ElementTree.SubElement(links[name], "inertial")
        ElementTree.SubElement(inertial, "mass", value=repr(mass))
        numbers = dict.fromkeys(_DIAGONAL, repr(_ball(mass))) | dict.fromkeys(_PRODUCTS, "0")
        ElementTree.SubElement(inertial, "inertia", numbers)
    if light:
        yield f"repaired: {len(light)} links that move and weigh nothing get {mass:.2g} kg, such as {light[0]}"


def _weighed(links: dict[str, ElementTree.Element]) -> Iterator[tuple[str, ElementTree.Element]]:
    return ((name, link) for name, link in links.items() if link.find("inertial") is not None)


def _cluster(name: str, fixed: dict[str, list[str]]) -> list[str]:
    """Return a link and all that are fixed to it."""
    found = [name]
    for link in found:
        found += [child for child in fixed[link] if child not in found]
    return found


def _check_joint(name: str, joint: ElementTree.Element, links: dict[str, ElementTree.Element]) -> None:
    if joint.get("type") not in _KINDS:
        raise SpecError(f"joint {name!r}: expected a type out of {', '.join(_KINDS)}, got {joint.get('type')!r}")
    for end in ("parent", "child"):
        element = joint.find(end)
        link = None if element is None else element.get("link")
        if link not in links:
            raise SpecError(f"joint {name!r}: its {end} is no link of the file: {link!r}")
    tags = [element.tag for element in joint]
    twice = next((tag for tag in tags if tags.count(tag) > 1), None)
    if twice is not None:
        raise SpecError(f"joint {name!r}: expected one element {twice!r}, got {tags.count(twice)}")
    for tag, keys in _JOINT_NUMBERS.items():
        element = joint.find(tag)
        for key in [] if element is None else keys:
            _numbers(f"joint {name!r}: {tag} {key}", element.get(key, "0" if tag != "axis" else "1 0 0"), keys[key])


def _add_root(robot: ElementTree.Element, links: dict, joints: dict, turn: str) -> None:
    """Have the base float on an empty link, unless it floats: MuJoCo welds the base of a URDF to the world."""
    if any(joint.get("type") == "floating" for joint in joints.values()):
        return
    children = {joint.find("child").get("link") for joint in joints.values()}
    bases = [name for name in links if name not in children]
    if len(bases) != 1:
        raise SpecError(f"expected one link without a parent, got {len(bases)}: {', '.join(bases[:4]) or 'a loop'}")
    chain = [f"{_OWN}world", bases[0]] if turn == LEVEL else [f"{_OWN}world", f"{_OWN}torso", bases[0]]
    for link in chain[:-1]:
        ElementTree.SubElement(robot, "link", name=link)
    for parent, child in itertools.pairwise(chain):
        kind = "floating" if parent == chain[0] else "fixed"
        joint = ElementTree.SubElement(robot, "joint", name=f"{parent}_joint", type=kind)
        ElementTree.SubElement(joint, "parent", link=parent)
        ElementTree.SubElement(joint, "child", link=child)
        if kind == "fixed":
            ElementTree.SubElement(joint, "origin", rpy=turn)
