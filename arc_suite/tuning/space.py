"""What is searched: the numbers in which presets of a robot may differ, as vectors."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from arc_suite.cpg.presets import Bend, ByRank, Preset
from arc_suite.spec import Body

DECIMALS = 4  # of all numbers

# How far a number is moved at first, and the least and most that it may be; degrees and cycles.
_SHARED = {
    "stiffness": (0.3, 0.05, 5.0),
    "damping": (0.08, 0.0, 1.0),
    "ramp": (5.0, 1.0, 40.0),
    "duty_factor": (0.08, 0.3, 0.85),
}
_BY_RANK = {"lead": (0.06, -1.0, 2.0), "sweep": (8.0, -60.0, 60.0), "hip": (6.0, -60.0, 60.0)}
_BY_JOINT_AND_RANK = {
    "centre": (8.0, -120.0, 120.0),
    "stance": (8.0, -120.0, 120.0),
    "swing": (10.0, -120.0, 120.0),
}


class Space(NamedTuple):
    """Vectors of numbers about a preset.

    A vector holds the stiffness, the damping, the ramp and the duty factor; for each rank of legs
    its lead over the preset's clock (cycles), the sweep and the centre of the hip (degrees); and
    for each other joint and each rank its centre and bends (degrees). The frequency is the gait's
    and stays; the robot walks at once, without settling.

    Attributes:
        body: of the robot.
        origin: the preset.
    """

    body: Body
    origin: Preset

    @property
    def ranks(self) -> int:
        """How many ranks of legs there are."""
        return max(self.body.ranks) + 1

    def bounds(self) -> np.ndarray:
        """Scale, least and most of every number, (3, size)."""
        by_rank = [*_BY_RANK.values(), *len(self.origin.bends) * list(_BY_JOINT_AND_RANK.values())]
        return np.array([*_SHARED.values(), *(bounds for bounds in by_rank for _ in range(self.ranks))]).T

    def vector(self, lead: float = 0.0) -> np.ndarray:
        """The vector (size,) of the preset itself, but for a lead of all legs in cycles."""
        preset = self.origin
        angles = [lead, preset.sweep, preset.centre.get("hip", 0.0)]
        for name, bend in preset.bends.items():
            angles += [preset.centre[name], bend.stance, bend.swing]
        by_rank = [value for angle in angles for value in self._by_rank(angle)]
        return np.array([*(getattr(preset, name) for name in _SHARED), *by_rank])

    def preset(self, vector: np.ndarray) -> Preset:
        """The preset of a vector (size,), within bounds and rounded."""
        _, low, high = self.bounds()
        numbers = iter(vector.clip(low, high).round(DECIMALS).tolist())
        shared = {name: next(numbers) for name in _SHARED}

        def by_rank() -> tuple[float, ...]:
            return tuple(next(numbers) for _ in range(self.ranks))

        leads, sweep, centre, bends = by_rank(), by_rank(), {"hip": by_rank()}, {}
        for name in self.origin.bends:
            centre[name] = by_rank()
            bends[name] = Bend(by_rank(), by_rank())
        offsets = zip(self.origin.phase_offsets, self.body.ranks, strict=True)
        return self.origin._replace(
            **shared,
            settle=0,
            phase_offsets=tuple(round((offset + leads[rank]) % 1.0, DECIMALS) for offset, rank in offsets),
            sweep=sweep,
            centre=centre,
            bends=bends,
        )

    def _by_rank(self, angle: ByRank) -> Iterable[float]:
        return angle if isinstance(angle, tuple) else (angle,) * self.ranks
