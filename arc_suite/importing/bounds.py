"""Bounds on the work that a robot's file asks for, checked before MuJoCo reads it.

A file may claim any size in a few bytes: a `replicate` within a `replicate`, a height field, a number of keyframes.
MuJoCo makes what a file claims. So all elements are counted first, as often as they would be made, in the file and
in all files that it includes.
"""

import collections
import math
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from arc_suite import files, parsers
from arc_suite.robots import sources
from arc_suite.robots.spec import SpecError

MAX_BYTES = 1 << 24  # of a file; the largest of 45 has 200 kB
MAX_MESH_BYTES = 1 << 27  # of all files of meshes together

_MAX_FILES = 100  # that a file includes
_MAX_ELEMENTS = 1 << 15  # of all kinds together
_MAX_TAGS = 1 << 18  # of a file, in its comments too
_MAX_QUOTE = 40  # characters of a tag or value in an error
# The most that a robot and its scene may have of the parts that take MuJoCo long, by tag.
_MAX_COUNTS = {"body": 2048, "link": 2048, "geom": 4096, "joint": 1024}
# Elements that make as many parts as the product of these numbers says; each may be a body.
_MULTIPLIERS = ("replicate", "composite", "flexcomp")

# The largest product of an attribute's numbers, for attributes by which MuJoCo sizes arrays, in any element.
_MAX_SIZES = {
    "nkey": 1 << 10,
    "nuserdata": 1 << 16,
    "njmax": 1 << 20,
    "nconmax": 1 << 20,
    "nstack": 1 << 26,
    **{f"nuser_{kind}": 1 << 8 for kind in ("body", "jnt", "geom", "site", "cam", "tendon", "actuator", "sensor")},
    "dim": 1 << 12,  # of a sensor
    "num": 1 << 12,  # of contacts of a sensor
    "actdim": 1 << 12,
    "nsample": 1 << 16,
    "resolution": 1 << 22,
    "nrow": 1 << 12,
    "ncol": 1 << 12,
    "order": 1 << 4,
    "params": 1 << 12,  # of a mesh that MuJoCo makes
    "octree_maxdepth": 1 << 3,
    **dict.fromkeys(("iterations", "ls_iterations", "noslip_iterations", "ccd_iterations"), sources.MAX_INTEGER),
    **dict.fromkeys(("sdf_iterations", "sdf_initpoints"), 1 << 10),
}
_MEMORY = re.compile(r"\s*(\d{1,12})\s*([kmgtpe]?)\s*", re.IGNORECASE)
_MAX_MEMORY = 1 << 30  # bytes
_UNITS = "kmgtpe"
_XML_DECLARATION = re.compile(r"^\s*<\?xml[^>]*\?>")


class _Inclusion(NamedTuple):
    """A file that another one names.

    Attributes:
        name: its path, as it is written.
        copies: how often MuJoCo makes what it contains.
    """

    name: str
    copies: int


class _Place(NamedTuple):
    """An element, and where it stands.

    Attributes:
        element: the element.
        depth: elements around it.
        copies: how often MuJoCo makes it.
    """

    element: ElementTree.Element
    depth: int
    copies: int


def parse(path: Path) -> tuple[ElementTree.Element, tuple[Path, ...]]:
    """Return the root element of a robot's file, and all files that MuJoCo would read as parts of it, itself first.

    Raises:
        SpecError: no XML, or XML that asks for too much; the message names the included file.
        OSError: the file cannot be read.
    """
    root_element = _parse(files.read_bytes(path, MAX_BYTES))
    counts: collections.Counter[str] = collections.Counter()
    inclusions = list(_check_elements(root_element, counts))
    parts = {path: None}
    while inclusions:
        name, copies = inclusions.pop()
        for part in dict.fromkeys(folder / name for folder in (path.parent, *(file.parent for file in parts))):
            if part in parts or not part.exists():
                continue
            parts[part] = None
            if len(parts) > _MAX_FILES:
                raise SpecError(f"expected at most {_MAX_FILES} included files")
            with parsers.guard(f"included file {name[:_MAX_QUOTE]!r}", raises=SpecError):
                inclusions += _check_elements(_parse(files.read_bytes(part, MAX_BYTES)), counts, copies)
    return root_element, tuple(parts)


def check_mesh_files(paths: Iterable[Path]) -> None:
    """Refuse files of meshes that are no plain files, such as pipes, or too large.

    Raises:
        SpecError: the message names the file.
    """
    total = 0
    for path in dict.fromkeys(paths):
        if not path.exists():
            continue
        if not path.is_file():
            raise SpecError(f"mesh {path.name[:_MAX_QUOTE]!r}: expected a file")
        total += path.stat().st_size
        if total > MAX_MESH_BYTES:
            raise SpecError(f"mesh {path.name[:_MAX_QUOTE]!r}: expected at most {MAX_MESH_BYTES} bytes of meshes")


def _parse(data: bytes) -> ElementTree.Element:
    """Return the root element of XML without entities."""
    if len(data) > MAX_BYTES:
        raise SpecError(f"expected at most {MAX_BYTES} bytes")
    if data.count(b"<") > _MAX_TAGS:
        raise SpecError(f"expected at most {_MAX_TAGS} tags")
    try:
        text = data.rstrip(b"\0\r\n\t ").decode("utf-8")  # some writers end a file as C ends a text
    except UnicodeDecodeError:
        raise SpecError("expected text in UTF-8") from None
    if sources.ENTITY.search(text):
        raise SpecError("expected XML without a document type and entities")
    # Some exporters write an empty line before the declaration, which XML forbids.
    cure = "; a body in JSON needs no import: every program takes it as --spec" if text.lstrip()[:1] == "{" else ""
    with parsers.guard("expected XML", cure, raises=SpecError):
        return ElementTree.fromstring(_XML_DECLARATION.sub("", text))


def _check_elements(
    root: ElementTree.Element, counts: collections.Counter[str], copies_of_root: int = 1
) -> Iterator[_Inclusion]:
    """Count the elements of a file, and yield the files that it includes.

    Raises:
        SpecError: too many elements, too many within each other, or an attribute that asks for too much.
    """
    places = [_Place(root, 0, copies_of_root)]
    attached_names = []
    while places:
        element, depth, copies = places.pop()
        tag = str(element.tag)
        if depth > sources.MAX_DEPTH:
            raise SpecError(f"too deep: expected at most {sources.MAX_DEPTH} elements within each other")
        copies *= _count_copies(element)
        _count(counts, tag, copies)
        if tag in _MULTIPLIERS:
            _count(counts, "body", copies)
        _check_sizes(element)
        if tag == "flexcomp" and "file" in element.attrib:  # MuJoCo would read it with the XML
            raise SpecError("flexcomp: file: expected none, as soft bodies do not come in")
        if tag == "include" and "file" in element.attrib:
            yield _Inclusion(element.attrib["file"], copies)
        if tag == "model" and "file" in element.attrib:
            attached_names.append(element.attrib["file"])
        places += [_Place(child, depth + 1, copies) for child in element]
    for name in attached_names:
        yield _Inclusion(name, copies_of_root + counts["attach"])  # at most


def _count(counts: collections.Counter[str], tag: str, copies: int) -> None:
    counts[tag] += copies
    max_count = _MAX_COUNTS.get(tag, _MAX_ELEMENTS)
    if counts[tag] > max_count or counts.total() > _MAX_ELEMENTS:
        raise SpecError(
            f"expected at most {max_count} elements {tag[:_MAX_QUOTE]!r}, and {_MAX_ELEMENTS} of all kinds together"
        )


def _count_copies(element: ElementTree.Element) -> int:
    """Return how often an element makes what it contains: the product of its counts."""
    if element.tag not in _MULTIPLIERS:
        return 1
    return max(1, _multiply(element, "count", _MAX_ELEMENTS))


def _check_sizes(element: ElementTree.Element) -> None:
    for name in _MAX_SIZES.keys() & element.attrib.keys():
        _multiply(element, name, _MAX_SIZES[name])
    if element.tag == "size" and "memory" in element.attrib:
        _check_memory(element.attrib["memory"])


def _multiply(element: ElementTree.Element, name: str, max_size: int) -> int:
    """Return the product of an attribute's numbers; 1 for words that are no numbers, which MuJoCo refuses."""
    try:
        numbers = [int(float(word)) for word in element.get(name, "1").split()]
    except (ValueError, OverflowError):
        return 1
    positive_numbers = [max(1, number) for number in numbers]
    size = math.prod(positive_numbers)
    if size > max_size:
        label = f"{str(element.tag)[:_MAX_QUOTE]}: {name}"
        raise SpecError(f"{label}: expected at most {max_size}, got {element.get(name)[:_MAX_QUOTE]!r}")
    return size


def _check_memory(text: str) -> None:
    match = _MEMORY.fullmatch(text)
    if match is None:  # -1 stands for what MuJoCo finds to be enough
        return
    exponent = 1 + _UNITS.index(match[2].lower()) if match[2] else 0
    if int(match[1]) << (10 * exponent) > _MAX_MEMORY:
        raise SpecError(f"size: memory: expected at most {_MAX_MEMORY} bytes, got {text[:_MAX_QUOTE]!r}")
