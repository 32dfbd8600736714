"""Conformance of every task: what users of dm_control's suite rely on."""

import copy
import io
import math
import unittest

import mujoco
import numpy as np
import pytest
from absl.testing import absltest
from dm_control.rl import control
from dm_env import StepType, specs
from dm_env.test_utils import EnvironmentTestMixin
from numpy.testing import assert_array_equal

import arc_suite

SIZES = {"queen": 199, "bastion": 151, "tick": 199, "leaper": 163}
JOINTS = {"queen": 18, "bastion": 12, "tick": 18, "leaper": 12}
every_task = pytest.mark.parametrize(("domain", "task"), arc_suite.ALL_TASKS)


def load(domain, task="walk", random=0, **task_kwargs):
    return arc_suite.load(domain, task, {"random": random, **task_kwargs})


def flat(timestep):
    return np.concatenate(list(timestep.observation.values()))


def random_actions(environment, count, seed=0):
    """Actions too weak for a robot to fall within a few dozen steps."""
    return np.random.RandomState(seed).uniform(-0.3, 0.3, (count, *environment.action_spec().shape))


@every_task
def test_dm_env_contract(domain, task):
    class Contract(EnvironmentTestMixin, absltest.TestCase):
        def make_object_under_test(self):
            return load(domain, task)

    suite = absltest.TestLoader().loadTestsFromTestCase(Contract)
    result = unittest.TextTestRunner(stream=io.StringIO()).run(suite)
    assert result.testsRun >= 4
    assert result.wasSuccessful(), result.failures + result.errors


def test_registry():
    assert {name: ("walk",) for name in ("queen", "bastion", "tick", "leaper")} == arc_suite.TASKS_BY_DOMAIN
    assert set(arc_suite.ALL_TASKS) == {(name, "walk") for name in SIZES}


@every_task
def test_specs_and_sizes(domain, task):
    environment = load(domain, task)
    assert isinstance(environment, control.Environment)
    action = environment.action_spec()
    assert isinstance(action, specs.BoundedArray)
    assert action.shape == (JOINTS[domain],)
    assert (action.minimum == -1).all() and (action.maximum == 1).all()
    n, parts = JOINTS[domain], (SIZES[domain] - 13 - 2 * JOINTS[domain]) // 6
    timestep = environment.reset()
    assert {name: block.shape for name, block in timestep.observation.items()} == {
        "posture": (5 + n,),
        "velocities": (6 + n,),
        "contact_forces": (6 * parts,),
        "gait_clock": (2,),
    }
    assert parts == {"queen": 25, "bastion": 19, "tick": 25, "leaper": 21}[domain]
    for name, spec in environment.observation_spec().items():
        spec.validate(timestep.observation[name])
    assert flat(timestep).shape == (SIZES[domain],)


@every_task
def test_flat_observation_is_the_blocks_in_order(domain, task):
    blocks = load(domain, task)
    vector = arc_suite.load(domain, task, {"random": 0}, {"flat_observation": True})
    assert_array_equal(vector.reset().observation["observations"], flat(blocks.reset()))
    for action in random_actions(blocks, 5):
        assert_array_equal(vector.step(action).observation["observations"], flat(blocks.step(action)))


@every_task
def test_observation_is_the_papers_vector(domain, task):
    environment = load(domain, task)
    data, n = environment.physics.data.ptr, JOINTS[domain]
    environment.reset()
    frequency = {"leaper": 1.2}.get(domain, 1.5)
    phase = 0.0
    for action in random_actions(environment, 30):
        observation = flat(environment.step(action))
        phase += 2 * math.pi * frequency * 0.05
        assert observation[0] == data.qpos[2]
        assert_array_equal(observation[1:5], data.qpos[3:7])
        assert_array_equal(observation[5 : 5 + n], data.qpos[7:])
        assert_array_equal(observation[5 + n : 11 + n], data.qvel[:6])
        assert_array_equal(observation[11 + n : 11 + 2 * n], data.qvel[6:])
        assert_array_equal(observation[11 + 2 * n : -2], data.cfrc_ext[1:].ravel().clip(-1, 1))
        np.testing.assert_allclose(observation[-2:], [math.sin(phase), math.cos(phase)], atol=1e-12)
    assert np.abs(observation[11 + 2 * n : -2]).max() > 0.1, "no contact was felt in 30 steps"


@every_task
def test_first_observation_has_the_clock_at_zero_and_contact_forces_filled(domain, task):
    environment = load(domain, task, base_noise=0.0, joint_noise=0.0)
    timestep = environment.reset()
    assert_array_equal(timestep.observation["gait_clock"], [0.0, 1.0])
    assert timestep.observation["posture"][0] == environment.task.body.torso.standing_height
    for _ in range(10):
        timestep = environment.step(np.zeros(JOINTS[domain]))
    assert np.abs(timestep.observation["contact_forces"]).max() > 0.0


@every_task
def test_physics_is_25_plain_steps_of_2_ms(domain, task):
    environment = load(domain, task)
    environment.reset()
    model = environment.physics.model.ptr
    plain = mujoco.MjData(model)
    assert model.opt.timestep == 0.002
    for action in random_actions(environment, 20):
        mujoco.mj_copyData(plain, model, environment.physics.data.ptr)
        plain.ctrl[:] = action
        mujoco.mj_step(model, plain, 25)
        environment.step(action)
        data = environment.physics.data.ptr
        for field in ("qpos", "qvel", "cfrc_ext", "xpos", "sensordata", "qacc_warmstart", "time"):
            assert_array_equal(getattr(data, field), getattr(plain, field), err_msg=field)
        mujoco.mj_rnePostConstraint(model, plain)
        assert_array_equal(data.cfrc_ext, plain.cfrc_ext)


@every_task
def test_same_seed_same_episode_and_resets_differ(domain, task):
    one, two, other = load(domain, task), load(domain, task), load(domain, task, random=1)
    first, third = one.reset(), other.reset()
    assert_array_equal(flat(first), flat(two.reset()))
    assert not np.array_equal(flat(first), flat(third))
    for action in random_actions(one, 20):
        a, b = one.step(action), two.step(action)
        assert a.reward == b.reward
        assert_array_equal(flat(a), flat(b))
    again = one.reset()
    assert not np.array_equal(flat(first), flat(again))
    assert_array_equal(flat(again), flat(two.reset()))


@every_task
def test_reset_noise(domain, task):
    base = {"queen": 0.02, "tick": 0.02, "bastion": 0.1, "leaper": 0.1}[domain]
    environment = load(domain, task)
    height = environment.task.body.torso.standing_height
    positions, velocities = [], []
    for _ in range(400):
        environment.reset()
        positions.append(environment.physics.position())
        velocities.append(environment.physics.velocity())
    positions, velocities = np.array(positions), np.array(velocities)
    for column, centre in ((0, 0.0), (1, 0.0), (2, height)):
        offsets = positions[:, column] - centre
        assert 0.9 * base < np.abs(offsets).max() <= base
        assert abs(offsets.mean()) < 0.15 * base
    np.testing.assert_allclose(np.linalg.norm(positions[:, 3:7], axis=1), 1.0, atol=1e-12)
    assert 0.9 * 0.1 < np.abs(positions[:, 7:]).max() <= 0.1
    np.testing.assert_allclose(velocities[:, :6].std(), base, rtol=0.1)
    np.testing.assert_allclose(velocities[:, 6:].std(), 0.1, rtol=0.05)


@every_task
def test_observations_share_no_memory(domain, task):
    environment = load(domain, task)
    timestep = environment.reset()
    kept = flat(timestep).copy()
    for action in random_actions(environment, 3):
        following = environment.step(action)
        for name, block in timestep.observation.items():
            assert not np.shares_memory(block, following.observation[name])
            assert not any(np.shares_memory(block, field) for field in (environment.physics.data.ptr.qpos,))
    assert_array_equal(flat(timestep), kept)


@every_task
def test_action_out_of_range_is_clipped(domain, task):
    one, two = load(domain, task), load(domain, task)
    one.reset(), two.reset()
    action = random_actions(one, 1)[0] * 10
    a, b = one.step(action), two.step(action.clip(-1, 1))
    assert a.reward == b.reward
    assert_array_equal(flat(a), flat(b))
    assert one.step(np.full(JOINTS[domain], np.inf)).reward == two.step(np.ones(JOINTS[domain])).reward


@every_task
def test_bad_action_is_refused_and_changes_nothing(domain, task):
    one, two = load(domain, task), load(domain, task)
    one.reset(), two.reset()
    n = JOINTS[domain]
    action = random_actions(one, 1)[0]
    one.step(action), two.step(action)
    poisoned = action.copy()
    poisoned[4] = np.nan
    for bad, message in (
        (poisoned, r"^action\[4\]: expected a number from -1 to 1, got nan$"),
        (np.zeros(n + 1), rf"^action: expected shape \({n},\), got \({n + 1},\)$"),
        (np.zeros((2, n)), rf"^action: expected shape \({n},\), got \(2, {n}\)$"),
        (0.5, rf"^action: expected shape \({n},\), got \(\)$"),
        (["a"] * n, rf"^action: expected {n} numbers, got list$"),
        (None, rf"^action: expected shape \({n},\), got \(\)$"),
    ):
        with pytest.raises(ValueError, match=message):
            one.step(bad)
    for following in random_actions(one, 3, seed=1):
        a, b = one.step(following), two.step(following)
        assert a.reward == b.reward
        assert_array_equal(flat(a), flat(b))


def test_fall_ends_the_episode_with_discount_0_and_the_time_limit_with_1():
    environment = load("bastion", healthy_range=(0.4, 1.0))
    timestep = environment.reset()
    while not timestep.last():
        timestep = environment.step(np.ones(12))
    assert timestep.discount == 0.0
    assert environment.physics.position()[2] < 0.4
    environment = load("queen", time_limit=0.5)
    timesteps = [environment.reset()] + [environment.step(np.zeros(18)) for _ in range(10)]
    assert [t.step_type for t in timesteps] == [StepType.FIRST] + [StepType.MID] * 9 + [StepType.LAST]
    assert timesteps[-1].discount == 1.0
    assert environment.step(np.zeros(18)).first()


@pytest.mark.parametrize("healthy_range", [(0.9, 1.2), (0.1, 0.6)])
def test_both_ends_of_the_healthy_range_end_the_episode(healthy_range):
    environment = load("queen", healthy_range=healthy_range)
    environment.reset()
    assert environment.step(np.zeros(18)).discount == 0.0


@every_task
def test_episode_is_1000_steps_of_50_ms(domain, task):
    environment = load(domain, task, healthy_range=(-10.0, 10.0))
    timestep, length = environment.reset(), 0
    action = np.zeros(JOINTS[domain])
    while not timestep.last():
        timestep = environment.step(action)
        length += 1
    assert length == 1000
    assert environment.control_timestep() == 0.05


OVERRIDES = {
    "weights": {"forward": 3.0, "posture": -1.0},
    "target_velocity": 0.1,
    "velocity_band": 1.0,
    "gait_frequency": 0.7,
    "duty_factor": 0.3,
    "phase_offsets": [0.1, 0.2, 0.3, 0.4],
    "stance_threshold": 0.3,
    "default_angles": 0.5,
    "base_noise": 0.0,
    "joint_noise": 0.0,
}


@pytest.mark.parametrize("name", OVERRIDES)
def test_every_number_can_be_overridden(name):
    usual, changed = load("leaper"), load("leaper", **{name: OVERRIDES[name]})
    starts = flat(usual.reset()), flat(changed.reset())
    rewards = []
    for environment in (usual, changed):
        rewards.append([environment.step(action).reward for action in random_actions(environment, 10)])
    assert rewards[0] != rewards[1]
    assert np.array_equal(*starts) == (name not in ("base_noise", "joint_noise"))


def test_overriding_one_weight_keeps_the_others():
    weights = load("tick", weights={"contact": -1}).task.settings.weights
    assert weights == {
        "forward": 1.5,
        "healthy": 1.0,
        "gait_bonus": 1.5,
        "gait_cost": -0.1,
        "control": -0.05,
        "smoothness": -0.02,
        "contact": -1.0,
        "angular_velocity": -0.05,
        "vertical_velocity": -0.02,
        "posture": -0.001,
    }
    assert load("tick").task.settings.weights["contact"] == -0.0005


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("quen", "walk"), "unknown domain 'quen'; did you mean 'queen'? (there are: queen, bastion, tick, leaper)"),
        (("queen", "wlak"), "unknown task 'wlak'; did you mean 'walk'? (there are: walk)"),
        (
            ("queen", "walk", {"target_velocty": 1}),
            "unknown setting of walk 'target_velocty'; did you mean 'target_velocity'?",
        ),
        (("queen", "walk", {"weights": {"foward": 1}}), "unknown weight 'foward'; did you mean 'forward'?"),
        (
            ("queen", "walk", {"weights": {"forward": math.nan}}),
            "weights['forward']: expected a finite number from -inf to inf, got nan",
        ),
        (("queen", "walk", {"weights": [1.0]}), "weights: expected a mapping of names to numbers, got [1.0]"),
        (
            ("queen", "walk", {"duty_factor": 1.5}),
            "duty_factor: expected a finite number from 0 to 1, got 1.5",
        ),
        (
            ("queen", "walk", {"velocity_band": 0}),
            "velocity_band: expected a finite number from 1e-09 to inf, got 0",
        ),
        (
            ("queen", "walk", {"phase_offsets": [0, 1]}),
            "phase_offsets: expected one finite number or 6 of them, got [0, 1]",
        ),
        (("queen", "walk", {"healthy_range": (1.0, 0.2)}), "healthy_range: expected low < high, got (1.0, 0.2)"),
        (("queen", "walk", {"base_noise": -1}), "base_noise: expected a finite number from 0 to inf, got -1"),
        (
            ("queen", "walk", {"time_limit": "long"}),
            "time_limit: expected a finite number from 1e-09 to inf, got 'long'",
        ),
        (
            ("queen", "walk", None, {"flat_observations": True}),
            "unknown environment setting 'flat_observations'; did you mean 'flat_observation'?",
        ),
    ],
)
def test_bad_names_and_values_are_one_line_errors(arguments, message):
    with pytest.raises(ValueError) as error:
        arc_suite.load(*arguments)
    assert str(error.value).startswith(message)
    assert "\n" not in str(error.value)


def test_copy_of_physics_is_independent_and_equal():
    environment = load("queen")
    environment.reset()
    environment.step(np.zeros(18))
    copied = copy.deepcopy(environment)
    for action in random_actions(environment, 10):
        assert_array_equal(flat(environment.step(action)), flat(copied.step(action)))
