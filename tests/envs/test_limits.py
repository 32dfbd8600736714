"""Ends of episodes on every face: one limit, falls that terminate at any time, divergences that truncate."""

import gymnasium
import numpy as np
import pytest

import arc_suite
from arc_suite.bodies import BodiesEnv
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv

DT = 0.05  # s, control step of the robots


def faces(task, steps, **settings):
    """Environments of one task with a time limit: one and many by id, and those of a setup, a vector and two bodies."""
    task_kwargs = {"time_limit": steps * DT, **settings}
    env_id = f"arc_suite/tick-{task}-v0"
    setup = Setup.of("tick", task, task_kwargs)
    return {
        "make": gymnasium.make(env_id, task_kwargs=task_kwargs),
        "setup": setup.make(),
        "make_vec": gymnasium.make_vec(env_id, 1, task_kwargs=task_kwargs, autoreset_mode="SameStep"),
        "sync": gymnasium.make_vec(env_id, 1, vectorization_mode="sync", task_kwargs=task_kwargs),
        "vector": VectorEnv("tick", task, 1, 1, "SameStep", task_kwargs=task_kwargs),
        "bodies": BodiesEnv(task, 1, ["tick"], task_kwargs=task_kwargs, flat=True),
    }


def play(environment, steps, before_last=lambda environment: None):
    """The number of steps of an episode, whether it is terminated and whether truncated; at most `steps`."""
    environment.reset(seed=0)
    action = np.zeros(environment.action_space.shape, np.float32)
    for step in range(1, steps + 1):
        if step == steps:
            before_last(environment)
        terminated, truncated = environment.step(action)[2:4]
        if np.any(terminated) or np.any(truncated):
            return step, bool(np.any(terminated)), bool(np.any(truncated))
    return steps, False, False


@pytest.mark.slow
@pytest.mark.parametrize("task", ["walk", pytest.param("steer", marks=pytest.mark.release)])
def test_a_longer_time_limit_holds_on_every_face(task):
    settings = {"healthy_range": (0.0, 1.0)} if task == "walk" else {}
    for name, environment in faces(task, 1010, **settings).items():
        assert play(environment, 1100) == (1010, False, True), name
        environment.close()
    environment = arc_suite.load("tick", task, {"time_limit": 1010 * DT, **settings})
    timestep, steps = environment.reset(), 0
    while not timestep.last():
        timestep, steps = environment.step(np.zeros(18)), steps + 1
    assert (steps, timestep.discount) == (1010, 1.0)
    assert all(0.0 <= environment.task.progress[name] <= 1.0 for name in ("gait_compliance",))


def test_metrics_of_an_episode_that_falls_are_those_of_its_own_limit():
    for limit in (500, 1000, 1500):
        task = Setup.of("tick", "steer", {"time_limit": limit * DT}).definition
        assert task.context.steps == limit
    assert Setup.of("tick", "steer", {"time_limit": np.inf}).definition.context.steps == 1000


def simulation(environment):
    """The arrays of positions and velocities of an environment."""
    if isinstance(environment, gymnasium.vector.SyncVectorEnv):
        environment = environment.envs[0]
    environment = environment.unwrapped
    if hasattr(environment, "batch") and environment.batch is not None:
        return environment.batch.data
    if hasattr(environment, "_places"):
        return environment._places[0].group.batch.data
    return environment.physics.data


def lift(environment):
    """Put the body far above its healthy heights."""
    simulation(environment).qpos[..., 2] += 5.0


def spoil(environment):
    """Make the physics diverge."""
    simulation(environment).qvel[..., 0] = 1e11


@pytest.mark.parametrize("name", ["make", "setup", "make_vec", "sync", "vector", "bodies"])
def test_a_fall_in_the_last_step_terminates(name):
    assert play(faces("walk", 5)[name], 5, lift) == (5, True, False)
    assert play(faces("walk", 5)[name], 4, lift) == (4, True, False)
    assert play(faces("walk", 5)[name], 5) == (5, False, True)


@pytest.mark.parametrize("steps", [4, 5])
@pytest.mark.parametrize("name", ["make", "setup", "make_vec", "sync", "vector", "bodies"])
def test_a_divergence_truncates(name, steps):
    assert play(faces("walk", 5, on_divergence="truncate")[name], steps, spoil) == (steps, False, True)


@pytest.mark.parametrize(("spoilt", "discount"), [(lift, 0.0), (spoil, 1.0)])
def test_the_discount_of_dm_env_is_that_of_the_end(spoilt, discount):
    environment = arc_suite.load("tick", "walk", {"time_limit": 5 * DT, "on_divergence": "truncate"})
    environment.reset()
    for _ in range(4):
        environment.step(np.zeros(18))
    data = environment.physics.data
    if spoilt is lift:
        data.qpos[2] += 5.0
    else:
        data.qvel[0] = 1e11
    timestep = environment.step(np.zeros(18))
    assert timestep.last() and timestep.discount == discount
    assert (timestep.reward == 0.0) == (spoilt is spoil)


@pytest.mark.parametrize("make", [gymnasium.make, gymnasium.make_vec])
def test_a_fall_at_the_limit_of_gymnasium_is_both(make):
    """As its TimeLimit says, whose vector counterpart is the argument of that name."""
    environment = make("arc_suite/tick-walk-v0", max_episode_steps=5)
    assert play(environment, 5, lift) == (5, True, True)
    assert play(environment, 5) == (5, False, True)
