"""Divisions of the benchmark: the places of every division, and what each division gives to an algorithm."""

from typing import NamedTuple

from arc_suite import usage

SEEDS = 3  # of every place

# Robot and task of each place, with default settings.
PLACES = (
    *(("queen", "walk"), ("bastion", "walk"), ("tick", "walk"), ("leaper", "walk")),
    *(("queen", "steer"), ("tick", "steer"), ("leaper", "steer")),
    *(("tick", "rough"), ("queen", "stairs"), ("tick", "navigate")),
)
FAR = ("rough", "slopes", "stairs", "navigate")  # tasks that take more steps: uneven ground and pillars
TURNING = ("steer", "navigate")  # tasks with commands that turn: a heading error says nothing there


class Division(NamedTuple):
    """A division.

    Attributes:
        steps: environment steps of a run.
        far_steps: the same in tasks of `FAR`.
        source: what its algorithms learn from, see `Algorithm.source`.
        episodes: episodes of prior data; 0 for none.
    """

    steps: int
    far_steps: int
    source: str = usage.NOTHING
    episodes: int = 0

    def steps_in(self, task: str) -> int:
        """Return the environment steps of a run in a task."""
        return self.far_steps if task in FAR else self.steps


DIVISIONS = {
    "top": Division(1_000_000, 3_000_000),
    "samples": Division(100_000, 100_000),
    "demonstrations": Division(100_000, 100_000, usage.PRIOR_DATA, 100),
}
