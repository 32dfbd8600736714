"""How policies are judged: the protocol, and figures over episodes."""

from arc_suite.evaluation.protocol import EPISODES, EXPERT_RETURNS, Episode, episodes, rollout, run
from arc_suite.evaluation.statistics import Summary, interquartile_mean, iqm_and_interval, summary

__all__ = [
    "EPISODES",
    "EXPERT_RETURNS",
    "Episode",
    "Summary",
    "episodes",
    "interquartile_mean",
    "iqm_and_interval",
    "rollout",
    "run",
    "summary",
]
