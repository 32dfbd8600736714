"""The page: viser's widgets around a session; all visitors share them."""

import contextlib
import dataclasses
import functools
import io
import math
import random
import socket
import threading
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import viser

from arc_suite import checks
from arc_suite.animation import player_controls
from arc_suite.animation.studio import layout, texts
from arc_suite.animation.studio import sketch as sketches
from arc_suite.animation.studio.charts import Charts
from arc_suite.animation.studio.creature import Creature, open_creature
from arc_suite.animation.studio.downloads import Downloads
from arc_suite.animation.studio.editor import Editor
from arc_suite.animation.studio.effects import idle_fields
from arc_suite.animation.studio.gate import Server, offers
from arc_suite.animation.studio.handlers import in_order
from arc_suite.animation.studio.links import LinkWidgets
from arc_suite.animation.studio.session import Session
from arc_suite.animation.studio.sketch import DEFAULT_CHOICE, RANDOM, Sketch, open_body, open_file, original_shape
from arc_suite.animation.studio.states import POSE, PageState, VisitorCommand, from_json, is_state
from arc_suite.animation.studio.thumbnails import body_picture
from arc_suite.animation.studio.view import View
from arc_suite.cpg.selection import presets_of
from arc_suite.robots import gaits
from arc_suite.robots.spec import MAX_PALETTE_SEED
from arc_suite.robots.spec_files import MAX_IMPORTED, check_kind

_REFRESH_INTERVAL = 0.25  # s, between two updates of the status and the charts
_PANEL_WIDTH = 280  # pixels of the panel with the widgets: a third of a phone's window, held across
_CHARTS_WIDTH = 330  # pixels of the panel with the charts
_KEY_CHANGE = 0.25  # share of the body's target speed, by which a key changes the command


class _Key(NamedTuple):
    """A key that changes the velocity by command.

    Attributes:
        label: says what it does.
        letter: on the key.
        field: field of the command.
        change: change of the field.
    """

    label: str
    letter: str
    field: str
    change: float


_KEYS = (
    _Key("Faster", "I", "forward", _KEY_CHANGE),
    _Key("Slower", "K", "forward", -_KEY_CHANGE),
    _Key("Turn left", "J", "turn", _KEY_CHANGE),
    _Key("Turn right", "L", "turn", -_KEY_CHANGE),
    _Key("To the left", "U", "left", _KEY_CHANGE),
    _Key("To the right", "O", "left", -_KEY_CHANGE),
)


def serve(session: Session, host: str, port: int, report: Callable[[str], None]) -> None:
    """Serve the page until the session is closed or the keyboard interrupts.

    Args:
        session: session to show and change.
        host: address to listen on.
        port: port to listen on; the next free one if it is taken.
        report: called with the address of the page.

    Raises:
        ValueError: nothing can listen on the address.
    """
    try:
        socket.create_server((host, 0)).close()  # raises an error now, where viser would wait forever
    except OSError as error:
        reason, _, _ = (error.strerror or str(error)).partition(" (")  # behind it Python repeats the address
        raise ValueError(f"host {host}: cannot listen there: {reason.lower()}") from None
    with contextlib.redirect_stdout(io.StringIO()):  # viser prints a banner
        server = Server(host=host, port=port, label="arc_suite studio", verbose=False)
    try:
        page = Page(server, session)
        report(f"http://{host}:{server.get_port()}/?token={server.token}")
        session.run(page.show)
    finally:
        with contextlib.redirect_stdout(io.StringIO()):  # viser prints that it has stopped
            server.stop()


class Page:
    """Widgets, view and charts of a session."""

    def __init__(self, server: viser.ViserServer, session: Session):
        """Lay out the page."""
        self._server = server
        self._gui = server.gui
        self._session = session
        self._editor = Editor(session)
        self._view = View(server)
        self._shown_creature: Creature | None = None
        self._shown_companion: Creature | None = None
        self._refresh_time = -math.inf  # s, of the latest update of the status and the charts
        self._widgets: dict[str, Any] = {}  # by the fields of a `PageState` that they show
        self._fixed_pose_fields: frozenset[str] = frozenset()  # numbers of a pose that the body cannot change
        self._flaw_widgets: list[Any] = []

        self._gui.configure_theme(show_logo=False, show_share_button=False)
        self._gui.main_panel.dock_right()
        self._gui.main_panel.set_width(_PANEL_WIDTH)
        self._gui.add_html(texts.style_sheet())
        self._gui.add_html(texts.watch())
        self._status = self._gui.add_html("")
        self._add_changes()
        sketch = session.creature.sketch
        tabs = self._gui.add_tab_group()
        with tabs.add_tab("Body"):
            self._add_body(sketch)
        with tabs.add_tab("Task"):
            self._widgets |= layout.add_task(self._gui, sketch)
        with tabs.add_tab("Command"):
            self._add_command()
        with tabs.add_tab("Files"):
            self._downloads = Downloads(self._server, session, self._editor, self._show_state)
        for field, widget in self._widgets.items():
            widget.on_update(in_order(functools.partial(self._set_field, field)))
        self._panel = self._gui.add_panel()
        with self._panel.add_tab("Measured"):
            self._charts = Charts(self._gui)
        self._panel.dock_left()
        self._panel.set_width(_CHARTS_WIDTH)
        self._panel.visible = False
        threading.Thread(target=self._draw_sources, daemon=True).start()

    def show(self, session: Session) -> None:
        """Send a state to all visitors, in the thread of the session's loop; see `Session.run`."""
        walker = session.walker
        companion = session.companion
        companion_creature = None if companion is None else companion.creature
        if walker.creature is not self._shown_creature or companion_creature is not self._shown_companion:
            self._shown_creature = walker.creature
            self._shown_companion = companion_creature
            self._view.show(walker.creature, companion_creature)
            self._fit(walker.creature)
        # `share`: of the present control step that has passed; poses between two steps are interpolated.
        qpos = walker.episodes.qpos(walker.share)
        markers = walker.episodes.markers(walker.share)
        companion_qpos = None
        companion_seconds = 0.0
        if companion is not None:
            companion_qpos = companion.episodes.qpos(companion.share)
            companion_seconds = companion.episodes.seconds(companion.share)
        self._view.pose(qpos, markers, companion_qpos, walker.episodes.seconds(walker.share), companion_seconds)
        if time.monotonic() - self._refresh_time > _REFRESH_INTERVAL:
            self._refresh_time = time.monotonic()
            self._status.content = texts.status(session)
            if self._panel.visible:
                leg_names = tuple(leg.name for leg in session.creature.setup.body.legs)
                self._charts.update(session.history, leg_names)

    def _draw_sources(self) -> None:
        """Draw the bodies that visitors may begin with, in a thread of its own: it takes seconds."""
        pictures: dict[str, str] = {}
        for source in sketches.sources():
            pictures[source] = body_picture(sketches.source_body(Sketch(source=source)))
            self._widgets["source"].show_pictures(dict(pictures))

    def _add_changes(self) -> None:
        """Add undo, redo and reset, as buttons and as keys, and switches of charts and companion."""
        actions = {
            "Undo": self._undo,
            "Redo": self._redo,
            "Reset": self._reset,
        }
        buttons = self._gui.add_button_group("Changes", tuple(actions), hint="Ctrl+Z, Ctrl+Shift+Z")
        buttons.on_click(in_order(lambda event: actions[event.target.value]()))
        undo_command = self._gui.add_command("Undo", hotkey="Z", modifier="cmd/ctrl")
        undo_command.on_trigger(in_order(lambda event: self._undo()))
        redo_command = self._gui.add_command("Redo", hotkey="Z", modifier="cmd/ctrl+shift")
        redo_command.on_trigger(in_order(lambda event: self._redo()))
        charts = self._gui.add_checkbox("Charts", False)
        charts.on_update(in_order(self._switch_charts))
        keep = self._gui.add_checkbox("Keep", False, hint="This creature walks next to all later ones")
        keep.on_update(in_order(lambda event: self._session.keep(event.target.value)))

    def _switch_charts(self, event: viser.GuiEvent) -> None:
        self._panel.visible = event.target.value

    def _add_body(self, sketch: Sketch) -> None:
        """Add the widgets for the body, with the values of a sketch."""
        self._check = self._gui.add_folder("Check")
        self._widgets |= layout.add_source(self._gui, sketch)
        self._gui.add_button("Random body").on_click(in_order(lambda event: self._draw_random_body()))
        upload = self._gui.add_upload_button("Open a spec or a design", mime_type="application/json")
        upload.on_upload(self._open_upload)
        self._widgets |= layout.add_shape(self._gui, sketch)
        self._links = LinkWidgets(
            self._gui,
            self._view,
            self._editor,
            show_state=self._show_state,
            # In the thread of the simulation, between two of its steps.
            switch_dragging=lambda: self._session.do(self._switch_dragging),
        )

    def _draw_random_body(self) -> None:
        """Take a random body in random colors, in its own proportions."""
        seed = random.randint(0, MAX_PALETTE_SEED)
        changes = {"source": RANDOM, "seed": seed, "palette": str(seed)}
        self._editor.edit_sketch(lambda sketch: dataclasses.replace(original_shape(sketch), **changes), "random")
        self._show_state()

    def _add_command(self) -> None:
        """Add the widgets for the commands, as sliders, keys and buttons."""
        gui = self._gui
        self._widgets |= layout.add_velocity(gui, self._editor.initial_state)
        self._pose_folder = gui.add_folder("Pose and gait")
        with self._pose_folder:
            self._widgets |= layout.add_pose(gui)
            gui.add_button("Upright").on_click(in_order(lambda event: self._stand_upright()))
        for key in _KEYS:
            command = gui.add_command(key.label, hotkey=key.letter)
            command.on_trigger(in_order(functools.partial(self._press, key)))
        key_texts = [f"{key.letter} {key.label.lower()}" for key in _KEYS]
        gui.add_html(texts.paragraph(f"Keys: {', '.join(key_texts)}"))
        gui.add_button("Kick").on_click(lambda event: self._session.kick(random.uniform(-math.pi, math.pi)))
        gui.add_button("Restart").on_click(lambda event: self._session.restart())
        self._pause = gui.add_checkbox("Pause", False)
        self._pause.on_update(in_order(lambda event: self._session.pause(event.target.value)))

    def _fit(self, creature: Creature) -> None:
        """Show the choices, the flaws and the lines that belong to a creature."""
        body = creature.setup.body
        sketch = creature.sketch
        gait_names = (DEFAULT_CHOICE, *gaits.fitting_gaits(body))
        presets = (DEFAULT_CHOICE, *presets_of(body))
        # A present choice that is not among the names is listed, too.
        self._widgets["gait"].options = layout.list_with(sketch.gait, gait_names)
        self._widgets["preset"].options = layout.list_with(sketch.preset, presets)
        self._links.fit(creature)
        self._fit_pose(creature)
        self._show_state()
        self._links.show_handles()
        self._show_flaws(creature)
        self._downloads.show_lines(sketch)

    def _fit_pose(self, creature: Creature) -> None:
        """Offer the poses and gaits of a body, if its task takes commands for them."""
        task = creature.environment.task.definition
        self._fixed_pose_fields = frozenset()
        if not player_controls.is_directed(task):
            return
        self._widgets["gait_now"].options = list(player_controls.gaits_by_name(task))
        fixed_fields = []
        for field, (low, high) in zip(POSE, player_controls.pose_room(creature.setup.body), strict=True):
            if low >= high:
                fixed_fields.append(field)
            else:
                self._widgets[field].min = float(low)
                self._widgets[field].max = float(high)
        self._fixed_pose_fields = frozenset(fixed_fields)

    def _show_flaws(self, creature: Creature) -> None:
        """Show the flaws of a body, with buttons that apply their cures."""
        for widget in self._flaw_widgets:
            widget.remove()
        with self._check:
            self._flaw_widgets = [self._gui.add_html(texts.flaws(creature))]
            for flaw in creature.flaws:
                if flaw.cure is not None:
                    advice = flaw.text.rpartition(": ")[2]  # of PROBLEM: ADVICE
                    button = self._gui.add_button(f"Apply: {advice}")
                    cured_sketch = open_body(creature.sketch, flaw.cure)
                    button.on_click(in_order(functools.partial(self._apply_cure, cured_sketch)))
                    self._flaw_widgets.append(button)

    def _apply_cure(self, sketch: Sketch, event: viser.GuiEvent) -> None:
        """Take the sketch with a cure."""
        self._editor.edit_sketch(lambda present_sketch: sketch, "cure")
        self._show_state()

    def _show_state(self) -> None:
        """Show the state in the widgets, and hide those without effect; a slider shows a value within its range."""
        with self._editor.lock:
            state = self._editor.state
            creature = self._session.creature
            # Fields without effect now, whose widgets are hidden.
            idle = idle_fields(creature, state.command) | self._fixed_pose_fields
            for field, widget in self._widgets.items():
                layout.set_value(widget, state.value(field))
                layout.set_visible(widget, field not in idle)
            # `tempo` has an effect where poses and gaits have, and `lengths` where a body has links to drag.
            layout.set_visible(self._pose_folder, "tempo" not in idle)
            self._links.show(state.sketch, creature, visible="lengths" not in idle)

    def _switch_dragging(self) -> None:
        """Have time stand still at the start of an episode while visitors drag links."""
        self._pause.value = self._links.is_dragging
        if self._links.is_dragging:
            self._session.restart()
        self._links.show_handles()

    def _undo(self) -> None:
        self._editor.undo()
        self._show_state()

    def _redo(self) -> None:
        self._editor.redo()
        self._show_state()

    def _reset(self) -> None:
        self._editor.reset()
        self._show_state()

    def _set_field(self, field: str, event: viser.GuiEvent) -> None:
        """Set a field of the state."""
        is_by_visitor = event.client_id is not None  # not by the page itself
        if is_by_visitor:
            value = event.target.value
            self._editor.edit(lambda state: state.replace_fields(**{field: value}), field)
            self._show_state()

    def _stand_upright(self) -> None:
        """Command the pose at rest, and the gait of the task at its own frequency."""
        rest_pose = dict.fromkeys(POSE, 0.0)
        self._editor.edit(
            lambda state: state.replace_fields(gait_now=player_controls.OWN_GAIT, tempo=1.0, **rest_pose),
            "upright",
        )
        self._show_state()

    def _press(self, key: _Key, event: viser.CommandEvent) -> None:
        """Change the velocity by a key."""

        def change_velocity(state: PageState) -> PageState:
            number = min(max(state.value(key.field) + key.change, -1.0), 1.0)
            return state.replace_fields(by_hand=True, **{key.field: number})

        self._editor.edit(change_velocity, key.field)
        self._show_state()

    def _open_upload(self, event: viser.GuiEvent) -> None:
        """Open the spec of a body, or a state of the page, that a visitor uploads; one that makes nothing is refused.

        The visitor reads why, and nothing changes, as widgets could not help: whatever they change, the file stays.
        """
        name = event.target.value.name
        first_bytes = event.target.value.content[: MAX_IMPORTED + 1]  # one more than allowed, so that it is refused
        text = first_bytes.decode("utf-8", "replace")
        try:
            check_kind(name)
            if is_state(text):
                state = self._read_state(text)
            else:
                present_state = self._editor.state
                state = present_state._replace(sketch=open_file(present_state.sketch, text))
            open_creature(state.sketch)
        except (ValueError, OSError) as error:
            reason = " ".join(str(error).split()).removeprefix(f"{name}: ")
            event.client.add_notification("No creature", f"{name}: {reason}", color="red")
            return
        self._editor.edit(lambda present_state: state, "file")
        self._show_state()

    def _read_state(self, text: str) -> PageState:
        """Return the state of a file, if the widgets offer its values. No module that it names is imported.

        Raises:
            ValueError: a name or a number that the widgets do not offer.
        """
        state = from_json(text)
        for field in ("task", "policy"):
            checks.name(state.value(field), self._widgets[field].options, field)  # raises a ValueError for other names
        commands = [field.name for field in dataclasses.fields(VisitorCommand)]
        for name in commands:
            # Gait and pose depend on the body: the session replaces a gait that does not suit it, and limits a pose.
            if name == "gait_now" or name in POSE:
                continue
            if not offers(self._widgets[name], state.value(name)):
                raise ValueError(f"command.{name}: expected a value that its slider has, got {state.value(name)!r}")
        return state
