"""Gaits by speed: a run has quicker steps and shorter stances than a walk, and is faster."""

import numpy as np
import pytest

from arc_suite.animation.clips import swaying
from arc_suite.animation.clips.bounds import measure_ground
from arc_suite.animation.clips.clips import Clip
from arc_suite.animation.clips.drafts import make_drafts
from arc_suite.animation.clips.foot_contacts import FootContact
from arc_suite.animation.clips.metadata import measure_duty_factor
from arc_suite.animation.clips.recorder import Recorder
from arc_suite.animation.clips.root_motion import ClipMotion
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS
from arc_suite.robots.gaits import PACES

TICK = ROBOTS["tick"]


def gait_of(setup):
    parameters = setup.definition.parameters
    return parameters.gait_frequency, parameters.duty_factor, parameters.target_velocity


def test_a_pace_sets_the_gait_that_a_demonstrator_is_fitted_to():
    recorder = Recorder(Setup.of(TICK, "steer"), "cpg", None)
    # A cycle of 1 / 1.5 s is 13.3 control steps of 0.05 s.
    assert gait_of(recorder._setup) == pytest.approx((1.0 / 0.65, 0.6, 0.33))
    assert gait_of(recorder._setup_at_pace(PACES["run"])) == pytest.approx((2.0, 0.5, 1.75 * 0.33))
    assert gait_of(recorder._setup_at_pace(PACES["slow"])) == pytest.approx((1.25, 0.65, 0.6 * 0.33))


def test_a_frequency_of_the_caller_is_a_walk_of_which_paces_are_multiples():
    recorder = Recorder(Setup.of(TICK, "steer", {"gait_frequency": 1.7}), "cpg", None)
    assert recorder._setup.definition.parameters.gait_frequency == 1.7
    assert gait_of(recorder._setup_at_pace(PACES["run"]))[0] == pytest.approx(1.7 * PACES["run"].tempo)


@pytest.mark.parametrize(
    ("events", "duty_factor"),
    [
        ([("touch_down", 0.2), ("lift_off", 0.7)], 0.5),
        ([("lift_off", 0.2), ("touch_down", 0.7)], 0.5),
        ([("lift_off", 0.2), ("touch_down", 0.4), ("lift_off", 0.7), ("touch_down", 0.9)], 0.6),
        ([], 1.0),
    ],
)
def test_the_duty_factor_is_that_of_the_feet(events, duty_factor):
    motion = ClipMotion(0.1, *(np.zeros((11, size)) for size in (3, 3, 4, 18)), np.zeros(3))
    contacts = tuple(FootContact("foot", event, 0, time) for event, time in events)
    clip = Clip("walk", motion, loops=True, cycles=1, foot_contacts=contacts, feet=("foot",))
    assert measure_duty_factor(clip) == pytest.approx(duty_factor)


@pytest.mark.long
def test_a_run_is_no_walk_that_is_played_faster():
    recorder = Recorder(Setup.of(TICK, "steer"), "cpg", None)
    drafts = make_drafts(recorder, ["slow", "walk", "run"], iter, {}, character=swaying.choose_character(0.0))
    speeds = {name: draft.motion.twist[0] for name, draft in drafts.items()}
    assert speeds["run"] > 1.4 * speeds["walk"] > 1.4 * speeds["slow"]
    cadences = [drafts["walk"].cycle / drafts[name].cycle for name in ("slow", "run")]
    np.testing.assert_allclose(cadences, [0.8, 1.3], atol=0.05)
    soles = {name: measure_ground(TICK, draft.motion).soles for name, draft in drafts.items()}
    duty = {name: (heights < 0.01 * TICK.torso.standing_height).mean() for name, heights in soles.items()}
    assert duty["run"] < 0.5 < duty["walk"] < duty["slow"]
    lifts = {name: heights.max(axis=0).mean() for name, heights in soles.items()}
    assert lifts["run"] > 1.2 * lifts["walk"] > 1.2 * 1.05 * lifts["slow"]
