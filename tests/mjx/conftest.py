"""What tests of `learning.worlds.mjx` share: compiled environments, and walks on a processor to compare with."""

import functools
import importlib.util
import os

# Read when JAX is imported: compiling is what takes long here.
os.environ.setdefault("XLA_FLAGS", "--xla_backend_optimization_level=0 --xla_cpu_multi_thread_eigen=false")

import numpy as np

from arc_suite.cpg import Demonstrator, suited_preset
from arc_suite.cpg.selection import law, presets_of
from arc_suite.envs.vector import VectorEnv

HERE = importlib.util.find_spec("mujoco.mjx") is not None
collect_ignore_glob = [] if HERE else ["test_*.py"]

WORLDS = 4
# Of a walk; among them the first step, into which feet start in the ground, and places of the gait.
STEPS = 0, 1, 2, 5, 10, 20, 33, 47


@functools.cache
def compiled(robot, task="walk", settings=(), impl="jax", worlds=WORLDS):
    """An environment, and its compiled functions of a batch: `start` of seeds and `step`."""
    import jax

    from arc_suite.learning.worlds import mjx

    env = mjx.load(robot, task, dict(settings), impl, num_starts=16, num_envs=worlds)
    return env, jax.jit(jax.vmap(env.start)), jax.jit(jax.vmap(env.step))


def walked(env, start, step, steps, preset=None):
    """Let a demonstrator walk from seeds 0, 1, ... under JAX and on a processor.

    Returns:
        The last state, the environments on a processor, and two arrays (steps, worlds) of rewards.
    """
    import jax
    import jax.numpy as jnp

    made = law(env.task, presets_of(env.task.scene.body)[preset or suited_preset(env.task)])
    worlds = env.num_envs
    act = jax.jit(lambda mind, obs: made(mind, env.task.split(obs)))
    ours = jax.tree.map(jnp.asarray, made.initial(worlds))
    theirs = made.initial(worlds)
    environments = VectorEnv(env.task.scene.body, env.task.name, worlds, 1)
    observation, _ = environments.reset(seed=0)
    state, rewards = start(np.arange(worlds)), []
    np.testing.assert_array_equal(state.obs, observation)
    for _ in range(steps):
        ours, action = act(ours, state.obs)
        state = step(state, action)
        theirs, action = made(theirs, env.task.split(observation.astype(float)))
        observation, reward, *_ = environments.step(action)
        rewards.append((np.asarray(state.reward), reward))
    return state, environments, *np.swapaxes(rewards, 0, 1)


def recorded(body, preset):
    """Yield a walk's step, and state and memory of its environments before and after it."""
    environments = VectorEnv(body, "walk", WORLDS, 1)
    demonstrator, task = Demonstrator(environments, preset), environments.task.definition
    warmstart = environments.batch._simulations.bind("qacc_warmstart")
    observation, _ = environments.reset(seed=0)
    demonstrator.reset(range(WORLDS))
    for step in range(max(STEPS) + 1):
        data = environments.batch.data
        before = data.qpos.copy(), data.qvel.copy(), warmstart.copy(), environments._memory
        action = demonstrator.act(task.split(observation))
        observation, reward, *_ = environments.step(action)
        if step in STEPS:
            yield step, before, action, environments, observation, reward


def stepped(env, begun, step, count, before, action):
    """Return the state after one control step from a recorded one, the `count`-th of its episode."""
    import jax
    import jax.numpy as jnp

    qpos, qvel, warmstart, memory = jax.tree.map(jnp.asarray, before)
    time = jnp.full(WORLDS, count * env.dt)
    data = begun.data.replace(qpos=qpos, qvel=qvel, qacc_warmstart=warmstart, time=time)
    return step(begun.replace(data=data, info={**begun.info, "memory": memory}), action)
