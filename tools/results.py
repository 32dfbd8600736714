"""Measures demonstrators on tasks: the tables between the marks in studies/demonstrators.md, and the anchors of scores.

A cell holds the return, the task's metric, and in brackets the share of episodes that ended in a fall or with a
foot under the ground. Anchors are standing still and the best of the presets, in tasks with default settings; they
go into the package.

Example:
  python tools/results.py --tasks rough,steer --robots tick --difficulties 0.5 --episodes 4
  python tools/results.py --write
  python tools/results.py --anchors
"""

import contextlib
import itertools
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from absl import flags

from arc_suite import checks, evaluation, files, policies, registry
from arc_suite.cli import program
from arc_suite.cpg.selection import presets_of
from arc_suite.envs.setup import Setup
from arc_suite.envs.vector import VectorEnv
from arc_suite.evaluation import anchors
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS

PAGE = Path(__file__).resolve().parents[1] / "studies" / "demonstrators.md"
LANES = ("rough", "slopes", "stairs", "gaps", "course")

# Task -> presets to compare; zero stands still.
PRESETS = {
    "steer": ("zero", "tuned", "steered", "reactive"),
    "directed": ("zero", "steered", "reactive"),
    "shoved": ("zero", "tuned", "steered", "reactive", "braced"),
    "limp": ("zero", "tuned", "steered", "reactive", "braced"),
    "roam": ("zero", "steered", "surefooted", "braced"),
    "navigate": ("zero", "steered", "planned"),
    **dict.fromkeys(LANES, ("zero", "tuned", "surefooted", "climbing", "sighted")),
    "leap": ("zero", "sighted", "leaping"),
    "mimic": ("zero", "tracked"),
    "recover": ("zero", "rising"),
}
# Presets that straight walks are compared with, for anchors alone: docs/results.md has them by `arc-suite evaluate`.
WALK = ("zero", "medium", "tuned", "refined")
METRICS = ("distance", "goals", "tracking", "joint_error", "up")  # the first that a task has

FLAGS = flags.FLAGS
flags.DEFINE_list("tasks", None, "Which tasks. [default: all]")
flags.DEFINE_list("robots", list(ROBOTS), "Who walks.")
flags.DEFINE_list("presets", None, "Of the demonstrator; zero stands still. [default: those that suit the task]")
flags.DEFINE_list("difficulties", ["0.3333", "0.6667", "1"], "Of ground, from 0 to 1.")
flags.DEFINE_integer("episodes", evaluation.CURVE_EPISODES, "How many of each.", lower_bound=1)
flags.DEFINE_integer("terrain_seed", 1, "Of what is random in the ground; learners train on others.", lower_bound=0)
flags.DEFINE_integer("threads", None, "To simulate on. [default: as many as there are cores]", lower_bound=1)
flags.DEFINE_boolean("write", False, "Write the tables into studies/demonstrators.md.")
flags.DEFINE_boolean("anchors", False, "Measure anchors in place of tables, and write them into the package.")


def cell(task: str, robot: str, preset: str, settings: dict) -> str:
    """Return the cell of a preset in a table; "-" where the robot has no preset of that name."""
    if preset not in ("zero", *presets_of(registry.body_of(robot))):
        return "-"
    return summary(play(task, robot, preset, settings))


def play(task: str, robot: str, preset: str, settings: dict) -> list[evaluation.EpisodeResult]:
    """Play the episodes of one cell, all at once."""
    environment = VectorEnv(robot, task, FLAGS.episodes, FLAGS.threads, "Disabled", task_kwargs=settings)
    stands_still = preset == "zero"
    name = "zero" if stands_still else "cpg"
    presets = () if stands_still else (preset,)
    with contextlib.closing(environment):
        policy = policies.policy(name, robot, presets, FLAGS.episodes, task=environment.task.definition)
        return evaluation.episodes_in_batch(environment, policy, range(FLAGS.episodes))


def summary(episodes: list[evaluation.EpisodeResult]) -> str:
    """Return the return, the metric and the failures of episodes as text."""
    means = {name: np.mean([episode.progress[name] for episode in episodes]) for name in episodes[0].progress}
    metric = next(means[name] for name in METRICS if name in means)
    metric = round(metric, 2) + 0.0  # without the sign of -0.0
    mean_return = np.mean([episode.total for episode in episodes])
    failures = [f"{means[name]:.0%} {name}" for name in ("fell", "sank") if means.get(name)]
    note = f" ({', '.join(failures)})" if failures else ""
    return f"{mean_return:.0f}, {metric:.2f}{note}"


def rows(task: str) -> Iterator[tuple[str, str, dict]]:
    """Yield a row's robot, the difficulty of its ground as text, and its settings."""
    for robot in FLAGS.robots:
        if task not in LANES:
            yield robot, "", {}
            continue
        for text in FLAGS.difficulties:
            difficulty = checks.number("--difficulties", _number(text), 0.0, 1.0)
            yield robot, f" {difficulty:.2f}", {"difficulty": difficulty, "terrain_seed": FLAGS.terrain_seed}


def table(task: str) -> Iterator[str]:
    """Yield the lines of a table."""
    presets = FLAGS.presets or PRESETS[task]
    yield f"| {task} | {' | '.join(presets)} |"
    yield "|---" * (1 + len(presets)) + "|"
    for robot, difficulty, settings in rows(task):
        bar = program.progress(presets, desc=f"{task} {robot}{difficulty}", leave=False)
        yield f"| {robot}{difficulty} | {' | '.join(cell(task, robot, preset, settings) for preset in bar)} |"


def replace_table(page: str, task: str, lines: list[str]) -> str:
    """Return a page with the table between the marks of a task replaced."""
    old_table = re.compile(f"(?<=<!-- {task} -->\n).*?(?=<!-- end -->)", re.DOTALL)
    return old_table.sub("\n" + "\n".join(lines) + "\n\n", page, count=1)


def anchor(robot: str, task: str) -> anchors.Returns:
    """Return the returns of standing still and of the best preset of a robot in a task with default settings."""
    setup = Setup.of(robot, task)
    names = [name for name in PRESETS.get(task, WALK) if name in (anchors.ZERO, *presets_of(setup.body))]
    bar = program.progress(names, desc=f"{task} {robot}", leave=False)
    returns = {name: anchors.play_returns(setup, name, range(evaluation.EPISODES)) for name in bar}
    return {name: returns[name] for name in (anchors.ZERO, anchors.of_returns(returns).preset)}


def write_anchors(tasks: list[str]) -> None:
    """Measure anchors, and write each into the package; those of other places stay."""
    order = [str(Setup.of(robot, task)) for task in TASKS for robot in ROBOTS]
    for task, robot in itertools.product(tasks, FLAGS.robots):
        table_of_anchors = anchors.read(anchors.TABLE) if anchors.TABLE.exists() else {}
        table_of_anchors[str(Setup.of(robot, task))] = anchor(robot, task)
        with files.writing(anchors.TABLE) as temporary:
            anchors.write(temporary, {name: table_of_anchors[name] for name in order if name in table_of_anchors})


def _number(text: str):
    with contextlib.suppress(ValueError):
        return float(text)
    return text


def main() -> None:
    """Print a table for each task, and write it into the page; or write the anchors."""
    for robot in FLAGS.robots:
        presets = presets_of(registry.body_of(robot))
        for preset in FLAGS.presets or ():
            checks.name(preset, ("zero", *presets), "preset")
    tasks = FLAGS.tasks or list(TASKS if FLAGS.anchors else PRESETS)
    for task in tasks:
        checks.name(task, TASKS if FLAGS.anchors else PRESETS, "task")
    if FLAGS.anchors:
        return write_anchors(tasks)
    for task in tasks:
        lines = []
        for line in table(task):
            print(line, flush=True)
            lines.append(line)
        print()
        if FLAGS.write:
            page = replace_table(PAGE.read_text(encoding="utf-8"), task, lines)
            PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    program.run(main)
