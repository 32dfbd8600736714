"""The editor of the studio: it changes the page's state, keeps its history, and has the session follow the state."""

import threading
import time
from collections.abc import Callable

from arc_suite.animation.studio.session import Session
from arc_suite.animation.studio.sketch import Sketch
from arc_suite.animation.studio.states import Edits, PageState, record_edit, redo, undo


class Editor:
    """Holds the page's state, and asks the session for what the state says.

    Attributes:
        initial_state: state with which the studio began.
        lock: held while the state changes. Hold it while widgets show a state.
    """

    def __init__(self, session: Session):
        """Begin with the creature of a session."""
        self._session = session
        self.initial_state = PageState(session.creature.sketch)
        self._edits = Edits(self.initial_state)
        self.lock = threading.Lock()

    @property
    def state(self) -> PageState:
        """Return the present state."""
        return self._edits.now

    def edit(self, change: Callable[[PageState], PageState], name: str) -> None:
        """Change the state.

        Args:
            change: maps the present state to the new one.
            name: name of what changes; see `states.record_edit`.
        """
        with self.lock:
            state = change(self._edits.now)
            self._edits = record_edit(self._edits, state, name, time.monotonic())
            self._ask_session()

    def edit_sketch(self, change: Callable[[Sketch], Sketch], name: str) -> None:
        """Change the sketch of the state; see `edit`."""
        self.edit(lambda state: state._replace(sketch=change(state.sketch)), name)

    def undo(self) -> None:
        """Return to the state before the latest change."""
        with self.lock:
            self._edits = undo(self._edits)
            self._ask_session()

    def redo(self) -> None:
        """Return to the state that was undone last."""
        with self.lock:
            self._edits = redo(self._edits)
            self._ask_session()

    def reset(self) -> None:
        """Return to the initial state, as one change that can be undone."""
        self.edit(lambda state: self.initial_state, "reset")

    def _ask_session(self) -> None:
        """Ask the session for the creature and the commands of the state."""
        state = self._edits.now
        gait_name, tempo = state.gait
        self._session.ask(state.sketch)
        self._session.command(state.velocity)
        self._session.direct(state.pose, gait_name, tempo)
