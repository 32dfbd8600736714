"""Foot contact events from heights: bounces and feet that never leave the ground."""

import numpy as np

from arc_suite.animation.clips.foot_contacts import swings

PHASE = np.linspace(0.0, 3.0, 600, endpoint=False)  # cycles of 200 samples
HEIGHTS = 0.1 * np.sin(2.0 * np.pi * PHASE).clip(0.0) + 0.003 * np.sin(40.0 * PHASE)


def runs(up):
    return int((up & ~np.roll(up, 1)).sum())


def test_a_swing_a_cycle_wherever_the_loop_begins():
    for shift in range(0, 600, 37):
        up = swings(np.roll(HEIGHTS, shift), 0.01, 20, True)
        assert runs(up) == 3
        np.testing.assert_array_equal(up, np.roll(swings(HEIGHTS, 0.01, 20, True), shift))


def test_chatter_is_no_swing():
    chattering = HEIGHTS + 0.03 * (np.arange(600) % 200 == 150)
    assert runs(swings(chattering, 0.01, 20, True)) == 3


def test_a_bounce_belongs_to_its_swing():
    bouncing = HEIGHTS.copy()
    bouncing[60:65] = 0.0
    assert runs(swings(bouncing, 0.01, 20, True)) == 3
    assert runs(swings(bouncing, 0.01, 4, True)) == 4


def test_a_foot_that_stays_down():
    assert not swings(0.05 * HEIGHTS, 0.01, 20, True).any()


def test_what_is_no_loop_may_begin_and_end_in_a_swing():
    up = swings(HEIGHTS[50:450], 0.01, 20, False)
    assert up[0] and up[-1]
    assert np.flatnonzero(np.diff(up.astype(int))).size == 4
