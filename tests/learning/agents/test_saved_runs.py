"""Runs of every learner that an earlier version began go on, and their policies act; see `tests/saved_files.py`."""

import numpy as np
import pytest
import saved_files
from tiers import tiers

pytest.importorskip("jax", reason="of the extra learn: make check-agents")

from arc_suite import policies
from arc_suite.learning.agents.training import train


def check_policy(folder):
    """Check that the policy of a run gives actions."""
    policy = policies.network.load(folder)
    observations = np.ones((2, sum(policy.blocks.values())), np.float32)
    actions = policy.actions(observations)
    assert len(actions) == 2 and np.isfinite(actions).all()


# One of each kind of learner; the others differ from them by hyperparameters.
OFTEN = ("sac_parallel", "ppo", "finetune", "dagger", "dagger_bodies", "bc")


@pytest.mark.parametrize("algorithm", tiers(saved_files.HYPERPARAMETERS, OFTEN.__contains__))
def test_a_run_goes_on_and_its_policy_acts(algorithm, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folder = saved_files.unpack(f"runs/{algorithm}", tmp_path)
    table = folder / "evaluations.csv"
    evaluations = table.read_text() if table.exists() else ""
    if evaluations:
        check_policy(folder)
    with saved_files.datasets_in(tmp_path / "datasets"):
        configuration = saved_files.configuration_of_run(algorithm, tmp_path)
        assert train(configuration, folder, progress=saved_files.silent)
    continued = table.read_text()
    assert continued.startswith(evaluations) and len(continued) > len(evaluations)
    check_policy(folder)
