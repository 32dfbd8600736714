"""Measures control steps: all contestants in turn, again and again, so that they share the machine's moods."""

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
ENV_STEPS = 1500  # environments x control steps of a block beyond which blocks get shorter


def machine() -> dict:
    """What the figures hold for."""
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
    """Runs the whole benchmark.

    Args:
        robots: whose walks.
        rows: of the vector environment.
        threads: of the vector environment.
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
            results["robots"][robot] = {"contestants": field.results(), "size": _size(robot, max(rows), max(threads))}
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
        """One turn for each contestant, in alternating order."""
        order = range(len(self._contestants))
        for index in order if len(self._times[0]) % 2 == 0 else reversed(order):
            rows = self._contestants[index].num_envs
            few = max(1, steps // 3, min(steps, ENV_STEPS // rows))
            self._times[index].append(1e6 * self._run(index, few) / (few * rows))

    def results(self) -> list[dict]:
        """The times of all turns."""
        return [
            {"name": c.name, "num_envs": c.num_envs, "workers": c.workers, "microseconds": times}
            for c, times in zip(self._contestants, self._times, strict=True)
        ]

    def _blocks(self, observation) -> Mapping[str, np.ndarray]:
        """The named blocks of whatever a contestant returns: a dm_env `TimeStep`, a vector or the blocks."""
        observation = getattr(observation, "observation", observation)
        return observation if isinstance(observation, Mapping) else self._task.split(observation)

    def _run(self, index: int, steps: int) -> float:
        """Seconds spent in steps; the policy acts while the clock stands still."""
        contestant, policy, observation = self._contestants[index], self._policies[index], self._observations[index]
        seconds = 0.0
        for _ in range(steps):
            action = policy.act(self._blocks(observation))
            started = time.perf_counter()
            observation = contestant.step(action)
            seconds += time.perf_counter() - started
        self._observations[index] = observation
        return seconds


def _size(robot: str, rows: int, threads: int) -> dict:
    """What a vector environment of many environments costs in addition to its steps."""
    memory, started = _memory(), time.perf_counter()
    envs = gymnasium.make_vec(f"arc_suite/{robot}-walk-v0", rows, num_threads=threads)
    built = time.perf_counter() - started
    envs.reset(seed=0)
    envs.step(np.zeros(envs.action_space.shape, np.float32))
    memory = _memory() - memory
    mask, resets = np.zeros(rows, bool), []
    for row in range(min(rows, 100)):
        mask[:] = np.arange(rows) == row
        started = time.perf_counter()
        envs.reset(options={"reset_mask": mask})
        resets.append(time.perf_counter() - started)
    envs.close()
    return {
        "num_envs": rows,
        "build_seconds": built,
        "kilobytes_per_environment": memory / rows / 1e3,
        "masked_reset_microseconds": 1e6 * float(np.median(resets)),
    }


def _memory() -> int:
    """Bytes of the process that lie in memory."""
    return int(pathlib.Path("/proc/self/statm").read_text(encoding="utf-8").split()[1]) * resource.getpagesize()


def _processor() -> str:
    for line in pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return platform.machine()
