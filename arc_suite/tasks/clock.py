"""The clock of a gait: tables of phases and of the contact schedule, with an entry for each control step, a tick.

Feet touch down and lift off exactly at control steps, so rounding decides between a step and the next. Phases are
therefore summed up once, in double precision, and every run, on a CPU or a GPU, looks them up.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

TWO_PI = 2.0 * math.pi

_MAX_TICKS = 100_000  # of the tables; a longer episode repeats them


class Clock(NamedTuple):
    """Tables by tick; tick 0 is the start of an episode.

    Attributes:
        phases: (ticks,) rad in [0, 2 pi).
        circle: (ticks, 2) sine and cosine of the phases.
        stance: (ticks, feet) which feet the gait schedules on the ground.
    """

    phases: np.ndarray
    circle: np.ndarray
    stance: np.ndarray

    @classmethod
    def make(cls, frequency: float, duty_factor: float, offsets, control_timestep: float, steps: float) -> Self:
        """Make the clock of a gait.

        Args:
            frequency: frequency of the gait, Hz.
            duty_factor: share of a cycle that a foot spends in stance.
            offsets: (feet,) rad, added to the clock's phase.
            control_timestep: s between ticks.
            steps: ticks of an episode after the first, may be infinite. An episode longer than the tables repeats
                them: they end where the next phase is the nearest to that of tick 0.
        """
        advance = TWO_PI * frequency * control_timestep
        count = int(min(steps, _MAX_TICKS)) + 1
        phases = np.zeros(count)
        for tick in range(1, count):
            phases[tick] = (phases[tick - 1] + advance) % TWO_PI
        if steps > _MAX_TICKS:
            ends = np.arange(count // 2, count)
            distances_from_zero = np.abs(np.sin(0.5 * phases[ends]))
            phases = phases[: ends[np.argmin(distances_from_zero)]]
        return cls(
            phases=phases,
            circle=np.stack([np.sin(phases), np.cos(phases)], axis=-1),
            stance=desired_contacts(phases, duty_factor, offsets),
        )

    def entries(self, table: np.ndarray, tick):
        """Return the entries (..., n) of a table at ticks (...), integers of Python, NumPy or JAX."""
        if not isinstance(tick, int):
            table = tick.__array_namespace__().asarray(table)
        return table[tick % len(self.phases)]


class Clocks(NamedTuple):
    """Clocks of environments of different bodies, with their tables concatenated.

    Attributes:
        phases: (all ticks,) rad in [0, 2 pi).
        circle: (all ticks, 2) sine and cosine of the phases.
        stance: (all ticks, feet) which feet the gait schedules on the ground.
        starts: (environments,) where the tables of each begin.
        counts: (environments,) ticks of each.
    """

    phases: np.ndarray
    circle: np.ndarray
    stance: np.ndarray
    starts: np.ndarray
    counts: np.ndarray

    @classmethod
    def of(cls, clocks: Sequence[Clock]) -> Self:
        """Join clocks of gaits with equal numbers of feet; environments that share a clock share its tables."""
        distinct_clocks = {id(clock): clock for clock in clocks}
        index_of_id = {name: index for index, name in enumerate(distinct_clocks)}
        indices = np.array([index_of_id[id(clock)] for clock in clocks])
        counts = np.array([len(clock.phases) for clock in distinct_clocks.values()])
        starts = counts.cumsum() - counts
        phases, circle, stance = (np.concatenate(tables) for tables in zip(*distinct_clocks.values(), strict=True))
        return cls(phases, circle, stance, starts[indices], counts[indices])

    def entries(self, table: np.ndarray, tick):
        """Return the entries (environments, n) of a table at ticks (environments,)."""
        return table[self.starts + tick % self.counts]


def desired_contacts(phase, duty_factor: float, offsets):
    """Return which feet (..., feet) a gait schedules on the ground at phases (...), rad (the paper's Section 4)."""
    return (phase[..., None] + offsets) % TWO_PI < TWO_PI * duty_factor


def schedule_errors(foot_heights, threshold: float, desired):
    """Return the number of contact schedule errors (...): feet on the ground that should not be, or the reverse.

    Args:
        foot_heights: (..., feet) over the ground, m.
        threshold: m, below which a foot is on the ground.
        desired: (..., feet) desired contacts.
    """
    return ((foot_heights < threshold) != desired).sum(axis=-1, dtype=float)


def compliance(errors, steps, feet: int):
    """Return the mean share (...) of feet that followed the schedule, given all errors (...) in control steps (...)."""
    return 1.0 - errors / (steps * feet)
