"""A hand in a page to play in: a walking body is lifted by the pointer, in Chromium, on a clock of its own.

Pictures follow each other by a fixed time, however long the browser draws. So the film is the same at every run.
"""

import io
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw

from arc_suite.animation import play_pages
from arc_suite.registry import body_of
from media.views import FPS

_FLAGS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")  # no graphics card needed
_PATIENCE = 240_000  # ms
# The page's clock stands until `goOn` is called.
_CLOCK = """
let now = 0, waiting = [];
performance.now = () => now;
window.requestAnimationFrame = (call) => waiting.push(call);
window.goOn = (ms) => { const due = waiting; waiting = []; now += ms; for (const call of due) call(now); };
"""
_LOWER = 0.035  # of the window's height, by which the pointer lowers the camera, for a horizon
# Where the torso is in the window, pixels.
_TORSO = """() => {
const { parts, view } = play.state.play, { x, y } = parts[0].position.clone().project(view.camera);
return [(1 + x) / 2 * innerWidth, (1 - y) / 2 * innerHeight]; }"""
# Corners of an arrow, pixels from its tip, for a picture 720 pixels high.
_ARROW = ((0, 0), (0, 34), (8, 27), (13, 39), (19, 36), (14, 25), (24, 25))
_ARROW_COLORS = {False: "#ffffff", True: "#ffd23f"}  # by whether its button is down


class Hand(NamedTuple):
    """A body that walks, and a pointer that lifts it.

    Attributes:
        robot: name of the body.
        before: seconds that it walks before the film.
        path: (time, x, y, is down) of the pointer: seconds of the film, shares of the width and height from the torso
            at the moment when the button goes down; straight lines between them.
        seconds: duration of the film.
    """

    robot: str
    before: float
    path: Sequence[tuple[float, float, float, bool]]
    seconds: float

    @property
    def frames(self) -> int:
        """Number of frames of the film."""
        return round(self.seconds * FPS)


def pictures_of(hand: Hand, size: tuple[int, int]) -> Iterator[np.ndarray]:
    """Yield the pictures (height, width, 3) of a film.

    Raises:
        ImportError: playwright is not installed.
        ValueError: the page has not been built, or there is no Chromium.
    """
    from playwright.sync_api import sync_playwright

    chromium = shutil.which("chromium") or shutil.which("google-chrome")
    if chromium is None:
        raise ValueError("no Chromium here: apt-get install chromium")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as running:
        path = Path(folder) / "play.html"
        path.write_text(play_pages.page([play_pages.creature(body_of(hand.robot))]), encoding="utf-8")
        browser = running.chromium.launch(executable_path=chromium, args=_FLAGS)
        width, height = size
        tab = browser.new_page(viewport={"width": width, "height": height})
        tab.set_default_timeout(_PATIENCE)
        tab.add_init_script(_CLOCK)
        tab.goto(path.as_uri())
        tab.wait_for_function("window.play", polling=100)  # ms; by default at pictures, whose clock stands
        yield from _film(hand, tab, size)
        browser.close()


def _film(hand: Hand, tab, size: tuple[int, int]) -> Iterator[np.ndarray]:
    """Yield the pictures of a film in an open page."""
    width, height = size
    tab.evaluate("for (const part of document.querySelectorAll('details')) part.open = false")
    tab.mouse.move(0.1 * width, 0.5 * height)
    tab.mouse.down()
    tab.mouse.move(0.1 * width, (0.5 - _LOWER) * height)  # turns the view
    tab.mouse.up()
    tab.keyboard.down("w")
    for _ in range(round(hand.before * FPS)):
        tab.evaluate(f"goOn({1000.0 / FPS})")
    is_down = False
    torso = tab.evaluate(_TORSO)
    for frame in range(hand.frames):
        *shares, goes_down = _look_up(hand.path, frame / FPS)
        if not is_down:
            torso = tab.evaluate(_TORSO)  # the pointer aims at it until it holds it
        pointer = [start + share * length for start, share, length in zip(torso, shares, size, strict=True)]
        tab.mouse.move(*pointer)
        if goes_down != is_down:
            (tab.mouse.down if goes_down else tab.mouse.up)()
            is_down = goes_down
        tab.evaluate(f"goOn({1000.0 / FPS})")
        picture = Image.open(io.BytesIO(tab.screenshot(type="png"))).convert("RGB")
        yield _add_pointer(picture, pointer, is_down)


def _look_up(path: Sequence[tuple[float, float, float, bool]], time: float) -> tuple[float, float, bool]:
    """Return place and button of a path at a time, s."""
    times, across, down, buttons = zip(*path, strict=True)
    last = max(np.searchsorted(times, time, side="right") - 1, 0)
    return float(np.interp(time, times, across)), float(np.interp(time, times, down)), buttons[last]


def _add_pointer(picture: Image.Image, place: Sequence[float], is_down: bool) -> np.ndarray:
    """Return the picture (height, width, 3) with a pointer, whose tip is at a place, pixels."""
    scale = picture.height / 720.0
    corners = [(place[0] + scale * x, place[1] + scale * y) for x, y in _ARROW]
    drawing = ImageDraw.Draw(picture)
    drawing.polygon(corners, fill=_ARROW_COLORS[is_down], outline="#1d232b", width=round(2 * scale))
    return np.asarray(picture)
