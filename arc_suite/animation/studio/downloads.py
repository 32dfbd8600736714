"""Widgets that save files of a creature on the visitor's machine."""

import functools
from collections.abc import Callable

import viser

from arc_suite.animation.studio import layout, saving, texts
from arc_suite.animation.studio.editor import Editor
from arc_suite.animation.studio.handlers import in_order
from arc_suite.animation.studio.picture_buttons import PictureButtons
from arc_suite.animation.studio.session import Session
from arc_suite.animation.studio.sketch import Sketch, make_body
from arc_suite.animation.studio.states import PageState, to_json
from arc_suite.animation.studio.thumbnails import body_picture
from arc_suite.simulation.opengl import RenderingUnavailable

_MAX_GALLERY = 12  # pictures


class Downloads:
    """Buttons that save files, lines to copy, and a gallery of what was saved since the studio began."""

    def __init__(self, server: viser.ViserServer, session: Session, editor: Editor, show_state: Callable[[], None]):
        """Add the widgets to the present container of the page; `show_state` has its widgets show the state."""
        gui = server.gui
        self._server = server
        self._session = session
        self._editor = editor
        self._show_state = show_state
        self._saved_states: dict[str, PageState] = {}  # by name of their button, the latest last
        self._saved_count = 0
        gui.add_button("Save Design", hint="Body, task and command").on_click(self._save_design)
        self._weight, self._character = layout.add_weight(gui)
        self._character.on_update(in_order(self._choose_character))
        for file in saving.FILES:
            gui.add_button(f"Save {file.label}").on_click(functools.partial(self._save, file))
        self._gallery_folder = gui.add_folder("Saved in this session", visible=False)
        with self._gallery_folder:
            self._gallery = PictureButtons(gui, "gallery", "", [""], columns=3, height=48)
        self._gallery.on_update(in_order(self._reopen))
        self._lines = gui.add_html("")

    def show_lines(self, sketch: Sketch) -> None:
        """Show the lines of Python and the command that make the creature of a sketch."""
        self._lines.content = texts.lines_to_copy(sketch)

    def _choose_character(self, event: viser.GuiEvent) -> None:
        """Disable the slider of the weight where a character replaces it."""
        self._weight.disabled = event.target.value != layout.USUAL_CHARACTER

    def _weight_of_clips(self) -> float | str:
        """Return the name of a character, or a multiple of the usual weight; see `swaying.choose_character`."""
        if self._character.value == layout.USUAL_CHARACTER:
            return self._weight.value
        return self._character.value

    def _save_design(self, event: viser.GuiEvent) -> None:
        """Send the state of the page to the visitor who asks for it."""
        file_name = f"{self._session.creature.setup.body.name}_design.json"
        state = self._editor.state
        event.client.send_file_download(file_name, to_json(state).encode(), save_immediately=True)
        if not self._session.error:  # else it makes no creature
            self._add_to_gallery(file_name, state)

    def _save(self, file: saving.File, event: viser.GuiEvent) -> None:
        """Make a file, and send it to the visitor who asks for it."""
        creature = self._session.creature
        commands = self._session.commands
        state = self._editor.state._replace(sketch=creature.sketch)
        file_name = saving.download_name(creature, file)
        client = event.client
        notification = client.add_notification(f"Making {file_name}", "", loading=True)
        try:
            qpos = creature.environment.physics.data.qpos.copy()
            options = {"weight": self._weight_of_clips()} if file.takes_weight else {}
            content = file.make(creature, qpos, commands, **options)
        except (ValueError, OSError, RenderingUnavailable) as error:
            if self._is_here(client):
                client.add_notification(f"No {file_name}", " ".join(str(error).split()), color="red")
            return
        finally:
            notification.remove()
        if self._is_here(client):
            client.send_file_download(file_name, content, save_immediately=True)
            self._add_to_gallery(file_name, state)

    def _is_here(self, client: viser.ClientHandle) -> bool:
        """Return whether a visitor is still connected; viser warns of what is sent to one who has left."""
        return client.client_id in self._server.get_clients()

    def _add_to_gallery(self, file_name: str, state: PageState) -> None:
        """Show a creature that was saved, with the state of the page to return to; only the latest stay."""
        self._saved_count += 1
        self._saved_states[f"{self._saved_count} {file_name}"] = state
        for name in list(self._saved_states)[:-_MAX_GALLERY]:
            del self._saved_states[name]
        self._gallery.offer(list(self._saved_states))
        self._gallery.show_pictures(
            {name: body_picture(make_body(state.sketch)) for name, state in self._saved_states.items()}
        )
        self._gallery_folder.visible = True

    def _reopen(self, event: viser.GuiEvent) -> None:
        """Return to the state of a picture of the gallery."""
        state = self._saved_states.get(event.target.value)
        if state is not None:
            self._editor.edit(lambda present_state: state, "gallery")
            self._show_state()
