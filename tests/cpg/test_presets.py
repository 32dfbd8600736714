"""What the presets of the four robots earn, and how they walk."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from preset_search import Evaluator
from returns import RETURNS
from tiers import never, tiers

import arc_suite
from arc_suite import evaluation
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.prescribed import Preset
from arc_suite.cpg.presets import PRESETS
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS


@pytest.mark.release
@pytest.mark.parametrize("robot", RETURNS)
def test_medium_earns_the_published_return(robot):
    environment = arc_suite.load(robot, "walk")
    results = evaluation.episodes(environment, Demonstrator(robot, "medium"))
    returns = RETURNS[robot]
    assert_allclose(np.mean([episode.total for episode in results]), returns.medium, rtol=returns.within)
    assert {episode.length for episode in results} == {1000}


@pytest.mark.release
@pytest.mark.parametrize("robot", RETURNS)
def test_what_was_searched_for_earns_most_and_walks_no_worse_than_medium(robot):
    presets = [PRESETS[robot][name] for name in ("refined", "tuned", "medium")]
    score = Evaluator(Setup.of(robot), presets=3, episodes=10, steps=1000)(presets, range(10))
    returns, (refined, tuned, _) = RETURNS[robot], 1000 * score.rewards.mean(axis=-1)
    assert_allclose(tuned, returns.tuned, rtol=returns.tuned_within)
    assert_allclose(refined, returns.refined, rtol=returns.tuned_within)
    assert refined > tuned
    assert not score.falls.any()
    for cost, (*searched, medium) in score.style.items():
        for each in searched:
            assert each.mean() <= medium.mean(), cost


@pytest.mark.long
@pytest.mark.parametrize("robot", tiers(ROBOTS, never, lambda robot: robot == "leaper"))
def test_no_preset_falls_and_medium_walks_at_the_target_speed(robot):
    environment = arc_suite.load(robot, "walk")
    names = [name for name, preset in PRESETS[robot].items() if isinstance(preset, Preset)]
    episodes = {preset: evaluation.run(environment, Demonstrator(robot, preset), seed=1) for preset in names}
    assert {episode.length for episode in episodes.values()} == {1000}
    speeds = {preset: episode.progress["speed"] for preset, episode in episodes.items()}
    assert 0.0 < speeds["slow"] < speeds["medium"]
    target = environment.task.settings.parameters.target_velocity
    assert_allclose(speeds["medium"], target, rtol=0.02)
