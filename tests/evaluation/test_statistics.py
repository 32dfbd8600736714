"""Figures over episodes and over runs."""

import numpy as np
import pytest

from arc_suite import evaluation
from arc_suite.evaluation import statistics


def test_interquartile_mean_cuts_a_quarter_at_either_end():
    assert evaluation.interquartile_mean([100.0, 2.0, 4.0, -50.0]) == 3.0
    assert evaluation.interquartile_mean(np.arange(10.0)) == 4.5  # 2 and 7 are the outermost that count
    assert evaluation.interquartile_mean([0, 0, 3, 3, 3, 3, 3, 9, 9, 90]) == 4.0
    assert evaluation.interquartile_mean([1.0, 2.0, 6.0]) == 3.0  # too few to cut any
    np.testing.assert_array_equal(evaluation.interquartile_mean([[4, 3, 2, 1], [0, 0, 8, 0]]), [2.5, 0.0])


def test_interval_holds_most_of_the_resamples():
    values = np.random.default_rng(1).normal(10.0, 2.0, 400)
    iqm, (low, high) = evaluation.iqm_and_interval([values])
    assert low < iqm < high
    # The interquartile mean of n normal values deviates by about 1.09 sigma / sqrt(n).
    assert high - low == pytest.approx(2 * 1.96 * 1.09 * 2.0 / 20.0, rel=0.15)
    assert evaluation.iqm_and_interval([values]) == (iqm, (low, high))


def test_interval_resamples_within_strata():
    iqm, interval = evaluation.iqm_and_interval([[0.0] * 4, [1.0] * 4])
    assert (iqm, interval) == (0.5, (0.5, 0.5))
    _, (low, high) = evaluation.iqm_and_interval([[0.0] * 4 + [1.0] * 4])
    assert low < 0.5 < high


def test_summary():
    summary = evaluation.summary([1.0, 2.0, 3.0, 10.0])
    assert summary.mean == 4.0
    assert summary.deviation == pytest.approx(np.sqrt((9 + 4 + 1 + 36) / 4))
    assert summary.iqm == 2.5
    assert 1.0 <= summary.interval[0] <= 2.5 <= summary.interval[1] <= 10.0
    assert summary.episodes == 4


@pytest.mark.filterwarnings("error")
def test_summary_of_what_is_undefined_or_infinite():
    assert evaluation.summary([np.nan, 3.0]) == (3.0, 0.0, 3.0, (3.0, 3.0), 1)
    assert np.isnan(evaluation.summary([np.nan]).mean)
    assert evaluation.summary([np.nan]).episodes == 0
    infinite = evaluation.summary([np.inf, 3.0])
    assert infinite.mean == infinite.iqm == infinite.interval[1] == np.inf
    assert infinite.interval[0] == 3.0
    assert np.isnan(infinite.deviation)


def test_probability_of_improvement():
    """Of pairs of runs of the same stratum, a tie counting half; strata count equally."""
    estimate, interval = evaluation.probability_of_improvement([[1.0, 2.0, 3.0]], [[0.0, 2.0]])
    assert estimate == pytest.approx((3 + 1 + 0.5 + 0) / 6)
    assert 0.0 <= interval[0] < estimate < interval[1] <= 1.0
    estimate, interval = evaluation.probability_of_improvement([[1.0] * 3, [0.0]], [[0.0] * 5, [1.0]])
    assert (estimate, interval) == (0.5, (0.5, 0.5))
    with pytest.raises(ValueError, match=r"^strata: expected as many of X as of Y, got 1 and 2$"):
        evaluation.probability_of_improvement([[1.0]], [[1.0], [2.0]])


def test_performance_profile():
    profile = evaluation.performance_profile([[1.0, 2.0], [3.0, 4.0, 5.0, 6.0]], [0.0, 1.0, 3.0, 5.5, 6.0])
    np.testing.assert_allclose(profile.mean, [1.0, 0.75, 0.375, 0.125, 0.0])
    assert (profile.low <= profile.mean).all() and (profile.mean <= profile.high).all()
    assert profile.low[0] == profile.high[0] == 1.0


def test_an_interval_of_few_runs_is_students():
    mean, interval = evaluation.mean_and_interval([[1.0, 2.0, 3.0]])
    assert mean == 2.0
    assert interval == pytest.approx((2.0 - 4.302653 / np.sqrt(3.0), 2.0 + 4.302653 / np.sqrt(3.0)))
    assert evaluation.mean_and_interval([[1.0] * 3, [0.0] * 4]) == (0.5, (0.5, 0.5))


@pytest.mark.slow
def test_an_interval_over_strata_is_that_of_welch():
    """The mean of x and y is half of the difference of x and -y, which SciPy tests."""
    from scipy import stats

    random = np.random.default_rng(2)
    x = random.normal(1.0, 0.1, 3)
    y = random.normal(0.5, 0.4, 7)
    expected = stats.ttest_ind(x, -y, equal_var=False).confidence_interval()
    mean, interval = evaluation.mean_and_interval([x, y])
    assert mean == pytest.approx((x.mean() + y.mean()) / 2)
    np.testing.assert_allclose(interval, [expected.low / 2, expected.high / 2])


def test_a_difference_has_the_interval_of_welch():
    stats = pytest.importorskip("scipy.stats")
    x, y = [0.82, 0.91, 0.78, 0.95], [0.60, 0.44, 0.71]
    difference, interval = evaluation.difference_and_interval([x], [y])
    expected = stats.ttest_ind(x, y, equal_var=False).confidence_interval(0.95)
    np.testing.assert_allclose((difference, *interval), (np.mean(x) - np.mean(y), expected.low, expected.high))
    # Places count equally: twice the same place halves the variance of the mean.
    of_two, (low, high) = evaluation.difference_and_interval([x, x], [y, y])
    assert of_two == pytest.approx(difference) and 0.0 < high - low < 0.75 * (interval[1] - interval[0])
    reverse, (reverse_low, reverse_high) = evaluation.difference_and_interval([y], [x])
    np.testing.assert_allclose((reverse, reverse_high, reverse_low), (-difference, -interval[0], -interval[1]))
    assert np.isnan(evaluation.difference_and_interval([x], [y[:2]])[1]).all()


@pytest.mark.parametrize(
    "strata", [[], [[]], [[1.0], [np.nan, 2.0]], [[1.0], 2.0]], ids=["none", "empty", "nan", "flat"]
)
def test_strata_without_numbers_are_one_line(strata):
    line = r"^strata(_x)?(\[[01]\])?: expected (at least one (stratum|of X)|one number or)"
    for figure in (
        evaluation.mean_and_interval,
        evaluation.iqm_and_interval,
        lambda strata: evaluation.performance_profile(strata, [0.5]),
        lambda strata: evaluation.probability_of_improvement(strata, strata),
        lambda strata: evaluation.difference_and_interval(strata, strata),
    ):
        with pytest.raises(ValueError, match=line):
            figure(strata)


def test_learners_without_a_common_place_are_one_line():
    for figure in (evaluation.difference_and_interval, evaluation.probability_of_improvement):
        with pytest.raises(ValueError) as caught:
            figure([], [])
        assert str(caught.value) == (
            "strata: expected at least one of X and of Y, got none; the two learners have no place in common, or one "
            "of them has no scores"
        )


@pytest.mark.parametrize("strata", [[[1.0]], [[1.0, 2.0]], [[1.0, 2.0, 3.0], [1.0, 2.0]]])
def test_fewer_than_three_runs_have_no_interval(strata):
    mean, interval = evaluation.mean_and_interval(strata)
    assert mean == np.mean([np.mean(values) for values in strata])
    assert np.isnan(interval).all()


@pytest.mark.parametrize("strata_count", [1, 10])
@pytest.mark.parametrize("run_count", [3, 5, 10])
def test_intervals_hold_the_mean_of_normal_scores(strata_count, run_count):
    """In 93 % of experiments or more, though the strata's scores spread differently; the bootstrap had 75 to 91 %."""
    random = np.random.default_rng(7)
    spreads = np.linspace(1.0, 5.0, strata_count)
    strata = [random.normal(3.0, spread, (5000, run_count)) for spread in spreads]
    _, low, high = statistics.student_interval(strata)
    assert 0.93 <= np.mean((low <= 3.0) & (high >= 3.0)) <= 0.975


def test_curve():
    """Runs that lie apart by a constant give intervals of one width."""
    course = np.linspace(0.0, 100.0, 7)
    runs = course + np.arange(8.0)[:, None]
    curve = evaluation.curve([runs])
    np.testing.assert_allclose(curve.mean, course + 3.5)
    np.testing.assert_allclose(curve.high - curve.low, (curve.high - curve.low)[0])
    for point, values in enumerate(runs.T):
        mean, interval = evaluation.mean_and_interval([values])
        np.testing.assert_allclose([curve.mean[point], curve.low[point], curve.high[point]], [mean, *interval])


def test_a_curve_of_two_runs_has_no_intervals():
    curve = evaluation.curve([[[1.0, 2.0, 3.0], [3.0, 4.0, 5.0]]])
    np.testing.assert_array_equal(curve.mean, [2.0, 3.0, 4.0])
    assert np.isnan([curve.low, curve.high]).all()


class TestBesideRliable:
    """rliable (Agarwal et al., 2021) is an oracle here and no dependency."""

    scores = np.random.default_rng(3).normal(2000.0, 300.0, (2, 8, 4)) + [0.0, 200.0, 500.0, 900.0]
    x, y = scores[0], scores[1]  # (runs, robots)

    @pytest.fixture
    def rliable(self):
        pytest.importorskip("rliable", reason="an oracle: make check-agents")
        from rliable import library, metrics

        return library, metrics

    def test_interquartile_mean(self, rliable):
        library, metrics = rliable
        estimate, interval = evaluation.iqm_and_interval(list(self.x.T))
        expected, ends = library.get_interval_estimates(
            {"x": self.x}, lambda scores: np.array([metrics.aggregate_iqm(scores)]), reps=5000
        )
        assert estimate == pytest.approx(expected["x"][0])
        np.testing.assert_allclose(interval, ends["x"][:, 0], rtol=0.01)

    def test_probability_of_improvement(self, rliable):
        library, metrics = rliable
        estimate, interval = evaluation.probability_of_improvement(list(self.x.T), list(self.y.T))
        expected, ends = library.get_interval_estimates(
            {"x,y": (self.x, self.y)}, metrics.probability_of_improvement, reps=1000
        )
        assert estimate == pytest.approx(expected["x,y"])
        np.testing.assert_allclose(interval, np.ravel(ends["x,y"]), atol=0.03)

    def test_performance_profile(self, rliable):
        library, _ = rliable
        thresholds = np.linspace(1000.0, 4000.0, 13)
        profile = evaluation.performance_profile(list(self.x.T), thresholds)
        expected, ends = library.create_performance_profile({"x": self.x}, thresholds, reps=2000)
        np.testing.assert_allclose(profile.mean, expected["x"])
        np.testing.assert_allclose([profile.low, profile.high], ends["x"], atol=0.04)
