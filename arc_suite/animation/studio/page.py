"""The page: viser's widgets around a session; all visitors share them."""

import contextlib
import functools
import io
import itertools
import math
import random
import socket
import threading
import time
from collections.abc import Callable, Iterable
from typing import Any

import viser

from arc_suite.animation import direction
from arc_suite.animation.studio import saving, texts
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.charts import Charts
from arc_suite.animation.studio.creature import Creature
from arc_suite.animation.studio.gate import Server
from arc_suite.animation.studio.session import Session
from arc_suite.animation.studio.sketch import LEGS, OWN, RANDOM, Sketch, cured, lengthened, opened_file
from arc_suite.animation.studio.states import POSE, VELOCITY, Edits, State, edited, redone, undone
from arc_suite.animation.studio.view import View
from arc_suite.arenas import ARENAS
from arc_suite.cpg.selection import preset_names, presets_of
from arc_suite.policies import POLICIES
from arc_suite.robots import gaits, generator
from arc_suite.robots.spec import PALETTES
from arc_suite.robots.spec_files import MAX_IMPORTED
from arc_suite.simulation.opengl import RenderingUnavailable
from arc_suite.tasks import TASKS

_CHARTS_EVERY = 0.25  # s
_PRESS = 0.25  # of the body's own speed, by which a key changes the command
_LINKS = 8  # sliders of links, at most
_PROPORTIONS = (
    ("scale", "Size", 0.25, 4.0, 0.05),
    ("length", "Torso length", 0.5, 2.0, 0.05),
    ("width", "Torso width", 0.5, 2.0, 0.05),
    ("thickness", "Torso thickness", 0.5, 2.0, 0.05),
    ("fan", "Fan of the legs", -40.0, 40.0, 1.0),
)
_KEYS = (
    ("Faster", "I", ("forward", _PRESS)),
    ("Slower", "K", ("forward", -_PRESS)),
    ("Turn left", "J", ("turn", _PRESS)),
    ("Turn right", "L", ("turn", -_PRESS)),
    ("To the left", "U", ("left", _PRESS)),
    ("To the right", "O", ("left", -_PRESS)),
)
_KEYS_TOLD = ", ".join(f"{key} {label.lower()}" for label, key, _ in _KEYS)


def serve(session: Session, host: str, port: int, tell: Callable[[str], None]) -> None:
    """Serve the page until the session is closed or the keyboard interrupts.

    Args:
        session: to show and change.
        host: address to listen on.
        port: to listen on; the next free one if it is taken.
        tell: called with the address of the page.

    Raises:
        ValueError: nothing can listen on the address.
    """
    try:
        socket.create_server((host, 0)).close()  # viser would wait forever
    except OSError as error:
        raise ValueError(f"host {host}: cannot listen there: {(error.strerror or str(error)).lower()}") from None
    with contextlib.redirect_stdout(io.StringIO()):  # viser's own banner
        server = Server(host=host, port=port, label="arc_suite studio", verbose=False)
    try:
        page = Page(server, session)
        tell(f"http://{host}:{server.get_port()}/?token={server.token}")
        session.run(page.show)
    finally:
        server.stop()


class Page:
    """Widgets, view and charts of a session."""

    def __init__(self, server: viser.ViserServer, session: Session):
        """Lay out the page."""
        self._gui, self._session, self._drawn = server.gui, session, -math.inf
        self._creature: Creature | None = None
        self._first = State(session.creature.sketch)
        self._edits, self._lock = Edits(self._first), threading.Lock()
        self._widgets: dict[str, Any] = {}  # by the fields of a `State` that they show
        self._links: tuple[str, ...] = ()
        self._cures: list[Any] = []
        self._view = View(server)
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.main_panel.dock_right()
        self._status = self._gui.add_html("")
        self._add_changes()
        tabs, first = self._gui.add_tab_group(), session.creature.sketch
        with tabs.add_tab("Body"):
            self._add_body(first)
        with tabs.add_tab("Task"):
            self._add_task(first)
        with tabs.add_tab("Command"):
            self._add_command()
        with tabs.add_tab("Files"):
            self._add_files()
        for name, widget in self._widgets.items():
            widget.on_update(functools.partial(self._changed, name))
        self._panel = panel = server.gui.add_panel()
        with panel.add_tab("Measured"):
            self._charts = Charts(self._gui)
        panel.dock_left()
        panel.set_width(330)

    def show(self, session: Session, share: float) -> None:
        """Send a state to all visitors, in the loop's thread; see `Session.run`."""
        if session.creature is not self._creature:
            self._creature = session.creature
            self._view.show(session.creature)
            self._fit(session.creature)
        self._view.pose(session.episodes.qpos(share), session.episodes.markers(share))
        if time.monotonic() - self._drawn > _CHARTS_EVERY:
            self._drawn = time.monotonic()
            self._status.content = texts.status(session)
            if self._panel.visible:
                self._charts.update(session.history, tuple(leg.name for leg in session.creature.setup.body.legs))

    def _add_changes(self) -> None:
        """Add undo, redo and reset, as buttons and as keys."""
        calls = {"Undo": self._undo, "Redo": self._redo, "Reset": self._reset}
        buttons = self._gui.add_button_group("Changes", tuple(calls), hint="Ctrl+Z, Ctrl+Shift+Z")
        buttons.on_click(lambda event: calls[event.target.value]())
        for label, modifier in (("Undo", "cmd/ctrl"), ("Redo", "cmd/ctrl+shift")):
            command = self._gui.add_command(label, hotkey="Z", modifier=modifier)
            command.on_trigger(lambda event, call=calls[label]: call())
        charts = self._gui.add_checkbox("Charts", True)
        charts.on_update(lambda event: setattr(self._panel, "visible", event.target.value))

    def _add_body(self, first: Sketch) -> None:
        gui, widgets = self._gui, self._widgets
        self._check = gui.add_folder("Check")
        sources = _listed(first.source, sketches.sources())
        widgets["source"] = gui.add_dropdown("Body", sources, initial_value=first.source)
        widgets["legs"] = gui.add_slider("Legs", *generator.LEGS, 1, first.legs)
        widgets["links"] = gui.add_slider("Links", *generator.LINKS, 1, first.links)
        widgets["layout"] = gui.add_dropdown("Layout", [OWN, *generator.LAYOUTS], initial_value=first.layout)
        widgets["seed"] = gui.add_number("Seed", first.seed, min=0, max=2**32 - 1, step=1)
        upload = gui.add_upload_button("Open a spec file", mime_type="application/json")
        upload.on_upload(self._uploaded)
        for name, label, low, high, step in _PROPORTIONS:
            widgets[name] = gui.add_slider(label, low, high, step, getattr(first, name))
        palettes = _listed(first.palette, (OWN, *PALETTES))
        widgets["palette"] = gui.add_dropdown("Palette", palettes, initial_value=first.palette)
        with gui.add_folder("Length of links"):
            self._lengths = [gui.add_slider("", 0.5, 2.0, 0.05, 1.0, visible=False) for _ in range(_LINKS)]
        for index, slider in enumerate(self._lengths):
            slider.on_update(functools.partial(self._lengthened, index))

    def _add_task(self, first: Sketch) -> None:
        gui, widgets = self._gui, self._widgets
        widgets["task"] = gui.add_dropdown("Task", _listed(first.task, TASKS), initial_value=first.task)
        widgets["ground"] = gui.add_dropdown("Ground", _listed(first.ground, ARENAS), initial_value=first.ground)
        widgets["gait"] = gui.add_dropdown("Gait", [OWN, *gaits.NAMES], initial_value=first.gait)
        widgets["speed"] = gui.add_slider("Speed", 0.2, 2.0, 0.05, first.speed, hint="Multiple of the body's own")
        most = max(3.0, first.kicks)
        widgets["kicks"] = gui.add_slider("Kicks", 0.0, most, 0.1, first.kicks, hint="At most, sqrt(g h)")
        widgets["settings"] = gui.add_text("Settings", first.settings, hint="Of the task, as a JSON object")
        widgets["policy"] = gui.add_dropdown("Policy", _listed(first.policy, POLICIES), initial_value=first.policy)
        presets = _listed(first.preset, (OWN, *preset_names()))
        widgets["preset"] = gui.add_dropdown("Preset", presets, initial_value=first.preset)

    def _add_command(self) -> None:
        gui, widgets = self._gui, self._widgets
        widgets["by_hand"] = gui.add_checkbox("By hand", True, hint="Else the task's own command")
        for name in VELOCITY:
            widgets[name] = gui.add_slider(_label(name), -1.0, 1.0, 0.05, self._first.value(name))
        self._direction = gui.add_folder("Pose and gait")
        with self._direction:
            widgets["gait_now"] = gui.add_dropdown("Gait now", [direction.OWN], initial_value=direction.OWN)
            hint = "Multiple of the gait's own"
            widgets["tempo"] = gui.add_slider("Frequency", *direction.TEMPI, 0.05, 1.0, hint=hint)
            for name in POSE:
                widgets[name] = gui.add_slider(_label(name), -1.0, 1.0, 0.01, 0.0, hint="Standing heights or rad")
            gui.add_button("Upright").on_click(lambda event: self._stand())
        for label, key, change in _KEYS:
            command = gui.add_command(label, hotkey=key)
            command.on_trigger(functools.partial(self._press, *change))
        gui.add_html(texts.line(f"Keys: {_KEYS_TOLD}"))
        gui.add_button("Kick").on_click(lambda event: self._session.kick(random.uniform(-math.pi, math.pi)))
        gui.add_button("Restart").on_click(lambda event: self._session.restart())
        gui.add_checkbox("Pause", False).on_update(lambda event: self._session.pause(event.target.value))

    def _add_files(self) -> None:
        for file in saving.FILES:
            button = self._gui.add_button(f"Save {file.label}")
            button.on_click(functools.partial(self._save, file))
        self._lines = self._gui.add_html("")

    def _fit(self, creature: Creature) -> None:
        """Show the choices, the check and the lines that belong to a creature."""
        body, widgets = creature.setup.body, self._widgets
        widgets["gait"].options = _listed(creature.sketch.gait, (OWN, *gaits.fitting(body)))
        widgets["preset"].options = _listed(creature.sketch.preset, (OWN, *presets_of(body)))
        self._show_what_applies(creature.sketch)
        self._links = creature.links[:_LINKS]
        self._fit_direction(creature)
        self._render()
        for handle in self._cures:
            handle.remove()
        with self._check:
            self._cures = [self._gui.add_html(texts.checked(creature))]
            for flaw in creature.flaws:
                if flaw.cure is not None:
                    button = self._gui.add_button(f"Apply: {flaw.text.rpartition(': ')[2]}")
                    sketch = cured(creature.sketch, flaw.cure)
                    button.on_click(lambda event, sketch=sketch: self._sketched(sketch, "cure"))
                    self._cures.append(button)
        self._lines.content = texts.copied(creature.sketch)

    def _fit_direction(self, creature: Creature) -> None:
        """Offer the poses and gaits of a body, if they are by command in its task."""
        task, widgets = creature.environment.task.definition, self._widgets
        self._direction.visible = direction.directs(task)
        if not self._direction.visible:
            return
        widgets["gait_now"].options = list(direction.named(task))
        for name, (low, high) in zip(POSE, direction.room(creature.setup.body), strict=True):
            widgets[name].visible = bool(low < high)
            if widgets[name].visible:
                widgets[name].min, widgets[name].max = float(low), float(high)

    def _show_what_applies(self, sketch: Sketch) -> None:
        for name in ("legs", "links", "layout"):
            self._widgets[name].visible = sketch.source == LEGS
        self._widgets["seed"].visible = sketch.source == RANDOM

    def _render(self) -> None:
        """Have the widgets say the state, as far as they can."""
        state = self._edits.now
        self._widgets["source"].options = _listed(state.sketch.source, sketches.sources())
        for name, widget in self._widgets.items():
            widget.value = _shown(widget, state.value(name))
        given = dict(state.sketch.lengths)
        for slider, name in itertools.zip_longest(self._lengths, self._links):
            slider.visible = name is not None  # none is removed: a browser that is late would update it
            slider.label, slider.value = name or "", given.get(name, 1.0)

    def _edit(self, state: Callable[[State], State], name: str) -> None:
        """Take another state, which depends on that of now, under a name of what changes it."""
        with self._lock:
            self._edits = edited(self._edits, state(self._edits.now), name, time.monotonic())
            self._ask()

    def _go(self, move: Callable[[Edits], Edits]) -> None:
        """Undo or redo."""
        with self._lock:
            self._edits = move(self._edits)
            self._ask()
        self._render()

    def _ask(self) -> None:
        """Ask the session for what the state says."""
        state = self._edits.now
        self._session.ask(state.sketch)
        self._session.command(state.velocity)
        self._session.direct(state.pose, *state.gait)

    def _undo(self) -> None:
        self._go(undone)

    def _redo(self) -> None:
        self._go(redone)

    def _reset(self) -> None:
        """Return to the state in which the studio began, as one change."""
        self._edit(lambda state: self._first, "reset")
        self._render()

    async def _changed(self, name: str, event: viser.GuiEvent) -> None:  # viser keeps the order of async calls alone
        if event.client_id is not None:  # a visitor changed it, and not the page itself
            self._edit(lambda state: state.having(**{name: event.target.value}), name)

    async def _lengthened(self, index: int, event: viser.GuiEvent) -> None:
        if event.client_id is not None and index < len(self._links):
            link, factor = self._links[index], event.target.value
            self._edit(lambda state: state._replace(sketch=lengthened(state.sketch, link, factor)), link)

    def _sketched(self, sketch: Sketch, name: str) -> None:
        """Take another sketch, and show it."""
        self._edit(lambda state: state._replace(sketch=sketch), name)
        self._render()

    def _uploaded(self, event: viser.GuiEvent) -> None:
        text = event.target.value.content[: MAX_IMPORTED + 1].decode("utf-8", "replace")
        self._sketched(opened_file(self._edits.now.sketch, text), "file")

    def _stand(self) -> None:
        """Ask for the pose at rest and the body's own gait, at its own frequency."""
        self._edit(lambda state: state.having(gait_now=direction.OWN, tempo=1.0, **dict.fromkeys(POSE, 0.0)), "upright")
        self._render()

    def _press(self, name: str, change: float, event: viser.CommandEvent) -> None:
        """Change a number of the command by a step."""

        def pressed(state: State) -> State:
            number = min(max(state.value(name) + change, -1.0), 1.0)
            return state.having(by_hand=True, **{name: number})

        self._edit(pressed, name)
        self._render()

    def _save(self, file: saving.File, event: viser.GuiEvent) -> None:
        """Make a file, and send it to the visitor who asks for it."""
        creature, commands = self._session.creature, self._session.commands
        name, client = saving.name(creature, file), event.client
        note = client.add_notification(f"Making {name}", "", loading=True)
        try:
            content = file.content(creature, creature.environment.physics.data.qpos.copy(), commands)
        except (ValueError, OSError, RenderingUnavailable) as error:
            client.add_notification(f"No {name}", " ".join(str(error).split()), color="red")
        else:
            client.send_file_download(name, content, save_immediately=True)
        finally:
            note.remove()


def _listed(chosen: str, names: Iterable[str]) -> list[str]:
    """Return names for a list to choose from, with the chosen one."""
    return list(dict.fromkeys((*names, chosen)))


def _label(name: str) -> str:
    return name.replace("_", " ").capitalize()


def _shown(widget: Any, value: Any) -> Any:
    """Return what a widget shows of a value that it may not reach."""
    if isinstance(widget, viser.GuiSliderHandle):
        return min(max(value, widget.min), widget.max)
    if isinstance(widget, viser.GuiDropdownHandle):
        return value if value in widget.options else OWN
    return value
