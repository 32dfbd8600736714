"""Search for the demonstrators' parameters with the highest return."""

from arc_suite.learning.tuning.evaluator import Evaluator, PresetScore
from arc_suite.learning.tuning.search import Generation, Search
from arc_suite.learning.tuning.space import Space

__all__ = ["Evaluator", "Generation", "PresetScore", "Search", "Space"]
