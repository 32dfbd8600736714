"""Policies: one protocol of acting, and policies by name."""

from arc_suite.policies.named import (
    HELP,
    POLICIES,
    PRESET_HELP,
    digest,
    function_file,
    is_file,
    policy,
    preset_names,
    setup_of,
    trained,
    training_seeds,
)
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
    "digest",
    "function_file",
    "is_file",
    "policy",
    "preset_names",
    "setup_of",
    "trained",
    "training_seeds",
]
