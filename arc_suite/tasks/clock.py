"""The gait's clock, an integer tick a control step with tables by tick, and how well feet follow its contact schedule.

A gait's edges fall exactly on control steps, where rounding decides; so the phases are added up in
double precision once, and every run, on a CPU or a GPU, looks them up.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np

TWO_PI = 2.0 * math.pi

_LONGEST = 100_000  # ticks that are added up; a longer episode goes round


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
    def made(cls, frequency: float, duty_factor: float, offsets, control_timestep: float, steps: float) -> Self:
        """Make the clock of a gait.

        Args:
            frequency: of the gait, Hz.
            duty_factor: share of a cycle that a foot spends in stance.
            offsets: (feet,) rad, added to the clock's phase.
            control_timestep: s between ticks.
            steps: ticks of an episode after the first, may be infinite: an episode longer than the
                tables goes round them, back to the tick whose phase is the nearest to what is next.
        """
        turn = TWO_PI * frequency * control_timestep
        count = int(min(steps, _LONGEST)) + 1
        phases = np.zeros(count)
        for tick in range(1, count):
            phases[tick] = (phases[tick - 1] + turn) % TWO_PI
        if steps > _LONGEST:
            ends = np.arange(count // 2, count)
            phases = phases[: ends[np.argmin(np.abs(np.sin(0.5 * phases[ends])))]]
        return cls(
            phases=phases,
            circle=np.stack([np.sin(phases), np.cos(phases)], axis=-1),
            stance=desired_contacts(phases, duty_factor, offsets),
        )

    def at(self, table: np.ndarray, tick):
        """Return the entries (..., n) of a table at ticks (...), integers of Python, NumPy or JAX."""
        if not isinstance(tick, int):
            table = tick.__array_namespace__().asarray(table)
        return table[tick % len(self.phases)]


class Clocks(NamedTuple):
    """Clocks of environments of different bodies, with their tables one behind the other.

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
        """Join clocks of gaits of as many feet; a clock that several environments share is held once."""
        different = {id(clock): clock for clock in clocks}
        lengths = np.array([len(clock.phases) for clock in different.values()])
        places = {name: place for place, name in enumerate(different)}
        which = np.array([places[id(clock)] for clock in clocks])
        tables = (np.concatenate(tables) for tables in zip(*different.values(), strict=True))
        return cls(*tables, (lengths.cumsum() - lengths)[which], lengths[which])

    def at(self, table: np.ndarray, tick):
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
