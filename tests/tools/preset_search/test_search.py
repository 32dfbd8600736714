"""The search for a demonstrator's numbers: its course."""

import numpy as np
import pytest
from preset_search import Evaluator, Search

from arc_suite.cpg.presets import PRESETS
from arc_suite.envs.setup import Setup

SETTINGS = {"setup": Setup.of("bastion"), "seed": 3, "episodes": 2, "steps": 12, "starts": 8}


def resumed(settings, count):
    """Search, and go on with the last generation in another search; return the search and its generations."""
    straight, other = Search(**settings), Search(**settings)
    generations = [straight.step() for _ in range(count)]
    for generation in generations[:-1]:
        assert other.step(generation.fitness) is None
    assert other.step() == generations[-1]
    assert other.result() == straight.result()
    return straight, generations


@pytest.mark.release
def test_a_search_goes_on_where_it_was_broken_off():
    straight, generations = resumed(SETTINGS, 4)
    assert len(generations[0].fitness) == straight.candidates
    assert generations[0] != generations[1]


@pytest.mark.long
def test_a_search_for_torques_goes_on_where_it_was_broken_off_and_sets_out_from_tuned():
    settings = SETTINGS | {"setup": Setup.of("leaper"), "space": "torques", "episodes": 1, "steps": 40, "starts": 0}
    straight, generations = resumed(settings, 3)
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
