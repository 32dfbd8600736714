"""The demonstrator that plans: circles out of ranges, ways around them, goals reached."""

import math

import numpy as np
import pytest
from crossings import walked
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite.arenas.pillars import RADIUS
from arc_suite.cpg.planner import command_toward, locate_pillars, point_along_path, shortest_path
from arc_suite.cpg.presets import DEFAULTS
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS
from arc_suite.tasks.sensors import RAYS, SIGHT

PLAN = DEFAULTS["planned"]


def ranges_of(circles):
    """What a body at the origin sees of circles (n, 2), by trigonometry."""
    ranges = np.ones(24)
    for x, y in circles:
        distance = math.hypot(x, y)
        for ray, (forward, left) in enumerate(RAYS.T):
            angle = math.acos(min((forward * x + left * y) / distance, 1.0))
            if math.sin(angle) * distance < RADIUS and angle < 0.5 * math.pi:
                hit = distance * math.cos(angle) - math.sqrt(RADIUS**2 - (distance * math.sin(angle)) ** 2)
                ranges[ray] = min(ranges[ray], hit / SIGHT)
    return ranges


def test_circles_are_found_out_of_ranges():
    random = np.random.RandomState(0)
    for _ in range(200):
        distance, angle = random.uniform(1.2, 5.0), random.uniform(-math.pi, math.pi)
        middle = distance * np.array([math.cos(angle), math.sin(angle)])
        ranges = ranges_of([middle])
        found, rays = locate_pillars(ranges), (ranges < 1.0).sum()
        assert len(found) == min(rays, 1)
        if rays:
            assert_allclose(found[0], middle, atol=1e-9 if rays > 1 else 1.5 * RADIUS)
    several = [(3.0, 0.5), (-0.5, -2.0), (0.0, 2.0), (2.0, -2.0)]
    assert len(locate_pillars(ranges_of(several))) == 4
    assert locate_pillars(np.ones(24)).shape == (0, 2)


def nearest(corners, circles):
    """How near a way from the origin leads to circles."""
    points = np.array([np.zeros(2), *corners])
    shares = np.linspace(0.0, 1.0, 200)[:, None, None]
    places = (points[:-1] + shares * np.diff(points, axis=0)).reshape(-1, 2)
    return np.hypot(*np.moveaxis(places[:, None] - np.array(circles), -1, 0)).min()


def length(corners):
    return np.hypot(*np.diff([np.zeros(2), *corners], axis=0).T).sum()


def test_ways_are_straight_where_nothing_is_between_and_short_around_what_is():
    goal, none = np.array([5.0, 0.0]), np.zeros((0, 2))
    assert_array_equal(shortest_path(goal, none, 1.1, PLAN), [goal])
    assert_array_equal(shortest_path(goal, np.array([[2.5, 3.0]]), 1.1, PLAN), [goal])
    for side in (0.3, -0.3):
        circles = np.array([[2.5, side]])
        corners = shortest_path(goal, circles, 1.1, PLAN)
        assert_array_equal(corners[-1], goal)
        assert nearest(corners, circles) > RADIUS + 1.1
        assert all(np.sign(corner[1]) == -np.sign(side) for corner in corners[:-1]), "around the nearer side"
        assert 5.0 < length(corners) < 6.5
    gate = np.array([[2.5, 1.8], [2.5, -1.8], [2.5, 5.4], [2.5, -5.4]])
    through = shortest_path(goal, gate, 1.3, PLAN)
    assert length(through) < 5.1 and nearest(through, gate) > 1.7
    wall = np.stack([np.full(21, 2.5), np.arange(-10.0, 11.0)], axis=-1)
    assert shortest_path(goal, wall, 1.1, PLAN) == [] or length(shortest_path(goal, wall, 1.1, PLAN)) > 20.0


def test_the_point_that_is_steered_for_lies_along_the_way():
    corners = [np.array([1.0, 0.0]), np.array([1.0, 2.0])]
    for distance, point in ((0.4, (0.4, 0.0)), (1.5, (1.0, 0.5)), (9.0, (1.0, 2.0))):
        assert_allclose(point_along_path(corners, distance), point)


def test_commands_turn_to_where_they_lead():
    assert command_toward(0.0, PLAN) == (PLAN.forward, 0.0, 0.0)
    forward, left, turn = command_toward(2.0, PLAN)
    assert forward < 0.0 < left and turn == 1.0
    assert command_toward(-2.0, PLAN) == (forward, -left, -turn)


@pytest.mark.release
@pytest.mark.parametrize("robot", ROBOTS)
def test_robots_reach_goals_and_hit_nothing(robot):
    """At least four goals in 1000 steps, fewer than one collision in twenty."""
    _, fell, infos = zip(*walked(VectorEnv(robot, "navigate", 8), "planned", 999, seed=100), strict=True)
    assert not np.any(fell)
    goals, collisions = (infos[-1][f"progress_{name}"] for name in ("goals", "collisions"))
    assert goals.mean() >= 4.0
    assert collisions.sum() < 0.05 * goals.sum()
