"""The task recover: from which poses it starts, when a body is up, and what that earns."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from arc_suite import rotations
from arc_suite.bodies import generator
from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import provenance
from arc_suite.robots import ROBOTS
from arc_suite.simulation import falls
from tests.fixtures.episodes import begun, load
from tests.fixtures.refusals import refused

DROPS = 12


@pytest.mark.parametrize("robot", ROBOTS)
def test_falls_lie_on_the_ground_and_are_the_same_for_a_seed(robot):
    body = ROBOTS[robot]
    poses = falls.drop_body(body, 0, DROPS)
    assert poses.shape == (DROPS, 7 + len(body.joint_names)) and not poses.flags.writeable
    assert_array_equal(poses, falls.drop_body.__wrapped__(body, 0, DROPS))
    assert not np.array_equal(poses, falls.drop_body(body, 1, DROPS))
    assert_allclose(rotations.yaw(poses[:, 3:7]), 0.0, atol=1e-9)
    assert (rotations.upright(poses[:, 3:7]) < 0.0).any()
    assert (poses[:, 2] < 2.5 * body.torso.standing_height).all()


def test_starts_are_poses_of_the_table_and_their_images_with_any_heading():
    task = Setup.of("tick", "recover").definition
    image = task.symmetry.action
    table = task.start_table
    starts = [task.start(np.random.RandomState(seed), None) for seed in range(24)]
    mirrored = 0
    for start in starts:
        assert not start.qvel.any()
        lies_alike = abs(table[:, 7:] - start.qpos[7:]).max(axis=-1) == 0.0
        image_lies_alike = abs(image(table[:, 7:]) - start.qpos[7:]).max(axis=-1) == 0.0
        assert lies_alike.any() or image_lies_alike.any()
        mirrored += not lies_alike.any()
    assert 4 < mirrored < 20
    headings = rotations.yaw(np.stack([start.qpos[3:7] for start in starts]))
    assert np.ptp(headings) > np.pi
    assert (table[:, 2] < 0.8 * 0.18).any()


def test_a_body_without_mirror_image_has_none():
    task = Setup.of(generator.random_body(10), "recover").definition
    for seed in range(8):
        angles = task.start(np.random.RandomState(seed), None).qpos[7:]
        assert (task.start_table[:, 7:] == angles).all(axis=-1).any()


def test_learners_have_falls_of_their_own():
    pytest.importorskip("jax")
    from arc_suite.learning.agents.configuration import Configuration

    configuration = Configuration.of(Setup.of("tick", "recover"))
    judged, learned = configuration.setup.definition, configuration.training_setup.definition
    assert configuration.training == {"fall_seed": 1, "time_limit": 10.0}
    assert not np.array_equal(judged.start_table, learned.start_table)
    chosen = Configuration.of(Setup.of("tick", "recover"), training={"fall_seed": 7})
    assert chosen.training_setup.task_kwargs["fall_seed"] == 7


def test_a_setting_of_the_user_holds_in_training_too():
    pytest.importorskip("jax")
    from arc_suite.learning.agents.configuration import Configuration

    short = Setup.of("tick", "recover", {"time_limit": 5.0})
    learned = Configuration.of(short).training_setup.task_kwargs
    assert (learned["fall_seed"], learned["time_limit"]) == (1, 5.0)
    longer = Configuration.of(short, training={"time_limit": 10.0})
    assert longer.training_setup.task_kwargs["time_limit"] == 10.0


def test_others_learn_from_falls_of_training_unless_they_choose():
    judged = Setup.of("tick", "recover", {"weights": {"up": 2.0}})
    assert judged.learning() == judged.with_settings({"fall_seed": 1, "time_limit": 10.0})
    chosen = Setup.of("tick", "recover", {"fall_seed": 7, "time_limit": 3.0})
    assert chosen.learning() == chosen
    walk = Setup.of("tick", "walk", {"time_limit": 3.0})
    assert walk.learning() == walk


def test_records_have_the_hash_of_the_falls():
    records = [provenance.of_setup(Setup.of("tick", "recover", {"fall_seed": seed})) for seed in (0, 1)]
    assert len(records[0]["start_sha256"]) == 64
    assert records[0]["start_sha256"] != records[1]["start_sha256"]
    assert "start_sha256" not in provenance.of_setup(Setup.of("tick"))
    json.dumps(records)


def test_a_body_is_up_after_half_a_second_without_a_break():
    environment = begun("tick", "recover")
    physics = environment.physics
    joints = len(environment.task.body.joint_names)

    def stand():
        with physics.reset_context():
            physics.data.qpos[:] = physics.model.ptr.qpos0
            physics.data.qvel[:] = 0.0

    stand()
    for step in range(9):
        environment.step(np.zeros(joints))
        assert environment.task.terms["up"] == 1.0
        assert environment.task.progress["up"] == 0.0, step
    physics.data.qpos[3:7] = (0.0, 1.0, 0.0, 0.0)  # a break
    environment.step(np.zeros(joints))
    assert environment.task.terms["up"] == 0.0
    stand()
    for _ in range(10):
        environment.step(np.zeros(joints))
    assert environment.task.progress["up"] == 1.0
    time = environment.task.progress["time_to_get_up"]
    assert_allclose(time, 20 * 0.05)
    environment.step(np.zeros(joints))
    assert environment.task.progress["time_to_get_up"] == time


@pytest.mark.parametrize(("upright", "is_up"), [(19.0, True), (21.0, False)])
def test_the_tilt_of_a_body_that_is_up(upright, is_up):
    task = Setup.of("queen", "recover").definition
    angle = np.radians(upright)
    tilted = np.array((np.cos(angle / 2), np.sin(angle / 2), 0.0, 0.0))
    assert task.unwrapped.stands(0.75, tilted) == is_up
    assert not task.unwrapped.stands(0.79 * 0.75, np.array((1.0, 0.0, 0.0, 0.0)))


def test_standing_earns_nearly_the_most_and_lying_nearly_nothing():
    environment = begun("queen", "recover")
    physics = environment.physics
    with physics.reset_context():
        physics.data.qpos[:] = physics.model.ptr.qpos0
    rewards = [environment.step(np.zeros(18)).reward for _ in range(40)]
    assert 3.8 < rewards[-1] <= 4.0
    with physics.reset_context():
        physics.data.qpos[2] = 0.2
        physics.data.qpos[3:7] = (0.0, 1.0, 0.0, 0.0)
    rewards = [environment.step(np.zeros(18)).reward for _ in range(20)]
    assert abs(rewards[-1]) < 0.1


def test_errors_name_the_valid_settings():
    with refused("fall_seed: expected an integer from 0 to 4294967295, got -1"):
        load("tick", "recover", fall_seed=-1)
    with refused("arena: task recover has a ground of its own, expected none"):
        load("tick", "recover", arena="bumps")
    with refused("unknown setting of recover 'fallseed'; did you mean 'fall_seed'?", begins=True):
        load("tick", "recover", fallseed=1)


def test_rising_gets_up_from_the_belly_and_not_from_the_back():
    environment = load("tick", "recover")
    policy = Demonstrator(environment)
    for upright, gets_up in ((True, 1.0), (False, 0.0)):
        timestep = environment.reset()
        with environment.physics.reset_context():
            environment.physics.data.qpos[2] = 0.1 if upright else 0.2
            environment.physics.data.qpos[3:7] = (1.0, 0.0, 0.0, 0.0) if upright else (0.0, 1.0, 0.0, 0.0)
        for _ in range(60):
            timestep = environment.step(policy(timestep))
        assert environment.task.progress["up"] == gets_up


def test_the_torso_of_leaper_stands_lower_than_its_standing_height():
    tasks = {robot: Setup.of(robot, "recover").definition for robot in ("leaper", "queen")}
    assert_allclose(tasks["leaper"].unwrapped.height, 0.75 * 0.5, rtol=0.03)
    assert tasks["queen"].unwrapped.height == 0.75
