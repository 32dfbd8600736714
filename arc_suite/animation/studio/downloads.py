"""Widgets that save files of a creature on the visitor's machine."""

import functools

import viser

from arc_suite.animation.studio import saving, texts
from arc_suite.animation.studio.editor import Editor
from arc_suite.animation.studio.session import Session
from arc_suite.animation.studio.sketch import Sketch
from arc_suite.animation.studio.states import to_json
from arc_suite.simulation.opengl import RenderingUnavailable


class Downloads:
    """Buttons that save files, and lines to copy."""

    def __init__(self, gui: viser.GuiApi, session: Session, editor: Editor):
        """Add the widgets to the present container of the page."""
        self._session = session
        self._editor = editor
        gui.add_button("Save Design", hint="Body, task and command").on_click(self._save_design)
        for file in saving.FILES:
            gui.add_button(f"Save {file.label}").on_click(functools.partial(self._save, file))
        self._lines = gui.add_html("")

    def show_lines(self, sketch: Sketch) -> None:
        """Show the lines of Python and the command that make the creature of a sketch."""
        self._lines.content = texts.lines_to_copy(sketch)

    def _save_design(self, event: viser.GuiEvent) -> None:
        """Send the state of the page to the visitor who asks for it."""
        file_name = f"{self._session.creature.setup.body.name}_design.json"
        content = to_json(self._editor.state).encode()
        event.client.send_file_download(file_name, content, save_immediately=True)

    def _save(self, file: saving.File, event: viser.GuiEvent) -> None:
        """Make a file, and send it to the visitor who asks for it."""
        creature = self._session.creature
        commands = self._session.commands
        file_name = saving.download_name(creature, file)
        client = event.client
        notification = client.add_notification(f"Making {file_name}", "", loading=True)
        try:
            qpos = creature.environment.physics.data.qpos.copy()
            content = file.make(creature, qpos, commands)
        except (ValueError, OSError, RenderingUnavailable) as error:
            client.add_notification(f"No {file_name}", " ".join(str(error).split()), color="red")
        else:
            client.send_file_download(file_name, content, save_immediately=True)
        finally:
            notification.remove()
