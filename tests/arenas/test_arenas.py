"""Arenas: the height of the ground is that of the geometry, and bodies start clear of it."""

import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from tiers import tiers, turn

import arc_suite
from arc_suite import models
from arc_suite.arenas import ARENAS, FLAT
from arc_suite.cpg import Demonstrator
from arc_suite.robots import ROBOTS, generator

BODIES = {**ROBOTS, "small": generator.scaled(generator.generate(6, 3), 0.1)}
every_body = pytest.mark.parametrize("body", tiers(BODIES, lambda body: body in ("bastion", "small")))


@pytest.mark.parametrize(
    ("arena", "body"),
    tiers(
        [(arena, body) for arena in ARENAS for body in BODIES],
        lambda arena, body: turn(body, BODIES, list(ARENAS).index(arena)),
    ),
)
def test_height_is_that_of_rays(arena, body):
    body = BODIES[body]
    place, height = ARENAS[arena](body), body.torso.standing_height
    model = mujoco.MjModel.from_xml_string(models.assemble(body, place).to_xml_string())
    data = mujoco.MjData(model)
    data.qpos[2] = 1e3 * height  # out of the way
    mujoco.mj_forward(model, data)
    points = np.random.RandomState(0).uniform((-3.9, -19.0), 19.0, (1000, 2)) * height
    hit, above = np.zeros(1, np.int32), 50.0 * height
    for x, y in points:
        start, down = np.array([x, y, above]), np.array([0.0, 0.0, -1.0])
        distance = mujoco.mj_ray(model, data, start, down, None, 1, -1, hit)
        assert model.geom(hit[0]).name.startswith("floor")
        assert abs(above - distance - place.height(np.float64(x), np.float64(y))) < 1e-6 * height
    heights = place.height(points[:, 0], points[:, 1])
    assert_array_equal(heights, [place.height(x, y) for x, y in points])
    assert place.is_level == (np.ptp(heights) == 0.0)


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


def test_what_is_read_is_over_the_ground():
    environment = arc_suite.load("queen", "walk", {"arena": "bumps", "random": 0})
    timestep, policy = environment.reset(), Demonstrator("queen", "tuned")
    for _ in range(200):
        timestep = environment.step(policy(timestep))
    x, y, z = environment.physics.position()[:3]
    arena, data = environment.task.definition.scene.arena, environment.physics.data.ptr
    under = arena.height(np.float64(x), np.float64(y))
    assert timestep.observation["posture"][0] == z - under
    feet = np.array([data.body(name).xpos for name in ROBOTS["queen"].foot_names])
    readings = environment.task.definition.read(data)
    assert_allclose(readings.foot_heights, feet[:, 2] - arena.height(feet[:, 0], feet[:, 1]), atol=1e-15)
    assert np.ptp(arena.height(feet[:, 0], feet[:, 1])) > 0.01


def test_bodies_walk_on_bumps():
    environment = arc_suite.load("tick", "walk", {"arena": "bumps", "random": 0})
    timestep, policy = environment.reset(), Demonstrator("tick", "tuned")
    for _ in range(300):
        timestep = environment.step(policy(timestep))
    assert not timestep.last()
    assert environment.task.progress["speed"] > 0.15


def test_flat_is_the_default_and_costs_no_bits():
    default, named = (
        arc_suite.load("leaper", "walk", {"random": 0}),
        arc_suite.load("leaper", "walk", {"random": 0, "arena": "flat"}),
    )
    assert default.task.definition.scene.arena is FLAT is named.task.definition.scene.arena
    default.reset(), named.reset()
    for _ in range(10):
        a, b = default.step(np.zeros(12)), named.step(np.zeros(12))
        for name, block in a.observation.items():
            assert_array_equal(block, b.observation[name])


def test_an_arena_is_a_value():
    assert ARENAS["bumps"](ROBOTS["queen"]) == ARENAS["bumps"](ROBOTS["queen"]) != ARENAS["bumps"](ROBOTS["tick"])
    environment = arc_suite.load("queen", "walk", {"arena": ARENAS["bumps"](ROBOTS["queen"])})
    assert environment.task.definition.scene.arena == ARENAS["bumps"](ROBOTS["queen"])
    assert environment.physics.render(48, 64).std() > 5
