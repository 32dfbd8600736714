"""Scores of a policy of many bodies, by family."""

import math

import numpy as np
import pytest
from networks import of_many_bodies as drawn

from arc_suite import evaluation
from arc_suite.bodies import families, generator
from arc_suite.bodies.descriptions import body_description
from arc_suite.cpg import Demonstrator
from arc_suite.cpg.selection import memoryless_preset
from arc_suite.envs.setup import Setup
from arc_suite.evaluation.walking import WalkWatcher
from arc_suite.learning import transfer
from arc_suite.learning.transfer import Comparison, Judged
from arc_suite.robots import ROBOTS


def compared(policy, demonstrator, zero, walked=True, speed=1.0):
    played = ((policy, walked, speed, math.nan), (demonstrator, True, 0.8, math.nan), (zero, False, 0.0, math.nan))
    return Comparison("body", *(Judged(*each) for each in played))


def test_a_score_is_the_way_from_standing_to_the_demonstrator():
    assert compared(15.0, 20.0, 10.0).score == 0.5
    assert math.isnan(compared(15.0, 10.0, 10.0).score)
    slow = compared(10.0, 30.0, 10.0, False, 0.4)
    result = transfer.result([compared(15.0, 20.0, 10.0), slow, compared(0.0, 1.0, 2.0)])
    assert (result.count, result.score, result.worst) == (3, pytest.approx(5.0 / 30.0), 0.0)
    assert (result.walk, result.demonstrated, result.speed) == (pytest.approx(2 / 3), 1.0, pytest.approx(0.8))


def test_families_hold_bodies_that_nobody_trains_with():
    named = {name: made(0).name for name, (made, _) in transfer.FAMILIES.items()}
    assert named["random"] == "random_200000" and named["varied"] == "varied_200000"
    robots = [transfer.FAMILIES["robots"][0](index) for index in range(4)]
    assert all(body.name not in ROBOTS for body in robots)
    small, large = (transfer.FAMILIES[name][0](0) for name in ("small", "large"))
    ratio = large.torso.solids[0].size[0] / small.torso.solids[0].size[0]
    assert ratio == pytest.approx(40.0)


def test_a_robot_that_is_registered_joins_no_family(monkeypatch):
    """Tables of episodes stay those of the same bodies."""
    places = [(name, index) for name in ("robots", "mutants") for index in (0, 3, 4, 5)]
    before = [transfer.FAMILIES[name][0](index) for name, index in places]
    monkeypatch.setitem(ROBOTS, "newcomer", generator.random_body(3).replace(name="newcomer"))
    assert [transfer.FAMILIES[name][0](index) for name, index in places] == before


def seen(body):
    """What a network sees of a body, in units of its size."""
    description = body_description(Setup.of(body).definition)
    return np.concatenate([description.legs.ravel(), description.torso])


@pytest.mark.release
def test_no_body_that_tests_equals_one_of_training_up_to_size():
    """Lengths in h, angles in rad: some number of every test body differs by 0.03 from each training body's."""
    assert np.abs(seen(generator.scaled(generator.random_body(3), 2.0)) - seen(generator.random_body(3))).max() < 1e-5
    made = (families.varied_body, range(512)), (families.sound_body, range(128))
    training = np.array([seen(member(seed)) for member, seeds in made for seed in seeds])
    for name, (member, count) in transfer.FAMILIES.items():
        for index in range(count):
            nearest = np.abs(training - seen(member(index))).max(axis=1).min()
            assert nearest > 0.03, f"{name}, body {index}"


@pytest.mark.slow
def test_demonstrators_walk_and_drawn_weights_do_not(monkeypatch):
    """Scale changes little: small and large bodies of a seed earn the same, up to the noise of starts."""
    monkeypatch.setattr(transfer, "STEPS", 120)
    bodies = [transfer.FAMILIES[name][0](0) for name in ("small", "large")]
    small, large = transfer.compare(drawn(), bodies, "walk")
    assert small.demonstrator.walked and large.demonstrator.walked
    assert not small.policy.walked and not small.zero.walked
    assert small.demonstrator.speed > 0.7 and abs(small.zero.speed) < 0.1
    assert small.demonstrator.total > small.zero.total > 0.0
    for one, other in ((small.demonstrator, large.demonstrator), (small.zero, large.zero)):
        assert one.total == pytest.approx(other.total, rel=0.05)


@pytest.mark.slow
def test_a_walk_in_a_batch_is_judged_as_one_alone(monkeypatch):
    """Up to the rounding of observations in a batch."""
    monkeypatch.setattr(transfer, "STEPS", 120)
    body = transfer.FAMILIES["robots"][0](2)
    (played,) = transfer.compare(drawn(), [body], "walk")
    environment = Setup.of(body).load()
    watcher = WalkWatcher(environment)
    evaluation.run(
        environment, Demonstrator(environment, memoryless_preset(environment.task.definition)), 0, 120, [watcher]
    )
    verdict = watcher.verdict(120)
    assert played.demonstrator.speed == pytest.approx(verdict.speed, rel=0.01)
    assert played.demonstrator.walked == verdict.walks


def test_a_time_limit_is_the_length_of_the_walk(monkeypatch):
    """A shorter limit of the task gives the speeds of a trial of as many steps."""
    bodies = [transfer.FAMILIES["robots"][0](2)]
    settings = {"time_limit": 1.5}
    (limited,) = transfer.compare(drawn(), bodies, "walk", settings)
    monkeypatch.setattr(transfer, "STEPS", round(Setup.of(bodies[0], "walk", settings).definition.step_limit))
    (short,) = transfer.compare(drawn(), bodies, "walk")
    assert limited.demonstrator.speed == short.demonstrator.speed > 0.3
    assert limited.demonstrator.walked == short.demonstrator.walked


@pytest.mark.slow
def test_tracking_of_tasks_with_a_command(monkeypatch):
    monkeypatch.setattr(transfer, "STEPS", 60)
    played = transfer.compare(drawn(task="steer"), [transfer.FAMILIES["random"][0](1)], "steer")
    assert 0.0 < played[0].demonstrator.tracking <= 1.0
    assert np.isfinite(transfer.result(played).tracking)
