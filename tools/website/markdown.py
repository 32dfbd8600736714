"""Parts of Markdown pages, as text."""

import inspect
import re
from collections.abc import Iterable, Mapping, Sequence
from xml.etree.ElementTree import Element, indent, tostring

import numpy as np

_FIELD = re.compile(r"^    (?P<names>\w+(?:, \w+)*): (?P<text>.*(?:\n {8,}.*)*)", re.MULTILINE)


def page(title: str, *parts: str) -> str:
    """Return a page of paragraphs, headings and tables; empty parts are left out."""
    return joined(f"# {title}", *parts)


def joined(*parts: str) -> str:
    """Return paragraphs, headings and tables as text; empty parts are left out."""
    return "\n\n".join(filter(None, parts)) + "\n"


def dropdown(title: str, heads: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a long table that a click unfolds, as HTML, which Sphinx takes as it is."""
    rows = [_row("th", heads), *(_row("td", cells) for cells in lines)]
    table = element("table", children=rows, **{"class": "docutils"})
    return as_html(element("details", children=[element("summary", title), table]))


def _row(tag: str, cells: Sequence[str]) -> Element:
    return element("tr", children=[element(tag, cell) for cell in cells])


def element(tag: str, text: str = "", children: Sequence[Element] = (), **attributes: str) -> Element:
    """Return an element of HTML."""
    made = Element(tag, attributes)
    made.text = text
    made.extend(children)
    return made


def as_html(made: Element) -> str:
    """Return an element as text, with a row of a table on each line."""
    indent(made, space="")
    return tostring(made, encoding="unicode", method="html")


def cards(texts: Mapping[str, str]) -> str:
    """Return a grid of cards by their links, whose texts are those of the pages."""
    each = [f":::{{grid-item-card}}\n:link: {link}\n:link-type: doc\n\n{text}\n:::" for link, text in texts.items()]
    return "\n\n".join(["::::{grid} 1 2 2 2\n:gutter: 2", *each, "::::"])


def number(value) -> str:
    """Return a number, several numbers, a name or None as a cell of a table."""
    if isinstance(value, tuple | list | np.ndarray):
        values = np.asarray(value).tolist()
        same = len(values) > 2 and all(each == values[0] for each in values)
        return number(values[0]) if same else f"({', '.join(map(number, values))})"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {number(each)}" for name, each in value.items()) or "none"
    if isinstance(value, str) or value is None or isinstance(value, bool):
        return {"None": "none", "True": "true", "False": "false"}.get(str(value), str(value))
    return f"{float(value):.4g}"


def summary(documented) -> str:
    """Return the first sentence of a docstring."""
    return " ".join(inspect.getdoc(documented).partition("\n\n")[0].split())


def fields(documented) -> dict[str, str]:
    """Return the meanings of a class's attributes by name, from the section `Attributes` of its docstring."""
    _, _, section = inspect.getdoc(documented).partition("Attributes:\n")
    meanings = {}
    for found in _FIELD.finditer(section):
        for name in found["names"].split(", "):
            meanings[name] = " ".join(found["text"].split()).removesuffix(".")
    return meanings
