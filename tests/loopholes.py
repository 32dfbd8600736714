"""Searches for policies that earn reward and fail at a task: `make check-loopholes`, some ten minutes.

For each task the search, CMA-ES, changes a body that steps by a constant command and sways. It maximizes the
return over standing still, as a share of what a failing policy may earn. The best candidate is played once more
on other seeds. Exit status 1 if one of them earns more than it may.
"""

import argparse
import pathlib
import sys

import cma
import numpy as np
from tqdm import tqdm

sys.path.insert(0, str(pathlib.Path(__file__).parent / "fixtures"))

from exploits import FAILURE, METRICS, Exploit, Exploiting, earned, limits, opened  # noqa: E402

TASKS = ("steer", "directed", "roam", "rough", "slopes", "stairs", "gaps", "course", "navigate")
LOW = Exploit(-1, -1, -1, 0, -0.6, -0.6, -0.4, 0, 0, 5, 0.1, -0.2)
HIGH = Exploit(1, 1, 1, 1.2, 0.6, 0.6, 0.4, 1, 1, 80, 0.9, 0.5)
CANDIDATES, GENERATIONS, SEEDS, OTHERS = 20, 15, (0, 1), (100, 101, 102, 103)


def decoded(vector):
    """The exploit of a vector in [0, 1]."""
    return Exploit(*(np.array(LOW) + np.clip(vector, 0.0, 1.0) * np.subtract(HIGH, LOW)))


def shares(environment, exploits, seeds, limit, metric):
    """For each exploit its gain as a share of what it may gain, and its metric as a share of the demonstrator's."""
    repeated = [exploit for exploit in exploits for _ in seeds]
    policy = Exploiting(environment.task.definition, repeated)
    totals, metrics = earned(environment, policy, list(seeds) * len(exploits))
    means = [values.reshape(len(exploits), len(seeds)).mean(axis=-1) for values in (totals, metrics[metric])]
    return (means[0] - limit.standing) / limit.gain, means[1] / limit.metric


def search(robot, task, seed):
    """The best exploit of a search, its share of the gain and of the metric on other seeds."""
    settings = {"actions": "position"}
    metric, limit = METRICS.get(task, "distance"), limits(robot, task, SEEDS, **settings)
    environment = opened(robot, task, CANDIDATES * len(SEEDS), **settings)
    options = {"randn": np.random.RandomState(seed).randn, "seed": np.nan, "verbose": -9, "popsize": CANDIDATES}
    strategy = cma.CMAEvolutionStrategy(np.full(len(LOW), 0.5), 0.3, options)
    best, most = None, -np.inf
    for _ in range(GENERATIONS):
        vectors = strategy.ask()
        exploits = [decoded(vector) for vector in vectors]
        gains, works = shares(environment, exploits, SEEDS, limit, metric)
        # A policy that does the task is no exploit.
        fitness = gains - 10.0 * np.maximum(0.0, works - FAILURE)
        strategy.tell(vectors, list(-fitness))
        if fitness.max() > most:
            best, most = exploits[np.argmax(fitness)], fitness.max()
    judge = opened(robot, task, len(OTHERS), **settings)
    gain, works = shares(judge, [best], OTHERS, limits(robot, task, OTHERS, **settings), metric)
    return best, gain[0], works[0]


def main() -> int:
    """Search in every task, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", nargs="+", default=("queen", "tick"))
    parser.add_argument("--tasks", nargs="+", default=TASKS)
    parser.add_argument("--seed", type=int, default=0)
    flags = parser.parse_args()
    found = False
    for robot, task in tqdm([(robot, task) for robot in flags.robots for task in flags.tasks], disable=None):
        exploit, gain, works = search(robot, task, flags.seed)
        loophole = bool(gain > 1.0 and works < FAILURE)
        found |= loophole
        numbers = ", ".join(f"{name}={value:.3g}" for name, value in exploit._asdict().items())
        end = ", a loophole" if loophole else ""
        print(f"{robot} {task}: {gain:.2f} of what it may gain, {works:.2f} of the metric{end}")
        print(f"    Exploit({numbers})", flush=True)
    return int(found)


if __name__ == "__main__":
    sys.exit(main())
