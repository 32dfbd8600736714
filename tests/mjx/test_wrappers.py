"""Wrappers and trainers of MuJoCo Playground and Brax take an `Env` as it is."""

import os
import pathlib
import subprocess
import sys

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from conftest import WORLDS

pytest.importorskip("mujoco_playground", reason="make check-mjx")

from mujoco_playground import wrapper

from arc_suite.learning.worlds import mjx
from arc_suite.learning.worlds.randomization import randomization_fn

ROOT = pathlib.Path(__file__).parents[2]
LENGTH = 7


@pytest.mark.parametrize("randomized", [False, pytest.param(True, marks=pytest.mark.release)])
def test_nothing_of_an_old_episode_lives_on(randomized):
    env = mjx.load("leaper", "walk", num_starts=16)
    ranges = {"friction": (0.9, 1.1)}
    keys = jax.random.split(jax.random.PRNGKey(1), WORLDS)
    randomize = (lambda model: randomization_fn(**ranges)(model, keys)) if randomized else None
    wrapped = wrapper.wrap_for_brax_training(env, episode_length=LENGTH, randomization_fn=randomize)
    assert (wrapped.observation_size, wrapped.action_size) == (env.observation_size, env.action_size)
    state = jax.jit(wrapped.reset)(jax.random.split(jax.random.PRNGKey(0), WORLDS))
    step, action = jax.jit(wrapped.step), jnp.full((WORLDS, 12), 0.3)
    first, rewards, lengths = state, [], []
    for count in range(2 * LENGTH):
        state = step(state, action)
        rewards.append(np.asarray(state.reward))
        lengths.append(np.asarray(state.info["memory"].tick))
        ended = count % LENGTH == LENGTH - 1
        np.testing.assert_array_equal(state.done, np.full(WORLDS, float(ended)))
        np.testing.assert_array_equal(state.info["truncation"], state.done)
        if ended:  # of the next episode
            np.testing.assert_array_equal(state.obs, first.obs)
            np.testing.assert_array_equal(state.data.time, np.zeros(WORLDS))
        if count % LENGTH == 0:  # the clock starts at 0, and there is no action before
            np.testing.assert_allclose(state.metrics["reward_smoothness"], 12 * 0.3**2, rtol=1e-5)
    np.testing.assert_array_equal(rewards[:LENGTH], rewards[LENGTH:])
    np.testing.assert_array_equal(lengths[:LENGTH], lengths[LENGTH:])
    assert (np.array(lengths)[:LENGTH, 0] == np.arange(1, LENGTH + 1)).all()


@pytest.mark.release
def test_ppo_of_brax(tmp_path):
    script = ROOT / "examples" / "training" / "brax_ppo.py"
    flags = "--robot=leaper", "--worlds=4", "--steps=64", "--unroll=8", "--evaluations=1", "--episode_length=8"
    done = subprocess.run(
        [sys.executable, script, *flags],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    step, reward = done.stdout.splitlines()[-1].split()
    assert int(step) >= 64 and np.isfinite(float(reward))
