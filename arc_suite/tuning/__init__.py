"""Search for the demonstrators' numbers that earn most."""

from arc_suite.tuning.journal import Journal
from arc_suite.tuning.judge import Judge, Score
from arc_suite.tuning.search import Generation, Search
from arc_suite.tuning.space import Space

__all__ = ["Generation", "Journal", "Judge", "Score", "Search", "Space"]
