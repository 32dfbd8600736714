"""How policies are judged: seeded episodes, deterministic actions, mean and standard deviation."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

# Returns of the paper's demonstrators, the expert lines of its figures.
EXPERT_RETURNS = {"queen": 2048.0, "bastion": 2311.0, "tick": 1971.0, "leaper": 2630.0}


class Episode(NamedTuple):
    """What one episode amounts to.

    Attributes:
        total: its return.
        length: control steps.
        speed: mean forward velocity, m/s.
        compliance: mean share of feet that were in stance or swing as the gait prescribes.
    """

    total: float
    length: int
    speed: float
    compliance: float


def run(environment, policy, seed: int, max_steps: int | None = None) -> Episode:
    """Runs one episode.

    Args:
        environment: of `arc_suite.load`.
        policy: maps a `TimeStep` to an action.
        seed: of the episode's initial state.
        max_steps: to stop early.

    Returns:
        What it amounts to.
    """
    environment.task.random.seed(seed)
    timestep = environment.reset()
    start = environment.physics.position()[0]
    total, compliance, length = 0.0, 0.0, 0
    while not timestep.last() and length != max_steps:
        timestep = environment.step(policy(timestep))
        total += timestep.reward
        compliance += environment.task.terms["gait_bonus"]
        length += 1
    seconds = length * environment.control_timestep()
    speed = (environment.physics.position()[0] - start) / seconds
    return Episode(float(total), length, float(speed), float(compliance / length))


def episodes(environment, policy, count: int, seed: int = 0, progress: Callable = iter) -> list[Episode]:
    """Runs episodes seeded `seed`, `seed + 1`, ...

    Args:
        environment: of `arc_suite.load`.
        policy: maps a `TimeStep` to an action.
        count: how many.
        seed: of the first.
        progress: wraps the iteration over seeds, such as `tqdm`.

    Returns:
        One `Episode` for each seed.
    """
    return [run(environment, policy, s) for s in progress(range(seed, seed + count))]


def mean_and_deviation(values) -> tuple[float, float]:
    """Mean and population standard deviation."""
    return float(np.mean(values)), float(np.std(values))
