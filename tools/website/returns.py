"""Committed returns as tables: of standing, demonstrators and learners."""

import itertools
import json
from pathlib import Path

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
_LEARNER_HEADS = ("robot, task", "algorithm", "seeds", "return", "score", "IQM [95 %]", "metric", "steps", "study")


def demonstrators(robots=tuple(ROBOTS), tasks=tuple(TASKS)) -> str:
    """Return the table of standing and of the best demonstrator, of committed places; empty without any."""
    setups = [Setup.of(robot, task) for task in tasks for robot in robots]
    found = {setup: known for setup in setups if (known := anchors.known(setup))}
    heads = ("robot, task", "standing", "best demonstrator", "preset")
    return table(heads, itertools.starmap(_anchors, found.items())) if found else ""


def _anchors(setup: Setup, known: anchors.Returns) -> tuple[str, str, str, str]:
    best = anchors.of_returns(known).preset
    zero, most = (f"{known[name].mean():.0f} +- {known[name].std():.0f}" for name in (anchors.ZERO, best))
    return str(setup), zero, most, f"`{best}`"


def learners(robots=tuple(ROBOTS), tasks=tuple(TASKS), studies: str = "../../studies/") -> str:
    """Return the table of learners in committed studies, `studies` away; empty where there are none."""
    places = {str(Setup.of(robot, task)) for task in tasks for robot in robots}
    rows = leaderboard.rank_configurations(csv_files.read(ROOT / "studies" / leaderboard.TABLE, leaderboard.HEADS))
    lines = [row | {"study": leaderboard.link(row, studies)} for row in rows if row["robot, task"] in places]
    return table(_LEARNER_HEADS, ([line[head] for head in _LEARNER_HEADS] for line in lines)) if lines else ""


def published(robot: str) -> str:
    """Return the table of what the paper publishes for a robot in `walk`, and of the policy in the package."""
    packaged = json.loads((PACKAGED / "policies.json").read_text(encoding="utf-8"))[f"{robot}-walk"]
    lines = [("the paper's demonstrator", DEMONSTRATORS[robot])]
    lines += [(f"the paper's {name}, 1,000,000 steps", value) for name, value in FINALS[robot].items()]
    lines += [("`--policy ppo`, which comes with the package", packaged["return"])]
    return table(("policy", "return"), ((name, f"{value:.0f}") for name, value in lines))
