"""Who acts: one protocol, and policies by name."""

from arc_suite.policies.named import HELP, POLICIES, PRESET_HELP, policy

__all__ = ["HELP", "POLICIES", "PRESET_HELP", "policy"]
