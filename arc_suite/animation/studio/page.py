"""The page: viser's widgets around a session; all visitors share them."""

import contextlib
import dataclasses
import functools
import io
import itertools
import math
import random
import socket
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from arc_suite import checks
from arc_suite.animation import player_controls
from arc_suite.animation.studio import layout, saving, texts
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.charts import Charts
from arc_suite.animation.studio.creature import Creature
from arc_suite.animation.studio.effects import idle_fields
from arc_suite.animation.studio.gate import Server, offers
from arc_suite.animation.studio.session import Session
from arc_suite.animation.studio.sketch import (
    DEFAULT_CHOICE,
    Sketch,
    apply_cure,
    drag_end,
    length_factor,
    open_file,
    set_length_factor,
)
from arc_suite.animation.studio.states import (
    POSE,
    Edits,
    PageState,
    VisitorCommand,
    from_json,
    is_state,
    record_edit,
    redo,
    to_json,
    undo,
)
from arc_suite.animation.studio.view import View
from arc_suite.cpg.selection import presets_of
from arc_suite.robots import gaits
from arc_suite.robots.spec_files import MAX_IMPORTED
from arc_suite.simulation.opengl import RenderingUnavailable

_CHARTS_EVERY = 0.25  # s
_ROOM = 1000  # pixels of a window's width, from which charts leave room for a picture
_ALL = "all"  # legs
_PRESS = 0.25  # of the body's own speed, by which a key changes the command
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
        self._server, self._gui, self._session, self._drawn = server, server.gui, session, -math.inf
        self._creatures: tuple[Creature | None, Creature | None] = None, None
        self._first = PageState(session.creature.sketch)
        self._edits, self._lock = Edits(self._first), threading.Lock()
        self._widgets: dict[str, Any] = {}  # by the fields of a `State` that they show
        self._fixed: frozenset[str] = frozenset()  # numbers of a pose without room
        self._links: tuple[str, ...] = ()  # whose sliders are shown, of all legs or of one
        self._cures: list[Any] = []
        self._view = View(server)
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.main_panel.dock_right()
        self._gui.add_html(texts.style_sheet())
        self._status = self._gui.add_html("")
        self._add_changes()
        tabs, first = self._gui.add_tab_group(), session.creature.sketch
        with tabs.add_tab("Body"):
            self._add_body(first)
        with tabs.add_tab("Task"):
            self._widgets |= layout.add_task(self._gui, first)
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
        server.on_client_connect(self._greet)

    def show(self, session: Session) -> None:
        """Send a state to all visitors, in the loop's thread; see `Session.run`."""
        walker, kept = session.walker, session.kept
        creatures = walker.creature, kept and kept.creature
        if any(new is not old for new, old in zip(creatures, self._creatures, strict=True)):
            self._creatures = creatures
            self._view.show(*creatures)
            self._fit(walker.creature)
        next_to = kept and kept.episodes.qpos(kept.share)
        self._view.pose(walker.episodes.qpos(walker.share), walker.episodes.markers(walker.share), next_to)
        if time.monotonic() - self._drawn > _CHARTS_EVERY:
            self._drawn = time.monotonic()
            self._status.content = texts.status(session)
            if self._panel.visible:
                self._charts.update(session.history, tuple(leg.name for leg in session.creature.setup.body.legs))

    def _greet(self, client: viser.ClientHandle) -> None:
        """Hide the charts from a visitor who is alone and has a narrow window."""
        if len(self._server.get_clients()) == 1 and client.camera.image_width < _ROOM:
            self._charting.value = False

    def _add_changes(self) -> None:
        """Add undo, redo and reset, as buttons and as keys."""
        calls = {"Undo": self._undo, "Redo": self._redo, "Reset": self._reset}
        buttons = self._gui.add_button_group("Changes", tuple(calls), hint="Ctrl+Z, Ctrl+Shift+Z")
        buttons.on_click(lambda event: calls[event.target.value]())
        for label, modifier in (("Undo", "cmd/ctrl"), ("Redo", "cmd/ctrl+shift")):
            command = self._gui.add_command(label, hotkey="Z", modifier=modifier)
            command.on_trigger(lambda event, call=calls[label]: call())
        self._charting = self._gui.add_checkbox("Charts", True)
        self._charting.on_update(lambda event: setattr(self._panel, "visible", event.target.value))
        keep = self._gui.add_checkbox("Keep", False, hint="This creature walks next to all later ones")
        keep.on_update(lambda event: self._session.keep(event.target.value))

    def _add_body(self, first: Sketch) -> None:
        gui = self._gui
        self._check = gui.add_folder("Check")
        self._widgets |= layout.add_source(gui, first)
        upload = gui.add_upload_button("Open a spec or a design", mime_type="application/json")
        upload.on_upload(self._uploaded)
        self._widgets |= layout.add_shape(gui, first)
        self._shape = gui.add_folder("Links")
        with self._shape:
            self._leg = gui.add_dropdown("Legs to change", [_ALL], initial_value=_ALL)
            self._leg.on_update(lambda event: self._render())
            self._symmetric = gui.add_checkbox("Symmetric", True, hint="The leg across changes, too")
            self._dragging = gui.add_checkbox("Drag joints", False, hint="Time stands still; drag the balls")
            self._dragging.on_update(lambda event: self._session.do(self._let_drag))
            self._lengths = [gui.add_slider("", *layout.FACTORS, 1.0, visible=False) for _ in range(layout.LINKS)]
        for index, slider in enumerate(self._lengths):
            slider.on_update(functools.partial(self._lengthened, index))

    def _add_command(self) -> None:
        gui = self._gui
        self._widgets |= layout.add_velocity(gui, self._first)
        self._direction = gui.add_folder("Pose and gait")
        with self._direction:
            self._widgets |= layout.add_pose(gui)
            gui.add_button("Upright").on_click(lambda event: self._stand())
        for label, key, change in _KEYS:
            command = gui.add_command(label, hotkey=key)
            command.on_trigger(functools.partial(self._press, *change))
        gui.add_html(texts.paragraph(f"Keys: {_KEYS_TOLD}"))
        gui.add_button("Kick").on_click(lambda event: self._session.kick(random.uniform(-math.pi, math.pi)))
        gui.add_button("Restart").on_click(lambda event: self._session.restart())
        self._pause = gui.add_checkbox("Pause", False)
        self._pause.on_update(lambda event: self._session.pause(event.target.value))

    def _add_files(self) -> None:
        self._gui.add_button("Save Design", hint="Body, task and command").on_click(self._save_design)
        for file in saving.FILES:
            button = self._gui.add_button(f"Save {file.label}")
            button.on_click(functools.partial(self._save, file))
        self._lines = self._gui.add_html("")

    def _fit(self, creature: Creature) -> None:
        """Show the choices, the check and the lines that belong to a creature."""
        body, widgets = creature.setup.body, self._widgets
        widgets["gait"].options = layout.list_with(creature.sketch.gait, (DEFAULT_CHOICE, *gaits.fitting_gaits(body)))
        widgets["preset"].options = layout.list_with(creature.sketch.preset, (DEFAULT_CHOICE, *presets_of(body)))
        legs = (_ALL, *(leg.name for leg in body.legs))
        if self._leg.value not in legs:
            self._leg.value = _ALL
        self._leg.options = legs
        self._fit_direction(creature)
        self._render()
        self._show_balls()
        for handle in self._cures:
            handle.remove()
        with self._check:
            self._cures = [self._gui.add_html(texts.flaws(creature))]
            for flaw in creature.flaws:
                if flaw.cure is not None:
                    button = self._gui.add_button(f"Apply: {flaw.text.rpartition(': ')[2]}")
                    sketch = apply_cure(creature.sketch, flaw.cure)
                    button.on_click(lambda event, sketch=sketch: self._sketched(sketch, "cure"))
                    self._cures.append(button)
        self._lines.content = texts.lines_to_copy(creature.sketch)

    def _fit_direction(self, creature: Creature) -> None:
        """Offer the poses and gaits of a body, if they are by command in its task."""
        task, widgets = creature.environment.task.definition, self._widgets
        self._fixed = frozenset()
        if not player_controls.is_directed(task):
            return
        widgets["gait_now"].options = list(player_controls.gaits_by_name(task))
        rooms = dict(zip(POSE, player_controls.pose_room(creature.setup.body), strict=True))
        self._fixed = frozenset(name for name, (low, high) in rooms.items() if low >= high)
        for name in rooms.keys() - self._fixed:
            widgets[name].min, widgets[name].max = map(float, rooms[name])

    def _render(self) -> None:
        """Have the widgets say the state, as far as they can; what has no effect is not shown."""
        with self._lock:
            state, creature = self._edits.now, self._session.creature
            idle = idle_fields(creature, state.command) | self._fixed
            self._widgets["source"].options = layout.list_with(state.sketch.source, sketches.sources())
            for name, widget in self._widgets.items():
                widget.value = _shown(widget, state.value(name))
                _show(widget, name not in idle)
            _show(self._direction, "tempo" not in idle)
            _show(self._shape, "lengths" not in idle)
            self._links = self._shown_links(creature) if self._shape.visible else ()
            for slider, name in itertools.zip_longest(self._lengths, self._links):
                _show(slider, name is not None)  # none is removed: a browser that is late would update it
                if slider.label != (name or ""):
                    slider.label = name or ""
                slider.value = _shown(slider, 1.0 if name is None else length_factor(state.sketch, name))

    def _shown_links(self, creature: Creature) -> tuple[str, ...]:
        """The names of the links of all legs, or of the parts of the one to change."""
        chosen = [leg for leg in creature.setup.body.legs if leg.name == self._leg.value]
        names = tuple(leg.full_name(link) for leg in chosen for link in leg.links) or creature.links
        return names[: layout.LINKS]

    def _let_drag(self) -> None:
        """Have time stand still at the start of an episode while joints are dragged."""
        self._pause.value = self._dragging.value
        if self._dragging.value:
            self._session.restart()
        self._show_balls()

    def _show_balls(self) -> None:
        self._view.handles(self._dragged if self._dragging.value and self._shape.visible else None)

    def _dragged(self, part: str, by: np.ndarray) -> None:
        """Move the end of a link, in the frame of the link, m."""
        symmetric = self._symmetric.value
        self._edit(lambda state: state._replace(sketch=drag_end(state.sketch, part, by, symmetric)), part)
        self._render()

    def _edit(self, state: Callable[[PageState], PageState], name: str) -> None:
        """Take another state, which depends on that of now, under a name of what changes it."""
        with self._lock:
            self._edits = record_edit(self._edits, state(self._edits.now), name, time.monotonic())
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
        self._go(undo)

    def _redo(self) -> None:
        self._go(redo)

    def _reset(self) -> None:
        """Return to the state in which the studio began, as one change."""
        self._edit(lambda state: self._first, "reset")
        self._render()

    async def _changed(self, name: str, event: viser.GuiEvent) -> None:  # viser keeps the order of async calls alone
        if event.client_id is not None:  # a visitor changed it, and not the page itself
            self._edit(lambda state: state.replace_fields(**{name: event.target.value}), name)
            self._render()

    async def _lengthened(self, index: int, event: viser.GuiEvent) -> None:
        if event.client_id is not None and index < len(self._links):
            link, factor, symmetric = self._links[index], event.target.value, self._symmetric.value
            self._edit(
                lambda state: state._replace(sketch=set_length_factor(state.sketch, link, factor, symmetric)), link
            )

    def _sketched(self, sketch: Sketch, name: str) -> None:
        """Take another sketch, and show it."""
        self._edit(lambda state: state._replace(sketch=sketch), name)
        self._render()

    def _uploaded(self, event: viser.GuiEvent) -> None:
        text = event.target.value.content[: MAX_IMPORTED + 1].decode("utf-8", "replace")
        try:
            state = self._opened(text) if is_state(text) else None
        except ValueError as error:
            self._session.refuse(str(error))
            return
        self._edit(lambda now: state or now._replace(sketch=open_file(now.sketch, text)), "file")
        self._render()

    def _opened(self, text: str) -> PageState:
        """Return the state of a file, which imports nothing and asks for no more than the widgets offer."""
        state = from_json(text)
        for name in ("task", "policy"):
            checks.name(state.value(name), self._widgets[name].options, name)
        for name in (field.name for field in dataclasses.fields(VisitorCommand) if field.name != "gait_now"):
            if not offers(self._widgets[name], state.value(name)) and name not in POSE:
                raise ValueError(f"command.{name}: expected a value that its slider has, got {state.value(name)!r}")
        return state

    def _save_design(self, event: viser.GuiEvent) -> None:
        name = f"{self._session.creature.setup.body.name}_design.json"
        event.client.send_file_download(name, to_json(self._edits.now).encode(), save_immediately=True)

    def _stand(self) -> None:
        """Ask for the pose at rest and the body's own gait, at its own frequency."""
        self._edit(
            lambda state: state.replace_fields(
                gait_now=player_controls.OWN_GAIT, tempo=1.0, **dict.fromkeys(POSE, 0.0)
            ),
            "upright",
        )
        self._render()

    def _press(self, name: str, change: float, event: viser.CommandEvent) -> None:
        """Change a number of the command by a step."""

        def pressed(state: PageState) -> PageState:
            number = min(max(state.value(name) + change, -1.0), 1.0)
            return state.replace_fields(by_hand=True, **{name: number})

        self._edit(pressed, name)
        self._render()

    def _save(self, file: saving.File, event: viser.GuiEvent) -> None:
        """Make a file, and send it to the visitor who asks for it."""
        creature, commands = self._session.creature, self._session.commands
        name, client = saving.download_name(creature, file), event.client
        note = client.add_notification(f"Making {name}", "", loading=True)
        try:
            content = file.make(creature, creature.environment.physics.data.qpos.copy(), commands)
        except (ValueError, OSError, RenderingUnavailable) as error:
            client.add_notification(f"No {name}", " ".join(str(error).split()), color="red")
        else:
            client.send_file_download(name, content, save_immediately=True)
        finally:
            note.remove()


def _show(widget: Any, visible: bool) -> None:
    if widget.visible != visible:  # else viser sends it all the same
        widget.visible = visible


def _shown(widget: Any, value: Any) -> Any:
    """Return what a widget shows of a value that it may not reach."""
    if isinstance(widget, viser.GuiSliderHandle):
        return min(max(value, widget.min), widget.max)
    if isinstance(widget, viser.GuiDropdownHandle):
        return value if value in widget.options else DEFAULT_CHOICE
    return value
