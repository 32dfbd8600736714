"""Keys that a track needs."""

import numpy as np

from arc_suite.animation.clips import keys

TIMES = np.linspace(0.0, 2.0 * np.pi, 200)


def test_places_stay_within_the_bound():
    path = np.stack([np.sin(TIMES), 2.0 * TIMES, np.zeros_like(TIMES)], axis=-1)
    kept = keys.select_keys(path, 0.01)
    assert kept[0] == 0 and kept[-1] == 199 and 8 < len(kept) < 30
    between = np.stack([np.interp(np.arange(200), kept, path[kept, axis]) for axis in range(3)], axis=-1)
    assert np.linalg.norm(between - path, axis=-1).max() <= 0.01


def test_a_turn_at_a_constant_rate_needs_its_ends():
    half = 0.25 * TIMES
    turn = np.stack([np.cos(half), np.zeros_like(half), np.sin(half), np.zeros_like(half)], axis=-1)
    assert keys.select_keys(turn, 1e-6).tolist() == [0, 199]
    assert keys.select_keys(np.tile(turn[:1], (5, 1)), 1e-6).tolist() == [0, 4]


def test_two_samples():
    assert keys.select_keys(np.zeros((2, 3)), 0.1).tolist() == [0, 1]
