"""Measures control steps: all contestants in turn, again and again, as the machine's speed varies."""

import contextlib
import itertools
import pathlib
import platform
import resource
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version

import gymnasium
import numpy as np

from arc_suite.cpg import Demonstrator
from arc_suite.envs.prepare import prepare_task
from benchmark import contestants, growth, ordinary
from benchmark.contestants import Contestant

WARM_UP = 20  # control steps, in which a robot begins to walk
MAX_ENV_STEPS = 1500  # environments x control steps of a turn; with more environments, turns have fewer steps


def machine() -> dict:
    """Return the processor, the threads and the versions that the figures hold for."""
    names = ("mujoco", "dm-control", "gymnasium", "shimmy", "numpy")
    return {
        "processor": _processor(),
        "threads": max(contestants.all_threads()),
        "python": platform.python_version(),
        **{name: version(name) for name in names},
    }


def measure(
    robots: Sequence[str],
    rows: Sequence[int],
    threads: Sequence[int],
    workers: Sequence[int],
    rounds: int,
    steps: int,
    progress: Callable,
) -> dict:
    """Run the whole benchmark.

    Args:
        robots: names of the robots.
        rows: rows of the vector environment.
        threads: threads of the vector environment.
        workers: processes of Gymnasium's own.
        rounds: how often each contestant has its turn.
        steps: control steps of a turn, fewer where there are many environments, but not less than a third.
        progress: wraps an iterable, such as `tqdm`.

    Returns:
        JSON-able: "machine", "robots" and "growth"; times in us per control step of one environment, one
        for each round.
    """
    results = {"machine": machine(), "robots": {}, "growth": []}
    turns = iter(progress(range((len(robots) + 1) * rounds)))
    for robot in robots:
        with contextlib.ExitStack() as stack:
            field = _Field(robot, rows, threads, workers, stack)
            for _ in itertools.islice(turns, rounds):
                field.play(steps)
            cost = _cost_of_many(robot, max(rows), max(threads))
            results["robots"][robot] = {"contestants": field.results(), "size": cost}
    bodies = growth.Bodies()
    for _ in turns:
        bodies.play()
    return results | {"growth": bodies.results()}


class _Field:
    """All contestants of one robot, and their times."""

    def __init__(self, robot, rows, threads, workers, stack: contextlib.ExitStack):
        folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory()))
        path = folder / f"{robot}.xml"
        path.write_text(ordinary.full_model(robot).to_xml_string(), encoding="utf-8")
        ordinary_id = ordinary.register(robot, str(path))
        stack.callback(gymnasium.registry.pop, ordinary_id)
        # Processes fork before there are any threads.
        self._contestants: list[Contestant] = []
        for group in (
            contestants.ordinary_vectors(ordinary_id, workers),
            contestants.singles(robot, ordinary_id),
            contestants.vectors(robot, rows, threads),
        ):
            for contestant in group:
                stack.callback(contestant.close)
                self._contestants.append(contestant)
        self._contestants.sort(key=lambda contestant: contestants.ORDER.index(contestant.name))
        self._task, _ = prepare_task(robot, "walk")
        self._policies = [Demonstrator(robot) for _ in self._contestants]
        self._observations = [contestant.reset() for contestant in self._contestants]
        self._times = [[] for _ in self._contestants]
        for index in range(len(self._contestants)):
            self._run(index, WARM_UP)

    def play(self, steps: int) -> None:
        """Give each contestant a turn, forwards and backwards in alternation."""
        order = list(range(len(self._contestants)))
        rounds_before = len(self._times[0])
        if rounds_before % 2 == 1:
            order.reverse()
        for index in order:
            num_envs = self._contestants[index].num_envs
            turn_steps = max(1, steps // 3, min(steps, MAX_ENV_STEPS // num_envs))
            seconds = self._run(index, turn_steps)
            self._times[index].append(1e6 * seconds / (turn_steps * num_envs))

    def results(self) -> list[dict]:
        """Return the contestants with the times of all their turns."""
        results = []
        for contestant, times in zip(self._contestants, self._times, strict=True):
            fields = {name: getattr(contestant, name) for name in ("name", "num_envs", "workers")}
            results.append({**fields, "microseconds": times})
        return results

    def _blocks(self, observation) -> Mapping[str, np.ndarray]:
        """Return the blocks by name of what a contestant returns: a dm_env `TimeStep`, a vector or the blocks."""
        observation = getattr(observation, "observation", observation)
        return observation if isinstance(observation, Mapping) else self._task.split(observation)

    def _run(self, index: int, steps: int) -> float:
        """Return the time spent in steps, s, without that of the policy."""
        contestant = self._contestants[index]
        policy = self._policies[index]
        observation = self._observations[index]
        seconds = 0.0
        for _ in range(steps):
            action = policy.act(self._blocks(observation))
            start = time.perf_counter()
            observation = contestant.step(action)
            seconds += time.perf_counter() - start
        self._observations[index] = observation
        return seconds


def _cost_of_many(robot: str, num_envs: int, threads: int) -> dict:
    """Return what a vector environment of many environments costs in addition to its steps."""
    bytes_before = _used_memory()
    start = time.perf_counter()
    envs = gymnasium.make_vec(f"arc_suite/{robot}-walk-v0", num_envs, num_threads=threads)
    build_seconds = time.perf_counter() - start
    envs.reset(seed=0)
    envs.step(np.zeros(envs.action_space.shape, np.float32))
    num_bytes = _used_memory() - bytes_before
    reset_times = []
    for index in range(min(num_envs, 100)):
        mask = np.arange(num_envs) == index
        start = time.perf_counter()
        envs.reset(options={"reset_mask": mask})
        reset_times.append(time.perf_counter() - start)
    envs.close()
    return {
        "num_envs": num_envs,
        "build_seconds": build_seconds,
        "kilobytes_per_environment": num_bytes / num_envs / 1e3,
        "masked_reset_microseconds": 1e6 * float(np.median(reset_times)),
    }


def _used_memory() -> int:
    """Return the bytes of the process that lie in memory."""
    pages = pathlib.Path("/proc/self/statm").read_text(encoding="utf-8").split()[1]
    return int(pages) * resource.getpagesize()


def _processor() -> str:
    for line in pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return platform.machine()
