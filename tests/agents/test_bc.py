"""Behaviour cloning: it acts as its dataset does, goes on to the same bits, and refuses what does not fit."""

import numpy as np
import pytest

pytest.importorskip("jax", reason="of the extra agents: make check-agents")

from conftest import SHORT

from arc_suite import data
from arc_suite.agents import algorithms
from arc_suite.agents.learner import Stage
from arc_suite.policies.network import forward
from arc_suite.robots import ROBOTS


@pytest.fixture
def begin(tmp_path):
    """A function that begins a learner with a dataset, or none."""

    def begin(prior):
        definition = algorithms.algorithm("cloning").with_row({"hidden": 32, "batch": 64})
        stage = Stage(ROBOTS["tick"], "walk", SHORT, 0, 1000, tmp_path / "run", prior)
        return definition.module.begin(definition.row, stage)

    return begin


def test_it_learns_the_actions_of_its_dataset(begin, prior):
    cloner = begin(prior)
    errors = [cloner.advance(1000)["error"] for _ in range(2)]
    assert cloner.step == 1000
    assert errors[1] < 0.5 * errors[0]
    episodes = list(data.open(prior))
    observations = np.concatenate([episode.observations[:-1] for episode in episodes])
    actions = np.concatenate([episode.actions for episode in episodes])
    said = forward(cloner.policy(), observations)
    # Most of it; the demonstrator sets out by a clock that nobody sees.
    assert ((said - actions) ** 2).mean() < 0.3 * actions.var()
    # The network sees its observations normalised by the moments of the whole dataset.
    mean, factor, _ = cloner.policy()[0].arrays
    np.testing.assert_allclose(mean, observations.mean(axis=0), atol=1e-5)
    moving = observations.std(axis=0) > 1e-3
    np.testing.assert_allclose(1.0 / factor[moving], observations.std(axis=0)[moving], rtol=1e-3)


def test_it_goes_on_to_the_same_bits(begin, prior):
    whole, resumed = begin(prior), begin(prior)
    whole.advance(1000)
    resumed.restore(whole.arrays())
    assert whole.step == resumed.step == 500
    assert whole.advance(1000) == resumed.advance(1000)
    for name, array in whole.arrays().items():
        assert array.tobytes() == resumed.arrays()[name].tobytes(), name


def test_without_a_dataset_it_says_what_it_takes(begin):
    with pytest.raises(ValueError, match=r"^prior: the algorithm takes prior data, the id of a dataset, got None$"):
        begin(None)
