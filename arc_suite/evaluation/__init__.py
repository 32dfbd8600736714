"""Evaluation of policies: the protocol, and statistics over episodes."""

from arc_suite.evaluation.protocol import (
    CURVE_EPISODES,
    EPISODES,
    EpisodeResult,
    check_ends,
    episodes,
    episodes_in_batch,
    paper_return,
    published_returns,
    rollout,
    run,
)
from arc_suite.evaluation.reports import Report, evaluate
from arc_suite.evaluation.statistics import (
    MIN_RUNS,
    Curve,
    Summary,
    curve,
    difference_and_interval,
    interquartile_mean,
    iqm_and_interval,
    mean_and_interval,
    performance_profile,
    probability_of_improvement,
    summary,
)

__all__ = [
    "CURVE_EPISODES",
    "EPISODES",
    "MIN_RUNS",
    "Curve",
    "EpisodeResult",
    "Report",
    "check_ends",
    "Summary",
    "curve",
    "difference_and_interval",
    "episodes",
    "episodes_in_batch",
    "evaluate",
    "interquartile_mean",
    "iqm_and_interval",
    "mean_and_interval",
    "paper_return",
    "performance_profile",
    "probability_of_improvement",
    "published_returns",
    "rollout",
    "run",
    "summary",
]
