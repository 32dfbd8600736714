"""Clips of the suite as files of motions."""

import drawn_motions
import numpy as np
import pytest

from arc_suite import animation, motions, registry, rotations
from arc_suite.animation.clips import turning
from arc_suite.animation.clips.motion_of_clip import clip_of_motion
from arc_suite.animation.clips.root_motion import Pose
from arc_suite.models.posture import find_rest_pose
from arc_suite.motions import reading


@pytest.mark.slow
def test_clip_becomes_a_motion(tmp_path):
    (clip,) = animation.animate("tick", tmp_path / "attack.npz", "attack", fps=30)
    motion = motions.load(tmp_path / "attack.npz")
    motions.check_body(motion, registry.body_of("tick"))
    assert (motion.name, motion.frame_rate, motion.frames) == ("attack", pytest.approx(30.0), len(clip.times))
    np.testing.assert_array_equal(motion.angles, clip.motion.joints)
    assert not motion.loops
    assert (~motion.planted).any(axis=0).sum() == 1  # one leg strikes
    struck = int((~motion.planted).any(axis=0).argmax())
    assert motion.soles[:, struck, 2].max() > 0.5


@pytest.mark.slow
def test_loop_turns_by_its_command(tmp_path):
    (clip,) = animation.animate("tick", tmp_path / "turn.npz", "turn_left")
    motion = motions.load(tmp_path / "turn.npz")
    np.testing.assert_allclose(motion.displacement / motion.seconds, clip.motion.twist, rtol=0.1, atol=0.03)
    assert 0.5 < motion.planted.mean() < 0.7  # the duty factor of the gait


@pytest.mark.slow
@pytest.mark.parametrize("name", ["walk", "attack"])
def test_a_motion_file_has_the_foot_contacts_of_its_clip(name, tmp_path):
    file = str(tmp_path / f"{name}.npz")
    (clip,) = animation.animate("tick", file, name)
    (copy,) = animation.animate("tick", tmp_path / "copy.glb", file)
    assert len(copy.foot_contacts) == len(clip.foot_contacts)
    for contact in copy.foot_contacts:
        same = [other.time for other in clip.foot_contacts if contact[:2] == other[:2]]
        apart = abs(np.array(same) - contact.time)
        apart = np.minimum(apart, clip.motion.seconds - apart)  # over the seam
        assert apart.min() < 1.01 / 60  # events of the clip are at substeps, those of the file at frames


@pytest.mark.parametrize(("name", "motion"), [("hit_left", "stagger_left"), ("limp", "limp_walk")])
def test_additive_clip_is_no_motion(name, motion, tmp_path):
    line = f"clips: {name} is added to another clip, and is no motion by itself: take {motion}"
    with pytest.raises(ValueError, match=line):
        animation.animate("tick", tmp_path / "motion.npz", name)
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_motion_becomes_a_clip_and_comes_back(tmp_path):
    """Through a file that goes to Blender."""
    tick = registry.body_of("tick")
    steps = drawn_motions.step_loop(tick)
    file = str(tmp_path / "steps.npz")
    motions.save(steps, file)
    (clip,) = animation.animate("tick", tmp_path / "steps.glb", file, fps=40, root_motion="moving")
    assert steps.name == "walk"
    assert (clip.name, clip.loops, clip.cycles, len(clip.times)) == ("steps", True, 1, 27)
    assert [contact.event for contact in clip.foot_contacts].count("touch_down") == 6
    assert clip.motion.twist[0] == pytest.approx(steps.displacement[0] / steps.seconds)
    motion, notes = reading.read(tmp_path / "steps.glb", tick)
    assert notes == [] and motion.loops
    np.testing.assert_allclose(motion.displacement, steps.displacement, atol=1e-6)
    np.testing.assert_allclose(motions.resample(motion, 20.0).angles, steps.angles, atol=2e-3)
    with pytest.raises(ValueError, match="expected each name once, got steps, steps; .* .npz: rename the file"):
        animation.animate("tick", tmp_path / "two.glb", [file] * 2)
    with pytest.raises(ValueError, match="motion 'walk' is of 'tick': expected a standing height of 0.75 m"):
        animation.animate("queen", tmp_path / "two.glb", file)


@pytest.mark.parametrize("degrees", [150.0, 270.0, 500.0])
@pytest.mark.parametrize("loops", [False, True])
def test_a_large_turn_survives_fewer_keys(degrees, loops, tmp_path):
    """In the track of the torso, or, of a loop, in that of the root."""
    tick = registry.body_of("tick")
    turns = np.radians(degrees) * np.linspace(0.0, 1.0, 61)
    level = np.tile((1.0, 0.0, 0.0, 0.0), (61, 1))
    positions = np.tile((0.0, 0.0, tick.torso.standing_height), (61, 1))
    angles = np.zeros((61, len(tick.joint_names)))
    motion = motions.make(tick, "spin", 60.0, loops, positions, rotations.turn_about_z(level, turns), angles)
    file = str(tmp_path / "spin.npz")
    motions.save(motion, file)
    animation.animate("tick", tmp_path / "spin.glb", file, reduce=True, root_motion="moving")
    copy, _ = reading.read(tmp_path / "spin.glb", tick)
    assert copy.loops == loops
    np.testing.assert_allclose(np.unwrap(rotations.yaw(copy.quaternions)), turns, atol=np.radians(0.1))


@pytest.mark.parametrize("turns", [0.5, 0.999, 1.0, -2.0])
@pytest.mark.parametrize("radius", [0.0, 1.0])
def test_root_of_a_loop_of_whole_turns_stays_near_the_torso(turns, radius):
    tick = registry.body_of("tick")
    frames = 61
    yaw = np.linspace(0.0, 2.0 * np.pi * turns, frames)
    path = np.stack([radius * np.sin(yaw), radius * (1.0 - np.cos(yaw)), np.full(frames, 0.15)], axis=-1)
    drift = np.linspace(0.0, 0.01, frames)[:, None] * (1.0, 0.0, 0.0)
    quaternions = np.stack([np.cos(yaw / 2), 0 * yaw, 0 * yaw, np.sin(yaw / 2)], axis=-1)
    joints = np.zeros((frames, len(tick.joint_names)))
    motion = motions.make(tick, "spin", 30.0, True, path + drift, quaternions, joints)
    clip = clip_of_motion(tick, motion, fps=30.0).motion
    speed = radius * 2.0 * np.pi * turns / motion.seconds
    np.testing.assert_allclose(clip.twist, (speed, 0.0, 2.0 * np.pi * turns / motion.seconds), atol=0.02)
    assert abs(clip.positions[:, :2]).max() < 0.02
    np.testing.assert_allclose(clip.positions[-1], clip.positions[0], atol=1e-12)
    np.testing.assert_allclose(clip.poses()[:, :3], motion.positions, atol=1e-12)


@pytest.mark.parametrize("option", [{"plant": True}, {"straight": True}, {"weight": "heavy"}, {"preset": "tuned"}])
def test_options_of_recorded_clips_are_refused_where_all_clips_are_motions(option, tmp_path):
    tick = registry.body_of("tick")
    file = str(tmp_path / "steps.npz")
    motions.save(drawn_motions.step_loop(tick), file)
    (name,) = option
    with pytest.raises(ValueError, match=f"^{name}: it has no effect on {file}, a motion; leave it out$"):
        animation.animate(tick, tmp_path / "steps.glb", file, **option)
    assert not (tmp_path / "steps.glb").exists()
    animation.animate(tick, tmp_path / "steps.glb", file, weight=1, plant=False)


@pytest.mark.parametrize(("name", "degrees"), [("spider", 90.0), ("queen", -90.0), ("crab", 180.0)])
def test_a_turn_on_the_spot_is_one_of_another_body(name, degrees):
    tick = registry.body_of("tick")
    rest = find_rest_pose(tick)
    place = np.array((0.0, 0.0, -rest.sole_positions[:, 2].min()))
    pose = Pose(place, np.array(rotations.NO_TURN), rest.legs.by_joint(rest.joint_angles))
    motion = turning.turn(tick, pose, np.radians(degrees))
    frames = round(30.0 * motion.seconds)
    poses = motion.sample_at(np.linspace(0.0, motion.seconds, frames + 1)).poses()
    turn = motions.make(tick, "turn", 30.0, False, poses[:, :3], poses[:, 3:7], poses[:, 7:])

    body = registry.body_of(name)
    retargeted, _ = motions.retarget(turn, body)
    assert np.degrees(retargeted.displacement[2]) == pytest.approx(degrees, abs=0.1)
    soles = retargeted.soles[..., :2]
    torso = retargeted.positions[-1, :2] / retargeted.standing_height
    last_soles = rotations.to_heading_frame(soles[-1] - torso, np.radians(degrees))
    np.testing.assert_allclose(soles[0], retargeted.rest_soles[:, :2], atol=0.02)
    np.testing.assert_allclose(last_soles, retargeted.rest_soles[:, :2], atol=0.02)
    stays = retargeted.planted[1:] & retargeted.planted[:-1]
    slides = np.linalg.norm(np.diff(soles, axis=0), axis=-1) * stays
    assert slides.sum(axis=0).max() < 0.1
