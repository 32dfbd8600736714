"""The page: viser's widgets around a session; all visitors share them."""

import contextlib
import functools
import io
import itertools
import math
import random
import socket
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import viser

from arc_suite.animation import direction
from arc_suite.animation.studio import saving, texts
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.charts import Charts
from arc_suite.animation.studio.creature import Creature
from arc_suite.animation.studio.gate import Server
from arc_suite.animation.studio.session import Session
from arc_suite.animation.studio.sketch import FILE, LEGS, OWN, RANDOM, Sketch, cured, opened_file
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
    ("Faster", "I", (_PRESS, 0.0, 0.0)),
    ("Slower", "K", (-_PRESS, 0.0, 0.0)),
    ("Turn left", "J", (0.0, 0.0, _PRESS)),
    ("Turn right", "L", (0.0, 0.0, -_PRESS)),
    ("To the left", "U", (0.0, _PRESS, 0.0)),
    ("To the right", "O", (0.0, -_PRESS, 0.0)),
)
_POSE = ("Height", "Shift forward", "Shift left", "Roll", "Pitch", "Yaw")  # numbers of a pose
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
        self._file = session.creature.sketch.file
        self._widgets: dict[str, Any] = {}
        self._links: tuple[str, ...] = ()
        self._cures: list[Any] = []
        self._view = View(server)
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.main_panel.dock_right()
        self._status = self._gui.add_html("")
        tabs, first = self._gui.add_tab_group(), session.creature.sketch
        with tabs.add_tab("Body"):
            self._add_body(first)
        with tabs.add_tab("Task"):
            self._add_task(first)
        with tabs.add_tab("Command"):
            self._add_command()
        with tabs.add_tab("Files"):
            self._add_files()
        for widget in (*self._widgets.values(), *self._lengths):
            widget.on_update(self._changed)
        panel = server.gui.add_panel()
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
            self._charts.update(session.history, tuple(leg.name for leg in session.creature.setup.body.legs))

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
        gui = self._gui
        self._by_hand = gui.add_checkbox("By hand", True, hint="Else the task's own command")
        self._sticks = [
            gui.add_slider(label, -1.0, 1.0, 0.05, value)
            for label, value in (("Forward", 1.0), ("Left", 0.0), ("Turn", 0.0))
        ]
        self._direction = gui.add_folder("Pose and gait")
        with self._direction:
            self._gait = gui.add_dropdown("Gait now", [direction.OWN], initial_value=direction.OWN)
            self._tempo = gui.add_slider("Frequency", *direction.TEMPI, 0.05, 1.0, hint="Multiple of the gait's own")
            hint = "Standing heights or rad"
            self._pose = [gui.add_slider(label, -1.0, 1.0, 0.01, 0.0, hint=hint) for label in _POSE]
            gui.add_button("Upright").on_click(lambda event: self._stand())
        for widget in (self._by_hand, *self._sticks, self._gait, self._tempo, *self._pose):
            widget.on_update(lambda event: self._command())
        for label, key, change in _KEYS:
            command = gui.add_command(label, hotkey=key)
            command.on_trigger(functools.partial(self._press, change))
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
        self._fit_links(creature)
        self._fit_direction(creature)
        for handle in self._cures:
            handle.remove()
        with self._check:
            self._cures = [self._gui.add_html(texts.checked(creature))]
            for flaw in creature.flaws:
                if flaw.cure is not None:
                    button = self._gui.add_button(f"Apply: {flaw.text.rpartition(': ')[2]}")
                    button.on_click(functools.partial(self._apply, cured(creature.sketch, flaw.cure)))
                    self._cures.append(button)
        self._lines.content = texts.copied(creature.sketch)

    def _fit_links(self, creature: Creature) -> None:
        """Give each name of links a slider; the others are hidden, as a browser that is late updates removed ones."""
        names, given = creature.links[:_LINKS], dict(creature.sketch.lengths)
        if names == self._links:
            return
        self._links = names
        for slider, name in itertools.zip_longest(self._lengths, names):
            slider.visible = name is not None
            slider.label, slider.value = name or "", given.get(name, 1.0)

    def _fit_direction(self, creature: Creature) -> None:
        """Offer the poses and gaits of a body, if they are by command in its task."""
        task = creature.environment.task.definition
        self._direction.visible = direction.directs(task)
        if not self._direction.visible:
            return
        names = direction.named(task)
        if self._gait.value not in names:
            self._gait.value = direction.OWN
        self._gait.options = list(names)
        for slider, (low, high) in zip(self._pose, direction.room(creature.setup.body), strict=True):
            slider.visible = bool(low < high)
            slider.value = min(max(slider.value, low), high)
            if slider.visible:
                slider.min, slider.max = float(low), float(high)

    def _show_what_applies(self, sketch: Sketch) -> None:
        for name in ("legs", "links", "layout"):
            self._widgets[name].visible = sketch.source == LEGS
        self._widgets["seed"].visible = sketch.source == RANDOM

    def _read(self) -> Sketch:
        """Return what the widgets say."""
        lengths = tuple((name, slider.value) for name, slider in zip(self._links, self._lengths, strict=False))
        said = {name: widget.value for name, widget in self._widgets.items()}
        return Sketch(**said, lengths=lengths, file=self._file)

    def _changed(self, event: viser.GuiEvent) -> None:
        if event.client_id is not None:  # a visitor changed it, and not the page itself
            self._session.ask(self._read())

    def _apply(self, sketch: Sketch, event: viser.GuiEvent | None = None) -> None:
        """Set the widgets to a sketch, and ask for it."""
        self._file, widgets = sketch.file, self._widgets
        widgets["source"].options = (*sketches.sources(), FILE)
        for name, widget in widgets.items():
            widget.value = getattr(sketch, name)
        for slider in self._lengths:
            slider.value = 1.0
        self._session.ask(sketch)

    def _uploaded(self, event: viser.GuiEvent) -> None:
        text = event.target.value.content[: MAX_IMPORTED + 1].decode("utf-8", "replace")
        self._apply(opened_file(self._read(), text))

    def _command(self) -> None:
        by_hand = self._by_hand.value
        self._session.command([stick.value for stick in self._sticks] if by_hand else None)
        pose, gait = [slider.value for slider in self._pose], (self._gait.value, self._tempo.value)
        self._session.direct(*((pose, *gait) if by_hand else (None, None)))

    def _stand(self) -> None:
        """Ask for the pose at rest and the body's own gait, at its own frequency."""
        self._gait.value, self._tempo.value = direction.OWN, 1.0
        for slider in self._pose:
            slider.value = 0.0

    def _press(self, change: Sequence[float], event: viser.CommandEvent) -> None:
        """Change the command by a step."""
        self._by_hand.value = True
        for stick, step in zip(self._sticks, change, strict=True):
            stick.value = min(max(stick.value + step, -1.0), 1.0)

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
