"""Policies: one protocol of acting, and policies by name."""

from arc_suite.policies.hints import refuse_other_files, refuse_other_words
from arc_suite.policies.named import (
    HELP,
    POLICIES,
    PRESET_HELP,
    acting,
    check_preset,
    digest,
    function_file,
    is_file,
    is_packaged,
    load_network,
    policy,
    preset_names,
    setup_of,
    training_seeds,
)
from arc_suite.policies.protocol import Individuals, Mixture, Policy, PolicyFunction, Script, Sum, alone

__all__ = [
    "is_packaged",
    "policy",
    "POLICIES",
    "preset_names",
    "refuse_other_files",
    "refuse_other_words",
    "load_network",
    "setup_of",
    "training_seeds",
    "digest",
    "is_file",
    "function_file",
    "HELP",
    "PRESET_HELP",
    "Policy",
    "PolicyFunction",
    "Individuals",
    "Mixture",
    "Script",
    "Sum",
    "acting",
    "check_preset",
    "alone",
]
