"""Charts of a walk in viser: reward by term, foot contacts against the schedule, speed."""

import numpy as np
import viser
from PIL import Image, ImageColor, ImageDraw, ImageFont

from arc_suite.animation.colors import BLUE, INK, PALE, VERMILION, term_colors
from arc_suite.animation.studio.history import History

_HEIGHT = 190  # of a chart, pixels
_CELL, _LINE, _MARGIN = 4, 14, 74  # of the picture of contacts: width of a step, height of a foot, of names, pixels
_STEPS = 80  # control steps in that picture


class Charts:
    """Charts in viser's panel of now."""

    def __init__(self, gui: viser.GuiApi):
        """Add empty charts."""
        self._gui = gui
        self._rewards: dict[tuple[str, ...], viser.GuiUplotHandle] = {}
        self._folder = gui.add_folder("Reward by term")
        with gui.add_folder("Foot contacts against the gait"):
            self._contacts = gui.add_image(contacts_image(None, ()), format="png")
        with gui.add_folder("Speed, m/s"):
            nothing = np.zeros(1)
            series = ({"label": "s"}, *_series({"torso": BLUE, "command": VERMILION}))
            self._speed = gui.add_uplot((nothing, nothing, nothing), series, height=_HEIGHT, **_OPTIONS)

    def update(self, history: History, names: tuple[str, ...]) -> None:
        """Draw the last steps.

        Args:
            history: of the walk.
            names: of the legs.
        """
        if not len(history):
            return
        times, terms = history.times, history.terms()
        self._reward(tuple(terms)).data = (times, *terms.values())
        speeds, desired = history.speeds(), history.desired()
        self._speed.data = (times, speeds, np.where(np.isnan(desired), speeds, desired))  # without a command, one line
        self._contacts.image = contacts_image(history.contacts(), names)

    def _reward(self, terms: tuple[str, ...]) -> viser.GuiUplotHandle:
        """Return the chart of terms, and hide those of others.

        None is removed: a browser that is late applies updates of a widget after it has removed the widget.
        """
        if terms not in self._rewards:
            series, empty = ({"label": "s"}, *_series(term_colors(terms))), (np.zeros(1),) * (1 + len(terms))
            with self._folder:
                self._rewards[terms] = self._gui.add_uplot(empty, series, height=_HEIGHT + 60, **_OPTIONS)
        for each, chart in self._rewards.items():
            chart.visible = each == terms
        return self._rewards[terms]


def contacts_image(contacts: tuple[np.ndarray, np.ndarray] | None, names: tuple[str, ...]) -> np.ndarray:
    """Return a picture of foot contacts: blue where stance is scheduled, vermilion elsewhere, pale for the schedule.

    Args:
        contacts: which feet stand and which the gait wants there, (steps, feet) booleans each; None without a gait.
        names: of the legs.

    Returns:
        (height, width, 3) uint8, a line a leg, time from left to right.
    """
    size = _MARGIN + _STEPS * _CELL, max(1, len(names)) * _LINE
    picture = Image.new("RGB", size, "white")
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(10)
    if contacts is None:
        draw.text((2, 2), "no gait", INK, font)
        return np.asarray(picture)
    stance, schedule = (each[-_STEPS:] for each in contacts)
    colors = np.array([[ImageColor.getrgb(color) for color in pair] for pair in (("white", PALE), (VERMILION, BLUE))])
    cells = colors[stance.astype(int), schedule.astype(int)].astype(np.uint8).transpose(1, 0, 2)
    cells = cells.repeat(_LINE, axis=0).repeat(_CELL, axis=1)
    cells[::_LINE] = 255  # a gap between lines
    picture.paste(Image.fromarray(cells), (size[0] - cells.shape[1], 0))
    for index, name in enumerate(names):
        draw.text((2, index * _LINE + 1), name[:12], INK, font)
    return np.asarray(picture)


# Without space above, a number at the top of an axis is cut.
_OPTIONS: dict = {"scales": {"x": {"time": False}}, "legend": {"live": False}, "padding": (8, 24, 0, 0)}


def _series(colors: dict[str, str]) -> list[dict]:
    return [{"label": name, "stroke": color, "width": 1.5} for name, color in colors.items()]
