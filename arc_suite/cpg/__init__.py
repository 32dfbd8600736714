"""Central pattern generators that demonstrate how a robot walks (the paper's Section 5)."""

from arc_suite.cpg.demonstrator import Demonstrator
from arc_suite.cpg.presets import PRESETS

__all__ = ["PRESETS", "Demonstrator"]
