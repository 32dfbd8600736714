"""How often the intervals of the benchmark hold the expected score, in simulation; a table in docs/benchmark.md."""

import numpy as np

from arc_suite.evaluation import statistics
from arc_suite.learning.studies.divisions import PLACES
from arc_suite.learning.studies.text_tables import table

SEED_COUNTS = (3, 5, 10)
PLACE_COUNTS = (1, len(PLACES))
FAILURES = 0.2  # share of seeds that fail
_EXPERIMENTS = 10_000
_SCORE = 0.9  # mean of the seeds that learn
_SPREADS = (0.02, 0.1)  # standard deviations of scores in the first and in the last place
_FAILED_SCORE = 0.1


def cover(places: int, seeds: int, failures: float = 0.0) -> float:
    """Return the share of experiments whose interval holds the expected mean score.

    Scores are normal, and spread differently in each place. Some seeds fail.

    Args:
        places: number of places.
        seeds: seeds of each place.
        failures: share of seeds that fail.
    """
    random = np.random.default_rng(0)
    strata = []
    for spread in np.linspace(*_SPREADS, places):
        scores = random.normal(_SCORE, spread, (_EXPERIMENTS, seeds))
        strata.append(np.where(random.random(scores.shape) < failures, _FAILED_SCORE, scores))
    expected_score = (1.0 - failures) * _SCORE + failures * _FAILED_SCORE
    _, low, high = statistics.student_interval(strata)
    return float(((low <= expected_score) & (expected_score <= high)).mean())


def text() -> str:
    """Return the table in Markdown."""
    columns = [(places, failures) for failures in (0.0, FAILURES) for places in PLACE_COUNTS]
    heads = ["seeds"]
    for places, failures in columns:
        what = f"{failures:.0%} fail" if failures else "normal"
        heads.append(f"{what}, {places} {'place' if places == 1 else 'places'}")
    lines = []
    for seeds in SEED_COUNTS:
        lines.append([str(seeds), *(f"{cover(places, seeds, failures):.0%}" for places, failures in columns)])
    return table(heads, lines)
