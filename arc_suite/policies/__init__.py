"""Policies: one protocol of acting, and policies by name."""

from arc_suite.policies.named import HELP, POLICIES, PRESET_HELP, is_file, policy, preset_names
from arc_suite.policies.protocol import Individuals, Mixture, Policy, Positioned, Script, Sum, alone

__all__ = [
    "HELP",
    "POLICIES",
    "PRESET_HELP",
    "Individuals",
    "Mixture",
    "Policy",
    "Positioned",
    "Script",
    "Sum",
    "alone",
    "is_file",
    "policy",
    "preset_names",
]
