"""What a control step costs in every task, against one of walk."""

import contextlib
import time

import numpy as np

from arc_suite import policies
from arc_suite.envs.vector import VectorEnv
from arc_suite.tasks import TASKS

NUM_ENVS = 64
_ONSET, _STEPS = 40, 20  # control steps before those that are timed, and of one turn


def _walking(task: str, robot: str, threads: int):
    """Rows that are under way, and the actions of their next steps, which every turn repeats."""
    rows = VectorEnv(robot, task, NUM_ENVS, threads)
    has_command = "command" in rows.task.sizes
    policy = policies.policy(
        "cpg", robot, "surefooted" if has_command else "tuned", NUM_ENVS, task=rows.task.definition
    )
    observations, rewards, actions = rows.reset(seed=0)[0], np.zeros(NUM_ENVS), []
    policy.reset(range(NUM_ENVS), range(NUM_ENVS))
    for _ in range(_ONSET + _STEPS):
        actions.append(policy.act(rows.task.split(observations), rewards))
        observations, rewards, *_ = rows.step(actions[-1])
    return rows, actions[_ONSET:]


def measure(robot: str, threads: int, rounds: int) -> str:
    """Return a table of all tasks, measured in turn: us of a row's step, and its ratio to walk's, by medians."""
    with contextlib.ExitStack() as stack:
        contestants = {task: _walking(task, robot, threads) for task in TASKS}
        for rows, _ in contestants.values():
            stack.callback(rows.close)
        seconds = {task: [] for task in TASKS}
        for _ in range(rounds):
            for task, (rows, actions) in contestants.items():
                begin = time.perf_counter()
                for action in actions:
                    rows.step(action)
                seconds[task].append((time.perf_counter() - begin) / len(actions) / NUM_ENVS)
        scan = _scan(contestants["rough"][0], rounds)
    lines = [
        f"| {robot}, {NUM_ENVS} environments, {threads} threads | us an environment | of walk's |",
        "|---|---|---|",
    ]
    for task, times in seconds.items():
        ratio = np.median(np.divide(times, seconds["walk"]))
        lines.append(f"| {task} | {1e6 * np.median(times):.0f} | {ratio:.2f} |")
    lines.append(f"| the scan of rough | {1e6 * scan:.1f} | {scan / np.median(seconds['walk']):.3f} |")
    return "\n".join(lines)


def _scan(rows: VectorEnv, rounds: int) -> float:
    """Seconds that the height scan takes, a row."""
    task = rows.task.definition
    readings, times = rows.task.definition.read(rows.batch.data), []
    for _ in range(10 * rounds):
        begin = time.perf_counter()
        task.settings.ground.observe(task.context, rows._memory.ground, rows._memory.core.place, readings)
        times.append(time.perf_counter() - begin)
    return float(np.median(times)) / NUM_ENVS
