"""Measures how far demonstrators come on the tasks of ground: the tables of docs/ground.md.

Each cell is the share of the distance that is asked for in whole episodes, the return, and in brackets
the share of episodes that ended in a fall.

Example:
  python tools/ground.py --tasks rough,stairs --robots tick --difficulties 0.5 --episodes 4
"""

import contextlib

import numpy as np
from absl import flags

from arc_suite import checks, evaluation, policies
from arc_suite.arenas import terrain
from arc_suite.cli import program
from arc_suite.cpg.selection import presets_of
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS

FLAGS = flags.FLAGS
flags.DEFINE_list("tasks", list(terrain.KINDS), "On which ground.")
flags.DEFINE_list("robots", list(ROBOTS), "Who walks.")
flags.DEFINE_list("presets", ["tuned", "steered", "surefooted", "sighted"], "Of the demonstrator; zero stands still.")
flags.DEFINE_list("difficulties", ["0.3333", "0.6667", "1"], "From 0 to 1.")
flags.DEFINE_integer("episodes", evaluation.EPISODES, "How many of each.", lower_bound=1)
flags.DEFINE_integer("terrain_seed", 1, "Of what is random in the ground; learners train on others.", lower_bound=0)
flags.DEFINE_integer("threads", None, "To simulate on. [default: as many as there are cores]", lower_bound=1)


def played(task: str, robot: str, preset: str, difficulty: float) -> list[evaluation.Episode]:
    """Play the episodes of one cell, all at once."""
    settings = {"difficulty": difficulty, "terrain_seed": FLAGS.terrain_seed}
    rows = VectorEnv(robot, task, FLAGS.episodes, FLAGS.threads, "Disabled", task_kwargs=settings)
    name, preset = ("zero", "medium") if preset == "zero" else ("cpg", preset)
    with contextlib.closing(rows):
        policy = policies.policy(name, robot, preset, FLAGS.episodes, task=rows.task.definition)
        return evaluation.episodes_in_batch(rows, policy, range(FLAGS.episodes))


def cell(episodes: list[evaluation.Episode]) -> str:
    """Return what a table says of episodes."""
    means = {name: np.mean([e.progress[name] for e in episodes]) for name in ("distance", "fell", "sank")}
    total = np.mean([episode.total for episode in episodes])
    notes = [f"{means[name]:.0%} {name}" for name in ("fell", "sank") if means[name]]
    return f"{means['distance']:.2f}, {total:.0f}" + (f" ({', '.join(notes)})" if notes else "")


def difficulty(text: str) -> float:
    """Return the number that a text of `--difficulties` stands for."""
    try:
        value = float(text)
    except ValueError:
        value = text
    return checks.number("--difficulties", value, 0.0, 1.0)


def main() -> None:
    """Print a table for each task."""
    for robot in FLAGS.robots:
        presets = presets_of(ROBOTS[checks.name(robot, ROBOTS, "robot")])
        for preset in FLAGS.presets:
            checks.name(preset, ("zero", *presets), "preset")
    for task in FLAGS.tasks:
        checks.name(task, (*terrain.KINDS, "course"), "task of ground")
    difficulties = [difficulty(text) for text in FLAGS.difficulties]
    for task in FLAGS.tasks:
        print(
            f"| {task} | difficulty | {' | '.join(FLAGS.presets)} |", "|---" * (2 + len(FLAGS.presets)) + "|", sep="\n"
        )
        for robot in FLAGS.robots:
            for share in difficulties:
                bar = program.progress(FLAGS.presets, desc=f"{task} {robot} {share:g}", leave=False)
                cells = [cell(played(task, robot, preset, share)) for preset in bar]
                print(f"| {robot} | {share:.2f} | {' | '.join(cells)} |", flush=True)
        print()


if __name__ == "__main__":
    program.run(main)
