"""What the source of an imported body may hold: named parts, their numbers, and nothing that names a file.

A source comes from a file that anybody may have written, and MuJoCo reads it. Tags, attributes and what they hold are
therefore those of a list; `arc_suite.importing` writes no others.
"""

import collections
import re
import xml.etree.ElementTree as ElementTree
from typing import Any, NoReturn

from arc_suite import checks
from arc_suite.robots.spec import Body, SpecError

MAX_DEPTH = 200  # of bodies within bodies, and so on
_LARGEST = 1e15  # of numbers: above what any robot has, below what overflows in products
_MOST_STEPS = 10_000  # of a solver

_NAME, _NUMBERS, _STEPS = "a name", "numbers", f"an integer up to {_MOST_STEPS}"
_ON = ("enable", "disable")
_BOOL = ("true", "false")
_SOFT = {"solref": _NUMBERS, "solimp": _NUMBERS}
_PLACE = {"name": _NAME, "pos": _NUMBERS, "quat": _NUMBERS}

OPTIONS = {
    **dict.fromkeys(("timestep", "impratio", "tolerance", "ls_tolerance", "noslip_tolerance"), _NUMBERS),
    **dict.fromkeys(("ccd_tolerance", "gravity", "wind", "magnetic", "density", "viscosity"), _NUMBERS),
    **dict.fromkeys(("iterations", "ls_iterations", "noslip_iterations", "ccd_iterations"), _STEPS),
    "integrator": ("Euler", "RK4", "implicit", "implicitfast"),
    "cone": ("pyramidal", "elliptic"),
    "jacobian": ("dense", "sparse", "auto"),
    "solver": ("PGS", "CG", "Newton"),
}
# Flags of the physics; others would keep motors, contacts or sensors from working.
FLAGS = (
    *("frictionloss", "limit", "spring", "damper", "gravity", "warmstart", "filterparent", "refsafe", "midphase"),
    *("eulerdamp", "nativeccd", "island", "multiccd"),
)

# By tag: where it stands, how many there may be, and its attributes with what they hold.
_TAGS: dict[str, tuple[tuple[str | None, ...], int, dict[str, Any]]] = {
    "mujoco": ((None,), 1, {"model": _NAME}),
    "compiler": (
        ("mujoco",),
        1,
        {"angle": ("radian",), "autolimits": ("false",), "inertiafromgeom": ("false",)},
    ),
    "option": (("mujoco",), 1, OPTIONS),
    "flag": (("option",), 1, dict.fromkeys(FLAGS, _ON)),
    "asset": (("mujoco",), 1, {}),
    "mesh": (
        ("asset",),
        256,
        {
            "name": _NAME,
            "inertia": ("convex", "exact", "legacy", "shell"),
            "maxhullvert": _STEPS,
            **dict.fromkeys(("vertex", "face", "scale", "refpos", "refquat"), _NUMBERS),
        },
    ),
    "worldbody": (("mujoco",), 1, {}),
    "body": (("worldbody", "body"), 2048, {**_PLACE, "gravcomp": _NUMBERS}),
    "inertial": (("body",), 2048, {"pos": _NUMBERS, "quat": _NUMBERS, "mass": _NUMBERS, "diaginertia": _NUMBERS}),
    "joint": (
        ("body",),
        1024,
        {
            "name": _NAME,
            "type": ("free", "hinge", "slide"),
            "limited": _BOOL,
            "actuatorfrclimited": _BOOL,
            "actuatorgravcomp": _BOOL,
            **dict.fromkeys(("pos", "axis", "range", "actuatorfrcrange", "margin", "ref", "springref"), _NUMBERS),
            **dict.fromkeys(("armature", "frictionloss", "stiffness", "damping"), _NUMBERS),
            **{f"{name}{what}": _NUMBERS for name in _SOFT for what in ("limit", "friction")},
        },
    ),
    "geom": (
        ("body",),
        4096,
        {
            **_PLACE,
            **_SOFT,
            "type": ("sphere", "capsule", "cylinder", "ellipsoid", "box", "mesh"),
            "mesh": _NAME,
            "contype": ("1",),
            "conaffinity": ("0",),
            **dict.fromkeys(("size", "mass", "condim", "priority", "solmix", "margin", "gap", "friction"), _NUMBERS),
            **dict.fromkeys(("adhesion", "surfacevel"), _NUMBERS),
        },
    ),
    "site": (("body",), 1024, {"name": _NAME, "size": _NUMBERS, "group": ("4",)}),
    "keyframe": (("mujoco",), 1, {}),
    "key": (("keyframe",), 1, {"name": ("home",), "qpos": _NUMBERS}),
}

ENTITY = re.compile(r"<!\s*(DOCTYPE|ENTITY)", re.IGNORECASE)
_NAMED = re.compile(r"[a-z0-9_]{1,64}")


def check(body: Body) -> Body:
    """Return a body whose source holds what a source may hold, and the body's own parts.

    Raises:
        SpecError: it holds something else; the message begins with `source: `.
    """
    if body.source is not None:
        root = _parsed(body.source)
        _check_elements(root)
        _check_parts(root, body)
    return body


def _fail(reason: str) -> NoReturn:
    raise SpecError(reason, "source")


def _parsed(text: str) -> ElementTree.Element:
    if ENTITY.search(text):
        _fail("expected XML without a document type and entities")
    try:
        return ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError) as error:  # ValueError: an encoding that Python lacks
        _fail(f"expected MJCF: {checks.quote(error)}")


def _check_elements(root: ElementTree.Element) -> None:
    """Refuse tags, places, attributes and values that no source has."""
    counts = collections.Counter()
    waiting: list[tuple[ElementTree.Element, str | None, int]] = [(root, None, 0)]
    while waiting:
        element, parent, depth = waiting.pop()
        tag = element.tag
        if tag not in _TAGS or parent not in _TAGS[tag][0]:
            _fail(f"expected no element {str(tag)[:40]!r} in {parent or 'a file'!r}")
        counts[tag] += 1
        if counts[tag] > _TAGS[tag][1] or depth > MAX_DEPTH:
            _fail(f"expected at most {_TAGS[tag][1]} elements {tag!r}, at most {MAX_DEPTH} within each other")
        for name, value in element.attrib.items():
            _check_attribute(element, name, value)
        waiting += [(child, tag, depth + 1) for child in element]


def _check_attribute(element: ElementTree.Element, name: str, value: str) -> None:
    kinds = _TAGS[element.tag][2]
    place = f"{element.tag} {element.get('name', '')[:40]!r}"
    if name not in kinds:
        _fail(f"{place}: expected no attribute {name[:40]!r}")
    kind = kinds[name]
    if isinstance(kind, tuple):
        fits, kind = value in kind, f"one of {', '.join(kind)}"
    elif kind == _NAME:
        fits = _NAMED.fullmatch(value)
    elif kind == _STEPS:
        fits = value.isascii() and value.isdecimal() and len(value) <= 5 and int(value) <= _MOST_STEPS
    else:
        fits = _are_numbers(value)
    if not fits:
        _fail(f"{place}: {name}: expected {kind}, got {value[:40]!r}")


def _are_numbers(text: str) -> bool:
    try:
        return all(abs(float(word)) <= _LARGEST for word in text.split())  # false for NaN
    except ValueError:
        return False


def _check_parts(root: ElementTree.Element, body: Body) -> None:
    """Refuse a source without the body's parts: one free torso, its joints, links, feet and standing pose."""
    world = root.find("worldbody")
    torso = None if world is None or len(world) != 1 else world[0]
    free = [joint.get("name") for joint in root.iter("joint") if joint.get("type") == "free"]
    first = None if torso is None else torso.find("joint")
    if torso is None or torso.get("name") != "torso" or free != ["root"] or first.get("type") != "free":
        _fail("expected one body in the world, named 'torso', whose first joint 'root' is the one that is free")
    hinges = [joint.get("name") for joint in root.iter("joint") if joint.get("name") != "root"]
    held = [joint.name for joint in body.held]
    for kind, found, wanted, alone in (
        ("joint", hinges, (*body.joint_names, *held), True),
        ("body", [part.get("name") for part in root.iter("body")], body.part_names, False),
        ("site", [site.get("name") for site in root.iter("site")], ("torso", *body.foot_names), False),
    ):
        _check_names(kind, found, wanted, alone)
    keys = [key.get("qpos", "").split() for key in root.iter("key")]
    if [len(qpos) for qpos in keys] != [7 + len(hinges)]:
        _fail(f"expected a keyframe 'home' of {7 + len(hinges)} numbers")


def _check_names(kind: str, found: list[str], wanted: tuple[str, ...], alone: bool) -> None:
    """Refuse names that occur twice, lack, or, if those wanted stand alone, are too many."""
    twice = next((name for name, count in collections.Counter(found).items() if count > 1), None)
    if twice is not None:
        _fail(f"the {kind} {twice!r} occurs twice")
    lacking = next((name for name in wanted if name not in found), None)
    if lacking is not None:
        _fail(f"expected a {kind} {lacking!r}")
    other = next((name for name in found if name not in wanted), None)
    if alone and other is not None:
        _fail(f"expected no {kind} {other!r}, which the body has not")
