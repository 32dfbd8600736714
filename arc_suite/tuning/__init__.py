"""Search for the demonstrators' parameters with the highest return."""

from arc_suite.tuning.evaluator import Evaluator, Score
from arc_suite.tuning.journal import Journal
from arc_suite.tuning.search import Generation, Search
from arc_suite.tuning.space import Space

__all__ = ["Evaluator", "Generation", "Journal", "Score", "Search", "Space"]
