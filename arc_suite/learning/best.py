"""The checkpoint of a run that is best in validation episodes: `RUN/best`, a folder that is a policy.

The episodes of the curve choose a few candidates. The best of few episodes is partly lucky, so that more episodes, on
seeds of validation too, choose among them. Episodes that judge the final policy choose nothing.
"""

import contextlib
import shutil
from pathlib import Path

import numpy as np

from arc_suite import evaluation, files, seed_ranges
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.learning.agents.evaluating import Evaluator
from arc_suite.policies import checkpoints, network
from arc_suite.policies.checkpoints import Agent

FOLDER = "best"
CANDIDATES = 3  # checkpoints with the largest returns of the curve, in addition to the latest
SEEDS = seed_ranges.VALIDATION[: evaluation.EPISODES]


def keep_best(run: Configuration, folder: Path, threads: int | None = 1) -> tuple[Agent, Agent]:
    """Copy the best checkpoint of a run into its folder `best`.

    Args:
        run: configuration of the run.
        folder: folder of the run.
        threads: threads of the simulation; None for as many as there are cores.

    Returns:
        Metadata of the best checkpoint and of the latest one, with their mean returns in these episodes.

    Raises:
        ValueError: a damaged file.
        OSError: a file cannot be read or written.
    """
    *earlier, latest = checkpoints.agents(folder / checkpoints.FOLDER)
    by_curve = sorted(earlier, key=lambda agent: agent.mean_return)
    candidates = [latest, *by_curve[-CANDIDATES:]]
    measured_agents = []
    with contextlib.closing(Evaluator(run, threads, SEEDS)) as evaluator:
        for agent in candidates:
            policy = network.load(checkpoints.at(folder, agent.steps))
            lines = evaluator.play(agent.steps, policy)
            mean_return = float(np.mean([line["return"] for line in lines]))
            measured_agents.append(agent._replace(mean_return=mean_return))
    best = max(measured_agents, key=lambda agent: agent.mean_return)
    best_folder = files.folder(folder / FOLDER)
    with files.writing(best_folder / network.FILE) as temporary:
        shutil.copyfile(checkpoints.at(folder, best.steps) / network.FILE, temporary)
    checkpoints.save(best_folder, best)
    return best, measured_agents[0]


def describe(best: Agent, latest: Agent) -> str:
    """Return which checkpoint is the best, as text."""
    episodes = f"{len(SEEDS)} episodes of validation"
    if best.steps == latest.steps:
        return f"the latest checkpoint is the best, {best.mean_return:.1f} in {episodes}"
    return (
        f"best at step {best.steps}, {best.mean_return:.1f} in {episodes}; the latest {latest.mean_return:.1f}; kept "
        f"in {FOLDER}"
    )
