"""Threads: each may have its own environment; two may not share one."""

import concurrent.futures
import threading

import gymnasium
import numpy as np
import pytest

import arc_suite


def episode(seed):
    """Rewards of a walk and what a step ends in, made and stepped in the thread that calls."""
    environment = arc_suite.load("tick", "walk", {"random": seed})
    environment.reset()
    rewards = [environment.step(np.zeros(18)).reward for _ in range(200)]
    return rewards, environment.physics.get_state()


def test_an_environment_for_each_thread():
    with concurrent.futures.ThreadPoolExecutor(4) as pool:
        together = list(pool.map(episode, range(4)))
    for seed, (rewards, state) in enumerate(together):
        own_rewards, own_state = episode(seed)
        assert rewards == own_rewards
        np.testing.assert_array_equal(state, own_state)


@pytest.mark.parametrize("call", ["step", "reset", "render"])
def test_two_threads_cannot_use_one_vector_environment(call, monkeypatch):
    envs = gymnasium.make_vec("arc_suite/tick-walk-v0", num_envs=2, render_mode="rgb_array")
    twin = gymnasium.make_vec("arc_suite/tick-walk-v0", num_envs=2)
    actions = np.zeros((2, 18))
    envs.reset(seed=0), twin.reset(seed=0)
    inside, leave = threading.Event(), threading.Event()
    step = envs.batch.step

    def slow_step(*args):
        inside.set()
        assert leave.wait(20)
        return step(*args)

    monkeypatch.setattr(envs.batch, "step", slow_step)
    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        stepping = pool.submit(envs.step, actions)
        assert inside.wait(20)
        with pytest.raises(RuntimeError) as error:
            getattr(envs, call)(*([actions] if call == "step" else []))
        leave.set()
        observations = stepping.result()[0]
    assert str(error.value) == f"cannot {call}: another thread is using this environment; make one for each thread"
    np.testing.assert_array_equal(observations, twin.step(actions)[0])
    np.testing.assert_array_equal(envs.step(actions)[0], twin.step(actions)[0])
