"""What is compared: ways to run a control step of one robot's walk."""

import contextlib
import os
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import gymnasium
import mujoco

import arc_suite
from arc_suite.robots import ROBOTS
from arc_suite.simulation import timers
from arc_suite.simulation.model import compile_model
from benchmark import ordinary

FULL = "mj_step, full model"
LEAN = "mj_step, lean model"
SILENT = "mj_step, lean model without sensors"
DM_ENV = "dm_env"
GYM = "Gymnasium env"
ORDINARY = "ordinary MujocoEnv"
SYNC = "SyncVectorEnv of ordinary ones"
ASYNC = "AsyncVectorEnv of ordinary ones"
VECTOR = "vector env"
ORDER = (FULL, LEAN, SILENT, DM_ENV, GYM, ORDINARY, SYNC, ASYNC, VECTOR)

# No episode ends while it is measured.
_TASK_KWARGS = {"healthy_range": (-1e3, 1e3), "time_limit": 1e6}
_WITHOUT_END = {"max_episode_steps": 10**7}
_SUBSTEPS = 25  # of a control step of the robots


class Contestant(NamedTuple):
    """One way to run control steps.

    Attributes:
        name: what runs.
        num_envs: environments that a step advances.
        workers: threads or processes that do so.
        reset: starts; returns an observation.
        step: maps an action (num_envs, motors), or (motors,) where there is one environment, to an observation.
        close: frees everything.
    """

    name: str
    num_envs: int
    workers: int
    reset: Callable[[], Any]
    step: Callable[[Any], Any]
    close: Callable[[], None]


def singles(robot: str, ordinary_id: str) -> Iterator[Contestant]:
    """Yield plain MuJoCo and the environments that run alone."""
    lean = compile_model(ROBOTS[robot])
    silent = compile_model(ROBOTS[robot])
    silent.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    full = mujoco.MjModel.from_xml_string(ordinary.full_model(robot).to_xml_string())
    yield _mujoco(FULL, robot, full, contextlib.nullcontext())
    yield _mujoco(LEAN, robot, lean, timers.off)
    yield _mujoco(SILENT, robot, silent, timers.off)
    yield _dm_env(robot)
    yield _gymnasium(GYM, gymnasium.make(f"arc_suite/{robot}-walk-v0", task_kwargs=_TASK_KWARGS, **_WITHOUT_END))
    yield _gymnasium(ORDINARY, gymnasium.make(ordinary_id, terminate_when_unhealthy=False, **_WITHOUT_END))


def ordinary_vectors(ordinary_id: str, workers: Sequence[int]) -> Iterator[Contestant]:
    """Yield Gymnasium's own vector environments of ordinary ones: a process for each environment, or none at all."""
    options = {"terminate_when_unhealthy": False, **_WITHOUT_END}
    for num_envs in workers:
        envs = gymnasium.make_vec(ordinary_id, num_envs, vectorization_mode="async", **options)
        yield _gymnasium(ASYNC, envs, num_envs, num_envs)
    num_envs = min(workers)
    yield _gymnasium(SYNC, gymnasium.make_vec(ordinary_id, num_envs, vectorization_mode="sync", **options), num_envs)


def vectors(robot: str, env_counts: Sequence[int], threads: Sequence[int]) -> Iterator[Contestant]:
    """Yield the vector environment: every size on most threads, and one size on every number of threads."""
    most_threads = max(threads)
    sizes = [(num_envs, most_threads) for num_envs in env_counts]
    sizes += [(reference(env_counts), num_threads) for num_threads in threads if num_threads != most_threads]
    for num_envs, num_threads in sizes:
        envs = gymnasium.make_vec(
            f"arc_suite/{robot}-walk-v0",
            num_envs,
            num_threads=num_threads,
            task_kwargs=_TASK_KWARGS,
            **_WITHOUT_END,
        )
        yield _gymnasium(VECTOR, envs, num_envs, num_threads)


def reference(env_counts: Sequence[int]) -> int:
    """Return the number of environments at which threads are compared: 64 where it is among them."""
    return 64 if 64 in env_counts else max(env_counts)


def all_threads() -> list[int]:
    """Return the powers of two up to the number of CPUs that this process may use, and that number."""
    num_cpus = len(os.sched_getaffinity(0))
    powers = {2**exponent for exponent in range(num_cpus.bit_length())}
    return sorted({power for power in powers if power <= num_cpus} | {num_cpus})


def _mujoco(name: str, robot: str, model: mujoco.MjModel, context) -> Contestant:
    """Return 25 times mj_step within a context, and nothing else."""
    data = mujoco.MjData(model)
    observation = {"posture": data.qpos[2:], "velocities": data.qvel}  # views, which follow the simulation

    def reset():
        environment = arc_suite.load(robot, "walk", {"random": 0})
        environment.reset()
        data.qpos[:] = environment.physics.position()
        data.qvel[:] = environment.physics.velocity()
        return observation

    def step(action):
        data.ctrl[:] = action
        with context:
            mujoco.mj_step(model, data, _SUBSTEPS)
        return observation

    return Contestant(name, 1, 1, reset, step, lambda: None)


def _dm_env(robot: str) -> Contestant:
    environment = arc_suite.load(robot, "walk", {"random": 0, **_TASK_KWARGS})
    return Contestant(DM_ENV, 1, 1, environment.reset, environment.step, environment.physics.free)


def _gymnasium(name: str, env, num_envs: int = 1, workers: int = 1) -> Contestant:
    return Contestant(
        name,
        num_envs,
        workers,
        reset=lambda: env.reset(seed=0)[0],
        step=lambda action: env.step(action)[0],
        close=lambda: env.close(),
    )
