"""The search for a demonstrator's numbers: its course."""

import numpy as np
import pytest

from arc_suite.cpg.presets import PRESETS
from arc_suite.envs.setup import Setup
from arc_suite.learning.tuning import Evaluator, Search

SETTINGS = {"setup": Setup.of("bastion"), "seed": 3, "episodes": 2, "steps": 12, "starts": 8}


@pytest.mark.release
def test_a_search_goes_on_where_it_was_broken_off():
    straight, resumed = Search(**SETTINGS), Search(**SETTINGS)
    generations = [straight.step() for _ in range(4)]
    for generation in generations[:3]:
        assert resumed.step(generation.fitness) is None
    assert resumed.step() == generations[3]
    assert resumed.result() == straight.result()
    assert len(generations[0].fitness) == straight.candidates
    assert generations[0] != generations[1]


@pytest.mark.long
def test_a_search_for_torques_goes_on_where_it_was_broken_off_and_sets_out_from_tuned():
    settings = SETTINGS | {"setup": Setup.of("leaper"), "space": "torques", "episodes": 1, "steps": 40, "starts": 0}
    straight, resumed = Search(**settings), Search(**settings)
    generations = [straight.step() for _ in range(3)]
    for generation in generations[:2]:
        assert resumed.step(generation.fitness) is None
    assert resumed.step() == generations[2]
    assert resumed.result() == straight.result()
    assert [generation.tipping for generation in generations] == [0.0] * 3
    tuned = PRESETS["leaper"]["tuned"]
    assert straight.result()._replace(torques=None, steering=0.0) == tuned
    assert straight.candidates == 48


@pytest.mark.release
def test_a_search_learns():
    search = Search(**SETTINGS | {"episodes": 1, "steps": 80})
    first = search.step()
    for _ in range(14):
        last = search.step()
    assert np.median(last.fitness) > np.median(first.fitness)
    score = Evaluator(Setup.of("bastion"), 2, 2, 80)([search.result(), PRESETS["bastion"]["medium"]], [0, 1])
    tuned, medium = score.rewards.mean(axis=-1)
    assert tuned > medium
