"""Motions: places on the ground, loops of synthetic walks whose truth is known."""

import functools

import numpy as np
import pytest

from arc_suite import rotations
from arc_suite.export import root_motion
from arc_suite.export.recordings import Recording

STEP, CYCLE = 0.002, 0.55  # s; a cycle is 11 control steps
TWISTS = [(0.5, 0.0, 0.0), (0.4, -0.1, 0.8), (0.0, 0.2, -0.5), (-0.3, 0.0, 1e-12)]


@functools.cache
def walk(twist, seconds=6.0, cycle=CYCLE, drift=0.0, start=(1.0, -2.0, 2.5)):
    """Two joints and a torso that sway once a cycle on a path of constant twist."""
    times = STEP * np.arange(round(seconds / STEP) + 1)
    phase = 2.0 * np.pi * times / cycle
    root = root_motion.along(np.array(twist), times)
    sway = np.stack([0.02 * np.sin(2.0 * phase), 0.03 * np.cos(phase), 0.1 * np.sin(phase)], axis=-1)
    place = np.stack(
        [root_motion.after(root_motion.after(np.array(start), a), b) for a, b in zip(root, sway, strict=True)]
    )
    roll = 0.05 * np.sin(phase) + drift * times
    tilt = np.stack([np.cos(0.5 * roll), np.sin(0.5 * roll), 0.0 * roll, 0.0 * roll], axis=-1)
    quaternions = rotations.turned(tilt, place[:, 2])
    joints = np.stack([np.sin(phase), 0.3 * np.sin(2.0 * phase) + 0.2 * np.cos(phase) + drift * times], axis=-1)
    height = 0.5 + 0.01 * np.cos(2.0 * phase)
    return Recording(STEP, np.concatenate([place[:, :2], height[:, None], quaternions, joints], axis=-1))


@pytest.mark.parametrize("twist", TWISTS)
def test_logarithm_undoes_along(twist):
    place = root_motion.along(np.array(twist), np.array([0.0, 1.0]))
    np.testing.assert_allclose(place[0], 0.0)
    np.testing.assert_allclose(root_motion.logarithm(place[1]), twist, atol=1e-12)


def test_along_adds_small_steps():
    twist, place = np.array((0.4, -0.1, 0.8)), np.zeros(3)
    small = root_motion.along(twist, np.array([1e-3]))[0]
    for _ in range(1000):
        place = root_motion.after(place, small)
    np.testing.assert_allclose(root_motion.along(twist, np.array([1.0]))[0], place, atol=1e-12)


def test_relative_undoes_after():
    first, second = np.array((1.0, 2.0, 0.7)), np.array((-0.5, 0.2, 2.0))
    np.testing.assert_allclose(root_motion.relative(first, root_motion.after(first, second)), second)


def test_the_period_is_the_cycle():
    assert root_motion.period(walk(TWISTS[0])) == pytest.approx(CYCLE, abs=STEP)


def test_what_does_not_return_has_no_period():
    recording = walk(TWISTS[0])
    random = np.random.default_rng(0).normal(size=(len(recording.qpos), 2)).cumsum(axis=0)
    assert root_motion.period(recording._replace(qpos=np.concatenate([recording.qpos[:, :7], random], axis=-1))) is None


@pytest.mark.parametrize("twist", TWISTS)
def test_a_loop(twist):
    recording = walk(twist)
    closing = root_motion.closings(recording, CYCLE)[1]
    assert closing.samples == 275 and closing.seam < 1e-9
    loop = root_motion.loop(recording, root_motion.Stretch(137, closing.samples, True))
    assert loop.seconds == pytest.approx(CYCLE)
    np.testing.assert_allclose(loop.twist[2], twist[2], atol=1e-9)
    assert np.hypot(*loop.twist[:2]) == pytest.approx(np.hypot(*twist[:2]), rel=0.02)
    for name in ("positions", "quaternions", "joints"):
        values = getattr(loop, name)
        assert (values[0] == values[-1]).all(), name
    # The root runs below the torso, and the whole is what was recorded.
    np.testing.assert_allclose(loop.positions[:-1, :2].mean(axis=0), 0.0, atol=1e-3)
    np.testing.assert_allclose(rotations.yaw(loop.quaternions[:-1]).mean(), 0.0, atol=1e-3)
    qpos = loop.qpos()
    there = np.concatenate([recording.qpos[:, :2], rotations.yaw(recording.qpos[:, 3:7])[:, None]], axis=-1)[137:413]
    here = np.concatenate([qpos[:, :2], rotations.yaw(qpos[:, 3:7])[:, None]], axis=-1)
    difference = root_motion.relative(here[0], here) - root_motion.relative(there[0], there)
    np.testing.assert_allclose(difference[:, :2], 0.0, atol=1e-9)
    np.testing.assert_allclose(rotations.wrapped(difference[:, 2]), 0.0, atol=1e-9)
    np.testing.assert_allclose(qpos[:, 7:], recording.qpos[137:413, 7:], atol=1e-9)


def test_a_seam_is_spread():
    recording = walk(TWISTS[1], drift=0.02)
    loop = root_motion.loop(recording, root_motion.Stretch(10, 275, True))
    assert loop.seam == pytest.approx(0.02 * CYCLE, rel=0.01)
    assert root_motion.closings(recording, CYCLE)[1] == pytest.approx((loop.seam, 275))
    assert (loop.joints[0] == loop.joints[-1]).all() and (loop.quaternions[0] == loop.quaternions[-1]).all()
    correction = loop.joints[:, 1] - recording.qpos[10:286, 8]
    np.testing.assert_allclose(np.diff(correction)[:-1], -0.02 * STEP, atol=1e-12)
    jumps = abs(np.diff(loop.quaternions, axis=0)).max(axis=-1)
    assert jumps[[0, -1]].max() < 1.2 * np.median(jumps) + 1e-3


@pytest.mark.parametrize("twist", TWISTS[:3])
def test_of_the_loops_that_close_the_usual_one_is_taken(twist):
    """Of four cycles the last leads further: a loop of the first three goes as fast as the walk does on the mean."""
    recording = walk(twist, seconds=4 * CYCLE)
    qpos = recording.qpos.copy()
    qpos[825:, :2] += np.outer(np.arange(276) / 275.0, 0.3 * (qpos[-1, :2] - qpos[825, :2]))
    stretch = root_motion.usual(Recording(STEP, qpos), 275)
    assert stretch.first < 600 and stretch.samples == 275
    speed = np.hypot(*root_motion.loop(Recording(STEP, qpos), stretch).twist[:2])
    mean = np.hypot(*twist[:2])
    assert mean < speed < 1.3 * mean
    assert root_motion.usual(recording, 275).usual


def test_a_loop_that_is_the_only_one_to_close_need_not_be_usual():
    """Two cycles: the first is slower, the pose of the second returns."""
    recording = walk(TWISTS[0], seconds=2 * CYCLE)
    qpos = recording.qpos.copy()
    qpos[:275, 8] += 0.1 * (1.0 - np.arange(275) / 275.0)
    qpos[275:, 0] += 0.05 * np.cos(2.5) * np.arange(276) / 275.0
    qpos[275:, 1] += 0.05 * np.sin(2.5) * np.arange(276) / 275.0
    stretch = root_motion.usual(Recording(STEP, qpos), 275)
    assert not stretch.usual
    assert root_motion.loop(Recording(STEP, qpos), stretch).seam <= root_motion.CLOSED


def test_beginning_elsewhere_is_the_same_loop():
    loop = root_motion.loop(walk(TWISTS[1]), root_motion.Stretch(10, 275, True))
    begun = loop.begun(100)
    assert (begun.joints[0] == loop.joints[100]).all() and (begun.joints[-1] == begun.joints[0]).all()
    np.testing.assert_array_equal(np.sort(begun.joints[:-1], axis=0), np.sort(loop.joints[:-1], axis=0))


def test_frames_lie_between_samples():
    loop = root_motion.loop(walk(TWISTS[1]), root_motion.Stretch(10, 275, True))
    frames = loop.at(np.linspace(0.0, loop.seconds, 34))
    assert (frames.joints[0] == loop.joints[0]).all() and (frames.joints[-1] == loop.joints[-1]).all()
    place = loop.seconds / 33.0 / STEP
    low = int(place)
    np.testing.assert_allclose(
        frames.joints[1], loop.joints[low] + (place - low) * (loop.joints[low + 1] - loop.joints[low]), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.norm(frames.quaternions, axis=-1), 1.0)
    assert (loop.at(STEP * np.arange(276)).joints == loop.joints).all()


def test_a_passage_keeps_the_way():
    recording = walk((0.5, 0.0, 0.3))
    passage = root_motion.passage(recording, 500, 600, 275)
    there = recording.qpos[500:1101]
    qpos = passage.qpos()
    turn = rotations.yaw(qpos[:1, 3:7])[0] - rotations.yaw(there[:1, 3:7])[0]
    way = rotations.headed(there[:, :2] - there[0, :2], -turn)
    np.testing.assert_allclose(qpos[:, :2] - qpos[0, :2], way, atol=1e-9)
    np.testing.assert_allclose(passage.root[0], 0.0, atol=1e-12)
    speeds = np.hypot(*np.diff(passage.root[:, :2], axis=0).T) / STEP
    np.testing.assert_allclose(speeds, 0.5, rtol=0.05)  # the torso's own varies by 0.8
    part = passage.part(100, 200)
    np.testing.assert_allclose(part.root[0], 0.0, atol=1e-12)
    assert len(part.joints) == 201 and (part.joints == passage.joints[100:301]).all()
