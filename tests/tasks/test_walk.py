"""Walk: the paper's observation, start, numbers and ending."""

import math
import warnings

import numpy as np
import pytest
from dm_env import StepType
from episodes import begun
from numpy.testing import assert_array_equal
from refusals import refused
from tiers import tiers

import arc_suite

JOINTS = {"queen": 18, "bastion": 12, "tick": 18, "leaper": 12}
every_robot = pytest.mark.parametrize("domain", tiers(JOINTS, lambda domain: domain == "leaper"))


@every_robot
def test_first_observation_has_the_clock_at_zero_and_contact_forces_filled(domain):
    environment = begun(domain, base_noise=0.0, joint_noise=0.0)
    timestep = environment.reset()
    assert_array_equal(timestep.observation["gait_clock"], [0.0, 1.0])
    assert timestep.observation["posture"][0] == environment.task.body.torso.standing_height
    for _ in range(10):
        timestep = environment.step(np.zeros(JOINTS[domain]))
    assert np.abs(timestep.observation["contact_forces"]).max() > 0.0


@every_robot
def test_reset_noise(domain):
    base = {"queen": 0.02, "tick": 0.02, "bastion": 0.1, "leaper": 0.1}[domain]
    environment = begun(domain)
    height = environment.task.body.torso.standing_height
    positions, velocities = [], []
    for _ in range(400):
        environment.reset()
        positions.append(environment.physics.position())
        velocities.append(environment.physics.velocity())
    positions, velocities = np.array(positions), np.array(velocities)
    for column, center in ((0, 0.0), (1, 0.0), (2, height)):
        offsets = positions[:, column] - center
        assert 0.9 * base < np.abs(offsets).max() <= base
        assert abs(offsets.mean()) < 0.15 * base
    np.testing.assert_allclose(np.linalg.norm(positions[:, 3:7], axis=1), 1.0, atol=1e-12)
    assert 0.9 * 0.1 < np.abs(positions[:, 7:]).max() <= 0.1
    np.testing.assert_allclose(velocities[:, :6].std(), base, rtol=0.1)
    np.testing.assert_allclose(velocities[:, 6:].std(), 0.1, rtol=0.05)


def test_fall_ends_the_episode_with_discount_0_and_the_time_limit_with_1():
    environment = begun("bastion", healthy_range=(0.4, 1.0))
    timestep = environment.reset()
    while not timestep.last():
        timestep = environment.step(np.ones(12))
    assert timestep.discount == 0.0
    assert environment.physics.position()[2] < 0.4
    environment = begun("queen", time_limit=0.5)
    timesteps = [environment.reset()] + [environment.step(np.zeros(18)) for _ in range(10)]
    assert [t.step_type for t in timesteps] == [StepType.FIRST] + [StepType.MID] * 9 + [StepType.LAST]
    assert timesteps[-1].discount == 1.0
    assert environment.step(np.zeros(18)).first()


ANGLES = "expected one number from -6.28319 to 6.28319 or 6 of them"


@pytest.mark.parametrize("healthy_range", [(0.9, 1.2), (0.1, 0.6)])
def test_both_ends_of_the_healthy_range_end_the_episode(healthy_range):
    assert begun("queen", healthy_range=healthy_range).step(np.zeros(18)).discount == 0.0


def test_one_number_sets_all_noise_of_the_torso_and_one_all_of_the_joints():
    def noise(**settings):
        return arc_suite.load("leaper", "walk", settings).task.settings.noise

    assert noise() == (0.1, 0.1, 0.1, 0.1, 0.1, 0.1)
    assert noise(base_noise=0.3) == (0.3, 0.3, 0.3, 0.3, 0.1, 0.1)
    assert noise(joint_noise=0.3) == (0.1, 0.1, 0.1, 0.1, 0.3, 0.3)
    assert noise(orientation_noise=0.0, base_noise=0.3, joint_velocity_noise=0.2) == (0.3, 0.0, 0.3, 0.3, 0.1, 0.2)


def test_every_kind_of_noise_moves_what_it_is_named_after():
    parts = {
        "position_noise": ("position", slice(0, 3)),
        "orientation_noise": ("position", slice(3, 7)),
        "linear_velocity_noise": ("velocity", slice(0, 3)),
        "angular_velocity_noise": ("velocity", slice(3, 6)),
        "joint_angle_noise": ("position", slice(7, None)),
        "joint_velocity_noise": ("velocity", slice(6, None)),
    }
    silence = {"base_noise": 0.0, "joint_noise": 0.0}

    def start(**noise):
        physics = begun("tick", **silence | noise).physics
        return {"position": np.array(physics.position()), "velocity": np.array(physics.velocity())}

    still = start()
    for name, (which, part) in parts.items():
        noisy = start(**{name: 0.05})
        for kind in ("position", "velocity"):
            moved = noisy[kind] != still[kind]
            expected = np.zeros_like(moved)
            expected[part] = kind == which
            assert_array_equal(moved, expected, err_msg=name)


NUMBER = "expected a number from -1e+06 to 1e+06, got"


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"timelimit": 3}, "unknown setting of walk 'timelimit'; did you mean 'time_limit'?"),
        ({"weights": {"forward": math.nan}}, f"weights['forward']: {NUMBER} nan"),
        ({"weights": [1.0]}, 'weights: expected a mapping of names to numbers, such as {"forward": 1.5}, got [1.0]'),
        ({"duty_factor": 1.5}, "duty_factor: expected a number from 0 to 1, got 1.5"),
        ({"velocity_band": 0}, "velocity_band: expected a number above 0, at most 1e+06, got 0"),
        ({"weights": {"posture": -1e300}}, f"weights['posture']: {NUMBER} -1e+300"),
        ({"phase_offsets": [0, 1]}, f"phase_offsets: {ANGLES}, got [0, 1]"),
        ({"healthy_range": (1.0, 0.2)}, "healthy_range: expected low < high, got (1.0, 0.2)"),
        ({"base_noise": -1}, "base_noise: expected a number from 0 to 10, got -1"),
        ({"angular_velocity_noise": "big"}, "angular_velocity_noise: expected a number from 0 to 1"),
    ],
)
def test_bad_settings_are_one_line_errors(settings, message):
    with refused(message, begins=True):
        arc_suite.load("queen", "walk", settings)


def test_bad_settings_of_the_environment_are_one_line():
    with refused("unknown environment setting 'flat_observations'; did you mean 'flat_observation'?", begins=True):
        arc_suite.load("queen", "walk", None, {"flat_observations": True})


@pytest.mark.parametrize("task", ["walk", "steer", "recover"])
def test_a_cost_with_a_positive_weight_is_a_warning_of_one_line(task):
    text = r"^weights\['control'\]: 0.01 makes a bonus of this cost; -0.01 weighs it as a cost$"
    with pytest.warns(UserWarning, match=text):
        arc_suite.load("queen", task, {"weights": {"control": 0.01}})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        arc_suite.load("queen", task, {"weights": {"control": -0.01}})
        arc_suite.load("queen", task, {"weights": {"control": 0.0}})
