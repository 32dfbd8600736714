"""Threads: each may have its own environment; two may not share one."""

import concurrent.futures
import functools
import itertools
import threading

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from refusals import refused

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


ID = "arc_suite/tick-walk-v0"
FACES = {
    "dm": lambda: arc_suite.load("tick", "walk", {"random": 0}),
    "env": lambda: gymnasium.make(ID, task_kwargs={"random": 0}).unwrapped,
    "vector": lambda: gymnasium.make_vec(ID, num_envs=2, render_mode="rgb_array", task_kwargs={"random": 0}),
}
CALLS = {"dm": ("step", "reset"), "env": ("step", "reset", "close"), "vector": ("step", "reset", "render", "close")}


@pytest.mark.parametrize(("face", "call"), [(face, call) for face, calls in CALLS.items() for call in calls])
def test_two_threads_cannot_use_one_environment(face, call, monkeypatch):
    shared, twin = FACES[face](), FACES[face]()
    actions = np.zeros((2, 18) if face == "vector" else 18)
    shared.reset(), twin.reset()
    inside, leave = threading.Event(), threading.Event()
    simulation = shared.batch if face == "vector" else shared.physics
    step = simulation.step

    def slow_step(*args):
        inside.set()
        assert leave.wait(20)
        return step(*args)

    monkeypatch.setattr(simulation, "step", slow_step)
    line = f"cannot {call}: another thread is using this environment; make one for each thread"
    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        stepping = pool.submit(shared.step, actions)
        assert inside.wait(20)
        with refused(line, RuntimeError):
            getattr(shared, call)(*([actions] if call == "step" else []))
        leave.set()
        result = stepping.result()
    assert data_equivalence(result, twin.step(actions), exact=True)
    assert data_equivalence(shared.step(actions), twin.step(actions), exact=True)
    shared.close()


@pytest.mark.parametrize("face", ["dm", "vector"])
def test_a_thread_may_set_commands_without_end_while_another_steps(face):
    load = functools.partial(arc_suite.load, "tick", "steer", {"random": 0})
    make = functools.partial(gymnasium.make_vec, "arc_suite/tick-steer-v0", num_envs=2, task_kwargs={"random": 0})
    shared, twin = (load() if face == "dm" else make() for _ in range(2))
    shared.reset(), twin.reset()
    actions, stop = np.zeros((2, 18) if face == "vector" else 18), threading.Event()

    def command(environment, number):
        environment.command("command", (number, -number, 2.0 * number))

    def play():
        for number in itertools.cycle(np.arange(128) / 256):  # exact as float32
            command(shared, number)
            if stop.is_set():
                return

    def used(result):
        """The command of a step (..., 3), as observed."""
        return result.observation["command"][:3] if face == "dm" else shared.task.split(result[0])["command"][:, :3]

    command(shared, 0.0)
    results = []
    with concurrent.futures.ThreadPoolExecutor(1) as pool:
        playing = pool.submit(play)
        try:
            while len({used(result).flat[0] for result in results}) < 4 and len(results) < 900:
                results.append(shared.step(actions))
        finally:
            stop.set()
        playing.result()
    numbers = [float(used(result).flat[0]) for result in results]
    assert len(set(numbers)) == 4
    for number, result in zip(numbers, results, strict=True):
        assert (used(result) == (number, -number, 2.0 * number)).all()
        command(twin, number)
        assert data_equivalence(result, twin.step(actions), exact=True)
    command(shared, 0.25)
    assert (used(shared.step(actions)) == (0.25, -0.25, 0.5)).all()
    shared.close(), twin.close()
