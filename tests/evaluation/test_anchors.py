"""Anchors of scores: what standing still and the best demonstrator earn."""

import numpy as np
import pytest

from arc_suite.cpg.selection import suited_presets
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import EPISODES, anchors
from arc_suite.evaluation.anchors import Anchors
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS

TABLE = anchors.read(anchors.TABLE)


def test_a_score_is_0_for_standing_and_1_for_the_demonstrator():
    scale = Anchors(1000.0, 3000.0, "refined")
    assert scale.score(np.array([1000.0, 3000.0, 500.0, 3400.0])).tolist() == [0.0, 1.0, -0.25, 1.2]
    assert scale.at(0.5) == 2000.0


@pytest.mark.parametrize(
    ("scale", "flaw"),
    [
        (Anchors(1000.0), "no demonstrator suits body and task"),
        (Anchors(0.0, 0.0, "medium"), "the best demonstrator, medium, earns 0.0, and standing still 0.0"),
        (Anchors(1000.0, 900.0, "medium"), "the best demonstrator, medium, earns 900.0, and standing still 1000.0"),
        (
            Anchors(1900.0, 1918.0, "straight"),
            "the best demonstrator, straight, earns 1918.0, and standing still 1900.0",
        ),
    ],
)
def test_there_is_no_score_without_a_better_demonstrator(scale, flaw):
    assert np.isnan(scale.score(2000.0)) and scale.at(0.5) == np.inf and scale.flaw == flaw


def test_committed_anchors_have_scores():
    assert not any(anchors.of_returns(returns).flaw for returns in TABLE.values())


def test_anchors_are_the_best_of_the_presets_that_read_all_commands():
    spider = Setup.of("spider", "steer", {"time_limit": 1.0})
    assert suited_presets(spider.definition) == ("steered", "straight", "medium")
    assert list(anchors.measure_returns(spider, 1)) == ["zero", "steered"]


def test_the_best_demonstrator_is_the_one_that_earns_most():
    played = {"zero": np.array([1.0, 3.0]), "tuned": np.array([9.0, 9.0]), "steered": np.array([0.0, 20.0])}
    scale = anchors.of_returns(played)
    assert scale[:3] == (2.0, 10.0, "steered")
    # Deviations are 1 and 10, over two episodes.
    assert scale.errors == pytest.approx((0.5**0.5, 50.0**0.5))
    assert anchors.of_returns({"zero": played["zero"]}) == Anchors(2.0)


def test_anchors_are_means_over_the_episodes_that_are_scored():
    """The best demonstrator is that of these episodes, too; all count where one policy has not played them."""
    played = {"zero": np.array([1.0, 3.0, 8.0]), "tuned": np.array([9.0, 9.0, 9.0]), "steered": np.array([0.0, 20, 1])}
    assert anchors.of_returns(played, [0, 2])[:3] == (4.5, 9.0, "tuned")
    assert anchors.of_returns(played, range(2))[:3] == (2.0, 10.0, "steered")
    for others in ([0, 3], [9000], ()):
        assert anchors.of_returns(played, others)[:3] == (4.0, 9.0, "tuned")
    first_ten = anchors.anchors(Setup.of("tick", "steer"), range(10))
    assert round(first_ten.zero, 1) == 1311.1 and round(first_ten.demonstrator, 1) == 3800.2


def test_a_place_of_the_table_has_standing_still_and_one_demonstrator():
    assert TABLE.keys() <= {str(Setup.of(robot, task)) for robot in ROBOTS for task in TASKS}
    for place, every in TABLE.items():
        assert list(every)[0] == anchors.ZERO and len(every) == 2, place
        assert all(len(returns) == EPISODES for returns in every.values()), place


def test_standing_still_and_the_demonstrators_of_walk_earn_what_they_did():
    found = {robot: anchors.of_returns(anchors.committed_returns(Setup.of(robot))) for robot in ROBOTS}
    assert {scale.preset for scale in found.values()} == {"refined"}
    zeros = {"queen": 1622.2, "bastion": 1613.2, "tick": 1628.1, "leaper": 1722.4}
    assert {robot: round(scale.zero, 1) for robot, scale in found.items()} == zeros


def test_anchors_of_judging_agree_with_those_of_evaluation():
    """Other episodes of the same policies: within five standard errors."""
    for robot in ROBOTS:
        setup = Setup.of(robot)
        judged = anchors.anchors(setup)
        paired = anchors.of_returns(anchors.committed_returns(setup))
        assert judged.preset == paired.preset
        if judged.errors is not None:
            returns = anchors.committed_returns(setup)
            errors = [values.std() / len(values) ** 0.5 for values in returns.values()]
            assert abs(judged.zero - paired.zero) < 5.0 * np.hypot(errors[0], judged.errors[0])
            assert abs(judged.demonstrator - paired.demonstrator) < 5.0 * np.hypot(errors[1], judged.errors[1])


def _same_as_fresh(robot, task):
    """The first episode of each anchor, played anew. Chaotic motions differ between processors, so falls may too."""
    setup = Setup.of(robot, task)
    for name, returns in TABLE[str(setup)].items():
        (fresh,) = anchors.play_returns(setup, name, range(1))
        assert fresh == pytest.approx(returns[0], rel=0.01), (robot, task, name)


def test_a_fresh_episode_earns_what_the_table_says():
    _same_as_fresh("tick", "walk")


@pytest.mark.release
@pytest.mark.parametrize("place", TABLE)
def test_fresh_episodes_earn_what_the_table_says(place):
    _same_as_fresh(*place.split(", "))


def test_other_settings_are_measured():
    setup = Setup.of("tick", "walk", {"time_limit": 1.0})
    assert anchors.committed_returns(setup) is None
    scale, whole = anchors.anchors(setup), anchors.anchors(Setup.of("tick"))
    assert 0.0 < scale.zero < 0.05 * whole.zero and scale.demonstrator > scale.zero
    assert list(anchors.measure_returns(setup)) == ["zero", *suited_presets(setup.definition)]
