"""Charts of a walk in viser: reward by term, foot contacts against the schedule, speed."""

import numpy as np
import viser
from PIL import Image, ImageColor, ImageDraw, ImageFont

from arc_suite.animation.colors import BLUE, INK, PALE, VERMILION, term_colors
from arc_suite.animation.studio.history import History

_CHART_HEIGHT = 190  # pixels
_REWARD_CHART_HEIGHT = 250  # pixels; its legend is longer
_STEP_WIDTH = 4  # pixels of a control step in the picture of contacts
_LEG_HEIGHT = 14  # pixels of a leg in the picture of contacts
_NAME_WIDTH = 74  # pixels of the legs' names in the picture of contacts
_MAX_NAME_LENGTH = 12  # characters
_PICTURE_STEPS = 80  # control steps in the picture of contacts
_EMPTY_AXIS = np.zeros(1)  # the values of a chart without data

# Without space above, a number at the top of an axis is cut.
_CHART_OPTIONS: dict = {"scales": {"x": {"time": False}}, "legend": {"live": False}, "padding": (8, 24, 0, 0)}


class Charts:
    """Charts in the present container of viser's page."""

    def __init__(self, gui: viser.GuiApi):
        """Add empty charts."""
        self._gui = gui
        self._reward_charts: dict[tuple[str, ...], viser.GuiUplotHandle] = {}  # by names of the terms
        self._reward_folder = gui.add_folder("Reward by term", expand_by_default=False)
        with gui.add_folder("Foot contacts against the gait"):
            self._contacts = gui.add_image(contacts_image(None, ()), format="png")
        with gui.add_folder("Speed, m/s"):
            self._speed = self._add_chart({"torso": BLUE, "command": VERMILION}, _CHART_HEIGHT)

    def update(self, history: History, leg_names: tuple[str, ...]) -> None:
        """Draw the last control steps.

        Args:
            history: history of the walk.
            leg_names: in the order of the feet in the history.
        """
        if not len(history):
            return
        times = history.times
        terms = history.terms()
        self._show_reward_chart(tuple(terms)).data = (times, *terms.values())
        speeds = history.speeds()
        desired_speeds = history.desired_speeds()
        # Where there is no command, the line of the command lies on that of the torso.
        self._speed.data = (times, speeds, np.where(np.isnan(desired_speeds), speeds, desired_speeds))
        self._contacts.image = contacts_image(history.contacts(), leg_names)

    def _show_reward_chart(self, terms: tuple[str, ...]) -> viser.GuiUplotHandle:
        """Show the chart of these terms, add it if need be, and hide the charts of other terms.

        No chart is removed: a slow browser would apply updates of a chart after it has removed the chart.
        """
        if terms not in self._reward_charts:
            with self._reward_folder:
                self._reward_charts[terms] = self._add_chart(term_colors(terms), _REWARD_CHART_HEIGHT)
        for chart_terms, chart in self._reward_charts.items():
            chart.visible = chart_terms == terms
        return self._reward_charts[terms]

    def _add_chart(self, colors: dict[str, str], height: int) -> viser.GuiUplotHandle:
        """Add an empty chart over time with a line for each color, by label; the height is in pixels."""
        lines = [{"label": label, "stroke": color, "width": 1.5} for label, color in colors.items()]
        series = ({"label": "s"}, *lines)
        empty_data = (_EMPTY_AXIS,) * len(series)
        return self._gui.add_uplot(empty_data, series, height=height, **_CHART_OPTIONS)


def contacts_image(contacts: tuple[np.ndarray, np.ndarray] | None, leg_names: tuple[str, ...]) -> np.ndarray:
    """Return a picture of foot contacts: a line for each leg, time from left to right.

    Scheduled stance is blue, other stance is vermilion, and a schedule without stance is pale.

    Args:
        contacts: which feet are in stance and which the gait schedules so, (steps, feet) booleans each; None without a
            gait.
        leg_names: in the order of the feet.

    Returns:
        (height, width, 3) uint8.
    """
    width = _NAME_WIDTH + _PICTURE_STEPS * _STEP_WIDTH
    height = max(1, len(leg_names)) * _LEG_HEIGHT
    picture = Image.new("RGB", (width, height), "white")
    draw = ImageDraw.Draw(picture)
    font = ImageFont.load_default(10)
    if contacts is None:
        draw.text((2, 2), "no gait", INK, font)
        return np.asarray(picture)
    cells = _contact_colors(*contacts)
    picture.paste(Image.fromarray(cells), (width - cells.shape[1], 0))
    for index, name in enumerate(leg_names):
        draw.text((2, index * _LEG_HEIGHT + 1), name[:_MAX_NAME_LENGTH], INK, font)
    return np.asarray(picture)


def _contact_colors(stance: np.ndarray, schedule: np.ndarray) -> np.ndarray:
    """Return the pixels (height, width, 3) uint8 of the last control steps.

    Args:
        stance: (steps, feet) booleans.
        schedule: (steps, feet) booleans.
    """
    colors_by_contact = (("white", PALE), (VERMILION, BLUE))  # [is in stance][is scheduled]
    rgb_by_contact = np.array([[ImageColor.getrgb(color) for color in colors] for colors in colors_by_contact])
    is_stance = stance[-_PICTURE_STEPS:].astype(int)
    is_scheduled = schedule[-_PICTURE_STEPS:].astype(int)
    cells = rgb_by_contact[is_stance, is_scheduled].astype(np.uint8).transpose(1, 0, 2)  # (feet, steps, 3)
    pixels = cells.repeat(_LEG_HEIGHT, axis=0).repeat(_STEP_WIDTH, axis=1)
    pixels[::_LEG_HEIGHT] = 255  # a gap between legs
    return pixels
