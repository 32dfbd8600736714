"""Start replay: seeds of the episodes of a learner."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from arc_suite.learning.agents.start_replay import CAPACITY, EARLY, StartReplay

SEEDS = range(500, 510)
ALL = np.ones(3, bool)
NONE = np.zeros(3, bool)


@pytest.fixture
def replay():
    return StartReplay.begin(SEEDS, 3)


def kept(replay):
    return replay.fallen[replay.fallen >= 0].tolist()


def test_without_falls_seeds_come_in_their_order_and_again(replay):
    assert replay.present.tolist() == [500, 501, 502]
    random = np.random.default_rng(0)
    replay = replay.begin_episodes(np.array([True, False, True]), 1.0, SEEDS, random)
    assert replay.present.tolist() == [503, 501, 504]
    for _ in range(2):
        replay = replay.begin_episodes(ALL, 1.0, SEEDS, random)
    assert replay.present.tolist() == [508, 509, 500]


def test_a_start_is_kept_until_it_goes_well(replay):
    fell = np.array([True, True, False])
    late = replay._replace(steps=np.array([EARLY, EARLY + 1, 3]))
    fallen = late.end_episodes(ALL, fell)
    assert kept(fallen) == [500]
    assert kept(fallen.end_episodes(ALL, fell)) == [500]  # not twice
    assert kept(fallen.end_episodes(~ALL, fell)) == [500]
    assert kept(fallen.end_episodes(ALL, NONE)) == []
    assert kept(late) == []  # a value


def test_the_oldest_makes_room(replay):
    for first in range(0, CAPACITY + 3, 3):
        replay = replay._replace(present=np.arange(first, first + 3)).end_episodes(ALL, ALL)
    starts = kept(replay)
    assert len(starts) == CAPACITY and set(range(first, first + 3)) < set(starts) and not {0, 1} & set(starts)


def test_a_share_of_the_episodes_repeats_a_start(replay):
    replay = replay.end_episodes(ALL, np.array([True, False, True]))
    random = np.random.default_rng(0)
    seeds = []
    for _ in range(400):
        replay = replay._replace(steps=np.full(3, 7)).begin_episodes(ALL, 0.25, range(500, 5000), random)
        seeds += replay.present.tolist()
    assert_array_equal(replay.steps, 0)
    repeated = [seed for seed in seeds if seed in (500, 502)]
    assert len(repeated) == pytest.approx(300, abs=45) and set(repeated) == {500, 502}
    fresh = [seed for seed in seeds if seed not in (500, 502)]
    assert fresh == list(range(503, 503 + len(fresh)))
