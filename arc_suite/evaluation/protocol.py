"""The evaluation protocol, in one place: ten seeded episodes and deterministic actions."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

EPISODES = 10  # the paper's Section 6, Experimental Setting

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


def rollout(environment, policy, seed: int, max_steps: int | None = None) -> Iterator:
    """Plays one episode.

    Args:
        environment: of `arc_suite.load`.
        policy: maps a `TimeStep` to an action.
        seed: of the episode's initial state.
        max_steps: to stop early.

    Yields:
        The `TimeStep` of the reset and of every step; the environment stands there meanwhile.
    """
    environment.task.random.seed(seed)
    timestep = environment.reset()
    yield timestep
    length = 0
    while not timestep.last() and length != max_steps:
        timestep = environment.step(policy(timestep))
        length += 1
        yield timestep


def run(environment, policy, seed: int, max_steps: int | None = None) -> Episode:
    """Plays one episode and sums it up; the arguments are those of `rollout`."""
    total, compliance, length = 0.0, 0.0, 0
    for timestep in rollout(environment, policy, seed, max_steps):
        if timestep.first():
            start = environment.physics.position()[0]
            continue
        total += timestep.reward
        compliance += environment.task.terms["gait_bonus"]
        length += 1
    seconds = length * environment.control_timestep()
    speed = (environment.physics.position()[0] - start) / seconds
    return Episode(float(total), length, float(speed), float(compliance / length))


def episodes(environment, policy, seeds: Iterable[int] = range(EPISODES)) -> list[Episode]:
    """Runs one episode for each seed.

    Args:
        environment: of `arc_suite.load`.
        policy: maps a `TimeStep` to an action.
        seeds: of the episodes; those of the protocol if not given.

    Returns:
        One `Episode` for each seed.
    """
    return [run(environment, policy, seed) for seed in seeds]
