"""Texts of the page, as HTML: the walk, what `check` says, lines to copy."""

from xml.etree import ElementTree

from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.creature import Creature
from arc_suite.animation.studio.session import Session, Walker
from arc_suite.animation.studio.sketch import Sketch

_REAL = 0.97  # of real time, from which the pace is called so
_SMALL = "font-size:0.85em"
_INDENTED = "padding:0 0.8em"  # as far from the edges as widgets are
_BUTTON = (  # as viser's own look that are outlined
    "min-height:26px;padding:0 1em;font-size:0.85em;cursor:pointer;background:none;border:1px solid;"
    "color:var(--mantine-primary-color-filled)"
)
# viser's sheet of widgets leaves a third of a phone's width, and its controls are 7 to 26 px high.
_STYLES = """
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
# Browsers have a clipboard on pages of this machine alone; on others the text is selected.
_COPY = (
    "const text = this.nextElementSibling; getSelection().selectAllChildren(text);"
    "navigator.clipboard?.writeText(text.textContent)"
)


def status(session: Session) -> str:
    """Return lines about the walk and the machine, as HTML; the first is the error, if there is one."""
    episodes = session.episodes
    pace = "paused" if session.paused else "real time" if session.pace > _REAL else f"{session.pace:.2f} of real time"
    told = {
        "walks": _walk(session.walker),
        **({} if session.kept is None else {"kept": _walk(session.kept)}),
        "return": f"{episodes.episode_return:.0f} in {episodes.steps * episodes.control_timestep:.1f} s",
        "pace": pace,
    }
    lines = [_element("tr", _element("td", name), _element("td", value)) for name, value in told.items()]
    error = [_element("p", session.error, role="alert", style="color:#b3261e")] if session.error else []
    return _html(_element("div", *error, _element("table", *lines, id="status"), style=f"{_SMALL};padding:0 1em 0.6em"))


def _walk(walker: Walker) -> str:
    setup, history = walker.creature.setup, walker.history
    return f"{setup.body.name}, {setup.kind.name}, {history.speeds()[-1] if len(history) else 0.0:.2f} m/s"


def checked(creature: Creature) -> str:
    """Return what `arc-suite check` says of the body, as HTML."""
    texts = [flaw.text for flaw in creature.flaws] or [f"{creature.setup.body.name} stands and can take steps"]
    return _html(_element("ul", *(_element("li", text) for text in texts), style=_SMALL))


def copied(sketch: Sketch) -> str:
    """Return the Python lines and the command line that make the same, with buttons that copy them, as HTML."""
    texts = {"Python": sketches.python_lines(sketch), "command": sketches.command_line(sketch)}
    parts = []
    for name, text in texts.items():
        parts.append(_element("button", f"Copy {name}", onclick=_COPY, style=_BUTTON))
        parts.append(_element("pre", text, style=f"white-space:pre-wrap;{_SMALL}"))
    return _html(_element("div", *parts, style=_INDENTED))


def styles() -> str:
    """Return styles for narrow windows and for fingers, as HTML."""
    return _html(_element("style", _STYLES))


def line(text: str) -> str:
    """Return a line of text, as HTML."""
    return _html(_element("p", text, style=f"{_SMALL};{_INDENTED}"))


def _element(tag: str, *inside: str | ElementTree.Element, **attributes: str) -> ElementTree.Element:
    """An element with a text or with elements inside."""
    element = ElementTree.Element(tag, attributes)
    for each in inside:
        if isinstance(each, str):
            element.text = each
        else:
            element.append(each)
    return element


def _html(element: ElementTree.Element) -> str:
    return ElementTree.tostring(element, encoding="unicode", method="html")
