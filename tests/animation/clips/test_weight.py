"""Weight of walks, starts, stops and actions: how the torso moves, and that feet, seams and joins stay as they are."""

import functools

import numpy as np
import pytest
from refusals import refused

from arc_suite import rotations
from arc_suite.animation.clips import bounds, on_ground, planting, standing_legs, swaying, transients, turning, weight
from arc_suite.animation.clips.catalog import clip_of
from arc_suite.animation.clips.draft import Draft
from arc_suite.animation.clips.drafts import make_drafts
from arc_suite.animation.clips.recorder import Recorder
from arc_suite.animation.clips.root_motion import Pose
from arc_suite.envs.setup import Setup
from arc_suite.models import posture
from arc_suite.models.posture import find_rest_pose
from arc_suite.robots import ROBOTS

TICK = ROBOTS["tick"]
NAMES = ["walk", "run", "turn_left", "start", "stop", "idle", "attack", "jump"]


@functools.cache
def drafts_of(size):
    return make_drafts(recorder(), NAMES, iter, {}, character=swaying.choose_character(size))


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
    soles = on_ground.measure_ground(TICK, walk.motion).soles < 0.01 * TICK.torso.standing_height
    sides = np.array([1.0 if leg.side == "left" else -1.0 for leg in TICK.legs])
    stands_left = soles @ sides
    assert np.corrcoef(roll, stands_left)[0, 1] < -0.3  # a roll that is negative lowers the left side


@pytest.mark.long
def test_a_run_bounces_more_than_a_walk_and_leans_ahead():
    bobs = {name: np.ptp(drafts_of(1.0)[name].motion.positions[:, 2]) / TICK.torso.standing_height for name in NAMES}
    assert bobs["run"] > 1.8 * bobs["walk"] and bobs["run"] > 0.08
    leans = {
        name: (tilt_of(drafts_of(1.0)[name].motion) - tilt_of(drafts_of(0.0)[name].motion))[:, 1] for name in NAMES
    }
    np.testing.assert_allclose(leans["run"], np.degrees(swaying.USUAL.lean), atol=0.2)
    assert drafts_of(1.0)["run"].weight == 1.0


@pytest.mark.parametrize(
    ("name", "haste"),
    [("run", 1.0), ("fast", 1.0 / 3.0), ("slow", 0.0), ("walk", 0.0), ("turn_left", 0.0), ("stop", 0.0)],
)
def test_haste_grows_from_a_walk_to_a_run(name, haste):
    assert weight._measure_haste(clip_of(name)) == pytest.approx(haste)


@pytest.mark.long
def test_a_start_and_a_stop_pitch_into_the_acceleration():
    light, heavy = drafts_of(0.0), drafts_of(1.0)
    changes = {name: tilt_of(heavy[name].motion)[:, 1] - tilt_of(light[name].motion)[:, 1] for name in heavy}
    assert changes["start"].max() > 2.0 > 1.0 > -changes["start"].min()
    assert changes["stop"].min() < -2.0 < -1.0 < -changes["stop"].max()
    assert abs(changes["walk"]).max() < 0.1


def moved(name):
    """How far weight moves the torso ahead and up (samples, 2), standing heights."""
    changes = drafts_of(1.0)[name].motion.positions - drafts_of(0.0)[name].motion.positions
    return changes[:, [0, 2]] / TICK.torso.standing_height


@pytest.mark.long
def test_the_torso_draws_back_before_an_action_and_swings_on_after_it():
    height = TICK.torso.standing_height
    start, stop, attack, jump = map(moved, ("start", "stop", "attack", "jump"))
    early = len(start) // 5
    assert start[:early, 0].min() < -0.02 and start[:early, 1].min() < -0.015
    assert stop[:, 0].max() > 0.01 and stop[-1, 0] == pytest.approx(0.0, abs=1e-9)
    soles = on_ground.measure_ground(TICK, drafts_of(0.0)["attack"].motion).soles
    strike = np.flatnonzero((soles > 0.3 * height).any(axis=-1))[-1]
    assert attack[:strike, 0].min() < -0.02 and attack[strike:, 0].max() > 0.004
    soles = on_ground.measure_ground(TICK, drafts_of(0.0)["jump"].motion).soles
    flight = np.flatnonzero((soles > 0.02 * height).all(axis=-1))
    assert not jump[: flight[-1]].any()
    assert -0.06 < jump[flight[-1] :, 1].min() < -0.02
    assert drafts_of(1.0)["attack"].motion.seconds <= 1.5
    for name in ("attack", "jump"):
        assert drafts_of(1.0)[name].weight == 1.0
        for end in (0, -1):
            for one, other in zip(drafts_of(1.0)[name].motion.pose(end), drafts_of(0.0)["idle"].start, strict=True):
                np.testing.assert_allclose(one, other, atol=1e-9)


@pytest.mark.slow
def test_a_torso_sinks_as_feet_land_in_a_turn():
    rest = find_rest_pose(TICK)
    position = np.array((0.0, 0.0, -rest.sole_positions[:, 2].min()))
    stance = Pose(position, np.array((1.0, 0.0, 0.0, 0.0)), rest.legs.by_joint(rest.joint_angles))
    draft = Draft(turning.turn(TICK, stance, 0.5 * np.pi), loops=False)
    heavy_draft = weight.add_weight(TICK, {"turn_90": draft}, swaying.USUAL)["turn_90"]
    depths = (draft.motion.positions - heavy_draft.motion.positions) / TICK.torso.standing_height
    assert heavy_draft.weight == 1.0
    assert depths[:, 2].max() == pytest.approx(swaying.USUAL.bob, rel=0.1)
    assert not depths[:, :2].any() and not depths[[0, -1]].any()
    soles, heavy_soles = (on_ground.measure_ground(TICK, each.motion).soles for each in (draft, heavy_draft))
    np.testing.assert_allclose(heavy_soles, soles, atol=0.01 * TICK.torso.standing_height)


@pytest.mark.long
def test_feet_seams_and_joins_stay():
    light, heavy = drafts_of(0.0), drafts_of(1.0)
    for name in ("walk", "run", "turn_left"):
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
    followed = swaying.USUAL.follow(TICK, path, time_step=0.002)
    assert abs(followed[0]) < 0.01 < 1.05 < followed.max() < 1.3
    np.testing.assert_allclose(followed[1000:1500], 1.0, atol=0.01)


def test_offsets_around_an_action_are_0_at_both_ends():
    still = standing_legs.hold_pose(Pose(np.zeros(3), np.array((1.0, 0.0, 0.0, 0.0)), np.zeros(18)), 600, 0.002)
    for transient in (transients._START, transients._STOP, transients._ATTACK, transients._JUMP):
        poses = transients._make_poses(TICK, Draft(still), transient, 200, 300, frequency=5.0, damping=0.5)
        assert not poses[[0, -1]].any()
        assert not poses[200:300].any()
        for name, size in transient.before.items():
            column = posture.POSE_NAMES.index(name)
            assert abs(poses[:200, column]).max() == pytest.approx(abs(size), rel=1e-3)
        for name, size in transient.after.items():
            swing = poses[300:, posture.POSE_NAMES.index(name)] / size
            assert 0.3 < swing.max() < 1.0 and swing.min() < -0.02  # it swings back


def test_a_sway_only_lowers_the_torso():
    sway = swaying.Sway(bob=0.01j, roll=0.02, bank=0.01, sink=0.03)
    phases = np.linspace(0.0, 1.0, 201)
    poses = sway.poses(phases)
    np.testing.assert_allclose([poses[:, 0].max(), poses[:, 0].min()], [-0.03, -0.05], atol=1e-9)
    np.testing.assert_allclose([poses[:, 3].max(), poses[:, 3].min()], [0.03, -0.01], atol=1e-9)
    np.testing.assert_allclose(poses[0], poses[-1], atol=1e-12)


def test_half_a_sway_is_half_of_all_but_its_sink():
    sway = swaying.Sway(bob=0.02j, roll=0.04, bank=0.02, lean=0.1, sink=0.3)
    assert sway.scale(0.5, 0.05) == swaying.Sway(bob=0.01j, roll=0.02, bank=0.01, lean=0.05, sink=0.05)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("hevy", "unknown weight 'hevy'; did you mean 'heavy'? (there are: heavy, nervous, old, a number from 0 to 2)"),
        (2.5, "weight: expected a number from 0 to 2, got 2.5"),
        (float("nan"), "weight: expected a number from 0 to 2, got nan"),
    ],
)
def test_a_weight_that_does_not_fit_is_refused(value, message):
    with refused(message):
        swaying.choose_character(value)
