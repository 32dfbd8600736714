"""The widgets of the page.

Functions add widgets to the page, and return them by the names of the fields of a `PageState` that they show.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import viser

from arc_suite.animation import player_controls
from arc_suite.animation.clips.swaying import CHARACTERS, MAX_WEIGHT
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.picture_buttons import PictureButtons
from arc_suite.animation.studio.sketch import DEFAULT_CHOICE, Sketch
from arc_suite.animation.studio.states import POSE, VELOCITY, PageState
from arc_suite.animation.studio.thumbnails import palette_picture
from arc_suite.arenas import ARENAS
from arc_suite.bodies import generator, torsos
from arc_suite.cpg.selection import preset_names
from arc_suite.policies import POLICIES
from arc_suite.robots import gaits
from arc_suite.robots.spec import COLORS_EXAMPLE, MATERIALS, PALETTES
from arc_suite.tasks import TASKS

MAX_LINK_SLIDERS = 8
LENGTH_FACTORS = (0.5, 2.0)  # lowest and highest factor of a length
LENGTH_FACTOR_STEP = 0.05
_MAX_KICKS = 3.0  # sqrt(g h)
MAX_SEED = 2**32 - 1
USUAL_CHARACTER = "usual"  # stands for the slider of the weight


class _Slider(NamedTuple):
    """A slider of a number of a sketch.

    Attributes:
        field: name of the number.
        label: label that visitors see.
        low: lowest number.
        high: highest number.
        step: between two numbers.
    """

    field: str
    label: str
    low: float
    high: float
    step: float


_PROPORTIONS = (
    _Slider("scale", "Size", 0.25, 4.0, 0.05),
    _Slider("length", "Torso length", *LENGTH_FACTORS, LENGTH_FACTOR_STEP),
    _Slider("width", "Torso width", *LENGTH_FACTORS, LENGTH_FACTOR_STEP),
    _Slider("thickness", "Torso thickness", *LENGTH_FACTORS, LENGTH_FACTOR_STEP),
    _Slider("fan", "Fan of the legs", -40.0, 40.0, 1.0),  # degrees
)


def add_source(gui: viser.GuiApi, sketch: Sketch) -> dict[str, Any]:
    """Add widgets for the source of the body, with the values of a sketch."""
    sources = PictureButtons(gui, "sources", "Body", sketches.sources(), columns=4, height=40)
    sources.show_choice(sketch.source)
    min_legs, max_legs = generator.LEG_RANGE
    min_links, max_links = generator.LINK_RANGE
    layouts = [DEFAULT_CHOICE, *generator.LAYOUTS]
    return {
        "source": sources,
        "legs": gui.add_slider("Legs", min=min_legs, max=max_legs, step=1, initial_value=sketch.legs),
        "links": gui.add_slider("Links", min=min_links, max=max_links, step=1, initial_value=sketch.links),
        "layout": gui.add_dropdown("Layout", layouts, initial_value=sketch.layout),
        "seed": gui.add_number("Seed", sketch.seed, min=0, max=MAX_SEED, step=1),
    }


def add_shape(gui: viser.GuiApi, sketch: Sketch) -> dict[str, Any]:
    """Add widgets for the body's torso, proportions and colors, with the values of a sketch."""
    widgets: dict[str, Any] = {}
    for field, names in torsos.PARTS.items():
        options = (DEFAULT_CHOICE, *names)
        widgets[field] = gui.add_dropdown(_label(field), options, initial_value=getattr(sketch, field))
    for field, label, low, high, step in _PROPORTIONS:
        value = getattr(sketch, field)
        widgets[field] = gui.add_slider(label, min=low, max=high, step=step, initial_value=value)
    palettes = PictureButtons(gui, "palettes", "Palette", (DEFAULT_CHOICE, *PALETTES), columns=6, height=16)
    palettes.show_pictures({palette: palette_picture(palette) for palette in PALETTES})
    hint = f"A palette, a seed, or colors of {', '.join(MATERIALS)}: {COLORS_EXAMPLE}"
    palettes.add_text_field("Colors", hint, default=DEFAULT_CHOICE)
    palettes.show_choice(sketch.palette)
    widgets["palette"] = palettes
    widgets["no_ornaments"] = gui.add_checkbox(
        "No ornaments", sketch.no_ornaments, hint="Without the eyes, tails and the like that weigh nothing"
    )
    return widgets


def add_task(gui: viser.GuiApi, sketch: Sketch) -> dict[str, Any]:
    """Add widgets for the task and the policy, with the values of a sketch."""
    tasks = list_with(sketch.task, TASKS)
    grounds = list_with(sketch.ground, ARENAS)
    gait_names = [DEFAULT_CHOICE, *gaits.NAMES]
    max_kicks = max(_MAX_KICKS, sketch.kicks)
    policies = list_with(sketch.policy, POLICIES)
    presets = list_with(sketch.preset, (DEFAULT_CHOICE, *preset_names()))
    return {
        "task": gui.add_dropdown("Task", tasks, initial_value=sketch.task),
        "ground": gui.add_dropdown("Ground", grounds, initial_value=sketch.ground),
        "gait": gui.add_dropdown("Gait", gait_names, initial_value=sketch.gait),
        "speed": gui.add_slider(
            "Speed", min=0.2, max=2.0, step=0.05, initial_value=sketch.speed, hint="Multiple of the body's own"
        ),
        "kicks": gui.add_slider(
            "Kicks", min=0.0, max=max_kicks, step=0.1, initial_value=sketch.kicks, hint="At most, sqrt(g h)"
        ),
        "settings": gui.add_text("Settings", sketch.settings, hint="Of the task, as a JSON object"),
        "policy": gui.add_dropdown("Policy", policies, initial_value=sketch.policy),
        "preset": gui.add_dropdown("Preset", presets, initial_value=sketch.preset),
    }


def add_velocity(gui: viser.GuiApi, state: PageState) -> dict[str, Any]:
    """Add widgets for the velocity by command, with the values of a state."""
    widgets: dict[str, Any] = {}
    widgets["by_hand"] = gui.add_checkbox("By hand", state.command.by_hand, hint="Else the task's own command")
    for name in VELOCITY:
        widgets[name] = gui.add_slider(_label(name), min=-1.0, max=1.0, step=0.05, initial_value=state.value(name))
    return widgets


def add_pose(gui: viser.GuiApi) -> dict[str, Any]:
    """Add widgets for the pose and the gait by command."""
    min_tempo, max_tempo = player_controls.TEMPO_RANGE
    gait_names = [player_controls.OWN_GAIT]  # the page adds those that suit the body
    widgets: dict[str, Any] = {
        "gait_now": gui.add_dropdown("Gait now", gait_names, initial_value=player_controls.OWN_GAIT),
        "tempo": gui.add_slider(
            "Frequency", min=min_tempo, max=max_tempo, step=0.05, initial_value=1.0, hint="Multiple of the gait's own"
        ),
    }
    for name in POSE:
        widgets[name] = gui.add_slider(
            _label(name), min=-1.0, max=1.0, step=0.01, initial_value=0.0, hint="Standing heights or rad"
        )
    return widgets


def add_length_factor(gui: viser.GuiApi) -> viser.GuiSliderHandle:
    """Add a slider of the factor of a length, without a label and hidden."""
    lowest, highest = LENGTH_FACTORS
    return gui.add_slider("", min=lowest, max=highest, step=LENGTH_FACTOR_STEP, initial_value=1.0, visible=False)


def add_weight(gui: viser.GuiApi) -> tuple[viser.GuiSliderHandle, viser.GuiDropdownHandle[str]]:
    """Add a slider of the weight of clips that are saved, and a list of characters, which replace it."""
    slider = gui.add_slider(
        "Weight of clips", min=0.0, max=MAX_WEIGHT, step=0.1, initial_value=1.0, hint="Multiple of the usual one"
    )
    characters = gui.add_dropdown(
        "Character", (USUAL_CHARACTER, *CHARACTERS), hint="How the body carries its weight; usual: by the slider"
    )
    return slider, characters


def list_with(choice: str, names: Iterable[str]) -> list[str]:
    """Return names for a list to choose from; the present choice comes last if it is not among them."""
    return list(dict.fromkeys((*names, choice)))


def set_value(widget: Any, value: Any) -> None:
    """Have a widget show a value, or what is nearest to it among the values that the widget offers."""
    if isinstance(widget, PictureButtons):
        widget.show_choice(value)
        return
    if isinstance(widget, viser.GuiSliderHandle):
        value = min(max(value, widget.min), widget.max)
    elif isinstance(widget, viser.GuiDropdownHandle) and value not in widget.options:
        value = DEFAULT_CHOICE
    widget.value = value


def set_visible(widget: Any, visible: bool) -> None:
    """Show or hide a widget."""
    if widget.visible != visible:  # viser would send a value that stays the same, too
        widget.visible = visible


def _label(name: str) -> str:
    return name.replace("_", " ").capitalize()
