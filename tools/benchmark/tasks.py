"""What a control step costs in every task, against one of walk."""

import contextlib
import time

import numpy as np

from arc_suite import policies
from arc_suite.envs.vector import VectorEnv
from arc_suite.tasks import TASKS

NUM_ENVS = 64
_WARM_UP_STEPS = 40  # control steps before those that are timed
_STEPS = 20  # control steps of one turn


def _start_walking(task: str, robot: str, threads: int) -> tuple[VectorEnv, list[np.ndarray]]:
    """Return a vector environment whose robots walk, and the actions of their next steps, which every turn repeats."""
    environment = VectorEnv(robot, task, NUM_ENVS, threads)
    has_command = "command" in environment.task.sizes
    preset = "surefooted" if has_command else "tuned"
    policy = policies.policy("cpg", robot, preset, NUM_ENVS, task=environment.task.definition)
    observations, _ = environment.reset(seed=0)
    rewards = np.zeros(NUM_ENVS)
    actions = []
    policy.reset(range(NUM_ENVS), range(NUM_ENVS))
    for _ in range(_WARM_UP_STEPS + _STEPS):
        actions.append(policy.act(environment.task.split(observations), rewards))
        observations, rewards, *_ = environment.step(actions[-1])
    return environment, actions[_WARM_UP_STEPS:]


def measure(robot: str, threads: int, rounds: int) -> str:
    """Return a table of all tasks, measured in turn: us of a step, and its ratio to that of walk, by medians."""
    with contextlib.ExitStack() as stack:
        contestants = {task: _start_walking(task, robot, threads) for task in TASKS}
        for environment, _ in contestants.values():
            stack.callback(environment.close)
        seconds = {task: [] for task in TASKS}
        for _ in range(rounds):
            for task, (environment, actions) in contestants.items():
                start = time.perf_counter()
                for action in actions:
                    environment.step(action)
                seconds[task].append((time.perf_counter() - start) / len(actions) / NUM_ENVS)
        scan = _time_scan(contestants["rough"][0], rounds)
    lines = [
        f"| {robot}, {NUM_ENVS} environments, {threads} threads | us an environment | of walk's |",
        "|---|---|---|",
    ]
    for task, times in seconds.items():
        ratio = np.median(np.divide(times, seconds["walk"]))
        lines.append(f"| {task} | {1e6 * np.median(times):.0f} | {ratio:.2f} |")
    lines.append(f"| the scan of rough | {1e6 * scan:.1f} | {scan / np.median(seconds['walk']):.3f} |")
    return "\n".join(lines)


def _time_scan(environment: VectorEnv, rounds: int) -> float:
    """Return the median time of the height scan of one environment, s."""
    task = environment.task.definition
    readings = task.read(environment.batch.data)
    memory = environment._memory
    times = []
    for _ in range(10 * rounds):
        start = time.perf_counter()
        task.settings.ground.observe(task.context, memory.ground, memory.core.place, readings)
        times.append(time.perf_counter() - start)
    return float(np.median(times)) / NUM_ENVS
