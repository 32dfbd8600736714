"""Recorded tracks agree with the reward and the physics."""

import types

import gaitless
import mujoco
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refused
from synthetic import synthetic
from tiers import tiers

import arc_suite
from arc_suite import evaluation
from arc_suite.arenas import ARENAS, FLAT
from arc_suite.arenas.bumps import Bumps
from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.models import standing as poses
from arc_suite.robots import ROBOTS, gaits
from arc_suite.style import measure, record, report
from arc_suite.style.tracks import lowest_point_velocities
from arc_suite.tasks.clock import TWO_PI, desired_contacts


@pytest.mark.parametrize("steps", [0, -1, 2.5, True])
def test_a_track_has_a_step(steps):
    environment = arc_suite.load("tick", "walk")
    with refused(f"max_steps: expected an integer from 1, got {steps}"):
        record(environment, Demonstrator("tick", "medium"), seed=3, max_steps=steps)
    assert len(record(environment, Demonstrator("tick", "medium"), seed=3, max_steps=1).times) == 1


@pytest.mark.parametrize("robot", tiers(ROBOTS, lambda robot: robot == "bastion"))
def test_tracks_agree_with_the_reward(robot):
    environment = arc_suite.load(robot, "walk", {"time_limit": 5.0})
    track = record(environment, Demonstrator(robot, "medium"), seed=3)
    episode = evaluation.run(environment, Demonstrator(robot, "medium"), seed=3)
    assert len(track.times) == episode.length == 100
    assert track.times[-1] == pytest.approx(5.0)
    assert track.rewards.sum() == pytest.approx(episode.total, rel=1e-12)
    results = measure(track)
    assert results["gait_compliance"].value == pytest.approx(track.terms["gait_bonus"].mean(), rel=1e-12)
    cost = episode.progress["cost_of_transport"]
    assert cost == pytest.approx(results["cost_of_transport"].value, rel=0.25), "of x alone, and with the first step"
    joints = track.actions.shape[1]
    for metric, term in (("action_change", "smoothness"), ("posture_deviation", "posture")):
        squares = np.array(list(results[metric].legs.values())) ** 2
        assert squares.mean() * joints == pytest.approx(track.terms[term].mean(), rel=1e-12)
    assert_allclose(track.terms["vertical_velocity"], track.linear_velocities[:, 2] ** 2)
    assert_allclose(track.terms["angular_velocity"], (track.angular_velocities[:, :2] ** 2).sum(axis=1))
    assert_array_equal(track.joint_velocities[-1], environment.physics.data.qvel[6:])
    gears = environment.physics.model.ptr.actuator_gear[:, 0]
    assert_allclose(track.torques, track.actions * gears)
    assert track.mass == pytest.approx(poses.measure_standing(ROBOTS[robot]).mass, 1e-9)
    assert 0.05 < track.contacts.mean() < 0.95
    assert (track.foot_positions[track.contacts][:, 2] < track.foot_radii[0] + 0.011).all()  # within the contact margin


@pytest.mark.parametrize("task", ["steer", "stay"])
@pytest.mark.parametrize("arena", [FLAT, Bumps(0.2)], ids=["flat", "bumps"])  # small bumps, which begin near the start
def test_tracks_of_any_task_and_ground(task, arena, monkeypatch):
    monkeypatch.setitem(ARENAS, "here", lambda body: arena)
    settings = {"time_limit": 2.0, "arena": "here"}
    with gaitless.registered():
        setup = Setup.of("queen", task, settings)
        environment = setup.load()
        track = record(environment, Demonstrator("queen", "medium"), seed=3)
    definition = environment.task.definition
    episode = evaluation.run(environment, Demonstrator("queen", "medium"), seed=3)
    assert (track.setup, track.weights) == (setup, definition.settings.weights)
    assert len(track.times) == episode.length == 40
    assert track.rewards.sum() == pytest.approx(episode.total, rel=1e-12)
    assert track.progress == episode.progress
    metrics = {"tracking", "fell", "gait_compliance", "cost_of_transport"} if task == "steer" else set()
    assert track.progress.keys() == metrics
    assert np.isnan(track.target_velocity)
    for points, heights in ((track.foot_positions, track.foot_heights), (track.positions, track.torso_heights)):
        ground = arena.height(points[..., 0], points[..., 1])
        assert ground.any() == (arena != FLAT)
        assert_array_equal(heights, points[..., 2] - ground)
    if task == "steer":
        assert measure(track)["gait_compliance"].value == pytest.approx(track.progress["gait_compliance"], rel=1e-12)
        assert_array_equal(track.phases, definition.clock.phases[1:41])
    else:
        assert track.phases is track.parameters is None


def test_the_gait_of_a_track_is_the_one_that_holds():
    environment = arc_suite.load("tick", "directed", {"poses": 0.0, "gaits": (), "time_limit": 8.0})
    walker, task = Demonstrator(environment, "steered"), environment.task.definition
    quick = task.named_command("gait", "wave")
    quick[-1] = 1.2 * task.parameters.gait_frequency

    def reset(indices, seeds):
        walker.reset(indices, seeds)
        environment.command("command", (0.5, 0.0, 0.0))
        environment.command("gait", quick)

    track = record(environment, types.SimpleNamespace(reset=reset, act=walker.act), seed=3)
    compliance = measure(track)["gait_compliance"].value
    assert compliance > 0.75 and compliance == pytest.approx(track.progress["gait_compliance"], rel=1e-12)
    prescribed = desired_contacts(track.phases, track.parameters.duty_factor, track.parameters.phase_offsets)
    assert (track.stance == prescribed).mean() < compliance - 0.1
    wave, lags = gaits.gait(track.body, "wave"), (track.leg_phases[-1] - track.phases[-1]) / TWO_PI
    assert_allclose(np.exp(2j * np.pi * lags), np.exp(2j * np.pi * np.array(wave.offsets)), atol=1e-5)
    assert track.duty_factors[-1] == pytest.approx(wave.duty_factor, abs=1e-6)
    stride = report([track])["metrics"]["stride_frequency"]
    assert stride["prescribed"] == pytest.approx(quick[-1], rel=0.01)  # to which it glides


def test_recording_is_seeded():
    environment = arc_suite.load("leaper", "walk", {"time_limit": 1.0})
    first, second, other = (record(environment, Demonstrator("leaper", "medium"), seed) for seed in (1, 1, 2))
    assert_array_equal(first.foot_velocities, second.foot_velocities)
    assert (first.positions != other.positions).all()


def standing(body):
    """A track of a body, for what it tells of the body alone."""
    return synthetic(cycles=1)._replace(setup=Setup(body))


@pytest.mark.parametrize("robot", ROBOTS)
def test_every_leg_has_its_mirror(robot):
    across = {"l": "r", "r": "l"}
    names = [leg.name for leg in ROBOTS[robot].legs]
    for name, mirror in zip(names, standing(ROBOTS[robot]).mirrors, strict=True):
        expected = name[0] + across[name[1]] if robot == "leaper" else across[name[0]] + name[1]
        assert names[mirror] == expected


def test_legs_without_a_mirror():
    left = ROBOTS["queen"].replace(legs=ROBOTS["queen"].legs[:4])  # l1 l2 l3 r1
    assert_array_equal(standing(left).mirrors, [3, -1, -1, 0])


def test_velocities_of_lowest_points_are_their_motion():
    environment = arc_suite.load("queen", "walk", {"random": 0})
    environment.reset()
    model, data = environment.physics.model.ptr, environment.physics.data.ptr
    data.qvel[:] = np.random.default_rng(0).normal(size=model.nv)
    mujoco.mj_forward(model, data)
    feet = [model.body(name).id for name in ROBOTS["queen"].foot_names]
    radii = np.full(6, 0.05)
    velocities = lowest_point_velocities(model, data, feet, radii)
    before = [data.xpos[foot] + (0, 0, -0.05) for foot in feet]
    fixed = [data.xmat[foot].reshape(3, 3).T @ (0, 0, -0.05) for foot in feet]
    mujoco.mj_integratePos(model, data.qpos, data.qvel, 1e-6)
    mujoco.mj_kinematics(model, data)
    after = [data.xpos[foot] + data.xmat[foot].reshape(3, 3) @ point for foot, point in zip(feet, fixed, strict=True)]
    assert_allclose(velocities, (np.array(after) - before) / 1e-6, atol=1e-4)
