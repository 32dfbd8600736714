"""The widgets of the page, by the fields of a state that they show."""

from collections.abc import Iterable
from typing import Any

import viser

from arc_suite.animation import player_controls
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.sketch import DEFAULT_CHOICE, Sketch
from arc_suite.animation.studio.states import POSE, VELOCITY, PageState
from arc_suite.arenas import ARENAS
from arc_suite.bodies import generator
from arc_suite.cpg.selection import preset_names
from arc_suite.policies import POLICIES
from arc_suite.robots import gaits
from arc_suite.robots.spec import PALETTES
from arc_suite.tasks import TASKS

LINKS = 8  # sliders of links, at most
FACTORS = (0.5, 2.0, 0.05)  # of a length: least, most and step
_PROPORTIONS = (
    ("scale", "Size", 0.25, 4.0, 0.05),
    ("length", "Torso length", *FACTORS),
    ("width", "Torso width", *FACTORS),
    ("thickness", "Torso thickness", *FACTORS),
    ("fan", "Fan of the legs", -40.0, 40.0, 1.0),
)


def source(gui: viser.GuiApi, first: Sketch) -> dict[str, Any]:
    """Add where the body comes from."""
    return {
        "source": gui.add_dropdown("Body", list_with(first.source, sketches.sources()), initial_value=first.source),
        "legs": gui.add_slider("Legs", *generator.LEGS, 1, first.legs),
        "links": gui.add_slider("Links", *generator.LINKS, 1, first.links),
        "layout": gui.add_dropdown("Layout", [DEFAULT_CHOICE, *generator.LAYOUTS], initial_value=first.layout),
        "seed": gui.add_number("Seed", first.seed, min=0, max=2**32 - 1, step=1),
    }


def shape(gui: viser.GuiApi, first: Sketch) -> dict[str, Any]:
    """Add the body's proportions and colors."""
    sliders = {
        name: gui.add_slider(label, low, high, step, getattr(first, name))
        for name, label, low, high, step in _PROPORTIONS
    }
    palettes = list_with(first.palette, (DEFAULT_CHOICE, *PALETTES))
    return sliders | {"palette": gui.add_dropdown("Palette", palettes, initial_value=first.palette)}


def task(gui: viser.GuiApi, first: Sketch) -> dict[str, Any]:
    """Add the task and who acts."""
    most, presets = max(3.0, first.kicks), list_with(first.preset, (DEFAULT_CHOICE, *preset_names()))
    return {
        "task": gui.add_dropdown("Task", list_with(first.task, TASKS), initial_value=first.task),
        "ground": gui.add_dropdown("Ground", list_with(first.ground, ARENAS), initial_value=first.ground),
        "gait": gui.add_dropdown("Gait", [DEFAULT_CHOICE, *gaits.NAMES], initial_value=first.gait),
        "speed": gui.add_slider("Speed", 0.2, 2.0, 0.05, first.speed, hint="Multiple of the body's own"),
        "kicks": gui.add_slider("Kicks", 0.0, most, 0.1, first.kicks, hint="At most, sqrt(g h)"),
        "settings": gui.add_text("Settings", first.settings, hint="Of the task, as a JSON object"),
        "policy": gui.add_dropdown("Policy", list_with(first.policy, POLICIES), initial_value=first.policy),
        "preset": gui.add_dropdown("Preset", presets, initial_value=first.preset),
    }


def velocity(gui: viser.GuiApi, first: PageState) -> dict[str, Any]:
    """Add the velocity by command."""
    by_hand = gui.add_checkbox("By hand", first.command.by_hand, hint="Else the task's own command")
    sliders = {name: gui.add_slider(_label(name), -1.0, 1.0, 0.05, first.value(name)) for name in VELOCITY}
    return {"by_hand": by_hand} | sliders


def pose(gui: viser.GuiApi) -> dict[str, Any]:
    """Add pose and gait by command."""
    gait = gui.add_dropdown("Gait now", [player_controls.OWN_GAIT], initial_value=player_controls.OWN_GAIT)
    tempo = gui.add_slider("Frequency", *player_controls.TEMPO_RANGE, 0.05, 1.0, hint="Multiple of the gait's own")
    hint = "Standing heights or rad"
    sliders = {name: gui.add_slider(_label(name), -1.0, 1.0, 0.01, 0.0, hint=hint) for name in POSE}
    return {"gait_now": gait, "tempo": tempo} | sliders


def list_with(chosen: str, names: Iterable[str]) -> list[str]:
    """Return names for a list to choose from, with the chosen one."""
    return list(dict.fromkeys((*names, chosen)))


def _label(name: str) -> str:
    return name.replace("_", " ").capitalize()
