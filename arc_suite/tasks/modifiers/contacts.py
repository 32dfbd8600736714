"""Contacts: how slippery the ground is."""

from collections.abc import Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.draws import Episode, interpolate
from arc_suite.tasks.modifiers.modifier import Modifier
from arc_suite.tasks.modifiers.multiples import find_multiples
from arc_suite.tasks.parts import Scalar
from arc_suite.tasks.scene import Scene

FRICTION_FIELDS = ("pair_friction", "geom_friction")  # fields of the model that the setting `friction` multiplies


class ContactsState(NamedTuple):
    """What an episode draws of contacts.

    Attributes:
        friction: (..., 1) multiple of the friction of all contacts.
    """

    friction: np.ndarray


class _ContactsFields(NamedTuple):
    friction: tuple[float, float]


class Contacts(_ContactsFields, Modifier):
    """Contacts of the body.

    Attributes:
        friction: range of the multiple of the friction of all contacts.
    """

    __slots__ = ()

    defaults = {"friction": (1.0, 1.0)}
    bounds = {"friction": (0.0, 100.0)}
    read_back_fields = ("pair_friction",)

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        return cls(cls.check_span("friction", settings))

    @property
    def is_active(self) -> bool:
        """Whether steps have to call it: never, as the simulation itself has the friction."""
        return False

    def draw(self, episode: Episode) -> ContactsState:
        """Return the friction of the episode."""
        multiple = interpolate(self.friction, episode.stream.friction)
        return ContactsState(np.array([multiple]))

    def fields(self, scene: Scene, model: Mapping[str, Any], state: ContactsState) -> dict[str, Any]:
        """Return the frictions of the model."""
        if self.friction == (1.0, 1.0):
            return {}
        return {name: state.friction[0] * model[name] for name in FRICTION_FIELDS}

    def privileged_blocks(self, body: Body) -> dict[str, Block]:
        """Return the block `friction`."""
        return {"friction": Block((Scalar("multiple of the friction"),))}

    def privileged(self, state: ContactsState, elapsed, heading) -> dict[str, Any]:
        """Return the multiple of the friction."""
        return {"friction": state.friction}

    def read_back(self, scene: Scene, blocks: Mapping[str, Any], fields: Mapping[str, Any]) -> dict[str, Any]:
        """Return the mean multiple of the sliding frictions that a user has changed."""
        sliding = np.s_[:, 0]  # of each pair, the first column
        multiples = find_multiples(scene, fields, "pair_friction", sliding)
        return {} if multiples is None else {"friction": multiples.mean(keepdims=True)}
