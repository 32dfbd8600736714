"""Parts of Markdown pages, as text."""

import inspect
import re
from collections.abc import Iterable, Mapping, Sequence
from xml.etree.ElementTree import Element, indent, tostring

import numpy as np

# An entry of a docstring's section `Attributes`: names with commas between, a colon, and a text of one or more lines.
_ATTRIBUTES_ENTRY = re.compile(r"^    (?P<names>\w+(?:, \w+)*): (?P<text>.*(?:\n {8,}.*)*)", re.MULTILINE)


def page(title: str, *parts: str) -> str:
    """Return a page of paragraphs, headings and tables; empty parts are left out."""
    return join_parts(f"# {title}", *parts)


def join_parts(*parts: str) -> str:
    """Return paragraphs, headings and tables as one text; empty parts are left out."""
    return "\n\n".join(part for part in parts if part) + "\n"


def dropdown(title: str, heads: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    """Return a long table that a click unfolds, as HTML, which Sphinx copies into the page.

    Args:
        title: text on which to click.
        heads: heads of the columns.
        lines: cells of each line of the table.
    """
    head_line = _table_line("th", heads)
    body_lines = [_table_line("td", cells) for cells in lines]
    table = element("table", children=[head_line, *body_lines], **{"class": "docutils"})
    return to_html(element("details", children=[element("summary", title), table]))


def _table_line(tag: str, cells: Sequence[str]) -> Element:
    return element("tr", children=[element(tag, cell) for cell in cells])


def element(tag: str, text: str = "", children: Sequence[Element] = (), **attributes: str) -> Element:
    """Return an HTML element."""
    html_element = Element(tag, attributes)
    html_element.text = text
    html_element.extend(children)
    return html_element


def to_html(html_element: Element) -> str:
    """Return an HTML element as text, with each child on its own line."""
    indent(html_element, space="")
    return tostring(html_element, encoding="unicode", method="html")


def cards(texts: Mapping[str, str]) -> str:
    """Return a grid of cards that lead to other pages, given their texts by page."""
    items = [f":::{{grid-item-card}}\n:link: {link}\n:link-type: doc\n\n{text}\n:::" for link, text in texts.items()]
    return "\n\n".join(["::::{grid} 1 2 2 2\n:gutter: 2", *items, "::::"])


def format_value(value) -> str:
    """Return the text of a value in a table's cell. The value is a number, a text, None, or a collection of these.

    More than two equal numbers are written as one.
    """
    if isinstance(value, tuple | list | np.ndarray):
        values = np.asarray(value).tolist()
        if len(values) > 2 and all(item == values[0] for item in values):
            return format_value(values[0])
        return f"({', '.join(map(format_value, values))})"
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {format_value(item)}" for name, item in value.items()) or "none"
    if value is None:
        return "none"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return {"None": "none", "True": "true", "False": "false"}.get(value, value)
    return f"{float(value):.4g}"


def summary(documented) -> str:
    """Return the first paragraph of a docstring in one line."""
    paragraph, _, _ = inspect.getdoc(documented).partition("\n\n")
    return " ".join(paragraph.split())


def attribute_meanings(documented) -> dict[str, str]:
    """Return the meanings of a class's attributes by name, from the section `Attributes` of its docstring."""
    _, _, section = inspect.getdoc(documented).partition("Attributes:\n")
    meanings = {}
    for entry in _ATTRIBUTES_ENTRY.finditer(section):
        for name in entry["names"].split(", "):
            meanings[name] = " ".join(entry["text"].split()).removesuffix(".")
    return meanings
