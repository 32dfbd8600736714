"""Parts of Markdown pages, as text."""

import inspect
from collections.abc import Iterable, Mapping, Sequence
from xml.etree.ElementTree import Element, indent, tostring


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


def summary(documented) -> str:
    """Return the first paragraph of a docstring in one line."""
    paragraph, _, _ = inspect.getdoc(documented).partition("\n\n")
    return " ".join(paragraph.split())
