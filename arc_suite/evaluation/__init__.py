"""Evaluation of policies: the protocol, and figures over episodes."""

from arc_suite.evaluation.protocol import EPISODES, Episode, episodes, episodes_in_rows, expert_return, rollout, run
from arc_suite.evaluation.statistics import Summary, interquartile_mean, iqm_and_interval, summary

__all__ = [
    "EPISODES",
    "Episode",
    "Summary",
    "episodes",
    "episodes_in_rows",
    "expert_return",
    "interquartile_mean",
    "iqm_and_interval",
    "rollout",
    "run",
    "summary",
]
