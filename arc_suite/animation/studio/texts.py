"""Texts of the page, as HTML: status of the walk, flaws of the body, lines to copy."""

import time
from collections.abc import Sequence
from xml.etree import ElementTree

from arc_suite.animation.studio import copy_lines
from arc_suite.animation.studio.creature import Creature
from arc_suite.animation.studio.session import Session, Walker
from arc_suite.animation.studio.sketch import Sketch, make_body

_REAL_TIME_PACE = 0.97  # simulated seconds a second, from which a walk counts as being in real time
_SMALL_STYLE = "font-size:0.85em"
_INDENT_STYLE = "padding:0 0.8em"  # the distance of widgets from the edges
_BUTTON_STYLE = (  # that of viser's outlined buttons
    "min-height:26px;padding:0 1em;font-size:0.85em;cursor:pointer;background:none;border:1px solid;"
    "color:var(--mantine-primary-color-filled)"
)
# viser's sheet of widgets leaves a third of a phone's width and takes most of its height. Its controls are 7 to 26 px
# high.
# An error is at the top of the window, next to the sheet, as the sheet may be scrolled down to the wrong value.
_STYLE_SHEET = """
.studio-error {
  position: fixed; inset: 0 24em auto 0; z-index: 1000; margin: 0; padding: 0.8em; background: #b3261e; color: white;
  overflow-wrap: anywhere
}
@media (max-width: 36em) {
  .studio-error { right: 0 }
  [style*="width: 20em"] { width: 100% !important }
  [style*="max-height: 60%"] { max-height: 34% !important }
}
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
_EMPTY_PICTURE = "data:image/gif;base64,R0lGODlhAQABAAAAACH5BAEKAAEALAAAAAABAAEAAAICTAEAOw=="
_STOP_NOTE = "The studio has stopped. Start it again, and open the address that it prints."
_STOP_STYLE = (
    "position:fixed;inset:0 0 auto 0;z-index:1000;padding:0.8em;background:#b3261e;color:white;text-align:center"
)
# The status has another beat each second. A window in the background may look less often.
_WATCH_SCRIPT = f"""
window.studioWatch ??= setInterval(() => {{
  const beat = document.getElementById("status")?.dataset.beat, state = window.studioState ??= {{ note: null }};
  if (beat && beat !== state.beat) Object.assign(state, {{ beat, time: Date.now() }});
  const stopped = state.beat && Date.now() - state.time > 8000 && !document.hidden;
  if (stopped && !state.note) {{
    state.note = document.createElement("div");
    Object.assign(state.note, {{ role: "alert", textContent: "{_STOP_NOTE}" }});
    state.note.style.cssText = "{_STOP_STYLE}";
    document.body.append(state.note);
  }} else if (!stopped) {{
    state.note?.remove();
    state.note = null;
  }}
}}, 1000)
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
    beat = str(round(time.monotonic()))  # by which the page knows that the studio runs
    table = _element("table", *lines, id="status", **{"data-beat": beat})
    errors = [_element("p", session.error, role="alert", **{"class": "studio-error"})] if session.error else []
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
    texts = {"Python": copy_lines.python_lines(sketch), "command": copy_lines.command_line(sketch)}
    elements = []
    spec_file = copy_lines.spec_file_name(make_body(sketch))
    if any(spec_file in text for text in texts.values()):
        elements.append(_element("p", f"Save the spec first: these lines read {spec_file}.", style=_SMALL_STYLE))
    for name, text in texts.items():
        elements.append(_element("button", f"Copy {name}", onclick=_COPY_SCRIPT, style=_BUTTON_STYLE))
        elements.append(_element("pre", text, style=f"white-space:pre-wrap;overflow-wrap:anywhere;{_SMALL_STYLE}"))
    return _html(_element("div", *elements, style=_INDENT_STYLE))


def style_sheet() -> str:
    """Return styles for narrow windows and for fingers, as HTML."""
    return _html(_element("style", _STYLE_SHEET))


def picture_styles(key: str, pictures: Sequence[str], choice: int | None, columns: int, height: int) -> str:
    """Return styles that show pictures on the group of buttons that follows, as HTML.

    Args:
        key: unique in the page.
        pictures: values of CSS, one for each button.
        choice: index of the button to mark; None for none.
        columns: buttons of a row.
        height: height of a picture, pixels.
    """
    group = f"div:has(> #pictures-{key}) + div"
    rules = [
        f"{group} > .mantine-Flex-root {{ flex-direction: column; align-items: stretch !important }}",
        f"{group} button {{ flex: 0 0 calc({100.0 / columns:g}% - 6px) !important; min-width: 0 !important;"
        f" padding: {height + 3}px 0 0 !important; height: {height + 22}px !important;"
        f" background: center 3px / auto {height}px no-repeat }}",
        f"{group} button .mantine-Button-label {{ font-size: 10px; letter-spacing: -0.8px }}",
    ]
    for number, image in enumerate(pictures, start=1):
        rules.append(f"{group} button:nth-child({number}) {{ background-image: {image} }}")
    if choice is not None:
        rules.append(f"{group} button:nth-child({choice + 1}) {{ outline: 2px solid }}")
    return _html(_element("style", "\n".join(rules), id=f"pictures-{key}"))


def watch() -> str:
    """Return a script that tells visitors when the studio has stopped, as HTML."""
    return _html(_element("img", src=_EMPTY_PICTURE, alt="", onload=_WATCH_SCRIPT, style="display:none"))


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
