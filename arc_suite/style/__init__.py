"""Style of movement: recorded rollouts, metrics of style, and pictures of both."""

from arc_suite.style.files import load, save
from arc_suite.style.measures import METRICS, measure, report
from arc_suite.style.sources import Source, source
from arc_suite.style.tracks import Track, record

__all__ = ["record", "measure", "report", "METRICS", "Track", "source", "Source", "save", "load"]
