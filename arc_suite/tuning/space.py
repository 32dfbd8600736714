"""Spaces of a search: the numbers in which presets of a robot may differ, as vectors."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from arc_suite.cpg.presets import Bend, ByRank, Preset
from arc_suite.robots.spec import Body


class Range(NamedTuple):
    """The range of a number, in degrees or cycles.

    Attributes:
        scale: how far it is moved at first.
        low, high: the least and the most that it may be.
        decimals: that matter.
    """

    scale: float
    low: float
    high: float
    decimals: int


_SHARED = {
    "stiffness": Range(0.3, 0.05, 5.0, 3),
    "damping": Range(0.08, 0.0, 1.0, 3),
    "settle": Range(5.0, 0.0, 40.0, 0),
    "ramp": Range(5.0, 1.0, 40.0, 1),
    "ramp_start": Range(0.2, 0.0, 1.0, 2),
    "duty_factor": Range(0.08, 0.3, 0.85, 3),
}
_BY_RANK = {
    "lead": Range(0.06, -1.0, 2.0, 3),
    "sweep": Range(8.0, -60.0, 60.0, 1),
    "hip": Range(6.0, -60.0, 60.0, 1),
}
_BY_JOINT_AND_RANK = {
    "centre": Range(8.0, -120.0, 120.0, 1),
    "stance": Range(8.0, -120.0, 120.0, 1),
    "swing": Range(10.0, -120.0, 120.0, 1),
}
_DECIMALS = 4  # of all numbers of a preset


class Space(NamedTuple):
    """A space of vectors of numbers about a preset.

    A vector holds the stiffness, the damping, how it settles and ramps up, and the duty factor; for
    each rank of legs its lead over the preset's clock (cycles), the sweep and the centre of the hip
    (degrees); and for each other joint and each rank its centre and bends (degrees). The frequency
    is the gait's and stays.

    Attributes:
        body: of the robot.
        origin: the preset.
    """

    body: Body
    origin: Preset

    @property
    def ranks(self) -> int:
        """Number of ranks of legs."""
        return max(self.body.ranks) + 1

    def ranges(self) -> list[Range]:
        """Return the range of every number of a vector, in order."""
        by_rank = [*_BY_RANK.values(), *len(self.origin.bends) * list(_BY_JOINT_AND_RANK.values())]
        return [*_SHARED.values(), *(number for number in by_rank for _ in range(self.ranks))]

    def rounded(self, vector: np.ndarray) -> np.ndarray:
        """Return a vector (size,) to the decimals that matter."""
        return np.array([round(value, number.decimals) for value, number in zip(vector, self.ranges(), strict=True)])

    def vector(self, lead: float = 0.0) -> np.ndarray:
        """Return the vector (size,) of the preset itself, but for a lead of all legs in cycles."""
        preset = self.origin
        angles = [lead, preset.sweep, preset.centre.get("hip", 0.0)]
        for name, bend in preset.bends.items():
            angles += [preset.centre[name], bend.stance, bend.swing]
        by_rank = [value for angle in angles for value in self._by_rank(angle)]
        return np.array([*(getattr(preset, name) for name in _SHARED), *by_rank])

    def preset(self, vector: np.ndarray) -> Preset:
        """Return the preset of a vector (size,), within its ranges."""
        _, low, high, _ = np.transpose(self.ranges())
        numbers = iter((vector.clip(low, high).round(_DECIMALS) + 0.0).tolist())
        shared = {name: next(numbers) for name in _SHARED}
        shared["settle"] = round(shared["settle"])

        def by_rank() -> tuple[float, ...]:
            return tuple(next(numbers) for _ in range(self.ranks))

        leads, sweep, centre, bends = by_rank(), by_rank(), {"hip": by_rank()}, {}
        for name in self.origin.bends:
            centre[name] = by_rank()
            bends[name] = Bend(by_rank(), by_rank())
        offsets = zip(self.origin.phase_offsets, self.body.ranks, strict=True)
        return self.origin._replace(
            **shared,
            phase_offsets=tuple(round((offset + leads[rank]) % 1.0, _DECIMALS) for offset, rank in offsets),
            sweep=sweep,
            centre=centre,
            bends=bends,
        )

    def _by_rank(self, angle: ByRank) -> Iterable[float]:
        return angle if isinstance(angle, tuple) else (angle,) * self.ranks
