"""Blocks that the observation leaves out."""

from collections.abc import Hashable, Iterable, Mapping
from typing import Any, NamedTuple, Self

from arc_suite import checks
from arc_suite.robots.spec import Body
from arc_suite.tasks.blocks import Block
from arc_suite.tasks.modifiers.modifier import Modifier


class _ExcludedBlocksFields(NamedTuple):
    exclude_blocks: tuple[str, ...]


class ExcludedBlocks(_ExcludedBlocksFields, Modifier):
    """Blocks that are not observed.

    Attributes:
        exclude_blocks: names of blocks that the observation leaves out. The vector gets shorter.
    """

    __slots__ = ()

    defaults = {"exclude_blocks": ()}

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        return cls(check_exclusion(settings["exclude_blocks"], blocks))

    @property
    def is_active(self) -> bool:
        """Whether blocks are left out."""
        return bool(self.exclude_blocks)

    @property
    def structure(self) -> Hashable:
        """The names of the blocks."""
        return self.exclude_blocks

    def blocks(self, body: Body, blocks: Mapping[str, Block]) -> Mapping[str, Block]:
        """Return the blocks that are not left out."""
        return {name: block for name, block in blocks.items() if name not in self.exclude_blocks}

    def observe(self, state, observed: dict, elapsed) -> dict[str, Any]:
        """Return the blocks that are not left out."""
        return {name: block for name, block in observed.items() if name not in self.exclude_blocks}


def check_exclusion(value, blocks: Iterable[str]) -> tuple[str, ...]:
    """Return the checked names of blocks that are left out.

    Raises:
        ValueError: an unknown name, or all of the blocks.
    """
    names = checks.names("exclude_blocks", value, blocks, "block")
    if set(names) == set(blocks):
        raise ValueError(f"exclude_blocks: expected to leave a block, got all of them: {', '.join(names)}")
    return names
