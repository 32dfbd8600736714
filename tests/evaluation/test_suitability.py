"""The presets of a body, tried in a task: the default is the one that suits, and falls short of none."""

import pytest

from arc_suite.envs.setup import Setup
from arc_suite.evaluation import suitability
from arc_suite.evaluation.suitability import Trial
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS

SEEDS = suitability.SEEDS[:2]


def test_presets_that_obey_are_tried_once_each_and_the_default_first():
    names = [trial.preset for trial in suitability.try_presets(ROBOTS["leaper"], "steer", SEEDS, 10)]
    # Braced and balanced are other names of these.
    assert names == ["steered", "surefooted", "reactive", "posed", "in_step"]


def test_a_trial_has_return_metric_and_falls():
    (trial, *_) = suitability.try_presets(ROBOTS["tick"], "navigate", SEEDS, 20)
    standing = suitability.stand_still(ROBOTS["tick"], "navigate", SEEDS, 20)
    assert trial[:2] == ("navigate", "planned") and (trial.metric, trial.upright, trial.episodes) == ("goals", 2, 2)
    assert trial.mean_return > standing.mean_return


def test_episodes_that_fall_in_the_same_step_are_not_upright():
    too_high = Setup.of("tick", "walk", {"healthy_range": (0.9, 1.0)})  # the torso stands lower
    trial = suitability.try_preset(too_high, "medium", SEEDS, 20)
    assert (trial.upright, trial.episodes) == (0, 2)


@pytest.mark.parametrize(("returns", "shortfall"), [((3.0, 2.0), 0.0), ((2.0, 3.0), 0.5), ((0.5, 0.0), 0.0)])
def test_a_shortfall_is_a_share_of_what_the_best_gains(returns, shortfall):
    trials = [Trial("steer", "a", value, "tracking", 0.0, 1, 1) for value in returns]
    standing = Trial("steer", "zero", 1.0, "tracking", 0.0, 1, 1)
    assert suitability.shortfall(trials, standing) == pytest.approx(shortfall)


@pytest.mark.release
@pytest.mark.parametrize("robot", ROBOTS)
def test_no_other_preset_of_a_robot_gains_more_than_its_default(robot):
    short = {}
    for task in TASKS:
        trials = suitability.try_presets(ROBOTS[robot], task, suitability.SEEDS, 600)
        standing = suitability.stand_still(ROBOTS[robot], task, suitability.SEEDS, 600)
        short[task] = suitability.shortfall(trials, standing)
    assert not {task: value for task, value in short.items() if value > suitability.MAX_SHORTFALL}
