"""Widgets that change the links of a creature: sliders of their lengths, and balls to drag their ends by."""

import functools
import itertools
from collections.abc import Callable

import numpy as np
import viser

from arc_suite.animation.studio import layout
from arc_suite.animation.studio.creature import Creature
from arc_suite.animation.studio.editor import Editor
from arc_suite.animation.studio.handlers import in_order
from arc_suite.animation.studio.sketch import Sketch, drag_end, length_factor, set_length_factor
from arc_suite.animation.studio.view import View

_ALL_LEGS = "all"  # the choice of sliders that change a link in all legs


class LinkWidgets:
    """A folder of widgets for the links of all legs, or of one leg."""

    def __init__(
        self,
        gui: viser.GuiApi,
        view: View,
        editor: Editor,
        show_state: Callable[[], None],
        switch_dragging: Callable[[], None],
    ):
        """Add the widgets to the present container of the page.

        Args:
            gui: gui of the page.
            view: view that shows the balls.
            editor: editor of the state.
            show_state: has all widgets of the page show the state.
            switch_dragging: called when visitors begin or end to drag links.
        """
        self._view = view
        self._editor = editor
        self._show_state = show_state
        self._switch_dragging = switch_dragging
        self._link_names: tuple[str, ...] = ()  # of the sliders that are visible; see `sketch.length_factor`
        self._folder = gui.add_folder("Links")
        with self._folder:
            self._leg = gui.add_dropdown("Legs to change", [_ALL_LEGS], initial_value=_ALL_LEGS)
            self._symmetric = gui.add_checkbox("Symmetric", True, hint="The leg across changes, too")
            self._dragging = gui.add_checkbox("Drag joints", False, hint="Time stands still; drag the balls")
            self._sliders = [layout.add_length_factor(gui) for _ in range(layout.MAX_LINK_SLIDERS)]
        self._leg.on_update(in_order(lambda event: self._show_state()))
        self._dragging.on_update(in_order(lambda event: self._switch_dragging()))
        for index, slider in enumerate(self._sliders):
            slider.on_update(in_order(functools.partial(self._set_length, index)))

    @property
    def is_dragging(self) -> bool:
        """Return whether visitors have chosen to drag links."""
        return self._dragging.value

    def fit(self, creature: Creature) -> None:
        """Offer the legs of a creature."""
        legs = (_ALL_LEGS, *(leg.name for leg in creature.setup.body.legs))
        if self._leg.value not in legs:
            self._leg.value = _ALL_LEGS
        self._leg.options = legs

    def show(self, sketch: Sketch, creature: Creature, visible: bool) -> None:
        """Show the lengths of a sketch.

        Args:
            sketch: sketch that has the lengths.
            creature: creature that walks, of which the sliders show the links.
            visible: whether the widgets have an effect.
        """
        layout.set_visible(self._folder, visible)
        self._link_names = self._names_of_links(creature) if visible else ()
        # Sliders without a link are hidden, not removed: a slow browser would update a slider after its removal.
        for slider, name in itertools.zip_longest(self._sliders, self._link_names):
            layout.set_visible(slider, name is not None)
            label = name or ""
            if slider.label != label:
                slider.label = label
            layout.set_value(slider, 1.0 if name is None else length_factor(sketch, name))

    def show_handles(self) -> None:
        """Show the balls, if visitors want to drag links that they can change."""
        can_drag = self.is_dragging and self._folder.visible
        self._view.show_handles(self._drag if can_drag else None)

    def _names_of_links(self, creature: Creature) -> tuple[str, ...]:
        """Return the names of the links of all legs, or of the parts of the leg that visitors choose."""
        names = []
        for leg in creature.setup.body.legs:
            for link in leg.links:
                part = leg.full_name(link)
                if part in creature.parts_with_lengths and self._leg.value in (_ALL_LEGS, leg.name):
                    names.append(link.name if self._leg.value == _ALL_LEGS else part)
        return tuple(dict.fromkeys(names))[: layout.MAX_LINK_SLIDERS]

    def _set_length(self, index: int, event: viser.GuiEvent) -> None:
        """Set the length of a link."""
        is_by_visitor = event.client_id is not None  # not by the page itself
        if is_by_visitor and index < len(self._link_names):
            link = self._link_names[index]
            factor = event.target.value
            symmetric = self._symmetric.value
            self._editor.edit_sketch(lambda sketch: set_length_factor(sketch, link, factor, symmetric), link)

    def _drag(self, part: str, shift: np.ndarray) -> None:
        """Move the end of a link by a shift (3,) in the frame of the link, m."""
        symmetric = self._symmetric.value
        self._editor.edit_sketch(lambda sketch: drag_end(sketch, part, shift, symmetric), part)
        self._show_state()
