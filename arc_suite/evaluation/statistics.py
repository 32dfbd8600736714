"""Figures over episodes: interquartile means and their bootstrap intervals."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

RESAMPLES = 10_000  # of the bootstrap
CONFIDENCE = 0.95


class Summary(NamedTuple):
    """The summary of a figure over episodes; those in which it is NaN are left out, NaN if that is all of them.

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


def summary(values: Sequence[float]) -> Summary:
    """Return the summary of a figure over episodes.

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
    """Return the mean of the middle half, over the last axis: (..., n) to (...).

    A quarter of the values, rounded down, is cut off at either end, as in rliable and in SciPy's
    `trim_mean` (Agarwal et al., "Deep reinforcement learning at the edge of the statistical
    precipice", 2021).
    """
    values = np.sort(values, axis=-1)
    cut = values.shape[-1] // 4
    return values[..., cut : values.shape[-1] - cut].mean(axis=-1)


def iqm_and_interval(strata: Sequence[Sequence[float]], seed: int = 0) -> tuple[float, tuple[float, float]]:
    """Return the interquartile mean of all values, with its stratified bootstrap interval (Agarwal et al., 2021).

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
