"""Tables of committed returns: of standing, of demonstrators and of learners."""

import json
from pathlib import Path

import numpy as np

from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors
from arc_suite.evaluation.published import DEMONSTRATORS, FINALS
from arc_suite.learning.studies import csv_files
from arc_suite.learning.studies.text_tables import table
from arc_suite.policies.network import PACKAGED
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS
from studies import leaderboard

ROOT = Path(__file__).parents[2]
_LEARNER_HEADS = (
    *("robot, task", "algorithm", "seeds", "return", "95 %", "of each seed"),
    *("score", "metric", "steps", "study"),
)


def demonstrators(robots=tuple(ROBOTS), tasks=tuple(TASKS)) -> str:
    """Return the table of the returns of standing and of the best demonstrator; empty if none are committed."""
    lines = []
    for task in tasks:
        for robot in robots:
            setup = Setup.of(robot, task)
            returns_of_presets = anchors.committed_returns(setup)
            if returns_of_presets:
                lines.append(_demonstrator_cells(setup, returns_of_presets))
    return table(("robot, task", "standing", "best demonstrator", "preset"), lines) if lines else ""


def _demonstrator_cells(setup: Setup, returns_of_presets: anchors.Returns) -> tuple[str, str, str, str]:
    """Return the cells of a setup's line in the table of demonstrators."""
    best_preset = anchors.of_returns(returns_of_presets).preset
    standing = _mean_and_deviation(returns_of_presets[anchors.ZERO])
    best = _mean_and_deviation(returns_of_presets[best_preset])
    return str(setup), standing, best, f"`{best_preset}`"


def _mean_and_deviation(returns: np.ndarray) -> str:
    return f"{returns.mean():.0f} +- {returns.std():.0f}"


def learners(robots=tuple(ROBOTS), tasks=tuple(TASKS), studies: str = "../../studies/") -> str:
    """Return the table of learners in committed studies; empty if there are none.

    Args:
        robots: names of robots.
        tasks: names of tasks.
        studies: path of the folder of studies, from the page with the table.
    """
    setup_names = {str(Setup.of(robot, task)) for task in tasks for robot in robots}
    results = csv_files.read(ROOT / "studies" / leaderboard.TABLE, leaderboard.HEADS)
    lines = []
    for configuration in leaderboard.rank_configurations(results):
        if configuration["robot, task"] in setup_names:
            fields = configuration | {"study": leaderboard.link(configuration, studies)}
            lines.append([fields[head] for head in _LEARNER_HEADS])
    return table(_LEARNER_HEADS, lines) if lines else ""


def paper_table(robot: str) -> str:
    """Return the table of the paper's returns of a robot in `walk`, and of the policy in the package."""
    packaged_policies = json.loads((PACKAGED / "policies.json").read_text(encoding="utf-8"))
    returns_of_policies = {"the paper's demonstrator": DEMONSTRATORS[robot]}
    for name, final_return in FINALS[robot].items():
        returns_of_policies[f"the paper's {name}, 1,000,000 steps"] = final_return
    returns_of_policies["`--policy ppo`, which comes with the package"] = packaged_policies[f"{robot}-walk"]["return"]
    lines = [(name, f"{policy_return:.0f}") for name, policy_return in returns_of_policies.items()]
    return table(("policy", "return"), lines)
