"""Keys that a track needs."""

from itertools import pairwise

import numpy as np
import pytest

from arc_suite.animation.clips import keys

TIMES = np.linspace(0.0, 2.0 * np.pi, 200)


def test_places_stay_within_the_bound():
    path = np.stack([np.sin(TIMES), 2.0 * TIMES, np.zeros_like(TIMES)], axis=-1)
    kept = keys.select_keys(path, 0.01)
    assert kept[0] == 0 and kept[-1] == 199 and 8 < len(kept) < 30
    between = np.stack([np.interp(np.arange(200), kept, path[kept, axis]) for axis in range(3)], axis=-1)
    assert np.linalg.norm(between - path, axis=-1).max() <= 0.01


def turn_evenly(degrees):
    """Quaternions (200, 4) of a turn about y at a constant rate."""
    half = np.radians(0.5 * degrees) * np.linspace(0.0, 1.0, 200)
    return np.stack([np.cos(half), np.zeros_like(half), np.sin(half), np.zeros_like(half)], axis=-1)


def test_a_turn_at_a_constant_rate_needs_its_ends():
    turn = turn_evenly(179.0)
    assert keys.select_keys(turn, 1e-6).tolist() == [0, 199]
    assert keys.select_keys(np.tile(turn[:1], (5, 1)), 1e-6).tolist() == [0, 4]


def test_two_samples():
    assert keys.select_keys(np.zeros((2, 3)), 0.1).tolist() == [0, 1]


@pytest.mark.parametrize(("degrees", "count"), [(179.9, 2), (180.0, 3), (270.0, 3), (360.0, 4), (500.0, 5)])
def test_players_take_the_shorter_way_between_the_keys_of_a_large_turn(degrees, count):
    turn = turn_evenly(degrees)
    kept = keys.select_keys(turn, np.radians(0.1))
    assert len(kept) == count
    for start, end in pairwise(kept):
        first, last = turn[[start, end]].astype("f4").astype(float)
        half = np.arctan2(last[2], last[0]) - np.arctan2(first[2], first[0])
        half = (half + 0.5 * np.pi) % np.pi - 0.5 * np.pi  # the shorter way round
        assert np.degrees(2.0 * half) == pytest.approx(degrees * (end - start) / 199, abs=0.1)
