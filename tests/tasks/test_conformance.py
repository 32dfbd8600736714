"""Conformance of every task of the registry: what users of dm_control's suite rely on."""

import io
import unittest

import mujoco
import numpy as np
import pytest
from absl.testing import absltest
from dm_control.rl import control
from dm_env import specs
from dm_env.test_utils import EnvironmentTestMixin
from episodes import assert_same_steps, begun, flat, load, random_actions
from numpy.testing import assert_array_equal
from refusals import refused
from tiers import tiers, turns

import arc_suite
from arc_suite.envs.gym import Env
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS, mirror
from arc_suite.tasks import TASKS

JOINTS = {name: len(body.joint_names) for name, body in ROBOTS.items()}
# Robots take turns from task to task.
every_task = pytest.mark.parametrize(("domain", "task"), tiers(arc_suite.ALL_TASKS, check=turns(JOINTS, TASKS)))


@pytest.mark.parametrize(
    ("domain", "task"),
    tiers(
        arc_suite.ALL_TASKS,
        check=lambda domain, task: (domain, task) in (("tick", "walk"), ("leaper", "roam"), ("bastion", "navigate")),
        test=turns(JOINTS, TASKS),
    ),
)
def test_dm_env_contract(domain, task):
    class Contract(EnvironmentTestMixin, absltest.TestCase):
        def make_object_under_test(self):
            return load(domain, task)

    suite = absltest.TestLoader().loadTestsFromTestCase(Contract)
    result = unittest.TextTestRunner(stream=io.StringIO()).run(suite)
    assert result.testsRun >= 4
    assert result.wasSuccessful(), result.failures + result.errors


@every_task
def test_specs_are_those_of_the_declared_blocks(domain, task):
    environment = load(domain, task)
    assert isinstance(environment, control.Environment)
    action = environment.action_spec()
    assert isinstance(action, specs.BoundedArray)
    assert action.shape == (JOINTS[domain],)
    assert (action.minimum == -1).all() and (action.maximum == 1).all()
    declared = {name: (size,) for name, size in environment.task.sizes.items()}
    timestep = environment.reset()
    assert {name: block.shape for name, block in timestep.observation.items()} == declared
    assert {name: spec.shape for name, spec in environment.observation_spec().items()} == declared
    for name, spec in environment.observation_spec().items():
        spec.validate(timestep.observation[name])
    assert flat(timestep).shape == (environment.task.definition.size,)


@every_task
def test_flat_observation_is_the_blocks_in_order(domain, task):
    blocks = load(domain, task)
    vector = arc_suite.load(domain, task, {"random": 0}, {"flat_observation": True})
    assert_array_equal(vector.reset().observation["observations"], flat(blocks.reset()))
    for action in random_actions(blocks, 5):
        assert_array_equal(vector.step(action).observation["observations"], flat(blocks.step(action)))


@every_task
def test_physics_is_25_plain_steps_of_2_ms(domain, task):
    environment = begun(domain, task, actions="torque")
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
    assert_same_steps(one, two, random_actions(one, 20))
    again = one.reset()
    assert not np.array_equal(flat(first), flat(again))
    assert_array_equal(flat(again), flat(two.reset()))


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
def test_privileged_observations_are_those_of_the_declared_blocks_in_every_driver(domain, task):
    """And name by name without noise; the mirror of a mirror is the same."""
    settings = {"kicks": 1.0, "observation_noise": 1.0, "time_limit": 0.4}
    one = load(domain, task, **settings, random=6)
    with refused("no episode has begun; call reset first", RuntimeError):
        one.task.privileged  # noqa: B018
    one.reset()
    options = {"domain_name": domain, "task_name": task, "task_kwargs": settings, "privileged": True}
    single, vector, body = Env(**options), VectorEnv(num_envs=2, **options), one.task.body
    infos = [single.reset(seed=6)[1], vector.reset(seed=5)[1]]
    definition = one.task.definition
    for action in random_actions(one, 12):
        found = one.task.privileged
        assert {name: block.shape for name, block in found.items()} == {
            name: (block.size,) for name, block in definition.privileged_blocks.items()
        }
        flattened = np.concatenate(list(found.values())).astype(np.float32)
        assert np.isfinite(flattened).all()
        assert_array_equal(infos[0]["privileged"], flattened)
        if infos[1]["_privileged"][1]:
            assert_array_equal(infos[1]["privileged"][1], flattened)
            assert_array_equal(vector.task.privileged["velocity"][1], found["velocity"])
        one.step(action)
        *_, over, cut, single_info = single.step(action)
        infos = [single_info, vector.step(np.stack([action] * 2))[-1]]
        if over or cut:
            one.reset()
            infos[0] = single.reset()[1]
            infos[1] = vector.step(np.stack([action] * 2))[-1]
    image = mirror.image(body)
    for block in definition.privileged_blocks.values():
        numbers = np.arange(1.0, block.size + 1.0)
        assert_array_equal(block.mirror(image)(block.mirror(image)(numbers)), numbers)


@every_task
def test_action_out_of_range_is_clipped(domain, task):
    one, two = begun(domain, task), begun(domain, task)
    action = random_actions(one, 1)[0] * 10
    a, b = one.step(action), two.step(action.clip(-1, 1))
    assert a.reward == b.reward
    assert_array_equal(flat(a), flat(b))
    assert one.step(np.full(JOINTS[domain], 1e300)).reward == two.step(np.ones(JOINTS[domain])).reward
