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
from arc_suite.simulation.model import compiled
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
_FOREVER = {"max_episode_steps": 10**7}
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
    """Plain MuJoCo and the environments that run alone."""
    lean, silent = compiled(ROBOTS[robot]), compiled(ROBOTS[robot])
    silent.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_SENSOR
    full = mujoco.MjModel.from_xml_string(ordinary.full_model(robot).to_xml_string())
    yield _mujoco(FULL, robot, full, contextlib.nullcontext())
    yield _mujoco(LEAN, robot, lean, timers.off)
    yield _mujoco(SILENT, robot, silent, timers.off)
    yield _dm_env(robot)
    yield _gymnasium(GYM, gymnasium.make(f"arc_suite/{robot}-walk-v0", task_kwargs=_TASK_KWARGS, **_FOREVER))
    yield _gymnasium(ORDINARY, gymnasium.make(ordinary_id, terminate_when_unhealthy=False, **_FOREVER))


def ordinary_vectors(ordinary_id: str, workers: Sequence[int]) -> Iterator[Contestant]:
    """Gymnasium's own vector environments of ordinary ones: as many processes as environments, or none at all."""
    forever = {"terminate_when_unhealthy": False, **_FOREVER}
    for rows in workers:
        envs = gymnasium.make_vec(ordinary_id, rows, vectorization_mode="async", **forever)
        yield _gymnasium(ASYNC, envs, rows, rows)
    rows = min(workers)
    yield _gymnasium(SYNC, gymnasium.make_vec(ordinary_id, rows, vectorization_mode="sync", **forever), rows)


def vectors(robot: str, rows: Sequence[int], threads: Sequence[int]) -> Iterator[Contestant]:
    """The vector environment: every size on most threads, and the middle one on every number of threads."""
    most = max(threads)
    sizes = [(number, most) for number in rows] + [(reference(rows), few) for few in threads if few != most]
    for number, few in sizes:
        envs = gymnasium.make_vec(
            f"arc_suite/{robot}-walk-v0", number, num_threads=few, task_kwargs=_TASK_KWARGS, **_FOREVER
        )
        yield _gymnasium(VECTOR, envs, number, few)


def reference(rows: Sequence[int]) -> int:
    """The number of environments at which threads are compared: 64 where it is among them."""
    return 64 if 64 in rows else max(rows)


def all_threads() -> list[int]:
    """1 to the number of CPUs that this process may use, in powers of two and the last."""
    most = len(os.sched_getaffinity(0))
    return sorted({2**power for power in range(most.bit_length()) if 2**power <= most} | {most})


def _mujoco(name: str, robot: str, model: mujoco.MjModel, context) -> Contestant:
    """25 times mj_step within a context, and nothing else."""
    data = mujoco.MjData(model)
    observation = {"posture": data.qpos[2:], "velocities": data.qvel}  # live

    def reset():
        environment = arc_suite.load(robot, "walk", {"random": 0})
        environment.reset()
        data.qpos[:], data.qvel[:] = environment.physics.position(), environment.physics.velocity()
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


def _gymnasium(name: str, env, rows: int = 1, workers: int = 1) -> Contestant:
    return Contestant(
        name, rows, workers, lambda: env.reset(seed=0)[0], lambda action: env.step(action)[0], lambda: env.close()
    )
