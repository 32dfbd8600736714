"""Buttons with pictures, in a grid: each has its picture above its name."""

from collections.abc import Callable, Coroutine, Mapping, Sequence
from typing import Any

import viser

from arc_suite.animation.studio import texts


class PictureButtons:
    """A group of buttons, one of which may be the present choice.

    Attributes:
        buttons: the group, whose value is the button that was pressed last.
        text_field: shows the choice, and takes choices without a button; None: there is no such field.
    """

    def __init__(self, gui: viser.GuiApi, key: str, label: str, options: Sequence[str], columns: int, height: int):
        """Add buttons without pictures to the present container of the page.

        Args:
            gui: gui of the page.
            key: unique in the page.
            label: label that visitors see.
            options: names of the buttons.
            columns: buttons of a row.
            height: height of a picture, pixels.
        """
        self._key = key
        self._columns = columns
        self._height = height
        self._choice = ""
        self._default = ""
        self._pictures: Mapping[str, str] = {}
        self._style = gui.add_html("")  # right before the buttons, where its rules look for them
        self.buttons = gui.add_button_group(label, tuple(options))
        self.text_field: viser.GuiTextHandle | None = None
        self._gui = gui
        self._update_style()

    @property
    def visible(self) -> bool:
        """Whether visitors see the buttons."""
        return self.buttons.visible

    @visible.setter
    def visible(self, visible: bool) -> None:
        self.buttons.visible = visible
        if self.text_field is not None:
            self.text_field.visible = visible

    def add_text_field(self, label: str, hint: str, default: str) -> None:
        """Add a text field for choices without a button, to the present container of the page.

        Args:
            label: label that visitors see.
            hint: text that visitors see while the pointer rests on the field.
            default: choice of a visitor who empties the field.
        """
        self.text_field = self._gui.add_text(label, self._choice, hint=hint)
        self._default = default

    def on_update(self, call: Callable[[viser.GuiEvent], Coroutine[Any, Any, None]]) -> None:
        """Have a function called when a visitor presses a button, or changes the text field.

        See `viser.GuiButtonGroupHandle.on_click`.
        """
        self.buttons.on_click(call)

        async def read_text_field(event: viser.GuiEvent) -> None:
            if not event.target.value.strip():
                event.target.value = self._default
            await call(event)

        if self.text_field is not None:
            self.text_field.on_update(read_text_field)

    def offer(self, options: Sequence[str]) -> None:
        """Offer other buttons."""
        self.buttons.options = tuple(options)
        self._update_style()

    def show_pictures(self, pictures: Mapping[str, str]) -> None:
        """Show pictures, values of CSS, by name of the button."""
        self._pictures = pictures
        self._update_style()

    def show_choice(self, choice: str) -> None:
        """Mark a button as the present choice; a name without a button marks none."""
        if choice != self._choice:
            self._choice = choice
            self._update_style()
        if self.text_field is not None and self.text_field.value != choice:
            self.text_field.value = choice

    def _update_style(self) -> None:
        pictures = [self._pictures.get(option, "none") for option in self.buttons.options]
        choice = None
        if self._choice in self.buttons.options:
            choice = self.buttons.options.index(self._choice)
        self._style.content = texts.picture_styles(self._key, pictures, choice, self._columns, self._height)
