"""Texts of the page, as HTML: status of the walk, flaws of the body, lines to copy."""

from xml.etree import ElementTree

from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.creature import Creature
from arc_suite.animation.studio.session import Session, Walker
from arc_suite.animation.studio.sketch import Sketch

_REAL_TIME_PACE = 0.97  # simulated seconds a second, from which a walk counts as being in real time
_SMALL_STYLE = "font-size:0.85em"
_INDENT_STYLE = "padding:0 0.8em"  # the distance of widgets from the edges
_BUTTON_STYLE = (  # that of viser's outlined buttons
    "min-height:26px;padding:0 1em;font-size:0.85em;cursor:pointer;background:none;border:1px solid;"
    "color:var(--mantine-primary-color-filled)"
)
# viser's sheet of widgets leaves a third of a phone's width, and its controls are 7 to 26 px high.
_STYLE_SHEET = """
@media (max-width: 36em) { [style*="width: 20em"] { width: 100% !important } }
@media (pointer: coarse) {
  button { min-width: 40px !important; min-height: 40px !important }
  input.mantine-Input-input { height: 36px !important; min-height: 36px !important }
  .mantine-Checkbox-inner, .mantine-Checkbox-input { width: 28px !important; height: 28px !important }
  .mantine-Checkbox-icon { width: 60% !important }
  .mantine-Slider-root { padding-block: 12px !important }
  .mantine-Slider-trackContainer { margin-block: -12px; height: 36px !important }
  .mantine-Slider-thumb { width: 16px !important; height: 28px !important }
}
"""
# Browsers offer a clipboard only to pages of the same machine. On other pages the script just selects the text.
_COPY_SCRIPT = (
    "const text = this.nextElementSibling; getSelection().selectAllChildren(text);"
    "navigator.clipboard?.writeText(text.textContent)"
)


def status(session: Session) -> str:
    """Return lines about the walk and the machine, as HTML; the first line is the error, if there is one."""
    rows = {"walks": _describe_walk(session.walker)}
    if session.companion is not None:
        rows["kept"] = _describe_walk(session.companion)
    episodes = session.episodes
    rows["return"] = f"{episodes.episode_return:.0f} in {episodes.steps * episodes.control_timestep:.1f} s"
    rows["pace"] = _describe_pace(session)

    lines = [_element("tr", _element("td", name), _element("td", value)) for name, value in rows.items()]
    table = _element("table", *lines, id="status")
    errors = [_element("p", session.error, role="alert", style="color:#b3261e")] if session.error else []
    return _html(_element("div", *errors, table, style=f"{_SMALL_STYLE};padding:0 1em 0.6em"))


def _describe_walk(walker: Walker) -> str:
    setup = walker.creature.setup
    history = walker.history
    speed = history.speeds()[-1] if len(history) else 0.0
    return f"{setup.body.name}, {setup.kind.name}, {speed:.2f} m/s"


def _describe_pace(session: Session) -> str:
    if session.paused:
        return "paused"
    if session.pace > _REAL_TIME_PACE:
        return "real time"
    return f"{session.pace:.2f} of real time"


def flaws(creature: Creature) -> str:
    """Return the flaws that `arc-suite check` finds in the body, as HTML."""
    lines = [flaw.text for flaw in creature.flaws]
    if not lines:
        lines = [f"{creature.setup.body.name} stands and can take steps"]
    items = [_element("li", text) for text in lines]
    return _html(_element("ul", *items, style=_SMALL_STYLE))


def lines_to_copy(sketch: Sketch) -> str:
    """Return the Python lines and the command line that make the same creature, with buttons to copy them, as HTML."""
    texts = {"Python": sketches.python_lines(sketch), "command": sketches.command_line(sketch)}
    elements = []
    for name, text in texts.items():
        elements.append(_element("button", f"Copy {name}", onclick=_COPY_SCRIPT, style=_BUTTON_STYLE))
        elements.append(_element("pre", text, style=f"white-space:pre-wrap;{_SMALL_STYLE}"))
    return _html(_element("div", *elements, style=_INDENT_STYLE))


def style_sheet() -> str:
    """Return styles for narrow windows and for fingers, as HTML."""
    return _html(_element("style", _STYLE_SHEET))


def paragraph(text: str) -> str:
    """Return a paragraph of text, as HTML."""
    return _html(_element("p", text, style=f"{_SMALL_STYLE};{_INDENT_STYLE}"))


def _element(tag: str, *content: str | ElementTree.Element, **attributes: str) -> ElementTree.Element:
    """Return an element that holds a text or other elements."""
    element = ElementTree.Element(tag, attributes)
    for item in content:
        if isinstance(item, str):
            element.text = item
        else:
            element.append(item)
    return element


def _html(element: ElementTree.Element) -> str:
    return ElementTree.tostring(element, encoding="unicode", method="html")
