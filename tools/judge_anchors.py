"""Measures the anchors of the benchmark's scores: standing still, the best law, and on uneven ground a blind walker.

The seeds are shared among eight grounds. What the table of the package has is not played again: the same command goes
on after a stop. A thousand episodes of a policy take about 500 s of one core.

Example:
  python tools/judge_anchors.py --seeds 1000
  python tools/judge_anchors.py --seeds 500 --places tick-rough
"""

import contextlib
from collections.abc import Iterator

import numpy as np
from absl import flags
from gymnasium.vector import AutoresetMode

from arc_suite import checks, evaluation, files, policies
from arc_suite.cli import program
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, judging
from arc_suite.evaluation.judging import Part
from arc_suite.learning.studies.divisions import PLACES, place_setup
from arc_suite.policies.network import EXTENSION, PACKAGED

# The law with the highest return at each place, of all that obey its commands; 16 episodes of each tell.
BEST_LAWS = {
    "walk": "refined",
    "steer": "reactive",
    "rough": "sighted",
    "gaps": "sighted",
    "navigate": "planned",
}
SHARE = len(judging.ANCHOR_SEEDS) // judging.GROUNDS  # seeds of a line

FLAGS = flags.FLAGS
_NAMES = [f"{robot}-{task}" for robot, task in PLACES]
flags.DEFINE_integer("seeds", len(judging.ANCHOR_SEEDS), "Episodes of each policy.", 1, len(judging.ANCHOR_SEEDS))
flags.DEFINE_list("places", _NAMES, "Places, ROBOT-TASK.")


def play(setup: Setup, policy_name: str, seeds: range) -> np.ndarray:
    """Return the returns (episodes,) of standing still, of a preset, or of the blind walker."""
    if policy_name != judging.BLIND:
        return anchors.play_returns(setup, policy_name, seeds)
    path = PACKAGED / f"{setup.name}-steer{EXTENSION}"
    without_scan = setup.with_settings({"exclude_blocks": ["scan"]})
    environment = without_scan.make_vec(len(seeds), num_threads=1, autoreset_mode=AutoresetMode.DISABLED)
    with contextlib.closing(environment):
        policy = policies.policy(path, setup.body, num_envs=len(seeds), task=environment.task.definition)
        return np.array([episode.total for episode in evaluation.episodes_in_batch(environment, policy, seeds)])


def policies_of(setup: Setup) -> list[str]:
    """Return the policies that are anchors at a place, and the blind walker where there is a height scan."""
    names = [BEST_LAWS[setup.kind.name], anchors.ZERO]
    return [*names, judging.BLIND] if "scan" in setup.definition.blocks else names


def lines_to_play(names: list[str], count: int) -> Iterator[tuple[Setup, str, int, range]]:
    """Yield setup, policy, ground and seeds of each line, the first shares of all places first."""
    setups = [place_setup(robot, task) for robot, task in PLACES if f"{robot}-{task}" in names]
    for ground, first in enumerate(range(0, count, SHARE)):
        seeds = judging.ANCHOR_SEEDS[first : min(first + SHARE, count)]
        for setup in setups:
            for policy_name in policies_of(setup):
                yield setup, policy_name, judging.ANCHOR_SEEDS[ground], seeds


def main() -> None:
    """Play the lines that the table lacks, and write each."""
    names = [checks.name(name, _NAMES, "place") for name in FLAGS.places]
    lines = list(lines_to_play(names, FLAGS.seeds))
    for setup, policy_name, ground, seeds in program.progress(lines, unit="line"):
        parts = judging.read(judging.TABLE)
        key = (str(setup), policy_name, seeds.start)
        if any((part.place, part.policy, part.first_seed) == key and part.seeds >= len(seeds) for part in parts):
            continue
        ground_setup = judging.on_ground(setup, ground)
        returns = play(ground_setup, policy_name, seeds)
        ground_text = "" if ground_setup == setup else str(ground)
        mean, deviation = (round(float(value), 3) for value in (returns.mean(), returns.std()))
        part = Part(str(setup), policy_name, ground_text, seeds.start, len(seeds), mean, deviation)
        remaining = [line for line in parts if (line.place, line.policy, line.first_seed) != key]
        with files.writing(judging.TABLE) as temporary:
            judging.write(temporary, sorted([*remaining, part]))


if __name__ == "__main__":
    program.run(main)
