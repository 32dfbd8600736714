"""A history of observations and actions."""

from collections.abc import Hashable, Iterable, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite import checks
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.draws import Episode
from arc_suite.tasks.modifiers.excluded_blocks import check_exclusion
from arc_suite.tasks.modifiers.modifier import Modifier
from arc_suite.tasks.parts import Joints, Repeated

LONGEST_HISTORY = 50  # control steps


class HistoryState(NamedTuple):
    """Observations and actions of the latest steps.

    Attributes:
        now: (..., size) the latest observation of the blocks that it keeps.
        recent: (..., history, size + joints) earlier ones and the actions after them, the newest first.
    """

    now: np.ndarray
    recent: np.ndarray


class _HistoryFields(NamedTuple):
    history: int
    names: tuple[str, ...]
    size: int


class History(_HistoryFields, Modifier):
    """A block with earlier observations and actions.

    Attributes:
        history: number of earlier control steps of which the block `history` holds the blocks that measure joints,
            and the actions after them, the newest first; before the start they are those of the start, and 0.
        names: of the blocks that it keeps.
        size: of these blocks.
    """

    __slots__ = ()

    defaults = {"history": 0}
    bounds = {"history": (0, LONGEST_HISTORY)}

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        excluded = check_exclusion(settings["exclude_blocks"], blocks)
        count = checks.integer("history", settings["history"], *cls.bounds["history"])
        joint_blocks = select_blocks(blocks, excluded)
        if count and not joint_blocks:
            observed = ", ".join(name for name in blocks if name not in excluded)
            expected = "expected blocks that measure joints, as posture and velocities do"
            raise ValueError(f"history: {expected}, got {observed}")
        return cls(count, tuple(joint_blocks), sum(block.size for block in joint_blocks.values()))

    @property
    def is_active(self) -> bool:
        """Whether there is a history."""
        return self.history > 0

    @property
    def structure(self) -> Hashable:
        """Its length."""
        return self.history

    def draw(self, episode: Episode) -> HistoryState:
        """Return an empty history."""
        size = self.size if self.is_active else 0
        joints = len(episode.scene.body.joint_names)
        return HistoryState(np.zeros(size), np.zeros((self.history, size + joints)))

    def act(self, state: HistoryState, action, elapsed) -> tuple[HistoryState, Any]:
        """Return the state with the latest observation and the action after it as the newest."""
        xp = state.recent.__array_namespace__()
        newest = xp.concatenate([state.now, action], axis=-1)[..., None, :]
        return state._replace(recent=xp.concatenate([newest, state.recent[..., :-1, :]], axis=-2)), action

    def blocks(self, body: Body, blocks: Mapping[str, Block]) -> Mapping[str, Block]:
        """Return the blocks with the history."""
        parts = [part for name in self.names for part in blocks[name].parts]
        return {**blocks, "history": Block((Repeated((*parts, Joints(body, "action of {}")), self.history),))}

    def observe(self, state: HistoryState, observed: dict, elapsed) -> dict[str, Any]:
        """Return the blocks with the history."""
        return observed | {"history": state.recent.reshape(*state.recent.shape[:-2], -1)}

    def remember(self, state: HistoryState, observed: Mapping[str, Any], is_start: bool) -> HistoryState:
        """Return the state with the latest observation; at the start, with a history that repeats it."""
        arrays = [observed[name] for name in self.names]
        xp = arrays[0].__array_namespace__()
        now = xp.concatenate(arrays, axis=-1)
        recent = state.recent
        if is_start:
            repeated = xp.broadcast_to(now[..., None, :], (*recent.shape[:-1], self.size))
            recent = xp.concatenate([repeated, 0.0 * recent[..., self.size :]], axis=-1)
        return HistoryState(now, recent)


def select_blocks(blocks: Mapping[str, Block], excluded: Iterable[str]) -> dict[str, Block]:
    """Return the blocks that a history keeps, by name: those that measure joints and are not left out."""
    return {name: block for name, block in blocks.items() if block.measures_joints and name not in excluded}
