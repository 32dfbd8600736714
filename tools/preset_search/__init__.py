"""Search for the demonstrators' parameters with the highest return."""

from preset_search.evaluator import Evaluator, PresetScore
from preset_search.search import Generation, Search
from preset_search.space import Space

__all__ = ["Evaluator", "Generation", "PresetScore", "Search", "Space"]
