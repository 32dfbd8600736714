"""What must hold for long and everywhere: bits, memory, and a thousand accidents."""

import os
import pathlib
import re
import subprocess
import sys

import determinism
import gymnasium
import numpy as np
import pytest
import soak
from dm_control.rl.control import PhysicsError

import arc_suite

FOLDER = pathlib.Path(__file__).parents[1]
STEPS = 60
ENVIRON = os.environ | {"PYTHONPATH": str(FOLDER.parent)}


@pytest.mark.release
def test_the_same_bits_in_every_process_on_any_number_of_threads_and_in_a_batch():
    found = {}
    for threads in (["1", "8"], ["2"]):
        command = [sys.executable, FOLDER / "determinism.py", *threads, f"--steps={STEPS}"]
        done = subprocess.run(command, env=ENVIRON, capture_output=True, text=True, check=True)
        for line in done.stdout.splitlines()[1:]:
            robot, task, *_, observations, rewards = line.split()
            found.setdefault((robot, task), []).append(determinism.Digests(observations, rewards))
    for robot, task in found:
        if task != "recover":  # in this process it has the small tables of falls of all tests
            found[robot, task].append(determinism.digests(determinism.single(robot, task, STEPS)))
    assert tuple(found) == arc_suite.ALL_TASKS
    assert all(len(digests) == 6 - (task == "recover") for (_, task), digests in found.items())
    assert all(len(set(digests)) == 1 for digests in found.values())
    walks = [digests[0] for (_, task), digests in found.items() if task == "walk"]
    assert all(len(set(kind)) == len(walks) for kind in zip(*walks, strict=True))


@pytest.mark.release
@pytest.mark.skipif(not os.path.exists("/proc/self/task"), reason="reads Linux's /proc")
def test_soak_in_short():
    command = [sys.executable, FOLDER / "soak.py", "--steps=8000", "--block=2000", "--lives=4", "--slope=1000"]
    done = subprocess.run(command, env=ENVIRON, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.findall(r"^(\w+): 8000 steps, ", done.stdout, re.MULTILINE) == list(soak.STEPS)


ACCIDENTS = (("qpos", np.nan), ("qpos", np.inf), ("qvel", np.nan), ("qvel", -np.inf), ("qvel", 1e12))


def accidents(count, size, seed=0):
    """Field, index and value of what goes wrong, at random."""
    random = np.random.RandomState(seed)
    for _ in range(count):
        field, value = ACCIDENTS[random.randint(len(ACCIDENTS))]
        yield field, random.randint(size), value


@pytest.mark.slow
@pytest.mark.parametrize("on_divergence", ["raise", "truncate"])
def test_500_divergences_of_a_single_environment_are_all_reported(on_divergence):
    environment = arc_suite.load("tick", "walk", {"random": 0, "on_divergence": on_divergence})
    reported = 0
    for field, index, value in accidents(500, 18):
        first = environment.reset()
        getattr(environment.physics.data, field)[index] = value
        try:
            timestep = environment.step(np.zeros(18))
        except PhysicsError as error:
            reported += str(error).startswith("tick: physics diverged in the step from 0.000 s: ")
            timestep = first
        else:
            reported += timestep.last() and (timestep.reward, timestep.discount) == (0.0, 1.0)
        assert all(np.isfinite(block).all() for block in timestep.observation.values())
        assert all(np.isfinite(block).all() for block in environment.reset().observation.values())
    assert reported == 500


@pytest.mark.release
@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_1000_divergences_of_environments_are_all_reported(mode):
    envs = gymnasium.make_vec("arc_suite/tick-walk-v0", num_envs=50, autoreset_mode=mode)
    random, reported = np.random.RandomState(0), 0
    envs.reset(seed=0)
    chances = accidents(1000, 18)
    while reported < 1000:
        spoilt = random.choice(50, 25, replace=False)
        for row_index, (field, index, value) in zip(spoilt, chances, strict=False):
            getattr(envs.batch.data, field)[row_index, index] = value
        observations, rewards, terminated, truncated, info = envs.step(np.zeros((50, 18)))
        info = info if mode == "NextStep" else info["final_info"]
        assert set(np.flatnonzero(info["_diverged"])) == set(spoilt)
        assert terminated[spoilt].all() and not truncated[spoilt].any() and (rewards[spoilt] == 0.0).all()
        assert np.isfinite(observations).all() and np.isfinite(rewards).all()
        reported += len(spoilt)
        observations, rewards, *_, info = envs.step(np.zeros((50, 18)))
        assert np.isfinite(observations).all() and np.isfinite(rewards).all() and "diverged" not in info
    assert next(chances, None) is None
