"""The table in docs/benchmark.md of learners of other libraries, next to `ppo` in the same places.

studies/peers.csv says how their policies were trained, a line for each. Scores are those of the benchmark.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from arc_suite import evaluation
from arc_suite.learning.studies import benchmark, csv_files, results
from arc_suite.learning.studies.benchmark import RunScore
from arc_suite.learning.studies.divisions import PLACES
from arc_suite.learning.studies.text_tables import table
from studies import catalog

TABLE = "peers.csv"
COLUMNS = ("learner", "robot", "task", "seed", "training_seed", "steps", "cpu_minutes")
DIVISION = "top"
OURS = "ppo"  # the learner next to which they stand
# Library and source of the hyperparameters by learner.
SOURCES: Mapping[str, tuple[str, str]] = {
    OURS: ("this suite", "its defaults"),
    "sb3_ppo": (
        "stable-baselines3 2.9.2",
        "[RL Baselines3 Zoo](https://github.com/DLR-RM/rl-baselines3-zoo/blob/master/hyperparams/ppo.yml), Ant-v4",
    ),
    "rsl_rl_ppo": (
        "rsl_rl 5.5.1",
        "[Rudin et al., 2021](https://github.com/leggedrobotics/legged_gym), 64 environments",
    ),
    "cleanrl_ppo": (
        "after CleanRL 1",
        "[ppo_continuous_action.py](https://docs.cleanrl.dev/rl-algorithms/ppo/#ppo_continuous_actionpy)",
    ),
}
HEADS = ("place", "learner", "library", "hyperparameters", "steps", "CPU min", "score [95 %]", "of each seed", "return")


class Cost(NamedTuple):
    """What the training of a policy took.

    Attributes:
        steps: environment steps, over all environments.
        minutes: CPU time.
    """

    steps: int
    minutes: float


Costs = Mapping[tuple[str, str, str, int], Cost]  # by learner, robot, task and seed


def text(studies: Path) -> str:
    """Return the table in Markdown.

    Raises:
        ValueError: a damaged table.
        OSError: a table cannot be read.
    """
    costs = {**_read_costs(studies / TABLE), **_measured_costs(studies / f"{DIVISION}-{OURS}")}
    places_of_peers = {(robot, task) for learner, robot, task, _ in costs if learner != OURS}
    scores_by_learner = benchmark.read(studies)
    lines = []
    for robot, task in PLACES:
        if (robot, task) not in places_of_peers:
            continue
        for learner in SOURCES:
            scores = [
                score
                for score in scores_by_learner.get((DIVISION, learner), [])
                if (score.robot, score.task) == (robot, task)
            ]
            if scores:
                lines.append(_cells(learner, sorted(scores, key=lambda score: score.seed), costs))
    return table(HEADS, lines)


def _read_costs(path: Path) -> Costs:
    costs = {}
    for row in csv_files.read(path, COLUMNS):
        key = (row["learner"], row["robot"], row["task"], int(row["seed"]))
        costs[key] = Cost(int(row["steps"]), float(row["cpu_minutes"]))
    return costs


def _measured_costs(published: Path) -> Costs:
    """Return the costs of the runs of a study."""
    costs = {}
    for result in results.read_results(catalog.study(published.name).runs, published):
        configuration = result.run.configuration
        setup = configuration.setup
        key = (OURS, setup.name, setup.kind.name, configuration.seed)
        costs[key] = Cost(int(result.steps[-1]), float(result.cpu[-1]) / 60.0)
    return costs


def _cells(learner: str, scores: Sequence[RunScore], costs: Costs) -> list[str]:
    """Return the cells of a learner in a place, given its scores by seed."""
    costs_of_seeds = [costs[learner, score.robot, score.task, score.seed] for score in scores]
    values = [score.score for score in scores]
    mean, (low, high) = evaluation.mean_and_interval([values])
    interval = f" [{low:z.2f}, {high:z.2f}]" if np.isfinite(low) else ""
    return [
        f"{scores[0].robot} {scores[0].task}",
        learner,
        *SOURCES[learner],
        f"{costs_of_seeds[0].steps:,}",
        f"{np.mean([cost.minutes for cost in costs_of_seeds]):.1f}",
        f"{mean:z.2f}{interval}",
        ", ".join(f"{value:z.2f}" for value in values),
        f"{np.mean([score.result for score in scores]):.0f}",
    ]
