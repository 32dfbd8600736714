"""Noise of what is observed."""

from collections.abc import Hashable, Mapping
from typing import Any, NamedTuple, Self

import numpy as np

from arc_suite import checks
from arc_suite.robots.spec import Body
from arc_suite.tasks import noise
from arc_suite.tasks.blocks import Block, slices
from arc_suite.tasks.modifiers.draws import Episode
from arc_suite.tasks.modifiers.excluded_blocks import check_exclusion
from arc_suite.tasks.modifiers.modifier import Modifier


class NoiseState(NamedTuple):
    """The key from which the noise of an episode follows.

    Attributes:
        key: (..., 1) uint32.
    """

    key: np.ndarray


class _ObservationNoiseFields(NamedTuple):
    observation_noise: Mapping[str, float]
    widths: Mapping[str, np.ndarray]
    slices: Mapping[str, slice]
    total: int


class ObservationNoise(_ObservationNoiseFields, Modifier):
    """Uniform noise on what is measured.

    Attributes:
        observation_noise: level of uniform noise by the name of each block that has some.
        widths: half-widths (size,) of the noise of each block that has some, by name.
        slices: slice of each of these blocks in the random numbers of a step, by name.
        total: how many random numbers a step has.
    """

    __slots__ = ()

    defaults = {"observation_noise": {}}
    bounds = {"observation_noise": (0.0, 100.0)}

    @classmethod
    def of(cls, settings: Mapping[str, Any], body: Body, blocks: Mapping[str, Block]) -> Self:
        """Return the modifier that settings ask for."""
        noisy = {name: block for name, block in blocks.items() if block.noise is not None}
        levels = cls._check_levels(settings["observation_noise"], noisy)
        excluded = check_exclusion(settings["exclude_blocks"], blocks)
        # Slices of the noise of all blocks: a block has the same noise, whichever other blocks have noise.
        slices_of_all = slices({name: block.size for name, block in noisy.items()})
        names = [name for name in noisy if levels.get(name) and name not in excluded]
        widths = {name: levels[name] * noisy[name].widths for name in names}
        slices_of_names = {name: slices_of_all[name] for name in names}
        total = max((part.stop for part in slices_of_names.values()), default=0)
        return cls({name: levels[name] for name in names}, widths, slices_of_names, total)

    @classmethod
    def _check_levels(cls, value, noisy: Mapping[str, Block]) -> dict[str, float]:
        levels = value if isinstance(value, Mapping) else dict.fromkeys(noisy, value)
        return {
            checks.name(name, list(noisy), "block of observation_noise"): checks.number(
                "observation_noise", level, *cls.bounds["observation_noise"]
            )
            for name, level in levels.items()
        }

    @property
    def is_active(self) -> bool:
        """Whether a block has noise."""
        return bool(self.slices)

    @property
    def structure(self) -> Hashable:
        """The names of the blocks that have noise."""
        return tuple(self.slices)

    def draw(self, episode: Episode) -> NoiseState:
        """Return the key of the episode."""
        return NoiseState(np.array([episode.stream.noise_key], np.uint32))

    def observe(self, state: NoiseState, observed: dict, elapsed) -> dict[str, Any]:
        """Return the blocks with the noise of the step."""
        numbers = noise.noise(state.key, elapsed, self.total)
        return observed | {
            name: observed[name] + width * numbers[..., self.slices[name]] for name, width in self.widths.items()
        }
