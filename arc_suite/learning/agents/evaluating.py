"""Evaluations of the policies of a run while it learns: in this process, or in other ones.

A process is `python -m arc_suite.learning.agents.evaluating RUN STEP THREADS MODULES...`. It evaluates the policy in
`RUN/checkpoints/STEP`, and prints its lines as JSON. It needs no JAX, so all of a GPU's memory is left to the learner.
"""

import importlib
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gymnasium.vector import AutoresetMode

from arc_suite import evaluation
from arc_suite.learning.agents import configuration, run_folder
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.policies import checkpoints, network
from arc_suite.policies.network import Network
from arc_suite.simulation.cores import usable_cores

Lines = list[dict[str, Any]]  # of the table of evaluations, one for each episode


class Evaluator:
    """Evaluates policies in this process, as soon as they are there."""

    def __init__(self, run: Configuration, threads: int):
        """Make the environments of evaluation."""
        self._environment = run.validation.make_vec(
            evaluation.CURVE_EPISODES, num_threads=threads, autoreset_mode=AutoresetMode.DISABLED
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
        episodes = evaluation.episodes_in_batch(self._environment, policy)
        return [
            {"step": step, "seed": seed, "return": episode.total, "length": episode.length, **episode.progress}
            for seed, episode in enumerate(episodes)
        ]

    def pop_results(self, wait: bool) -> Iterator[tuple[int, Lines]]:
        """Yield the steps and lines of the evaluations that have ended since the last call."""
        while self._finished:
            yield self._finished.pop(0)


class ProcessEvaluator:
    """Evaluates the policies of a run's folder in processes of their own, on the cores that learning leaves free.

    Attributes:
        block_sizes: sizes of the blocks of the observation by name.
        pending: steps whose results nobody has asked for.
    """

    def __init__(self, run: Configuration, threads: int, path: Path):
        """Remember the run.

        Args:
            run: configuration of the run.
            threads: threads of the simulation in each process.
            path: folder of the run.
        """
        self.block_sizes = dict(run.policy_setup.definition.sizes)
        self.pending = []
        self._path = path
        self._arguments = [str(threads), *run.modules]
        self._processes = {}  # running and ended ones by step
        self._max_processes = max(1, usable_cores() - 1)

    def close(self) -> None:
        """End the processes."""
        for process in self._processes.values():
            process.kill()
            process.communicate()

    def begin(self, step: int, policy: Network) -> None:
        """Evaluate the policy of a step, which is in the folder of the run, as soon as a core is free."""
        self.pending.append(step)
        self._start_processes()

    def pop_results(self, wait: bool) -> Iterator[tuple[int, Lines]]:
        """Yield the steps and lines of the evaluations that have ended since the last call, in the order of steps.

        Args:
            wait: whether to wait until all have ended.

        Raises:
            ValueError: an evaluation has failed.
        """
        while self.pending:
            step = self.pending[0]
            process = self._processes[step]
            if not wait and process.poll() is None:
                return
            output, errors = process.communicate()
            if process.returncode:
                last_line = errors.strip().rpartition("\n")[2] or f"exit status {process.returncode}"
                raise ValueError(f"{self._path / checkpoints.FOLDER / str(step)}: evaluation failed: {last_line}")
            del self._processes[step]
            self.pending.remove(step)
            self._start_processes()
            yield step, json.loads(output)

    def _start_processes(self) -> None:
        """Start the process of each pending step, as far as there are cores."""
        for step in self.pending:
            running = [process for process in self._processes.values() if process.poll() is None]
            if step not in self._processes and len(running) < self._max_processes:
                command = [sys.executable, "-m", __name__, str(self._path), str(step), *self._arguments]
                self._processes[step] = subprocess.Popen(
                    command,
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE,
                    encoding="utf-8",
                    start_new_session=True,  # a Ctrl-C in the terminal is for this process alone, which ends them
                )


def main(path: str, step: str, threads: str, *modules: str) -> None:
    """Evaluate the policy of a run at a step, and print its lines."""
    for module in modules:
        importlib.import_module(module)
    run = configuration.read(Path(path) / run_folder.CONFIG)
    policy = network.load(Path(path) / checkpoints.FOLDER / step)
    evaluator = Evaluator(run, int(threads))
    print(json.dumps(evaluator.play(int(step), policy), default=lambda number: number.item()))
    evaluator.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
