"""Delay of actions."""

from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite import checks
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.draws import Episode
from arc_suite.tasks.modifiers.modifier import Modifier

LONGEST_DELAY = 100  # control steps


class DelayState(NamedTuple):
    """Actions under way.

    Attributes:
        delay: (...) of actions, control steps.
        waiting: (..., longest delay, joints) the latest actions, the newest first.
    """

    delay: np.ndarray
    waiting: np.ndarray


class _DelayFields(NamedTuple):
    delay: tuple[int, int]


class Delay(_DelayFields, Modifier):
    """Delay of actions.

    Attributes:
        delay: delay of actions, control steps, or two of them.
    """

    __slots__ = ()

    defaults = {"delay": (0, 0)}
    bounds = {"delay": (0, LONGEST_DELAY)}

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        value = settings["delay"]
        least, most = cls.bounds["delay"]
        low, high = value if isinstance(value, tuple | list) and len(value) == 2 else (value, value)
        low = checks.integer("delay", low, least, most)
        return cls((low, checks.integer("delay", high, low, most)))

    @property
    def is_active(self) -> bool:
        """Whether actions can be delayed."""
        return self.delay[1] > 0

    @property
    def structure(self) -> Hashable:
        """The longest delay."""
        return self.delay[1]

    def draw(self, episode: Episode) -> DelayState:
        """Return the delay of the episode, and no action."""
        low, high = self.delay
        waiting = np.zeros((high, len(episode.scene.body.joint_names)))
        return DelayState(low + int(episode.stream.delay * (high - low + 1)), waiting)

    def act(self, state: DelayState, action, elapsed) -> tuple[DelayState, Any]:
        """Return the state with an action among those that wait, and the one that arrives."""
        xp = action.__array_namespace__()
        under_way = xp.concatenate([action[..., None, :], state.waiting], axis=-2)
        delay = xp.asarray(state.delay)[..., None, None]
        arrived = xp.take_along_axis(under_way, delay, axis=-2)[..., 0, :]
        return state._replace(waiting=under_way[..., :-1, :]), arrived
