"""Checks of the source, the MJCF of an imported body: only known elements, and nothing that names a file.

A source comes from a file that anybody may have written, and MuJoCo reads it. So only listed tags, attributes and
values are valid; `arc_suite.importing` writes no others.
"""

import collections
import dataclasses
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable
from typing import Any, NamedTuple, NoReturn

from arc_suite import checks
from arc_suite.robots.spec import Body, SpecError

MAX_DEPTH = 200  # of elements within elements
_MAX_NUMBER = 1e15  # above what any robot has, below what overflows in products
MAX_INTEGER = 10_000  # of iterations of solvers, and of a hull's vertices
_MAX_QUOTE = 40  # characters of a name or value in an error


@dataclasses.dataclass(frozen=True)
class _Range:
    """Valid numbers of an attribute."""

    low: float
    high: float

    def __str__(self) -> str:
        return f"numbers from {self.low:g} to {self.high:g}"


# What an attribute may contain: one of these, or a tuple of the valid texts. Errors contain them.
_NAME = "a name"
_NUMBERS = _Range(-_MAX_NUMBER, _MAX_NUMBER)
_PLACE = _Range(-100.0, 100.0)  # m, as of the parts of bodies
_SIZE = _Range(0.0, 100.0)  # m
_AMOUNT = _Range(0.0, _MAX_NUMBER)  # of what pulls where it should resist if it is below 0
_INTEGER = f"an integer up to {MAX_INTEGER}"
_SWITCH = ("enable", "disable")
_BOOLEAN = ("true", "false")

# Attributes that several elements have.
_SOLVER_PARAMETERS = {"solref": _NUMBERS, "solimp": _NUMBERS}
_NAME_AND_POSE = {"name": _NAME, "pos": _PLACE, "quat": _NUMBERS}

OPTIONS = {
    **dict.fromkeys(("timestep", "impratio", "tolerance", "ls_tolerance", "noslip_tolerance"), _NUMBERS),
    **dict.fromkeys(("ccd_tolerance", "gravity", "wind", "magnetic", "density", "viscosity"), _NUMBERS),
    **dict.fromkeys(("iterations", "ls_iterations", "noslip_iterations", "ccd_iterations"), _INTEGER),
    "integrator": ("Euler", "RK4", "implicit", "implicitfast"),
    "cone": ("pyramidal", "elliptic"),
    "jacobian": ("dense", "sparse", "auto"),
    "solver": ("PGS", "CG", "Newton"),
}
# Flags of MuJoCo that a source may set; others would disable motors, contacts or sensors.
FLAGS = (
    "frictionloss",
    "limit",
    "spring",
    "damper",
    "gravity",
    "warmstart",
    "filterparent",
    "refsafe",
    "midphase",
    "eulerdamp",
    "nativeccd",
    "island",
    "multiccd",
)


# Visual meshes, their geoms and other visual geoms: names begin with this, and they touch nothing and weigh nothing.
VISUAL = "visual"
VISUAL_GROUP = "2"
VISUAL_GEOM = {"mass": "0", "contype": "0", "conaffinity": "0", "group": VISUAL_GROUP}


class _Element(NamedTuple):
    """The valid elements of a tag.

    Attributes:
        parents: tags of the elements that may contain it; None for the file.
        max_count: the most that a source may have.
        attributes: valid contents of the attributes by name; see `_NAME`.
    """

    parents: tuple[str | None, ...]
    max_count: int
    attributes: dict[str, Any]


_ELEMENTS = {
    "mujoco": _Element((None,), 1, {"model": _NAME}),
    "compiler": _Element(
        ("mujoco",),
        1,
        {"angle": ("radian",), "autolimits": ("false",), "inertiafromgeom": ("false",)},
    ),
    "option": _Element(("mujoco",), 1, OPTIONS),
    "flag": _Element(("option",), 1, dict.fromkeys(FLAGS, _SWITCH)),
    "asset": _Element(("mujoco",), 1, {}),
    "mesh": _Element(
        ("asset",),
        256,
        {
            "name": _NAME,
            "inertia": ("convex", "exact", "legacy", "shell"),
            "maxhullvert": _INTEGER,
            **dict.fromkeys(("vertex", "face", "scale", "refpos", "refquat"), _NUMBERS),
        },
    ),
    "worldbody": _Element(("mujoco",), 1, {}),
    "body": _Element(("worldbody", "body"), 2048, {**_NAME_AND_POSE, "gravcomp": _NUMBERS}),
    "inertial": _Element(("body",), 2048, {"pos": _PLACE, "quat": _NUMBERS, "mass": _AMOUNT, "diaginertia": _AMOUNT}),
    "joint": _Element(
        ("body", "equality"),
        1024,
        {
            "name": _NAME,
            "type": ("free", "hinge", "slide"),
            "limited": _BOOLEAN,
            "actuatorfrclimited": _BOOLEAN,
            "actuatorgravcomp": _BOOLEAN,
            "pos": _PLACE,
            **dict.fromkeys(("axis", "range", "actuatorfrcrange", "margin", "ref", "springref"), _NUMBERS),
            **dict.fromkeys(("armature", "frictionloss", "stiffness", "damping"), _AMOUNT),
            **{f"{name}{what}": _NUMBERS for name in _SOLVER_PARAMETERS for what in ("limit", "friction")},
            # Of a joint in `equality`, which MuJoCo's own check of the file keeps apart.
            **{"joint1": _NAME, "joint2": _NAME, "polycoef": _NUMBERS, **_SOLVER_PARAMETERS},
        },
    ),
    "geom": _Element(
        ("body",),
        4096,
        {
            **_NAME_AND_POSE,
            **_SOLVER_PARAMETERS,
            "type": ("sphere", "capsule", "cylinder", "ellipsoid", "box", "mesh"),
            "mesh": _NAME,
            "contype": ("0", "1"),
            "conaffinity": ("0",),
            "group": (VISUAL_GROUP,),
            "rgba": _Range(0.0, 1.0),
            "size": _SIZE,
            **dict.fromkeys(("mass", "friction"), _AMOUNT),
            **dict.fromkeys(("condim", "priority", "solmix", "margin", "gap"), _NUMBERS),
            **dict.fromkeys(("adhesion", "surfacevel"), _NUMBERS),
        },
    ),
    "site": _Element(("body",), 1024, {**_NAME_AND_POSE, "size": _SIZE, "group": ("4",)}),
    "equality": _Element(("mujoco",), 1, {}),
    "connect": _Element(("equality",), 256, {"site1": _NAME, "site2": _NAME, **_SOLVER_PARAMETERS}),
    "weld": _Element(
        ("equality",), 256, {"site1": _NAME, "site2": _NAME, "torquescale": _AMOUNT, **_SOLVER_PARAMETERS}
    ),
    "keyframe": _Element(("mujoco",), 1, {}),
    "key": _Element(("keyframe",), 1, {"name": ("home",), "qpos": _Range(-1000.0, 1000.0)}),
}

ENTITY = re.compile(r"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)
_VALID_NAME = re.compile(r"[a-z0-9_]{1,64}")


def check(body: Body) -> Body:
    """Return a body after a check of its source: only valid elements, and all parts of the body.

    Raises:
        SpecError: the source is not valid; the message begins with `source: `.
    """
    if body.source is not None:
        root = _parse(body.source)
        _check_elements(root)
        _check_parts(root, body)
    return body


def remove_visuals(root: ElementTree.Element) -> ElementTree.Element:
    """Remove visual meshes, visual geoms and colors from the tree of a source, and return it: no dynamics change."""
    for parent in [element for element in root.iter() if element.tag in ("asset", "body")]:
        for child in list(parent):
            is_visual_mesh = child.tag == "mesh" and child.get("name", "").startswith(VISUAL)
            if is_visual_mesh or (child.tag == "geom" and child.get("group") == VISUAL_GROUP):
                parent.remove(child)
            child.attrib.pop("rgba", None)
    return root


def _fail(reason: str) -> NoReturn:
    raise SpecError(reason, "source")


def _parse(text: str) -> ElementTree.Element:
    if ENTITY.search(text):
        _fail("expected XML without a document type and entities")
    try:
        return ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:  # ValueError: an encoding that Python lacks
        _fail(f"expected MJCF: {checks.quote(error)}")


def _check_elements(root: ElementTree.Element) -> None:
    """Raise SpecError for a tag, a nesting, an attribute or a value that is not valid."""
    counts = collections.Counter()
    unchecked: list[tuple[ElementTree.Element, str | None, int]] = [(root, None, 0)]  # element, parent's tag, depth
    while unchecked:
        element, parent, depth = unchecked.pop()
        tag = element.tag
        if tag not in _ELEMENTS or parent not in _ELEMENTS[tag].parents:
            _fail(f"expected no element {str(tag)[:_MAX_QUOTE]!r} in {parent or 'a file'!r}")
        counts[tag] += 1
        max_count = _ELEMENTS[tag].max_count
        if counts[tag] > max_count or depth > MAX_DEPTH:
            _fail(f"expected at most {max_count} elements {tag!r}, at most {MAX_DEPTH} within each other")
        for name, value in element.attrib.items():
            _check_attribute(element, name, value)
        unchecked += [(child, tag, depth + 1) for child in element]


def _check_attribute(element: ElementTree.Element, name: str, value: str) -> None:
    """Raise SpecError for an attribute that the element may not have, or a value that is not valid."""
    contents = _ELEMENTS[element.tag].attributes
    label = f"{element.tag} {element.get('name', '')[:_MAX_QUOTE]!r}"
    if name not in contents:
        _fail(f"{label}: expected no attribute {name[:_MAX_QUOTE]!r}")
    content = contents[name]
    expected = f"one of {', '.join(content)}" if isinstance(content, tuple) else content
    if not _is_valid(value, content):
        _fail(f"{label}: {name}: expected {expected}, got {value[:_MAX_QUOTE]!r}")


def _is_valid(value: str, content: str | _Range | tuple[str, ...]) -> bool:
    """Return whether an attribute's value is valid content; see `_NAME`."""
    if isinstance(content, _Range):
        return _are_numbers(value, content)
    if isinstance(content, tuple):
        return value in content
    if content == _NAME:
        return _VALID_NAME.fullmatch(value) is not None
    if content == _INTEGER:
        has_valid_digits = value.isascii() and value.isdecimal() and len(value) <= len(str(MAX_INTEGER))
        return has_valid_digits and int(value) <= MAX_INTEGER
    raise ValueError(f"unknown content {content}")


def _are_numbers(text: str, valid: _Range) -> bool:
    try:
        return all(valid.low <= float(word) <= valid.high for word in text.split())  # a comparison with NaN is false
    except ValueError:
        return False


def _check_parts(root: ElementTree.Element, body: Body) -> None:
    """Raise SpecError for a source without the body's parts.

    These are one free torso, and the joints, links, feet and standing pose of the body.
    """
    joint_names = [joint.get("name") for joint in _find_torso(root).iter("joint")]
    # Joints that the body has not are passive.
    hinge_names = [name for name in joint_names if name != "root"]
    _check_names("joint", hinge_names, [*body.joint_names, *(joint.name for joint in body.held)])
    _check_names("body", [part.get("name") for part in root.iter("body")], body.part_names)
    _check_names("site", [site.get("name") for site in root.iter("site")], ("torso", *body.foot_names))

    keyframe_sizes = [len(key.get("qpos", "").split()) for key in root.iter("key")]
    position_count = 7 + len(hinge_names)  # the free joint has 7
    if keyframe_sizes != [position_count]:
        _fail(f"expected a keyframe 'home' of {position_count} numbers")


def _find_torso(root: ElementTree.Element) -> ElementTree.Element:
    """Return the torso of a source; raise SpecError for one that is not the only free body."""
    torsos = root.findall("worldbody/*")
    if len(torsos) == 1 and torsos[0].get("name") == "torso":
        first_joint = torsos[0].find("joint")
        free_joints = [joint.get("name") for joint in torsos[0].iter("joint") if joint.get("type") == "free"]
        if free_joints == ["root"] and first_joint is not None and first_joint.get("type") == "free":
            return torsos[0]
    _fail("expected one body in the world, named 'torso', whose first joint 'root' is the one that is free")


def _check_names(kind: str, names: list[str], required_names: Iterable[str]) -> None:
    """Raise SpecError for a name that occurs twice, or a required name that is missing."""
    for name, count in collections.Counter(names).items():
        if count > 1:
            _fail(f"the {kind} {name!r} occurs twice")
    for name in required_names:
        if name not in names:
            _fail(f"expected a {kind} {name!r}")
