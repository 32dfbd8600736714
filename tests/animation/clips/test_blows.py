"""Blows, the steps after them, and falls."""

import math
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from refusals import refused

from arc_suite import rotations
from arc_suite.animation import clips as export
from arc_suite.animation.clips import blow_clips, blows, bounds, from_rest, getting_up, standing_legs
from arc_suite.animation.clips.blows import Blow
from arc_suite.animation.clips.catalog import CLIPS, is_additive
from arc_suite.animation.clips.draft import Draft
from arc_suite.animation.clips.recordings import Recording, samples_to_rest, stop_at, stop_at_rest
from arc_suite.animation.clips.root_motion import Pose
from arc_suite.envs.setup import Setup
from arc_suite.models import posture
from arc_suite.models.standing import standing_qpos
from arc_suite.robots import ROBOTS
from arc_suite.simulation.model import compile_model

TICK, LEAPER = ROBOTS["tick"], ROBOTS["leaper"]
REST = Pose(np.array((0.0, 0.0, 0.13)), np.array((1.0, 0.0, 0.0, 0.0)), np.zeros(len(TICK.joint_names)))


@pytest.mark.parametrize(("side", "way"), blows.DIRECTIONS.items())
def test_a_blow_gives_its_momentum_away_from_its_side_and_tilts(side, way):
    """Of a body in the air, which looks to its left."""
    model = compile_model(TICK)
    data = mujoco.MjData(model)
    model.opt.gravity[:] = 0.0
    data.qpos[:] = standing_qpos(model)
    data.qpos[:7] = 0.0, 0.0, 1.0, math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)
    mujoco.mj_forward(model, data)
    positions = Blow(side, size=0.5, lever=0.5, friction=4.0).strike(TICK, model, data)
    assert len(positions) * model.opt.timestep == pytest.approx(0.1 * math.sqrt(0.18 / 9.81), abs=model.opt.timestep)
    assert not data.xfrc_applied.any()
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    forward, left = way
    speed = 0.5 * math.sqrt(9.81 * 0.18)
    np.testing.assert_allclose(data.subtree_linvel[0, :2], speed * np.array((-left, forward)), atol=0.02 * speed)
    top = rotations.matrix(data.qpos[3:7])[:2, 2]
    assert top @ (-left, forward) > 0.9 * np.linalg.norm(top) > 0.0


def test_the_ground_of_a_blow_is_hard_and_rough():
    model = compile_model(TICK)
    Blow("front", 0.5, 0.5, friction=4.0).set_ground(model)
    assert (model.pair_friction[:, :2] == 4.0).all() and not model.pair_margin.any()


def test_rest_begins_where_neither_joints_nor_the_torso_turn():
    poses = np.tile(np.array((0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0)), (100, 1))
    poses[:, 0] = np.arange(100)  # a way alone is no turn
    assert samples_to_rest(Recording(0.01, 1, poses)) == 99
    poses[20:, 7] = 0.1
    assert samples_to_rest(Recording(0.01, 1, poses)) == 21
    poses[40:, 5] = 0.1
    assert samples_to_rest(Recording(0.01, 1, poses)) == 41


def test_a_body_that_trembles_is_at_rest_and_one_that_creeps_is_not():
    poses = np.tile(np.array((0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0)), (1000, 1))
    poses[:500, 7] = np.linspace(-1.0, 0.0, 500)
    trembling = poses.copy()
    trembling[500:, 7] = np.radians(0.2) * np.sin(np.arange(500))
    assert samples_to_rest(Recording(0.002, 1, trembling)) == pytest.approx(500, abs=10)
    creeping = poses.copy()
    creeping[500:, 7] = np.radians(10.0) * 0.002 * np.arange(500)
    assert samples_to_rest(Recording(0.002, 1, creeping)) > 950


def test_a_recording_stops_smoothly_where_it_is_cut():
    poses = np.tile(np.array((0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0)), (400, 1))
    poses[:, 7] = np.radians(50.0) * 0.002 * np.arange(400)
    stopped = stop_at(Recording(0.002, 1, poses), 300)
    speeds = np.degrees(np.diff(stopped.poses[:, 7])) / 0.002
    assert len(stopped.poses) == 351 and stopped.poses[-1, 7] == pytest.approx(poses[300, 7])
    np.testing.assert_allclose(speeds[:250], 50.0)
    assert (np.diff(speeds) < 1e-6).all() and 0.0 < speeds[-1] < 0.5
    np.testing.assert_array_equal(stop_at(Recording(0.002, 1, poses), 0).poses, poses[:1])
    whole = stop_at_rest(Recording(0.002, 1, poses))  # never rests: nothing hides it
    np.testing.assert_array_equal(whole.poses, poses)


def test_a_rise_ends_when_the_torso_stands_though_a_raised_leg_creeps():
    """Of a torso that rises for a second, and a joint that goes on at 30 degrees/s."""
    poses = np.tile(np.append((0.0, 0.0, 0.1, 1.0, 0.0, 0.0, 0.0), np.zeros(len(TICK.joint_names))), (2000, 1))
    poses[:500, 2] = np.linspace(0.0, 0.1, 500)
    poses[:, 8] = np.radians(30.0) * 0.002 * np.arange(2000)
    recording = Recording(0.002, 1, poses)
    assert samples_to_rest(recording) > 1950
    assert getting_up._samples_to_stand(TICK, recording) == pytest.approx(500, abs=2)
    poses[1500:, 4] = 0.1
    assert getting_up._samples_to_stand(TICK, recording) == pytest.approx(1500, abs=2)


def test_poses_of_a_motion_are_those_that_it_was_drawn_by():
    poses = np.random.default_rng(0).uniform(-0.3, 0.3, (5, 6))
    motion = standing_legs.pose_motion(TICK, REST, poses, np.tile(REST.joints, (5, 1)))
    np.testing.assert_allclose(standing_legs.poses_of_motion(TICK, REST, motion), poses, atol=1e-9)


def still(tilt=0.0, bend=0.0):
    """A body that lies still, with its torso rolled and all joints turned, rad."""
    pose = REST._replace(
        quaternion=np.array((math.cos(0.5 * tilt), math.sin(0.5 * tilt), 0.0, 0.0)), joints=REST.joints + bend
    )
    return Draft(standing_legs.hold_pose(pose, samples=2, time_step=0.01), loops=False)


def test_a_death_that_lies_as_another_is_left_out_with_its_line():
    likeness = from_rest._find_likeness
    drafts = {"death": still(), "death_back": still(0.4, 0.2)}
    line = "it lies as in death: 23 degrees of the torso and 0.20 rad of joints apart"
    assert likeness("death_back", drafts) == line
    assert likeness("death_left", drafts | {"death_left": still(0.4, 0.4)}).startswith(
        "it lies as in death_back: 0 deg"
    )
    for other in (still(0.6), still(0.0, 0.31)):
        assert likeness("death_back", drafts | {"death_back": other}) == ""
    assert likeness("death", drafts) == likeness("walk", drafts) == likeness("death_left", drafts) == ""


def fake_blows(monkeypatch, max_size, tilt_per_lever=0.0, max_drawn_size=9.0):
    """Blows are taken up to a size, and drawn up to another; they tilt by degrees a lever and bend by their size."""

    def record(recorder, clip, size, lever):
        if size > max_size:
            raise ValueError("its torso tilts by 40 degrees, more than 30")
        return size, lever

    def draw(body, clip, blow, idle):
        size, lever = blow
        if size > max_drawn_size:
            raise ValueError("the legs leave the torso no room to sway")
        tilted = still(np.radians(tilt_per_lever * lever), size)
        quaternions = np.stack([REST.quaternion, *tilted.motion.quaternions[1:]])
        return tilted._replace(motion=tilted.motion._replace(quaternions=quaternions))

    monkeypatch.setattr(blow_clips, "_record_blow", record)
    monkeypatch.setattr(blow_clips, "_draw_blow", draw)


RECORDER = SimpleNamespace(body=TICK)


def test_the_strongest_blow_counts_that_suits_the_body(monkeypatch):
    clip = CLIPS["stagger_left"]
    for limit, drawn, size in ((0.5, 9.0, 0.487), (9.0, 9.0, 3.0991), (9.0, 0.5, 0.487), (0.5, 0.1, 0.0906)):
        fake_blows(monkeypatch, limit, max_drawn_size=drawn)
        taken = blow_clips.record_blow(RECORDER, clip, REST)
        assert taken.motion.joints[0, 0] == pytest.approx(size, abs=1e-3)
    fake_blows(monkeypatch, 0.0)
    with refused("under a blow of 0.077 sqrt(g h), its torso tilts by 40 degrees, more than 30"):
        blow_clips.record_blow(RECORDER, clip, REST)
    fake_blows(monkeypatch, 0.5, max_drawn_size=0.0)
    with refused("under a blow of 0.077 sqrt(g h), the legs leave the torso no room to sway"):
        blow_clips.record_blow(RECORDER, clip, REST)


@pytest.mark.parametrize(("tilt_per_lever", "tilt"), [(11.0, 5.5), (3.0, 6.0), (1.3, 5.2), (0.2, 0.8)])
def test_a_light_blow_comes_higher_until_the_torso_tilts_by_5_degrees(monkeypatch, tilt_per_lever, tilt):
    fake_blows(monkeypatch, 9.0, tilt_per_lever)
    draft = blow_clips.record_blow(RECORDER, CLIPS["hit_front"], REST)
    assert blow_clips._measure_tilt(draft.motion.quaternions) == pytest.approx(tilt)


def test_a_sway_that_legs_cannot_follow_is_smaller_and_its_tilt_stays():
    """Of Tick's torso, which is pushed back by 0.8 standing heights and tilts by 5 degrees."""
    rest_pose = posture.find_rest_pose(TICK)
    idle = REST._replace(joints=rest_pose.legs.by_joint(rest_pose.joint_angles))
    shares = np.sin(np.linspace(0.0, np.pi, 100))
    poses = shares[:, None] * (0.1, -0.8, 0.0, 0.0, -np.radians(5.0), 0.0)
    motion = standing_legs.pose_motion(TICK, idle, poses, np.tile(idle.joints, (100, 1)))
    standing_motion = blow_clips._stand_on_feet(TICK, motion, idle)
    drawn = standing_legs.poses_of_motion(TICK, idle, standing_motion)
    assert np.degrees(np.ptp(drawn[:, 4])) == pytest.approx(5.0, abs=0.1)
    assert 0.1 < np.ptp(drawn[:, 1]) <= 0.4
    assert drawn[:, 0].max() <= 1e-9 and drawn[:, 0].min() < -0.04


def test_light_blows_are_added_to_other_clips_and_strong_ones_are_not():
    assert [is_additive(f"{name}_front") for name in ("hit", "stagger")] == [True, False]


@pytest.mark.long
def test_a_light_blow_sways_over_feet_that_stay_and_a_strong_one_makes_feet_step():
    names = ("idle", "hit_front", "stagger_front", "stagger_left")
    clips = {clip.name: clip for clip in export.clips(Setup.of("leaper", "steer"), names, fps=60)}
    height, idle = LEAPER.torso.standing_height, clips["idle"].motion.pose(0)
    for name in names[1:]:
        motion = clips[name].motion
        for end in (0, -1):
            for one, other in zip(motion.pose(end), idle, strict=True):
                np.testing.assert_allclose(one, other, atol=1e-6)
        assert bounds.find_excess(LEAPER, CLIPS[name], motion) == ""
        assert bounds.measure(LEAPER, motion).still_seconds < 0.4
    hit, stagger, aside = (clips[name].motion.poses() for name in names[1:])
    assert hit[:, 0].min() < hit[0, 0] - 0.02 * height and clips["hit_front"].slide < 0.05 * height
    assert not clips["hit_front"].moves and not clips["hit_front"].foot_contacts
    assert stagger[:, 0].min() < stagger[0, 0] - 0.1 * height and aside[:, 1].min() < aside[0, 1] - 0.1 * height
    assert len({contact.foot for contact in clips["stagger_front"].foot_contacts}) == 4
    assert clips["stagger_front"].moves


@pytest.mark.long
def test_deaths_by_other_blows_lie_in_other_poses():
    names = ("idle", "death", "death_back", "death_left")
    clips = {clip.name: clip for clip in export.clips(Setup.of("leaper", "steer"), names, fps=60)}
    deaths = [clips[name].motion for name in names[1:]]
    for motion, way in zip(deaths, (-1.0, 1.0, 0.0), strict=True):
        assert bounds.measure(LEAPER, motion).last_speed < 2.0
        assert np.sign(motion.positions[-1, 0] - motion.positions[0, 0]) == way or not way
    for first, second in ((0, 1), (0, 2), (1, 2)):
        ends = (deaths[first], deaths[second])
        up, other_up = (rotations.matrix(motion.quaternions[-1])[2] for motion in ends)
        bend = abs(ends[0].joints[-1] - ends[1].joints[-1]).mean()
        assert np.degrees(np.arccos(up @ other_up)) > 30.0 or bend > 0.3


@pytest.mark.long
@pytest.mark.parametrize("fps", [24, 60])
def test_the_last_frames_of_a_death_show_a_body_at_rest(fps):
    setup = Setup.of("bastion", "steer")
    for clip in export.clips(setup, ("death", "death_left"), fps=fps):
        assert bounds.measure(setup.body, clip.motion).last_speed < 1.0
