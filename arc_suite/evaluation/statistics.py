"""Statistics over episodes and over runs.

Means over runs, which are few, have intervals of Student's t. Interquartile means of episodes, which are many,
probabilities of improvement and performance profiles have stratified bootstrap intervals: they are those of Agarwal
et al., "Deep reinforcement learning at the edge of the statistical precipice", 2021.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

RESAMPLES = 10_000  # of the bootstrap
CONFIDENCE = 0.95
MIN_RUNS = 3  # of a mean with an interval
_TAILS = (50.0 * (1.0 - CONFIDENCE), 50.0 * (1.0 + CONFIDENCE))  # percentiles at the ends of an interval


class Summary(NamedTuple):
    """The summary of a figure over episodes; those in which it is NaN are left out, NaN if that is all of them.

    Attributes:
        mean: mean of the values.
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
    2.5th and the 97.5th percentile of the resamples' interquartile means. Of a hundred episodes it covers 94 to 96 %;
    for a few runs it is too narrow, see `mean_and_interval`.

    Args:
        strata: values by stratum, such as the returns of each robot's episodes; at least one value in each.
        seed: seed of the resampling.

    Returns:
        The interquartile mean, and the ends of the interval.

    Raises:
        ValueError: no strata, or one holds no value, or NaN.
    """
    random = np.random.default_rng(seed)
    samples = _samples("strata", strata)
    resamples = np.concatenate([random.choice(values, (RESAMPLES, values.size)) for values in samples], axis=-1)
    return float(interquartile_mean(np.concatenate(samples))), _interval(interquartile_mean(resamples))


def mean_and_interval(strata: Sequence[Sequence[float]]) -> tuple[float, tuple[float, float]]:
    """Return the mean over strata of their means over runs, with its 95 % interval of Student's t.

    Strata count equally, whatever their number of runs, and a weak one lowers the mean. Of several strata, the degrees
    of freedom are those of Welch (1947) and Satterthwaite (1946), as variances may differ. The interval is right for
    normal scores. Where few runs fail it is too narrow: docs/benchmark.md says by how much.

    Args:
        strata: values by stratum, such as the scores of runs in each place; at least one value in each.

    Returns:
        The mean, and the ends of the interval; they are NaN if a stratum has fewer than `MIN_RUNS` runs.

    Raises:
        ValueError: no strata, or one holds no value, or NaN.
    """
    mean, low, high = student_interval(_samples("strata", strata))
    return float(mean), (float(low), float(high))


def difference_and_interval(
    strata_x: Sequence[Sequence[float]], strata_y: Sequence[Sequence[float]]
) -> tuple[float, tuple[float, float]]:
    """Return by how much the mean of X exceeds that of Y, with its 95 % interval of Student's t.

    Runs of X and Y are independent. Means and degrees of freedom are those of `mean_and_interval`. A difference whose
    interval holds 0 may be one of seeds alone.

    Args:
        strata_x: values of X by stratum, such as the scores of runs in each place; at least one value in each.
        strata_y: values of Y, in the same strata.

    Returns:
        The difference, and the ends of the interval; they are NaN if a stratum has fewer than `MIN_RUNS` runs.

    Raises:
        ValueError: no strata, different numbers of them, or one without a value or with NaN.
    """
    samples_x, samples_y = _sample_pairs(strata_x, strata_y)
    # The mean over all 2 n strata of X and of -Y is half of the mean difference.
    halves = student_interval([*samples_x, *(-values for values in samples_y)])
    difference, low, high = (2.0 * float(value) for value in halves)
    return difference, (low, high)


def student_interval(strata: Sequence[np.ndarray]) -> np.ndarray:
    """Return means with the lower and upper ends of their intervals, (3, ...), as `mean_and_interval`.

    Args:
        strata: (..., runs) values by stratum.
    """
    from scipy.special import stdtrit  # takes a third of a second

    mean = np.mean([values.mean(axis=-1) for values in strata], axis=0)
    run_counts = np.array([values.shape[-1] for values in strata])
    if run_counts.min() < MIN_RUNS:
        return np.stack([mean, np.full_like(mean, np.nan), np.full_like(mean, np.nan)])
    # Variances of the means of strata, with the strata last.
    variances = np.stack([values.var(axis=-1, ddof=1) for values in strata], axis=-1) / run_counts
    total_variance = variances.sum(axis=-1)
    # Degrees of freedom by Welch and Satterthwaite; 1 where all runs of each stratum are equal.
    sum_of_squares = (variances**2 / (run_counts - 1)).sum(axis=-1)
    degrees = np.divide(total_variance**2, sum_of_squares, out=np.ones_like(mean), where=sum_of_squares > 0.0)
    half_width = stdtrit(degrees, 0.5 + CONFIDENCE / 2) * np.sqrt(total_variance) / len(strata)
    return np.stack([mean, mean - half_width, mean + half_width])


class Curve(NamedTuple):
    """Means along training, or along thresholds, with pointwise 95 % intervals.

    Attributes:
        mean: (points,)
        low: (points,) lower ends of the intervals.
        high: (points,) upper ends.
    """

    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray


def probability_of_improvement(strata_x, strata_y, seed: int = 0) -> tuple[float, tuple[float, float]]:
    """Return the probability that a run of X earns more than one of Y, with its stratified bootstrap interval.

    It is the mean over strata of P(x > y) + P(x = y) / 2, of the Mann-Whitney statistic (Agarwal et al., 2021).

    Args:
        strata_x: scores of X by stratum, such as of each robot; one for each run.
        strata_y: scores of Y, in the same strata.
        seed: seed of the resampling.

    Returns:
        The probability, and the ends of the interval.

    Raises:
        ValueError: no strata, different numbers of them, or one without a value or with NaN.
    """
    random = np.random.default_rng(seed)
    pairs = list(zip(*_sample_pairs(strata_x, strata_y), strict=True))
    resamples = np.mean(
        [_win_rate(random.choice(x, (RESAMPLES, x.size)), random.choice(y, (RESAMPLES, y.size))) for x, y in pairs],
        axis=0,
    )
    return float(np.mean([_win_rate(x, y) for x, y in pairs])), _interval(resamples)


def performance_profile(strata, thresholds, seed: int = 0) -> Curve:
    """Return the share of runs that score above each threshold, with pointwise stratified bootstrap intervals.

    Strata count equally, whatever their number of runs (Agarwal et al., 2021); `mean` holds the shares.

    Args:
        strata: scores by stratum, one for each run.
        thresholds: (points,)
        seed: seed of the resampling.

    Raises:
        ValueError: no strata, or one holds no score, or NaN.
    """
    random = np.random.default_rng(seed)
    thresholds = np.asarray(thresholds, float)
    samples = _samples("strata", strata)

    def shares(scores_of_strata):
        return np.mean([[(s > t).mean(axis=-1) for t in thresholds] for s in scores_of_strata], axis=0)

    resampled = shares([random.choice(scores, (RESAMPLES, scores.size)) for scores in samples])
    low, high = np.percentile(resampled, _TAILS, axis=-1, method="nearest")
    return Curve(shares(samples), low, high)


def curve(strata: Sequence[np.ndarray]) -> Curve:
    """Return the mean over runs at each point of training, with intervals as of `mean_and_interval`.

    Args:
        strata: (runs, points) scores by stratum, such as the returns of each robot at each evaluation.
    """
    return Curve(*student_interval([np.asarray(scores, float).T for scores in strata]))


def _samples(name: str, strata: Sequence[Sequence[float]]) -> list[np.ndarray]:
    """Return the values (runs,) of each stratum; ValueError if there are none, or one of them is NaN."""
    samples = [np.asarray(values, float) for values in strata]
    if not samples:
        raise ValueError(f"{name}: expected at least one stratum, got none")
    for number, values in enumerate(samples):
        if values.ndim != 1 or not values.size or np.isnan(values).any():
            cure = "; numbers of one stratum are a list in a list" if values.ndim == 0 else ""
            raise ValueError(
                f"{name}[{number}]: expected one number or more for each stratum, got {values.tolist()}{cure}"
            )
    return samples


def _sample_pairs(strata_x, strata_y) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the values of the strata of X and of Y; see `_samples`."""
    if len(strata_x) != len(strata_y):
        raise ValueError(f"strata: expected as many of X as of Y, got {len(strata_x)} and {len(strata_y)}")
    if not len(strata_x):
        what = "the two learners have no place in common, or one of them has no scores"
        raise ValueError(f"strata: expected at least one of X and of Y, got none; {what}")
    return _samples("strata_x", strata_x), _samples("strata_y", strata_y)


def _win_rate(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return P(x > y) + P(x = y) / 2 of all pairs of two samples, over the last axis."""
    first = x[..., :, None]
    second = y[..., None, :]
    return (np.greater(first, second) + 0.5 * np.equal(first, second)).mean(axis=(-2, -1))


def _interval(resamples: np.ndarray) -> tuple[float, float]:
    # Nearest ranks, as interpolation between infinite values has no result.
    low, high = np.percentile(resamples, _TAILS, method="nearest")
    return float(low), float(high)
