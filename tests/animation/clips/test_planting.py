"""Planting: feet in stance stay, and the rest of the walk is as it was."""

import functools

import numpy as np
import pytest
from poses import placed

from arc_suite.animation import clips as export
from arc_suite.animation.clips import planting
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS

BODY = ROBOTS["queen"]  # whose walk strides further than her hips turn: feet meet in the middle of what they reach
HEIGHT = BODY.torso.standing_height


@functools.cache
def made(plant):
    clips = export.clips(Setup.of(BODY, "steer"), ["walk", "stop", "idle"], fps=500, plant=plant)
    return {clip.name: clip for clip in clips}


def soles(motion):
    """Places (samples, feet, 3) of the lowest points of the feet in the world."""
    radii = np.array([leg.foot.radius for leg in BODY.legs])
    return placed(BODY, motion.poses(), BODY.foot_names)[0] - radii[:, None] * (0.0, 0.0, 1.0)


def slip(motion):
    """Mean path of the soles within 0.01 h of the ground, by that of the root."""
    places = soles(motion)
    low = (places[1:, :, 2] < 0.01 * HEIGHT) & (places[:-1, :, 2] < 0.01 * HEIGHT)
    paths = (np.linalg.norm(np.diff(places[..., :2], axis=0), axis=-1) * low).sum(axis=0)
    return paths.mean() / np.linalg.norm(np.diff(motion.root[:, :2], axis=0), axis=-1).sum()


@pytest.mark.long
@pytest.mark.slow
def test_feet_in_stance_neither_slide_nor_sink():
    before, after = (made(plant)["walk"].motion for plant in (False, True))
    assert slip(before) > 0.15 and slip(after) < 0.07
    assert soles(after)[..., 2].min() > -0.003 * HEIGHT
    assert (after.joints[0] == after.joints[-1]).all()
    np.testing.assert_array_equal(after.root, before.root)
    for name in ("positions", "quaternions"):  # weight falls after touchdowns, which planting moves by some samples
        np.testing.assert_allclose(getattr(after, name), getattr(before, name), atol=0.001)


@pytest.mark.long
def test_planted_clips_connect():
    clips = made(True)
    for before, after in (("walk", "stop"), ("stop", "idle")):
        for one, other in zip(clips[before].motion.pose(-1), clips[after].motion.pose(0), strict=True):
            np.testing.assert_allclose(one, other, atol=1e-6)
    jumps = []
    for plant in (False, True):
        before, after = (np.diff(soles(made(plant)[name].motion), axis=0) for name in ("walk", "stop"))
        jumps.append(np.linalg.norm(after[:8].mean(axis=0) - before[-8:].mean(axis=0), axis=-1).max())
    assert jumps[1] < 2.0 * jumps[0]


def test_corrections_hold_a_stance_and_bridge_swings():
    """A foot that slides by 1 mm a sample in two stances stays in each, and nothing jumps between them."""
    count = 100
    heights = np.where((np.arange(count) % 50) < 30, 0.1, 0.3)
    places = np.stack([0.001 * np.arange(count), np.zeros(count), heights], axis=-1)
    intervals = planting._find_stances(heights < 0.2, 5, None)
    assert intervals == [(0, 30), (50, 80)]
    held = places + planting._corrections(places, 0.1, intervals, True)
    assert np.ptp(held[:30], axis=0).max() < 1e-12 and np.ptp(held[50:80], axis=0).max() < 1e-12
    np.testing.assert_allclose(held[0], places[0], atol=1e-12)  # an end stays where it is
    assert abs(np.diff(held[:, 0])).max() < 0.006


def test_a_short_lift_is_no_end_of_a_stance():
    low = np.ones(60, bool)
    low[20:23], low[40:50] = False, False
    assert planting._find_stances(low, 5, None) == [(0, 40), (50, 60)]
    assert planting._find_stances(low, 5, 30) == [(50, 60)]
