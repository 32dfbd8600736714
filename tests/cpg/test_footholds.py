"""Footholds: what scans tell of the ground, and where feet are shifted that would land over a trench."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite.cpg import footholds
from arc_suite.cpg.footholds import View
from arc_suite.tasks.sensors import FORWARD, LEFT

REACH, HEIGHT = 1.3, 1.0  # m
PLACES = np.array([(1.0, 1.0), (0.0, 1.3), (-1.0, 1.0), (1.0, -1.0), (0.0, -1.3), (-1.0, -1.0)])


def scan(*trenches, moved=0.0):
    """Heights (points,) over trenches (from, to), m ahead of the torso, seen when it was `moved` m further back."""
    x = np.repeat(FORWARD * REACH, len(LEFT)) - moved
    return -0.6 * sum(((x >= first) & (x < last)) for first, last in trenches) if trenches else np.zeros(len(x))


def view(*scans):
    """A view of one environment from (heights, moved) of scans."""
    heights, moved = zip(*scans, strict=True)
    return View(np.stack(heights)[None], np.array([[(way, 0.0) for way in moved]]), REACH)


def shifted(seen, x):
    """By how much a foot that would land at x, ahead on the left, is shifted."""
    landing = np.array([[(x, 1.0), *PLACES[1:]]])
    along = np.tile((1.0, 0.0), (1, len(PLACES), 1))
    shifts, _ = footholds.find_landings(seen, landing, along, PLACES, HEIGHT)
    return shifts[0]


def test_level_ground_shifts_no_foot():
    assert_array_equal(shifted(view((scan(), 0.0)), 1.1), 0.0)


@pytest.mark.parametrize("x", np.linspace(1.05, 1.75, 15))
def test_a_foot_over_a_trench_is_shifted_to_land_and_no_other(x):
    shifts = shifted(view((scan((1.2, 1.6)), 0.0)), x)
    assert_array_equal(shifts[1:], 0.0)
    around = x + shifts[0] + footholds.SUPPORT_POINTS * HEIGHT
    assert ((around < 1.2) | (around >= 1.6)).all()


def test_a_foot_is_shifted_no_further_than_it_must():
    seen = view((scan((1.2, 1.6)), 0.0))
    assert shifted(seen, 1.25)[0] < 0.0 < shifted(seen, 1.58)[0]
    assert abs(shifted(seen, 1.25)[0]) < 0.5


def test_where_there_is_no_foothold_a_foot_lands_as_it_would():
    assert shifted(view((scan((0.4, 2.6)), 0.0)), 1.5)[0] == 0.0


def test_ground_is_the_lower_of_two_points_and_the_higher_of_two_scans():
    x, y = np.array([1.1]), np.array([1.0])
    spacing = (FORWARD[1] - FORWARD[0]) * REACH
    first = 1.1 + 0.25 * spacing
    one = scan((first, first + 0.5))
    edges = FORWARD * REACH
    for way in np.linspace(0.0, spacing, 7):
        other = scan((first, first + 0.5), moved=way)
        both = view((one, 0.0), (other, way)).ground(x, y)
        assert both == max(view((one, 0.0)).ground(x, y), view((other, way)).ground(x, y))
        nearest = edges[edges > 1.1 + way].min() - way
        assert (view((other, way)).ground(x, y) == 0.0) == (nearest < first)


def test_what_was_not_seen_yet_says_nothing():
    seen = view((scan((1.2, 1.6)), 0.0), (np.full(len(FORWARD) * len(LEFT), -np.inf), 0.0))
    assert_allclose(shifted(seen, 1.4), shifted(view((scan((1.2, 1.6)), 0.0)), 1.4))
