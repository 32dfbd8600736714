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
from arc_suite.tasks.parts import Joints, Part, Repeated

MAX_HISTORY = 50  # control steps


class HistoryState(NamedTuple):
    """Observations and actions of the latest steps.

    Attributes:
        latest: (..., size) the latest observation of the blocks that the history keeps.
        recent: (..., history, size + joints) earlier observations and the actions after them, the newest first.
    """

    latest: np.ndarray
    recent: np.ndarray


class _HistoryFields(NamedTuple):
    history: int
    names: tuple[str, ...]
    size: int


class History(_HistoryFields, Modifier):
    """A block with earlier observations and actions.

    Attributes:
        history: number of earlier control steps in the block `history`. Of each step it holds the blocks that measure
            joints, and the action after them, the newest first. Steps before the start repeat the observation of the
            start, with actions of 0.
        names: names of the blocks that the history keeps.
        size: numbers of these blocks together.
    """

    __slots__ = ()

    defaults = {"history": 0}
    bounds = {"history": (0, MAX_HISTORY)}

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        excluded = check_exclusion(settings["exclude_blocks"], blocks)
        history = checks.integer("history", settings["history"], 0, MAX_HISTORY)
        joint_blocks = select_blocks(blocks, excluded)
        if history > 0 and not joint_blocks:
            observed = ", ".join(name for name in blocks if name not in excluded)
            expected = "expected blocks that measure joints, as posture and velocities do"
            raise ValueError(f"history: {expected}, got {observed}")
        size = sum(block.size for block in joint_blocks.values())
        return cls(history, tuple(joint_blocks), size)

    @property
    def is_active(self) -> bool:
        """Whether there is a history."""
        return self.history > 0

    @property
    def structure(self) -> Hashable:
        """The number of control steps."""
        return self.history

    def draw(self, episode: Episode) -> HistoryState:
        """Return an empty history."""
        size = self.size if self.is_active else 0
        joints = len(episode.scene.body.joint_names)
        return HistoryState(latest=np.zeros(size), recent=np.zeros((self.history, size + joints)))

    def act(self, state: HistoryState, action, elapsed) -> tuple[HistoryState, Any]:
        """Return the state with the latest observation and the action after it as the newest."""
        xp = state.recent.__array_namespace__()
        newest = xp.concatenate([state.latest, action], axis=-1)[..., None, :]
        without_oldest = state.recent[..., :-1, :]
        recent = xp.concatenate([newest, without_oldest], axis=-2)
        return state._replace(recent=recent), action

    def blocks(self, body: Body, blocks: Mapping[str, Block]) -> Mapping[str, Block]:
        """Return the blocks with the history."""
        parts: list[Part] = []
        for name in self.names:
            parts += blocks[name].parts
        parts.append(Joints(body, "action of {}"))
        return {**blocks, "history": Block((Repeated(tuple(parts), self.history),))}

    def repeat_masks(self, masks: Mapping[str, np.ndarray], joints: int) -> np.ndarray:
        """Return the mask (size,) of the block `history`: those of its blocks at each step, and true for actions.

        Args:
            masks: masks (size,) of the blocks that the history keeps, by name; further ones are ignored.
            joints: number of joints of an action.
        """
        step = [*(masks[name] for name in self.names), np.ones(joints, bool)]
        return np.tile(np.concatenate(step), self.history)

    def observe(self, state: HistoryState, observed: dict, elapsed) -> dict[str, Any]:
        """Return the blocks with the history."""
        leading_axes = state.recent.shape[:-2]
        return observed | {"history": state.recent.reshape(*leading_axes, -1)}

    def remember(self, state: HistoryState, observed: Mapping[str, Any], is_start: bool) -> HistoryState:
        """Return the state with the latest observation; at the start, with a history that repeats it."""
        arrays = [observed[name] for name in self.names]
        xp = arrays[0].__array_namespace__()
        latest = xp.concatenate(arrays, axis=-1)
        recent = state.recent
        if is_start:
            repeated = xp.broadcast_to(latest[..., None, :], (*recent.shape[:-1], self.size))
            no_actions = 0.0 * recent[..., self.size :]
            recent = xp.concatenate([repeated, no_actions], axis=-1)
        return HistoryState(latest, recent)


def select_blocks(blocks: Mapping[str, Block], excluded: Iterable[str]) -> dict[str, Block]:
    """Return the blocks that a history keeps, by name: those that measure joints and are not left out."""
    return {name: block for name, block in blocks.items() if block.measures_joints and name not in excluded}
