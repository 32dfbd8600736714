"""The presets of a body, tried in a task: the default is the one that suits, and falls short of none."""

import warnings

import pytest

from arc_suite.envs.setup import Setup
from arc_suite.evaluation import suitability
from arc_suite.evaluation.protocol import EpisodeResult
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


def test_episodes_that_begin_on_the_ground_count_where_the_body_gets_up():
    trial = suitability.stand_still(ROBOTS["tick"], "recover", SEEDS, 5)  # too short to get up
    assert (trial.metric, trial.value, trial.upright, trial.episodes) == ("up", 0.0, 0, 2)


def test_episodes_that_fall_in_the_same_step_are_not_upright():
    too_high = Setup.of("tick", "walk", {"healthy_range": (0.9, 1.0)})  # the torso stands lower
    trial = suitability.try_preset(too_high, "medium", SEEDS, 20)
    assert (trial.upright, trial.episodes) == (0, 2)


def test_warnings_of_a_task_are_in_its_trial_alone(monkeypatch, recwarn):
    def play_episodes(setup, preset, seeds, *_):
        for _ in seeds:
            warnings.warn(f"{setup.body.name} cannot leap", stacklevel=1)
        return [EpisodeResult(0.0, 1, {"tracking": 0.5}) for _ in seeds]

    monkeypatch.setattr(suitability.anchors, "play_episodes", play_episodes)
    trial = suitability.try_preset(Setup.of("tick", "leap"), "leaping", SEEDS, 2)
    assert trial.warnings == ("tick cannot leap",) and not recwarn.list


@pytest.mark.parametrize(
    ("metric", "value", "text"),
    [
        ("speed", 0.25, "0.25 m/s, 1 of 4 without a fall"),
        ("tracking", 0.25, "tracking 0.25 of 1, 1 of 4 without a fall"),
        ("goals", 1.5, "1.50 goals an episode, 1 of 4 without a fall"),
        ("joint_error", 0.06, "joints off by 0.06 rad, 1 of 4 without a fall"),
        ("up", 0.25, "1 of 4 got up"),
    ],
)
def test_a_trial_is_described_by_its_metric_and_unit(metric, value, text):
    assert Trial("task", "preset", 0.0, metric, value, 1, 4).describe() == text


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
