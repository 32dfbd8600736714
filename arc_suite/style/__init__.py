"""How well a robot walks, beside what it earns: recorded rollouts, metrics of style, and pictures of both."""

from arc_suite.style.metrics import METRICS, measure
from arc_suite.style.tracks import Track, record

__all__ = ["METRICS", "Track", "measure", "record"]
