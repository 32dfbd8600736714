"""The evaluation protocol, in one place: ten seeded episodes, deterministic actions, and how figures are summed up."""

import importlib.metadata
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

EPISODES = 10  # the paper's Section 6, Experimental Setting

# Returns of the paper's demonstrators, the expert lines of its figures.
EXPERT_RETURNS = {"queen": 2048.0, "bastion": 2311.0, "tick": 1971.0, "leaper": 2630.0}

RESAMPLES = 10_000  # of the bootstrap
CONFIDENCE = 0.95


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


class Summary(NamedTuple):
    """A figure over episodes; episodes in which it is NaN are left out, NaN if that is all of them.

    Attributes:
        mean: of the values.
        deviation: population standard deviation.
        iqm: interquartile mean.
        interval: lower and upper end of the 95 % bootstrap interval of the interquartile mean.
        episodes: how many values there are.
    """

    mean: float
    deviation: float
    iqm: float
    interval: tuple[float, float]
    episodes: int


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


def summary(values: Sequence[float]) -> Summary:
    """Sums a figure up over episodes.

    Args:
        values: one for each episode; NaN where it is undefined; may be infinite.
    """
    values = np.asarray(values, dtype=float)
    values = values[~np.isnan(values)]
    if not values.size:
        return Summary(np.nan, np.nan, np.nan, (np.nan, np.nan), 0)
    with np.errstate(invalid="ignore"):  # inf - inf: the deviation of infinite values is NaN
        deviation = float(values.std())
    return Summary(float(values.mean()), deviation, *iqm_and_interval([values]), values.size)


def interquartile_mean(values) -> np.ndarray:
    """Mean of the middle half, over the last axis: (..., n) to (...).

    A quarter of the values, rounded down, is cut off at either end, as in rliable and in SciPy's
    `trim_mean` (Agarwal et al., "Deep reinforcement learning at the edge of the statistical
    precipice", 2021).
    """
    values = np.sort(values, axis=-1)
    cut = values.shape[-1] // 4
    return values[..., cut : values.shape[-1] - cut].mean(axis=-1)


def iqm_and_interval(strata: Sequence[Sequence[float]], seed: int = 0) -> tuple[float, tuple[float, float]]:
    """Interquartile mean of all values, with its stratified bootstrap interval (Agarwal et al., 2021).

    Every resample draws as many values from each stratum as it has; the interval lies between the
    2.5th and the 97.5th percentile of the resamples' interquartile means.

    Args:
        strata: values by stratum, such as the returns of each robot; at least one value in each.
        seed: of the resampling.

    Returns:
        The interquartile mean, and the ends of the interval.
    """
    random = np.random.default_rng(seed)
    strata = [np.asarray(values, dtype=float) for values in strata]
    resamples = np.concatenate([random.choice(values, (RESAMPLES, values.size)) for values in strata], axis=-1)
    tail = 50.0 * (1.0 - CONFIDENCE)
    # Nearest ranks, as interpolation between infinite values has no result.
    low, high = np.percentile(interquartile_mean(resamples), [tail, 100.0 - tail], method="nearest")
    return float(interquartile_mean(np.concatenate(strata))), (float(low), float(high))


def versions() -> dict[str, str | None]:
    """Versions of what results depend on, by package; None for a package that is not installed."""

    def version(package):
        try:
            return importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            return None

    return {name: version(name) for name in ("arc_suite", "mujoco", "dm_control", "numpy")}
