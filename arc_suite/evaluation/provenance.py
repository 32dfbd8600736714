"""What the results of an evaluation depend on: hashes of body, model, task and policy, and what it learned from."""

import hashlib
import os
from typing import Any

from arc_suite import checks, policies, seed_ranges
from arc_suite.envs.setup import Setup
from arc_suite.simulation.model_hash import PHYSICS

_FIELDS = ("robot", "task", "task_kwargs", "task_version", "task_sha256", "body_sha256", PHYSICS)
UNKNOWN = "training data unknown"


def of_setup(setup: Setup) -> dict[str, Any]:
    """Return what the results of a setup depend on, for JSON: names, settings, and hashes of body, model and task.

    A task that draws its starts from a table adds the hash of the table.
    """
    task = setup.definition
    values = setup.provenance()
    values["task_sha256"] = hashlib.sha256(checks.full_repr(task.settings).encode()).hexdigest()
    record = {name: values[name] for name in _FIELDS}
    if task.start_table is not None:
        record["start_sha256"] = hashlib.sha256(task.start_table.tobytes()).hexdigest()
    return record


def policy_sha256(policy: str) -> str | None:
    """Return the hash of a policy's files; None for one without files, such as a demonstrator."""
    is_file = policies.is_file(policy) or policy.lower().endswith(".npz")
    has_files = is_file or policies.function_file(policy) is not None
    return policies.digest(policy) if has_files else None


def training_seeds(policy, played: range) -> seed_ranges.Ranges | None:
    """Return the seeds of the episodes that a policy learned from; None if they are unknown.

    Args:
        policy: name of the policy, as on the command line, or the policy.
        played: seeds of the episodes that evaluate it.

    Raises:
        ValueError: the policy learned from some of the seeds of `played`.
    """
    learned_seeds = policies.training_seeds(policy)
    shared_seeds = seed_ranges.common_seeds(learned_seeds or (), played)
    if shared_seeds:
        hint = f"those below {seed_ranges.COLLECTING.start} are evaluation's"
        name = f"policy {policy}" if isinstance(policy, str | os.PathLike) else "policy"
        raise ValueError(f"{name}: learned from episodes of seeds {shared_seeds.start} to {shared_seeds[-1]}; {hint}")
    return learned_seeds
