"""Judges a policy: return, episode length, speed and gait compliance, beside the paper's expert line.

Example:
  python tools/evaluate.py --robot all --policy cpg --preset medium --episodes 10
"""

import functools

from absl import flags
from tqdm import tqdm

import arc_suite
from arc_suite import commands, evaluation, names, policies
from arc_suite.robots import ROBOTS

FLAGS = flags.FLAGS
flags.DEFINE_string("robot", "all", "queen, bastion, tick, leaper or all.")
flags.DEFINE_string("policy", "cpg", f"One of {', '.join(policies.POLICIES)}.")
flags.DEFINE_string("preset", "medium", "Of the cpg: slow, medium or fast.")
flags.DEFINE_integer("episodes", 10, "How many episodes for each robot.", lower_bound=1)
flags.DEFINE_integer("seed", 0, "Seed of the first episode; the others count on from it.", lower_bound=0)

COLUMNS = "{:<8} {:>16} {:>12} {:>14} {:>12} {:>13}"


def evaluate(robot: str, policy) -> list[evaluation.Episode]:
    """Runs the episodes of one robot behind a progress bar."""
    environment = arc_suite.load(robot, "walk")
    progress = functools.partial(tqdm, desc=robot, unit="episode", leave=False)
    return evaluation.episodes(environment, policy, FLAGS.episodes, FLAGS.seed, progress)


def row(robot: str, episodes: list[evaluation.Episode]) -> str:
    """One line of the table."""
    mean, deviation = evaluation.mean_and_deviation([episode.total for episode in episodes])
    length, speed, compliance = (
        evaluation.mean_and_deviation([getattr(episode, name) for episode in episodes])[0]
        for name in ("length", "speed", "compliance")
    )
    return COLUMNS.format(
        robot,
        f"{mean:.1f} +- {deviation:.1f}",
        f"{evaluation.EXPERT_RETURNS[robot]:.0f}",
        f"{length:.1f} steps",
        f"{speed:.3f} m/s",
        f"{100 * compliance:.1f} %",
    )


def main():
    """Prints the table."""
    robots = list(ROBOTS) if FLAGS.robot == "all" else [names.check(FLAGS.robot, [*ROBOTS, "all"], "robot")]
    walkers = {robot: policies.policy(FLAGS.policy, robot, FLAGS.preset, FLAGS.seed) for robot in robots}
    header = COLUMNS.format("robot", "return", "paper's cpg", "length", "speed", "compliance")
    print(header, "-" * len(header), sep="\n")
    for robot, policy in walkers.items():
        print(row(robot, evaluate(robot, policy)), flush=True)


if __name__ == "__main__":
    commands.run(main)
