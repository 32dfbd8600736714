"""Evaluations of the policies of a run while it learns: in this process, or in other ones.

A process is `python -m arc_suite.learning.agents.evaluating RUN STEP FIRST END MODULES...`. It plays the episodes with
the seeds from FIRST to END - 1 by the policy in `RUN/checkpoints/STEP`, and prints their lines as JSON. It needs no
JAX, so all of a GPU's memory is left to the learner.
"""

import importlib
import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode

from arc_suite import evaluation, seed_ranges
from arc_suite.learning.agents import configuration, run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.policies import checkpoints, network
from arc_suite.policies.network import Network
from arc_suite.simulation.cores import usable_cores

_POLL_INTERVAL = 0.02  # s between two looks at the processes
_SEEDS = seed_ranges.VALIDATION[: evaluation.CURVE_EPISODES]  # of the episodes of an evaluation

Lines = list[dict[str, Any]]  # of the table of evaluations, one for each episode


class Evaluator:
    """Evaluates policies in this process, as soon as they are there."""

    def __init__(self, run: Configuration, threads: int | None, seeds: range = _SEEDS):
        """Make the environments of evaluation, one for the episode of each seed."""
        self._seeds = seeds
        self._environment = run.validation.make_vec(
            len(seeds), num_threads=threads, autoreset_mode=AutoresetMode.DISABLED
        )
        # Tasks of one body are read as the policy has them, without the blocks that networks do not see.
        task = self._environment.task if run.setup.several else run.policy_setup.definition
        self.block_sizes = dict(task.sizes)
        self.pending = []  # steps of policies without lines, never any
        self._finished = []

    def close(self) -> None:
        """Close the environments."""
        self._environment.close()

    def begin(self, step: int, policy: Network) -> None:
        """Evaluate the policy of a step."""
        self._finished.append((step, self.play(step, policy)))

    def play(self, step: int, policy: Network) -> Lines:
        """Play the episodes of an evaluation, and return their lines."""
        episodes = evaluation.episodes_in_batch(self._environment, policy, self._seeds)
        lines = []
        for seed, episode in zip(self._seeds, episodes, strict=True):
            values = {"step": step, "seed": seed, "return": episode.total, "length": episode.length}
            lines.append({**values, **episode.progress, **values})  # no metric takes the place of another value
        return lines

    def pop_results(self, wait: bool) -> Iterator[tuple[int, Lines]]:
        """Yield the steps and lines of the evaluations that have ended since the last call."""
        while self._finished:
            yield self._finished.pop(0)


class ProcessEvaluator:
    """Evaluates the policies of a run's folder in processes of their own, on the cores that learning leaves free.

    The episodes of the last policy, for which nobody learns any more, are divided over as many processes as may run.

    Attributes:
        block_sizes: sizes of the blocks of the observation by name.
        pending: steps whose results nobody has asked for.
    """

    def __init__(self, run: Configuration, path: Path, runs: int = 1):
        """Remember the run.

        Args:
            run: configuration of the run.
            path: folder of the run.
            runs: runs that learn in this process, which share the cores.
        """
        self.block_sizes = dict(run.policy_setup.definition.sizes)
        self.pending = []
        self._path = path
        self._modules = run.modules
        self._last_step = run.steps
        self._max_processes = max(1, (usable_cores() - 1) // runs)
        self._waiting = []  # step and seeds of the parts of evaluations that no process plays yet
        self._processes = {}  # running and ended processes of a step, in the order of their seeds

    def close(self) -> None:
        """End the processes."""
        for processes in self._processes.values():
            for process in processes:
                process.kill()
                process.communicate()

    def begin(self, step: int, policy: Network) -> None:
        """Evaluate the policy of a step, which is in the folder of the run, as soon as cores are free."""
        self.pending.append(step)
        self._processes[step] = []
        count = min(self._max_processes, len(_SEEDS)) if step >= self._last_step else 1
        parts = np.array_split(_SEEDS, count)
        self._waiting += [(step, part[0], part[-1] + 1) for part in parts]
        self._start_processes()

    def pop_results(self, wait: bool) -> Iterator[tuple[int, Lines]]:
        """Yield the steps and lines of the evaluations that have ended since the last call, in the order of steps.

        Args:
            wait: whether to wait until all have ended.

        Raises:
            ValueError: an evaluation has failed.
        """
        self._start_processes()
        while self.pending:
            step = self.pending[0]
            if not wait and not self._has_ended(step):
                return
            lines = []
            for process in self._ended_processes(step):
                output, errors = process.communicate()
                if process.returncode:
                    last_line = errors.strip().rpartition("\n")[2] or f"exit status {process.returncode}"
                    raise ValueError(f"{self._path / checkpoints.FOLDER / str(step)}: evaluation failed: {last_line}")
                lines += json.loads(output)
            del self._processes[step]
            self.pending.remove(step)
            yield step, lines

    def _has_ended(self, step: int) -> bool:
        """Return whether all processes of a step have ended."""
        is_waiting = any(waiting_step == step for waiting_step, _, _ in self._waiting)
        return not is_waiting and all(process.poll() is not None for process in self._processes[step])

    def _ended_processes(self, step: int) -> list[subprocess.Popen]:
        """Wait until the processes of a step have ended, and return them."""
        while not self._has_ended(step):
            time.sleep(_POLL_INTERVAL)
            self._start_processes()
        return self._processes[step]

    def _start_processes(self) -> None:
        """Start the processes of evaluations that wait, as far as there are cores."""
        all_processes = [process for processes in self._processes.values() for process in processes]
        running = sum(process.poll() is None for process in all_processes)
        while self._waiting and running < self._max_processes:
            step, first_seed, end_seed = self._waiting.pop(0)
            numbers = [str(number) for number in (step, first_seed, end_seed)]
            process = subprocess.Popen(
                [sys.executable, "-m", __name__, str(self._path), *numbers, *self._modules],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                encoding="utf-8",
                start_new_session=True,  # a Ctrl-C in the terminal is for this process alone, which ends them
            )
            self._processes[step].append(process)
            running += 1


def main(path: str, step: str, first_seed: str, end_seed: str, *modules: str) -> None:
    """Play episodes by the policy of a run at a step, and print their lines."""
    for module in modules:
        importlib.import_module(module)
    run = configuration.read(Path(path) / run_folder.CONFIG)
    policy = network.load(Path(path) / checkpoints.FOLDER / step)
    evaluator = Evaluator(run, threads=1, seeds=range(int(first_seed), int(end_seed)))
    print(json.dumps(evaluator.play(int(step), policy), default=lambda number: number.item()))
    evaluator.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
