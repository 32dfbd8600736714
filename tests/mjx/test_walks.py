"""Walks in single precision: MJX and MuJoCo's C from the same seeds."""

import jax
import numpy as np
import pytest
from conftest import WORLDS, compiled, recorded, stepped, walked

ROBOTS = "leaper", "queen", "bastion", "tick"


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_hundred_steps(robot):
    env, start, step = compiled(robot)
    state, envs, ours, theirs = walked(env, start, step, 100, "tuned")
    assert ours.sum(axis=0) == pytest.approx(theirs.sum(axis=0), rel=0.01)
    assert not np.asarray(state.done).any()
    np.testing.assert_array_equal(state.data.time, np.full(WORLDS, np.float32(100) * np.float32(env.dt)))
    np.testing.assert_array_equal(state.info["memory"].tick, envs._memory.tick)
    np.testing.assert_array_equal(state.metrics["overflow"], np.zeros(WORLDS))


@pytest.mark.parametrize("robot", ROBOTS)
def test_one_step_in_single_precision(robot):
    """From recorded states, with MJX's own contact frames; see test_one_step."""
    env, start, step = compiled(robot)
    begun, places, terms = start(np.arange(WORLDS)), [], []
    for count, before, action, environments, *_ in recorded(robot, "tuned"):
        state = stepped(env, begun, step, count, before, action)
        places.append(abs(state.data.qpos - environments.batch.data.qpos).max(axis=-1))
        found = environments.task.terms
        terms.append([abs(state.metrics[f"reward_{name}"] - term) for name, term in found.items()])
    assert np.median(places) <= 1e-5
    assert np.median(terms, axis=(0, 2)).max() <= 1e-3


@pytest.mark.release
def test_a_whole_episode():
    env, start, step = compiled("leaper")
    state, _, ours, theirs = walked(env, start, step, 1000, "tuned")
    assert ours.sum(axis=0).mean() == pytest.approx(theirs.sum(axis=0).mean(), rel=0.01)
    assert not np.asarray(state.done).any()
    np.testing.assert_array_equal(state.info["memory"].tick, np.full(WORLDS, 1000))


@pytest.mark.parametrize("task", ["steer", "shoved", "limp", "navigate"])
def test_tasks_with_a_command(task):
    env, start, step = compiled("leaper", task)
    state, envs, ours, theirs = walked(env, start, step, 50, "steered")
    assert ours.sum(axis=0).mean() == pytest.approx(theirs.sum(axis=0).mean(), rel=0.01)
    assert not np.asarray(state.done).any()
    progress, expected = env.task.progress(state.info["memory"]), envs.task.progress
    assert progress.keys() == expected.keys()
    np.testing.assert_allclose(progress["gait_compliance"], expected["gait_compliance"], atol=0.05)


@pytest.mark.parametrize(("robot", "task"), [("tick", "mimic"), ("leaper", "recover")])
def test_motions_and_falls(robot, task):
    """Under the demonstrators of both tasks."""
    env, start, step = compiled(robot, task)
    state, envs, ours, theirs = walked(env, start, step, 50)
    assert ours.sum(axis=0).mean() == pytest.approx(theirs.sum(axis=0).mean(), rel=0.01)
    assert not np.asarray(state.done).any()
    progress, expected = env.task.progress(state.info["memory"]), envs.task.progress
    assert progress.keys() == expected.keys()
    for name in progress:  # rad, standing heights, s; whether it is up or fell
        np.testing.assert_allclose(progress[name].mean(), expected[name].mean(), rtol=0.05, err_msg=name)


MODIFIERS = {"kicks": 1.0, "motor_strength": (0.5, 1.0), "friction": (0.5, 1.0), "mass": (0.8, 1.2)}
MODIFIERS |= {"observation_noise": 1.0, "delay": (0, 3), "actions": "position"}


def test_modifiers():
    """Each world has the noise, delay, strength, mass, friction and kicks of its seed."""
    settings = tuple(MODIFIERS.items())
    env, start, step = compiled("leaper", settings=settings)
    from arc_suite.envs.vector import VectorEnv

    envs = VectorEnv("leaper", "walk", WORLDS, 1, task_kwargs=MODIFIERS)
    envs.reset(seed=0)
    state, random, apart = start(np.arange(WORLDS)), np.random.RandomState(0), []
    for _ in range(60):
        action = random.uniform(-0.3, 0.3, (WORLDS, 12))
        state = step(state, action)
        observation, reward, *_ = envs.step(action)
        apart.append(abs(state.obs - observation).max(axis=0))
    ours, theirs = state.info["memory"].changes, envs._memory.changes
    np.testing.assert_array_equal(np.asarray(ours.elapsed), theirs.elapsed)
    assert len(ours.states) == len(theirs.states)
    for one, other in zip(jax.tree.leaves(ours.states), jax.tree.leaves(theirs.states), strict=True):
        np.testing.assert_allclose(np.asarray(one), other, rtol=1e-6, atol=1e-2)  # of angles and speeds
    assert np.median(apart[:5]) <= 1e-3
    assert np.median(apart) <= 0.02
    assert jax.tree.structure(ours) == jax.tree.structure(start(np.arange(WORLDS)).info["memory"].changes)
