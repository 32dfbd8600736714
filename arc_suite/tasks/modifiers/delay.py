"""Delay of actions."""

from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite import checks
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.draws import Episode
from arc_suite.tasks.modifiers.modifier import Modifier

MAX_DELAY = 100  # control steps


class DelayState(NamedTuple):
    """Actions that have not arrived at the motors.

    Attributes:
        delay: (...) delay of actions in this episode, control steps.
        waiting: (..., longest delay, joints) the latest actions, the newest first.
    """

    delay: np.ndarray
    waiting: np.ndarray


class _DelayFields(NamedTuple):
    delay: tuple[int, int]


class Delay(_DelayFields, Modifier):
    """Delay of actions.

    Attributes:
        delay: lowest and highest delay of actions, control steps.
    """

    __slots__ = ()

    defaults = {"delay": (0, 0)}
    bounds = {"delay": (0, MAX_DELAY)}

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        value = settings["delay"]
        if isinstance(value, tuple | list) and len(value) == 2:
            low, high = value
        else:
            low = value
            high = value
        lowest = checks.integer("delay", low, 0, MAX_DELAY)
        highest = checks.integer("delay", high, lowest, MAX_DELAY)
        return cls((lowest, highest))

    @property
    def is_active(self) -> bool:
        """Whether actions can be delayed."""
        return self.delay[1] > 0

    @property
    def structure(self) -> Hashable:
        """The longest delay."""
        return self.delay[1]

    def draw(self, episode: Episode) -> DelayState:
        """Return the delay of the episode; until the first action arrives, motors get zeros."""
        low, high = self.delay
        delay = low + int(episode.stream.delay * (high - low + 1))
        joints = len(episode.scene.body.joint_names)
        return DelayState(delay, waiting=np.zeros((high, joints)))

    def act(self, state: DelayState, action, elapsed) -> tuple[DelayState, Any]:
        """Return the state with the new action among those that wait, and the action that arrives in this step."""
        xp = action.__array_namespace__()
        under_way = xp.concatenate([action[..., None, :], state.waiting], axis=-2)  # (..., longest delay + 1, joints)
        index = xp.asarray(state.delay)[..., None, None]
        arrived = xp.take_along_axis(under_way, index, axis=-2)[..., 0, :]
        return state._replace(waiting=under_way[..., :-1, :]), arrived
