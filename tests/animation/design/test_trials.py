"""Trials of bodies: what a walk is worth, and what excludes a body."""

import math

import imports
import pytest

from arc_suite.animation.design import trials
from arc_suite.animation.design.genes import Budget
from arc_suite.animation.design.trials import GOALS, Round, Trial, WalkMeans, evaluate, exclusion_reason, measure_walk
from arc_suite.bodies.generator import generate
from arc_suite.envs.setup import Setup

BUDGET = Budget(12.0, 1.5)
GOOD = WalkMeans(0.5, 0.9, math.nan, 1.5, 6.0, 0.0)


@pytest.mark.parametrize(
    ("goal", "walked", "reason"),
    [
        ("transport", GOOD, ""),
        ("transport", GOOD._replace(falls=0.5), "fell"),
        ("transport", GOOD._replace(achieved=0.69), "slow: 0.69 of the command"),
        ("transport", GOOD._replace(power=20.5), "power: 20.5 W/kg"),
        ("speed", GOOD._replace(achieved=0.1), ""),
        ("tracking", GOOD, "no finite metric"),
        ("robustness", GOOD._replace(tracking=0.4, falls=1.0), ""),
    ],
)
def test_guards(goal, walked, reason):
    assert exclusion_reason(GOALS[goal], BUDGET._replace(power=20.0), walked) == reason


def test_goals_are_raised_or_lowered():
    assert GOALS["transport"].value(GOOD) == -1.5 and GOALS["speed"].value(GOOD) == 0.5


@pytest.mark.parametrize(
    ("measure", "message"),
    [(lambda walk: walk.speed / 0, "division by zero"), (lambda walk: None, "must be a string or a real number")],
)
def test_a_metric_that_is_no_number_is_one_line(measure, message):
    goal = trials.Goal("thrift", 1.0, "walk", measure=measure)
    with pytest.raises(ValueError, match=f"^metric thrift: [^\\n]*{message}"):
        goal.value(GOOD)


def test_a_metric_that_fails_in_the_second_walk_excludes_the_body_alone(monkeypatch):
    walks = iter([GOOD, GOOD._replace(power=0.0)])
    monkeypatch.setattr(trials, "measure_walk", lambda *_: next(walks))
    thrift = trials.Goal("thrift", 1.0, "walk", measure=lambda walk: walk.speed / walk.power)
    monkeypatch.setitem(trials.GOALS, "thrift", thrift)
    outcome = evaluate(Trial.of("walk", {}, "thrift", BUDGET, 100), generate(6, 3), -math.inf)
    assert outcome.reason == "refused: metric thrift: float division by zero"


def test_what_is_no_goal_is_refused(monkeypatch):
    monkeypatch.setitem(trials.GOALS, "number", 7)
    with pytest.raises(ValueError, match="^goal 'number': expected a Goal, got 7$"):
        trials.goal_of("number")


def test_a_task_without_a_gait_is_refused():
    with pytest.raises(ValueError, match="^task recover: expected one that prescribes a gait$"):
        measure_walk(generate(6, 3), "recover", Round({}, (0,), 10))


def test_the_second_evaluation_is_longer_on_other_seeds_and_ground():
    trial = Trial.of("stairs", {"rise": 0.1, "terrain_seed": 4}, "progress", BUDGET, 100)
    assert trial.first == ({"rise": 0.1, "terrain_seed": 4}, (0,), 100)
    assert trial.second == ({"rise": 0.1, "terrain_seed": 5}, (1,), 200)
    assert Trial.of("walk", {}, "speed", BUDGET, 100).second.settings == {}
    assert Trial.of("rough", {}, "progress", BUDGET, 100).second.settings == {"terrain_seed": 1}


def test_a_body_walks_and_challenges_an_elite():
    trial, body = Trial.of("walk", {}, "transport", BUDGET, 100), generate(6, 3)
    challenger = evaluate(trial, body, -math.inf)
    assert challenger.reason == "" and challenger.second.falls == 0.0
    assert 0.7 < challenger.first.achieved < 1.3 and 0.5 < challenger.first.cost_of_transport < 6.0
    speed = challenger.first.speed
    assert math.isclose(challenger.first.power, 9.81 * speed * challenger.first.cost_of_transport, rel_tol=0.05)
    assert str(evaluate(trial, body, 0.0)) == str(challenger._replace(second=None))  # NaN is not equal to itself
    # No body and unsound bodies are not let walk.
    assert evaluate(trial, "no body: too large", 0.0) == ("no body: too large", None, None)
    high = body.replace(torso=body.torso.replace(standing_height=0.7))
    assert evaluate(trial, high, 0.0).reason.startswith("unsound: feet hang")


@pytest.mark.parametrize("task", ["walk", "steer"])
def test_an_episode_that_ends_by_its_time_limit_counts_its_steps_alone(task):
    """`walk` has a target speed, `steer` a command that it tracks."""
    body = generate(6, 3)
    whole = measure_walk(body, task, Round({}, (0,), 100))
    seconds = 100 * Setup.of(body, task).definition.scene.control_timestep
    cut = measure_walk(body, task, Round({"time_limit": seconds}, (0,), 200))
    assert str(cut) == str(whole)  # NaN is not equal to itself


def test_the_power_of_servos_is_that_of_their_torques():
    body = imports.with_arm()  # whose held joint stands between those of the legs
    walk = measure_walk(body, "walk", Round({}, (0,), 100))
    assert math.isclose(walk.power, 9.81 * walk.speed * walk.cost_of_transport, rel_tol=0.05)


def test_tracking_counts_steps_after_a_fall_as_nothing():
    trial = Trial.of("shoved", {"kicks": 30.0}, "robustness", BUDGET, 150)
    found = measure_walk(generate(4, 3), "shoved", trial.first)
    calm = measure_walk(generate(4, 3), "shoved", trial.first._replace(settings={"kicks": 0.0}))
    assert found.falls == 1.0 and calm.falls == 0.0
    assert found.tracking < 0.8 * calm.tracking
