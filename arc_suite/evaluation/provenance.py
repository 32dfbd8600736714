"""What the results of an evaluation depend on: hashes of body, model, task and policy."""

import hashlib
from typing import Any

from arc_suite import policies
from arc_suite.envs.setup import Setup

FIELDS = ("robot", "task", "task_kwargs", "task_version", "task_sha256", "body_sha256", "model_sha256")


def of_setup(setup: Setup) -> dict[str, Any]:
    """Return, JSON-able, what a setup's results depend on: names, settings, and hashes of body, model and task."""
    settings = repr(setup.definition.settings)
    known = setup.provenance() | {"task_sha256": hashlib.sha256(settings.encode()).hexdigest()}
    return {name: known[name] for name in FIELDS}


def policy_sha256(policy: str) -> str | None:
    """Return the hash of a policy's files; None for one without files, such as a demonstrator."""
    return policies.digest(policy) if policies.is_file(policy) or policy.endswith(".npz") else None
