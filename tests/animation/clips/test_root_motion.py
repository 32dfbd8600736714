"""Motions: places on the ground, loops of synthetic walks whose truth is known."""

import functools

import numpy as np
import pytest

from arc_suite import rotations
from arc_suite.animation.clips import loops, root_motion
from arc_suite.animation.clips.recordings import Recording
from arc_suite.motions import ground_poses

STEP, CYCLE = 0.002, 0.55  # s; a cycle is 11 control steps
TWISTS = [(0.5, 0.0, 0.0), (0.4, -0.1, 0.8), (0.0, 0.2, -0.5), (-0.3, 0.0, 1e-12)]


@functools.cache
def walk(twist, seconds=6.0, cycle=CYCLE, drift=0.0, start=(1.0, -2.0, 2.5)):
    """Two joints and a torso that sway once a cycle on a path of constant twist."""
    times = STEP * np.arange(round(seconds / STEP) + 1)
    phase = 2.0 * np.pi * times / cycle
    root = ground_poses.integrate_twist(np.array(twist), times)
    sway = np.stack([0.02 * np.sin(2.0 * phase), 0.03 * np.cos(phase), 0.1 * np.sin(phase)], axis=-1)
    place = np.stack(
        [ground_poses.compose(ground_poses.compose(np.array(start), a), b) for a, b in zip(root, sway, strict=True)]
    )
    roll = 0.05 * np.sin(phase) + drift * times
    tilt = np.stack([np.cos(0.5 * roll), np.sin(0.5 * roll), 0.0 * roll, 0.0 * roll], axis=-1)
    quaternions = rotations.turn_about_z(tilt, place[:, 2])
    joints = np.stack([np.sin(phase), 0.3 * np.sin(2.0 * phase) + 0.2 * np.cos(phase) + drift * times], axis=-1)
    height = 0.5 + 0.01 * np.cos(2.0 * phase)
    return Recording(STEP, 25, np.concatenate([place[:, :2], height[:, None], quaternions, joints], axis=-1))


@pytest.mark.parametrize("twist", TWISTS)
def test_logarithm_undoes_along(twist):
    place = ground_poses.integrate_twist(np.array(twist), np.array([0.0, 1.0]))
    np.testing.assert_allclose(place[0], 0.0)
    np.testing.assert_allclose(ground_poses.twist_to(place[1]), twist, atol=1e-12)


def test_along_adds_small_steps_and_relative_undoes_after():
    twist, place = np.array((0.4, -0.1, 0.8)), np.zeros(3)
    small = ground_poses.integrate_twist(twist, np.array([1e-3]))[0]
    for _ in range(1000):
        place = ground_poses.compose(place, small)
    np.testing.assert_allclose(ground_poses.integrate_twist(twist, np.array([1.0]))[0], place, atol=1e-12)
    first, second = np.array((1.0, 2.0, 0.7)), np.array((-0.5, 0.2, 2.0))
    np.testing.assert_allclose(ground_poses.relative_pose(first, ground_poses.compose(first, second)), second)


def test_the_period_is_the_cycle_if_the_pose_returns():
    recording = walk(TWISTS[0])
    assert loops.period(recording) == pytest.approx(CYCLE, abs=STEP)
    random = np.random.default_rng(0).normal(size=(len(recording.poses), 2)).cumsum(axis=0)
    assert loops.period(recording._replace(poses=np.concatenate([recording.poses[:, :7], random], axis=-1))) is None


@pytest.mark.parametrize("twist", TWISTS)
def test_a_loop(twist):
    recording = walk(twist)
    closing = loops.find_closings(recording, CYCLE, 4)[1]
    assert closing.samples == 275 and closing.seam < 1e-9
    loop = loops.cut_loop(recording, 137, closing.samples)
    assert loop.seconds == pytest.approx(CYCLE)
    np.testing.assert_allclose(loop.twist[2], twist[2], atol=1e-9)
    assert np.hypot(*loop.twist[:2]) == pytest.approx(np.hypot(*twist[:2]), rel=0.02)
    for name in ("positions", "quaternions", "joints"):
        values = getattr(loop, name)
        assert (values[0] == values[-1]).all(), name
    # The root runs below the torso, and the whole is what was recorded.
    np.testing.assert_allclose(loop.positions[:-1, :2].mean(axis=0), 0.0, atol=1e-3)
    np.testing.assert_allclose(rotations.yaw(loop.quaternions[:-1]).mean(), 0.0, atol=1e-3)
    poses = loop.poses()
    there = np.concatenate([recording.poses[:, :2], rotations.yaw(recording.poses[:, 3:7])[:, None]], axis=-1)[137:413]
    here = np.concatenate([poses[:, :2], rotations.yaw(poses[:, 3:7])[:, None]], axis=-1)
    difference = ground_poses.relative_pose(here[0], here) - ground_poses.relative_pose(there[0], there)
    np.testing.assert_allclose(difference[:, :2], 0.0, atol=1e-9)
    np.testing.assert_allclose(rotations.wrap_angle(difference[:, 2]), 0.0, atol=1e-9)
    np.testing.assert_allclose(poses[:, 7:], recording.poses[137:413, 7:], atol=1e-9)


def test_a_seam_is_spread():
    recording = walk(TWISTS[1], drift=0.02)
    loop = loops.cut_loop(recording, 10, 275)
    assert loop.seam == pytest.approx(0.02 * CYCLE, rel=0.01)
    assert loops.find_closings(recording, CYCLE, 4)[1] == pytest.approx((loop.seam, 275))
    assert (loop.joints[0] == loop.joints[-1]).all() and (loop.quaternions[0] == loop.quaternions[-1]).all()
    correction = loop.joints[:, 1] - recording.poses[10:286, 8]
    np.testing.assert_allclose(np.diff(correction)[:-1], -0.02 * STEP, atol=1e-12)
    jumps = abs(np.diff(loop.quaternions, axis=0)).max(axis=-1)
    assert jumps[[0, -1]].max() < 1.2 * np.median(jumps) + 1e-3


def choose_start(recording):
    """The first sample of the loop of one cycle that is chosen of all that close."""
    return loops.choose_start(recording, 275, loops.find_starts(recording, 275))


@pytest.mark.parametrize("twist", TWISTS[:3])
def test_of_the_loops_that_close_the_usual_one_is_taken(twist):
    """Of four cycles the last leads further: a loop of the first three goes as fast as the walk does on the mean."""
    recording = walk(twist, seconds=4 * CYCLE)
    poses = recording.poses.copy()
    poses[825:, :2] += np.outer(np.arange(276) / 275.0, 0.3 * (poses[-1, :2] - poses[825, :2]))
    first = choose_start(Recording(STEP, 25, poses))
    assert first < 600
    speed = np.hypot(*loops.cut_loop(Recording(STEP, 25, poses), first, 275).twist[:2])
    mean = np.hypot(*twist[:2])
    assert mean < speed < 1.3 * mean


def test_a_loop_that_closes_goes_before_a_usual_one():
    """Two cycles: the first is slower, the pose of the second returns."""
    recording = walk(TWISTS[0], seconds=2 * CYCLE)
    poses = recording.poses.copy()
    poses[:275, 8] += 0.1 * (1.0 - np.arange(275) / 275.0)
    poses[275:, 0] += 0.05 * np.cos(2.5) * np.arange(276) / 275.0
    poses[275:, 1] += 0.05 * np.sin(2.5) * np.arange(276) / 275.0
    first = choose_start(Recording(STEP, 25, poses))
    assert loops.cut_loop(Recording(STEP, 25, poses), first, 275).seam <= loops.GOOD_SEAM


def test_no_loop_is_taken_whose_seam_is_over_the_bound():
    """The least seam is 1.9 degrees; one of 2.2 degrees would be more usual."""
    recording = walk(TWISTS[0], seconds=2 * CYCLE)
    poses = recording.poses[:-1].copy()
    poses[:275, 8] += np.radians(np.where(np.arange(275) < 11, 1.9, 2.2))
    poses[:11, :2] += 0.05  # a longer way than that of the others
    first = choose_start(Recording(STEP, 25, poses))
    assert np.radians(1.8) < loops.cut_loop(Recording(STEP, 25, poses), first, 275).seam <= loops.MAX_SEAM


def test_the_least_number_of_cycles_that_refuses_the_fewest():
    degree = np.radians(1.0)

    def closings(*seams):
        return {cycles: loops.Closing(seam * degree, 275 * cycles) for cycles, seam in enumerate(seams, start=1)}

    walks = {"walk": closings(0.9, 0.1, 0.1), "back": closings(3.0, 2.5, 1.9)}
    assert loops.choose_cycles(walks, loops.MAX_SEAM) == 3
    assert loops.choose_cycles({"walk": walks["walk"]}, loops.MAX_SEAM) == 1
    assert loops.choose_cycles({"walk": walks["walk"]}, loops.GOOD_SEAM) == 2
    assert loops.choose_cycles({"back": closings(3.0, 4.0, 5.0)}, loops.MAX_SEAM) == 1


@pytest.mark.parametrize("end", [0, -1])
def test_an_end_meets_a_pose_and_feet_stay_where_they_are(end):
    passage = root_motion.follow_mean_path(walk((0.5, 0.1, 0.3)), 500, 600, 275)
    pose = loops.cut_loop(walk((0.4, 0.0, 0.0)), 10, 275).pose(100)
    met = passage.meet(pose, end, 200)
    for one, other in zip(met.pose(end), pose, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)
    np.testing.assert_allclose(met.root[0], 0.0, atol=1e-12)
    assert met.seam == pytest.approx(root_motion.seam_size(pose.relative(passage.pose(end))), rel=0.2)
    # Beyond the samples over which the pose fades, the motion in the world is as it was.
    rows = slice(220, 580) if end == 0 else slice(20, 380)
    before, after = (ground_poses.ground_poses(motion.poses()[rows]) for motion in (passage, met))
    np.testing.assert_allclose(
        ground_poses.relative_pose(after[0], after), ground_poses.relative_pose(before[0], before), atol=1e-9
    )
    np.testing.assert_allclose(met.joints[rows], passage.joints[rows], atol=1e-12)


def test_a_straight_loop_goes_where_it_is_to():
    loop = loops.cut_loop(walk((0.4, -0.1, 0.05)), 10, 275)
    straight = loops.straighten_loop(loop, 0.0)
    np.testing.assert_allclose(straight.twist, (np.hypot(*loop.twist[:2]), 0.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(straight.root[:, 1:], 0.0, atol=1e-12)
    # In the first moment the torso moves over the ground in the direction that it had, seen from itself.
    ways = [np.diff(ground_poses.ground_poses(motion.poses())[:2], axis=0)[0] for motion in (loop, straight)]
    headings = [rotations.yaw(motion.poses()[0, 3:7]) for motion in (loop, straight)]
    seen = [rotations.to_heading_frame(way[:2], heading) for way, heading in zip(ways, headings, strict=True)]
    np.testing.assert_allclose(seen[0], seen[1], atol=1e-5)


def test_beginning_elsewhere_is_the_same_loop():
    loop = loops.cut_loop(walk(TWISTS[1]), 10, 275)
    begun = loop.start_at(100)
    assert (begun.joints[0] == loop.joints[100]).all() and (begun.joints[-1] == begun.joints[0]).all()
    np.testing.assert_array_equal(np.sort(begun.joints[:-1], axis=0), np.sort(loop.joints[:-1], axis=0))


def test_frames_lie_between_samples():
    loop = loops.cut_loop(walk(TWISTS[1]), 10, 275)
    frames = loop.sample_at(np.linspace(0.0, loop.seconds, 34))
    assert (frames.joints[0] == loop.joints[0]).all() and (frames.joints[-1] == loop.joints[-1]).all()
    place = loop.seconds / 33.0 / STEP
    low = int(place)
    np.testing.assert_allclose(
        frames.joints[1], loop.joints[low] + (place - low) * (loop.joints[low + 1] - loop.joints[low]), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.norm(frames.quaternions, axis=-1), 1.0)
    assert (loop.sample_at(STEP * np.arange(276)).joints == loop.joints).all()


def test_a_passage_keeps_the_way():
    recording = walk((0.5, 0.0, 0.3))
    passage = root_motion.follow_mean_path(recording, 500, 600, 275)
    there = recording.poses[500:1101]
    poses = passage.poses()
    turn = rotations.yaw(poses[:1, 3:7])[0] - rotations.yaw(there[:1, 3:7])[0]
    way = rotations.to_heading_frame(there[:, :2] - there[0, :2], -turn)
    np.testing.assert_allclose(poses[:, :2] - poses[0, :2], way, atol=1e-9)
    np.testing.assert_allclose(passage.root[0], 0.0, atol=1e-12)
    speeds = np.hypot(*np.diff(passage.root[:, :2], axis=0).T) / STEP
    np.testing.assert_allclose(speeds, 0.5, rtol=0.05)  # the torso's own varies by 0.8
