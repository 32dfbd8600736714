"""Weight of walks, starts and stops: how the torso moves, and that feet, seams and joins stay as they are."""

import functools

import numpy as np
import pytest
from refusals import refused

from arc_suite import rotations
from arc_suite.animation.clips import bounds, planting, weight
from arc_suite.animation.clips.catalog import clip_of
from arc_suite.animation.clips.drafts import make_drafts
from arc_suite.animation.clips.recorder import Recorder
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS

TICK = ROBOTS["tick"]
NAMES = ["walk", "turn_left", "start", "stop", "idle"]


@functools.cache
def drafts_of(size):
    return make_drafts(recorder(), NAMES, iter, {}, character=weight.choose_character(size))


@functools.cache
def recorder():
    class Once(Recorder):
        record_walk = functools.cache(Recorder.record_walk)
        record_transition = functools.cache(Recorder.record_transition)

    return Once(Setup.of(TICK, "steer"), "cpg", None)


def tilt_of(motion):
    """Roll and pitch (samples, 2), degrees."""
    matrices = rotations.matrix(motion.quaternions)
    roll = np.arctan2(matrices[:, 2, 1], matrices[:, 2, 2])
    return np.degrees(np.stack([roll, -np.arcsin(matrices[:, 2, 0])], axis=-1))


@pytest.mark.long
def test_a_walk_bobs_and_rolls_towards_standing_feet():
    walk = drafts_of(1.0)["walk"]
    assert walk.weight == 1.0
    assert 0.02 < np.ptp(walk.motion.positions[:, 2]) / TICK.torso.standing_height < 0.05
    roll = tilt_of(walk.motion)[:, 0]
    assert 1.0 < np.ptp(roll) / 2.0 < 3.0
    soles = bounds.measure_ground(TICK, walk.motion).soles < 0.01 * TICK.torso.standing_height
    sides = np.array([1.0 if leg.side == "left" else -1.0 for leg in TICK.legs])
    stands_left = soles @ sides
    assert np.corrcoef(roll, stands_left)[0, 1] < -0.3  # a roll that is negative lowers the left side


@pytest.mark.long
def test_a_start_and_a_stop_pitch_into_the_acceleration():
    light, heavy = drafts_of(0.0), drafts_of(1.0)
    changes = {name: tilt_of(heavy[name].motion)[:, 1] - tilt_of(light[name].motion)[:, 1] for name in heavy}
    assert changes["start"].max() > 2.0 > 1.0 > -changes["start"].min()
    assert changes["stop"].min() < -2.0 < -1.0 < -changes["stop"].max()
    assert abs(changes["walk"]).max() < 0.1


@pytest.mark.long
def test_feet_seams_and_joins_stay():
    light, heavy = drafts_of(0.0), drafts_of(1.0)
    for name in ("walk", "turn_left"):
        assert planting.slip(TICK, heavy[name].motion) < planting.slip(TICK, light[name].motion) + 0.03
        np.testing.assert_array_equal(heavy[name].motion.poses()[0, 7:], heavy[name].motion.poses()[-1, 7:])
    for name, end, neighbor in (("start", 0, "idle"), ("start", -1, "walk"), ("stop", 0, "walk"), ("stop", -1, "idle")):
        pose, other = heavy[name].motion.pose(end), heavy[neighbor].motion.pose(0)
        for one, two in zip(pose, other, strict=True):
            np.testing.assert_allclose(one, two, atol=1e-9)
    for name in NAMES:
        assert not bounds.find_excess(TICK, clip_of(name), heavy[name].motion)
    np.testing.assert_array_equal(heavy["idle"].motion.joints, light["idle"].motion.joints)
    assert heavy["idle"].weight is light["walk"].weight is None


@pytest.mark.long
def test_a_character_moves_its_torso_more():
    heavy = drafts_of("heavy")["walk"]
    assert np.ptp(tilt_of(heavy.motion)[:, 0]) > 1.2 * np.ptp(tilt_of(drafts_of(1.0)["walk"].motion)[:, 0])


def test_a_spring_settles_where_its_path_ends():
    path = np.r_[0.0, np.ones(1999)]
    followed = weight.USUAL.follow(TICK, path, time_step=0.002)
    assert abs(followed[0]) < 0.01 < 1.05 < followed.max() < 1.3
    np.testing.assert_allclose(followed[1000:1500], 1.0, atol=0.01)


def test_a_sway_only_lowers_the_torso():
    sway = weight.Sway(bob=0.01j, roll=0.02, bank=0.01, sink=0.03)
    phases = np.linspace(0.0, 1.0, 201)
    poses = sway.poses(phases)
    np.testing.assert_allclose([poses[:, 0].max(), poses[:, 0].min()], [-0.03, -0.05], atol=1e-9)
    np.testing.assert_allclose([poses[:, 3].max(), poses[:, 3].min()], [0.03, -0.01], atol=1e-9)
    np.testing.assert_allclose(poses[0], poses[-1], atol=1e-12)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("hevy", "unknown weight 'hevy'; did you mean 'heavy'? (there are: heavy, nervous, old)"),
        (2.5, "weight: expected a number from 0 to 2, got 2.5"),
        (float("nan"), "weight: expected a number from 0 to 2, got nan"),
    ],
)
def test_a_weight_that_does_not_fit_is_refused(value, message):
    with refused(message):
        weight.choose_character(value)
