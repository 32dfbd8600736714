"""Central pattern generators that demonstrate how a robot walks (the paper's Section 5)."""

from arc_suite.cpg.demonstrator import Demonstrator
from arc_suite.cpg.selection import suited_preset

__all__ = ["Demonstrator", "suited_preset"]
