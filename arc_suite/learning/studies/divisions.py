"""Divisions of the benchmark: the places of every division, and what each division gives to an algorithm."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from arc_suite import registry, usage
from arc_suite.envs.setup import Setup

SEEDS = 3  # of every place

PLACES = registry.BENCHMARKING  # robot and task of each place
# Settings of places where they are not those of the task: ground on which walkers without sight fail.
SETTINGS: Mapping[tuple[str, str], Mapping[str, Any]] = {
    ("tick", "rough"): {"rise": 0.126},  # m, 0.7 standing heights
    ("queen", "gaps"): {"difficulty": 0.8},
}
FAR = ("rough", "slopes", "stairs", "gaps", "navigate")  # tasks that take more steps: uneven ground and pillars
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


def place_setup(robot: str, task: str) -> Setup:
    """Return the setup of a place."""
    return Setup.of(robot, task, SETTINGS.get((robot, task)))


DIVISIONS = {
    "top": Division(1_000_000, 3_000_000),
    "samples": Division(100_000, 100_000),
    "demonstrations": Division(100_000, 100_000, usage.PRIOR_DATA, 100),
}
