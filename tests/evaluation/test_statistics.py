"""Figures over episodes."""

import numpy as np
import pytest

from arc_suite import evaluation


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
