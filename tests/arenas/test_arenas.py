"""Arenas: the height of the ground is that of the geometry, and bodies start clear of it."""

import itertools

import mujoco
import numpy as np
import pytest
import rays
from numpy.testing import assert_allclose, assert_array_equal
from tiers import tiers, turns

import arc_suite
from arc_suite import models
from arc_suite.arenas import ARENAS, FLAT, terrain
from arc_suite.bodies import generator
from arc_suite.cpg import Demonstrator
from arc_suite.robots import ROBOTS

BODIES = {**ROBOTS, "small": generator.scaled(generator.generate(6, 3), 0.1)}
every_body = pytest.mark.parametrize("body", tiers(BODIES, lambda body: body in ("bastion", "small")))


@pytest.mark.parametrize(("body", "arena"), tiers(itertools.product(BODIES, ARENAS), turns(BODIES, ARENAS)))
def test_height_is_that_of_rays(arena, body):
    body = BODIES[body]
    place, height = ARENAS[arena](body), body.torso.standing_height
    model = mujoco.MjModel.from_xml_string(models.assemble(body, place).to_xml_string())
    points = np.random.RandomState(0).uniform((-3.9, -19.0), 19.0, (1000, 2)) * height
    rays.assert_heights(place, model, points, height)
    heights = place.height(points[:, 0], points[:, 1])
    assert_array_equal(heights, [place.height(x, y) for x, y in points])
    assert place.is_level == (np.ptp(heights) == 0.0)


@pytest.mark.parametrize(("task", "rise"), [("leap", 1.0), ("stairs", 0.5), ("leap", 0.05)])
def test_obstacles_stand_on_the_ground(task, rise):
    """A ray over the ground, half a millimeter above it, meets the first obstacle, however high this one is."""
    environment = arc_suite.load("tick", task, {"rise": rise, "random": 0})
    arena, model, data = environment.task.scene.arena, environment.physics.model.ptr, environment.physics.data.ptr
    data.qpos[2] = 1e3
    mujoco.mj_forward(model, data)
    y = arena.start(len(arena.lanes) - 1)
    x = np.linspace(0.0, arena.length * arena.unit, 20000)
    first_x = x[np.argmax(arena.height(x, np.full_like(x, y)) > 0.0)]
    for z in np.linspace(5e-4, 0.9 * rise, 7):
        start = np.array([0.0, y, z])
        distance = mujoco.mj_ray(model, data, start, np.array([1.0, 0.0, 0.0]), None, 1, -1, np.zeros(1, np.int32))
        assert abs(distance - first_x) < 0.01, z


def test_bumps_are_gentle_and_go_on_beyond_their_edge():
    bumps = ARENAS["bumps"](ROBOTS["queen"])
    far = np.array([1e3, -1e3])
    assert_allclose(bumps.height(far, far), bumps.height(far.clip(-60.0, 60.0), far.clip(-15.0, 15.0)))
    x = np.linspace(-10.0, 10.0, 4001)
    slopes = np.diff(bumps.height(x, 0.3 * x)) / np.diff(x)
    assert 0.1 < abs(slopes).max() < 0.3
    assert bumps.height(np.zeros(1), np.zeros(1)) == 0.0


@pytest.mark.parametrize("task", ["walk", "steer"])
@every_body
def test_bodies_start_with_every_foot_clear_of_the_ground(task, body):
    body = BODIES[body]
    environment = arc_suite.load(body, task, {"arena": "bumps", "random": 0})
    radii = np.array([leg.foot.radius for leg in body.legs])
    nearest = []
    for _ in range(20):
        environment.reset()
        definition = environment.task.definition
        heights = definition.read(environment.physics.data.ptr).foot_heights
        nearest.append((heights - radii).min() / body.torso.standing_height)
    assert min(nearest) > 0.0099
    assert np.isclose(nearest, 0.01, atol=1e-9).any(), "some starts are noisy enough to be lifted"


def walked(robot, steps):
    """An environment with bumps after steps of a demonstrator, and the last time step."""
    environment = arc_suite.load(robot, "walk", {"arena": "bumps", "random": 0})
    timestep, policy = environment.reset(), Demonstrator(robot, "tuned")
    for _ in range(steps):
        timestep = environment.step(policy(timestep))
    return environment, timestep


def test_what_is_read_is_over_the_ground():
    environment, timestep = walked("queen", 200)
    x, y, z = environment.physics.position()[:3]
    arena, data = environment.task.definition.scene.arena, environment.physics.data.ptr
    under = arena.height(np.float64(x), np.float64(y))
    assert timestep.observation["posture"][0] == z - under
    feet = np.array([data.body(name).xpos for name in ROBOTS["queen"].foot_names])
    readings = environment.task.definition.read(data)
    assert_allclose(readings.foot_heights, feet[:, 2] - arena.height(feet[:, 0], feet[:, 1]), atol=1e-15)
    assert np.ptp(arena.height(feet[:, 0], feet[:, 1])) > 0.01


def test_bodies_walk_on_bumps():
    environment, timestep = walked("tick", 300)
    assert not timestep.last()
    assert environment.task.progress["speed"] > 0.15


def test_flat_is_the_default():
    for settings in ({}, {"arena": "flat"}):
        assert arc_suite.load("leaper", "walk", settings).task.definition.scene.arena is FLAT


def test_an_arena_is_a_value():
    assert ARENAS["bumps"](ROBOTS["queen"]) == ARENAS["bumps"](ROBOTS["queen"]) != ARENAS["bumps"](ROBOTS["tick"])
    environment = arc_suite.load("queen", "walk", {"arena": ARENAS["bumps"](ROBOTS["queen"])})
    assert environment.task.definition.scene.arena == ARENAS["bumps"](ROBOTS["queen"])
    assert environment.physics.render(48, 64).std() > 5


@pytest.mark.parametrize(("width", "length"), [(0.15, 0.225), (0.16, 0.8 / 3.0), (0.5, 0.25)])
def test_hurdles_are_a_quarter_long_to_the_nearest_cell_next_to_trenches_of_any_width(width, length):
    queen = ROBOTS["queen"]
    unit = queen.torso.standing_height
    lanes = terrain.make_lanes(queen, {"trenches": 1, "hurdles": 1}, 40.0, sizes_in_meters={"width": width * unit})
    x = np.arange(0.0, 40.0, 0.001)
    is_on_hurdle = lanes.height(x * unit, np.full(len(x), lanes.start(1))) > 0.0
    first, last = np.flatnonzero(np.diff(is_on_hurdle))[:2]
    assert x[last] - x[first] == pytest.approx(length, abs=0.0021)
