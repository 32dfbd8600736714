"""The demonstrator that climbs: four legs on stairs, feet at the height of the ground, poses that free the feet."""

import numpy as np
import pytest
from crossings import crossed

from arc_suite import registry
from arc_suite.cpg.selection import law, presets_of
from arc_suite.envs.setup import Setup
from arc_suite.models import posture
from arc_suite.robots import ROBOTS
from arc_suite.tasks.sensors import SCAN

STAIRS = {"difficulty": 0.5, "terrain_seed": 1}
CAUGHT = "varied:7010"  # a body whose rear legs are straight at rest, at the limits of their joints


@pytest.mark.parametrize("name", ["varied:7012", "random:7031"])
def test_four_legs_climb_stairs(name):
    """Without sight they climb with the front feet, and hang with the rear ones."""
    body = registry.body_of(name)
    assert len(body.legs) == 4
    blind_way, _ = crossed(body, "surefooted", "stairs", STAIRS, num_envs=2)
    way, _ = crossed(body, "climbing", "stairs", STAIRS, num_envs=2)
    assert blind_way < 0.4
    assert way > 0.6


def test_a_torso_sinks_until_every_leg_can_lift_its_foot():
    body = registry.body_of(CAUGHT)
    wide = posture.find_wide_pose(body, 0.2, 0.15)
    climbing = posture.find_climbing_pose(body, 0.2, 0.15)
    assert wide.ride_height == 1.0 and climbing.ride_height == 0.95


def test_a_torso_does_not_sink_where_it_would_stand_less_firmly():
    """Its rear feet would come so near to the front ones that it falls as it walks."""
    body = registry.body_of("varied:9709")
    assert posture.find_climbing_pose(body, 0.2, 0.15).ride_height == 1.0


@pytest.mark.parametrize("name", ["tick", "varied:7012"])
def test_legs_that_can_lift_their_feet_stay_as_wide(name):
    body = registry.body_of(name)
    wide = posture.find_wide_pose(body, 0.2, 0.15)
    np.testing.assert_array_equal(posture.find_climbing_pose(body, 0.2, 0.15).joint_angles, wide.joint_angles)


def _sole_heights(heights: np.ndarray, preset) -> np.ndarray:
    """Return heights (legs,) of Tick's soles in stance over a scan (points,), m from those on level ground."""
    task = Setup.of("tick", "stairs").definition
    climbing = law(task, preset)
    soles = climbing.rest_soles[None]
    stance = np.zeros(soles.shape[:2])
    grown = np.ones((1, 1))
    plane = (climbing.ground_fit @ heights)[None]
    level = np.array([[0.0, 0.0, 1.0]])
    stepped = climbing.step_on_ground(soles, stance, np.zeros((1, 3)), grown, heights[None], plane, level)
    return (stepped - soles)[0, :, 2]


def test_feet_stand_at_the_height_of_the_ground_under_them():
    level_torso = presets_of(ROBOTS["tick"])["climbing"]._replace(slope=0.0)
    ahead = SCAN[0] > 0.3
    on_step = _sole_heights(np.where(ahead, 0.05, 0.0), level_torso)
    task = Setup.of("tick", "stairs").definition
    is_front = law(task, level_torso).rest_soles[:, 0] > 0.1
    assert on_step[is_front].min() - on_step[~is_front].max() == pytest.approx(0.05, abs=1e-9)
    np.testing.assert_allclose(_sole_heights(np.full(len(ahead), 0.05), level_torso), 0.0, atol=1e-9)


def test_a_torso_follows_the_slope_under_it():
    """A body with six legs tilts on stairs by a share of their slope, so that all legs keep room to lift their feet."""
    preset = presets_of(ROBOTS["tick"])["climbing"]
    assert preset.slope == 0.6
    slope = 0.2
    task = Setup.of("tick", "stairs").definition
    climbing = law(task, preset)
    heights = slope * climbing.scan_places[0]
    expected = (1.0 - preset.slope) * slope * climbing.rest_soles[:, 0]
    np.testing.assert_allclose(_sole_heights(heights, preset), expected, atol=0.01)


@pytest.mark.parametrize("depth", [0.6, 3.0])  # standing heights
def test_feet_pass_over_trenches_as_on_level_ground(depth):
    """A plane through the floor of a trench would lift the feet beside it, and a foot would reach down for it."""
    task = Setup.of("tick", "course").definition
    climbing = law(task, presets_of(ROBOTS["tick"])["climbing"])
    is_trench = abs(SCAN[0]) < 0.2
    height = climbing.mechanics.height
    trench = np.where(is_trench, -depth * height, 0.0)[None]
    np.testing.assert_array_equal(climbing.fill_trenches(trench), np.zeros_like(trench))
    step = np.where(is_trench, -0.3 * height, 0.0)[None]
    np.testing.assert_array_equal(climbing.fill_trenches(step), step)


@pytest.mark.slow
def test_five_legs_climb_stairs_under_a_torso_that_tilts():
    body = registry.body_of("varied:12237")
    preset = presets_of(body)["climbing"]
    level_way, _ = crossed(body, preset._replace(slope=0.0), "stairs", STAIRS, num_envs=2)
    way, _ = crossed(body, preset, "stairs", STAIRS, num_envs=2)
    assert level_way < 0.85
    assert way > 0.9
