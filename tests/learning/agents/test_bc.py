"""Behavior cloning: it acts as its dataset does, goes on to the same bits, and refuses what does not fit."""

import numpy as np
import pytest

pytest.importorskip("jax", reason="of the extra learn: make check-agents")

from conftest import SHORT, learning

from arc_suite import data
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents.configuration import Configuration

SMALL_NETWORK = {"hidden": 32, "batch": 64}


@pytest.fixture
def begun(tmp_path):
    """A function that begins to learn from a dataset, or none."""

    def begin(prior, **context):
        setup = Setup.of("tick", "walk", SHORT)
        return learning("bc", SMALL_NETWORK, tmp_path / "run", setup, 1000, 1000, prior=prior, **context)

    return begin


def test_it_learns_the_actions_of_its_dataset(begun, prior):
    agent = begun(prior)
    errors = [agent.advance().metrics["error"] for _ in range(2)]
    assert agent.usage.steps_by_learner == 1000 and not agent.usage.environment_steps
    assert errors[1] < 0.5 * errors[0]
    episodes = list(data.open(prior))
    observations = np.concatenate([episode.observations[:-1] for episode in episodes])
    actions = np.concatenate([episode.actions for episode in episodes])
    learned = agent.latest.policy(observations)
    # Most of it; the demonstrator starts by a clock that the network does not see.
    assert ((learned - actions) ** 2).mean() < 0.3 * actions.var()
    # The normalizer has the moments of the whole dataset.
    mean, factor = (agent.latest.policy.arrays[name] for name in ("0", "1"))
    np.testing.assert_allclose(mean, observations.mean(axis=0), atol=1e-5)
    moving = observations.std(axis=0) > 1e-3
    np.testing.assert_allclose(1.0 / factor[moving], observations.std(axis=0)[moving], rtol=1e-3)


def test_it_resumes_bit_exactly(begun, prior):
    whole = begun(prior)
    half = whole.advance()
    assert whole.step == 500
    resumed = begun(prior, checkpoint=half.checkpoint).advance()
    last = whole.advance()
    assert whole.step == 1000
    assert last.metrics == resumed.metrics
    for name, array in last.checkpoint.items():
        assert array.tobytes() == resumed.checkpoint[name].tobytes(), name


def test_without_a_dataset_it_says_what_it_takes(begun):
    with pytest.raises(
        ValueError, match=r"^prior: the algorithm needs the id of a dataset, which arc-suite collect makes, got None$"
    ):
        begun(None).advance()


def test_it_learns_where_a_task_has_settings_of_training(tmp_path, monkeypatch):
    """Those of `recover` are no settings of the caller, also in the record of a run."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    setup = Setup.of("tick", "recover")
    collected = data.DatasetSettings(setup.learning(), "zero", (), steps=8)
    data.collect("arc_suite/falls-v0", collected, 2, threads=1)
    run = Configuration.of(setup, "bc", SMALL_NETWORK, steps=4, evaluate_every=4, prior="arc_suite/falls-v0")
    assert Configuration.from_dict(run.to_dict()) == run
    assert "--train_set" not in run.command
    agent = learning("bc", SMALL_NETWORK, tmp_path / "run", setup, 4, 4, prior="arc_suite/falls-v0")
    assert agent.advance().metrics["error"] >= 0.0
    with pytest.raises(ValueError, match="^training: expected no settings, as the algorithm makes no step, got kicks$"):
        Configuration.of(setup, "bc", training={"kicks": 1.0})
