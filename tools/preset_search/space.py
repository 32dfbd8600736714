"""Spaces of a search: parameters of presets as vectors.

`SPACES` names them: the parameters of the paper's law around `medium`, and those of the torques added
to it around `tuned`.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from arc_suite.cpg.prescribed import Bend, ByRank, Preset
from arc_suite.robots.spec import Body


class Range(NamedTuple):
    """The range of a number, in degrees or cycles.

    Attributes:
        scale: its deviation in the first generation.
        low, high: its bounds.
        decimals: decimals to which it is rounded in a result.
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
    "center": Range(8.0, -120.0, 120.0, 1),
    "stance": Range(8.0, -120.0, 120.0, 1),
    "swing": Range(10.0, -120.0, 120.0, 1),
}
_DECIMALS = 4  # of all parameters of a preset
LEADS = 20  # phase leads of all legs over the clock, at which a search may start
HARMONICS = 3  # multiples of the leg's phase in torques
_AMPLITUDE = Range(0.08, -1.0, 1.0, 3)
_STEERING = Range(0.1, -1.0, 1.0, 3)
_INITIAL_STEERING = -0.2  # at which a search for torques starts; results of a search without it drift


class Space(NamedTuple):
    """A space of vectors of parameters around a preset.

    A vector holds the stiffness, the damping, how it settles and ramps up, and the duty factor; for
    each rank of legs its lead over the preset's clock (cycles), the sweep and the center of the hip
    (degrees); and for each other joint and each rank its center and bends (degrees). The frequency
    is the gait's and stays.

    Attributes:
        body: body of the robot.
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

    def origins(self) -> list[np.ndarray]:
        """Return possible starting points (size,): the preset with leads over its clock."""
        return [self.vector(lead / LEADS) for lead in range(LEADS)]

    def vector(self, lead: float = 0.0) -> np.ndarray:
        """Return the vector (size,) of the preset itself with a lead of all legs, cycles."""
        preset = self.origin
        angles = [lead, preset.sweep, preset.center.get("hip", 0.0)]
        for name, bend in preset.bends.items():
            angles += [preset.center[name], bend.stance, bend.swing]
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

        leads = by_rank()
        sweep = by_rank()
        center = {"hip": by_rank()}
        bends = {}
        for name in self.origin.bends:
            center[name] = by_rank()
            bends[name] = Bend(by_rank(), by_rank())
        offsets = zip(self.origin.phase_offsets, self.body.ranks, strict=True)
        return self.origin._replace(
            **shared,
            phase_offsets=tuple(round((offset + leads[rank]) % 1.0, _DECIMALS) for offset, rank in offsets),
            sweep=sweep,
            center=center,
            bends=bends,
        )

    def _by_rank(self, angle: ByRank) -> Iterable[float]:
        return angle if isinstance(angle, tuple) else (angle,) * self.ranks


class Torques(NamedTuple):
    """A space of vectors of torques that are added to a preset.

    A vector holds for each joint and each rank of legs the amplitudes of the cosines and then of the
    sines of the leg's phase and its multiples, and last the steering. All other parameters are the
    preset's.

    Attributes:
        body: body of the robot.
        origin: the preset.
    """

    body: Body
    origin: Preset

    @property
    def _shape(self) -> tuple[int, int, int]:
        return 1 + len(self.origin.bends), max(self.body.ranks) + 1, 2 * HARMONICS

    def ranges(self) -> list[Range]:
        """Return the range of every number of a vector, in order."""
        return [*[_AMPLITUDE] * math.prod(self._shape), _STEERING]

    def origins(self) -> list[np.ndarray]:
        """Return the vector (size,) at which a search starts: no torques except for steering."""
        return [np.array([*[0.0] * math.prod(self._shape), _INITIAL_STEERING])]

    def preset(self, vector: np.ndarray) -> Preset:
        """Return the preset of a vector (size,), within its ranges."""
        _, low, high, _ = np.transpose(self.ranges())
        *amplitudes, steering = vector.clip(low, high).round(_DECIMALS) + 0.0
        table = np.reshape(amplitudes, self._shape).tolist()
        torques = {name: tuple(map(tuple, rows)) for name, rows in zip(("hip", *self.origin.bends), table, strict=True)}
        return self.origin._replace(torques=torques, steering=float(steering))


def round_vector(vector: np.ndarray, ranges: Iterable[Range]) -> np.ndarray:
    """Return a vector (size,), each number rounded to the decimals of its range."""
    return np.array([round(value, number.decimals) for value, number in zip(vector, ranges, strict=True)])


class Kind(NamedTuple):
    """A kind of search with its default settings.

    Attributes:
        space: space of the parameters.
        preset: around which it searches.
        generations: generations of the search.
        candidates: candidates of a generation; None for the default of CMA-ES.
        episodes: episodes by which a candidate is evaluated.
        steps: control steps of each.
        skipped: first steps of an episode, in which the robot starts to walk; they do not count.
        starts: starts from which the hard ones are chosen; 0 for none.
    """

    space: type[Space] | type[Torques]
    preset: str
    generations: int
    candidates: int | None
    episodes: int
    steps: int
    skipped: int
    starts: int


SPACES = {
    "law": Kind(Space, "medium", generations=250, candidates=None, episodes=2, steps=300, skipped=0, starts=1000),
    "torques": Kind(Torques, "tuned", generations=60, candidates=48, episodes=1, steps=180, skipped=20, starts=0),
}
