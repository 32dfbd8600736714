"""Foot contact events from heights: bounces and feet that never leave the ground."""

import numpy as np

from arc_suite.animation.clips.foot_contacts import count_odd_feet, find_swings, find_touching

PHASE = np.linspace(0.0, 3.0, 600, endpoint=False)  # cycles of 200 samples
HEIGHTS = 0.1 * np.sin(2.0 * np.pi * PHASE).clip(0.0) + 0.003 * np.sin(40.0 * PHASE)


def runs(up):
    return int((up & ~np.roll(up, 1)).sum())


def test_a_swing_a_cycle_wherever_the_loop_begins():
    for shift in range(0, 600, 37):
        up = find_swings(np.roll(HEIGHTS, shift), 0.01, 20, True)
        assert runs(up) == 3
        np.testing.assert_array_equal(up, np.roll(find_swings(HEIGHTS, 0.01, 20, True), shift))


def test_chatter_is_no_swing():
    chattering = HEIGHTS + 0.03 * (np.arange(600) % 200 == 150)
    assert runs(find_swings(chattering, 0.01, 20, True)) == 3


def test_a_bounce_belongs_to_its_swing():
    bouncing = HEIGHTS.copy()
    bouncing[60:65] = 0.0
    assert runs(find_swings(bouncing, 0.01, 20, True)) == 3
    assert runs(find_swings(bouncing, 0.01, 4, True)) == 4


def test_feet_are_odd_that_step_twice_in_a_cycle_or_not_at_all():
    twice = HEIGHTS + 0.09 * (np.arange(600) // 20 == 27)
    still = 0.0 * HEIGHTS
    heights = np.stack([HEIGHTS, np.roll(HEIGHTS, 90), twice, still], axis=-1)
    assert count_odd_feet(heights, 3, 1.0) == 2
    assert count_odd_feet(heights[:400], 2, 1.0) == 1  # before the second step


def test_a_foot_that_stays_down():
    assert not find_swings(0.05 * HEIGHTS, 0.01, 20, True).any()


def test_what_is_no_loop_may_begin_and_end_in_a_swing():
    up = find_swings(HEIGHTS[50:450], 0.01, 20, False)
    assert up[0] and up[-1]
    assert np.flatnonzero(np.diff(up.astype(int))).size == 4


def test_it_touches_when_the_sole_is_near():
    for shift in (0, 37, 150, 399):
        heights = np.roll(HEIGHTS, shift)
        up = find_swings(heights, 0.01, 20, True)
        down = find_touching(heights, up, 0.004, True)
        assert runs(~down) == runs(up) == 3 and (~down).sum() > up.sum()
        edges = np.flatnonzero(down & ~(np.roll(down, 1) & np.roll(down, -1)))
        assert len(edges) == 6 and (heights[edges] <= 0.004).all() and (heights[~down & ~up] > 0.004).all()


def test_a_foot_that_stays_above_the_ground_touches_near_its_lowest_point():
    up = find_swings(HEIGHTS + 0.02, 0.01, 20, True)
    np.testing.assert_array_equal(
        find_touching(HEIGHTS + 0.02, up, 0.004, True), find_touching(HEIGHTS - HEIGHTS.min(), up, 0.004, True)
    )


def test_a_foot_that_is_on_its_way_when_the_samples_end_does_not_touch():
    heights = np.array((0.0, 0.0, 0.05, 0.1, 0.05, 0.015, 0.01))
    up = find_swings(heights, 0.01, 1, False)
    assert not up[-1]
    assert find_touching(heights, up, 0.005, False).tolist() == [True, True, False, False, False, False, False]
