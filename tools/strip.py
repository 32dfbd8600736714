"""Draws a strip of all tasks, a view each, with robots in turn: docs/tasks.png.

Example:
  python tools/strip.py --output docs/tasks.png
"""

import imageio.v3 as imageio
import numpy as np
from absl import flags

import arc_suite
from arc_suite import checks, evaluation, files, policies
from arc_suite.cli import program
from arc_suite.cpg import suited_preset
from arc_suite.export import films
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS

FLAGS = flags.FLAGS
flags.DEFINE_integer("steps", 110, "Control steps before the picture.", lower_bound=1)
flags.DEFINE_integer("columns", 4, "Views side by side.", lower_bound=1)
flags.DEFINE_string("output", "docs/tasks.png", "File to write.", short_name="o")

WIDTH, HEIGHT = 360, 270  # pixels of a view
NEAR = ("walk", "steer", "shoved", "limp", "roam")  # seen from before, where arrows of the command show their length


def view(task: str, robot: str) -> np.ndarray:
    """Picture of a robot that does a task, (HEIGHT, WIDTH, 3), with both names."""
    environment = arc_suite.load(robot, task)
    definition = environment.task.definition
    policy = policies.policy("cpg", robot, suited_preset(definition), task=definition)
    for _ in evaluation.rollout(environment, policy, 0, FLAGS.steps):
        pass
    camera = "portrait" if task in NEAR else "tracking"
    picture = environment.physics.render(HEIGHT, WIDTH, camera, quality="still")
    return films.captioned(picture, f"{task}: {robot}")


def main() -> None:
    """Draw the views and write them."""
    checks.extension(FLAGS.output, [".png"])
    robots = list(ROBOTS)
    pairs = [(task, robots[index % 3]) for index, task in enumerate(TASKS)]  # Leaper falls on ground
    views = [view(*pair) for pair in program.progress(pairs, desc="tasks", leave=False)]
    views += [np.full_like(views[0], 255)] * (-len(views) % FLAGS.columns)
    with files.writing(FLAGS.output) as path:
        imageio.imwrite(path, films.grid(views, FLAGS.columns))


if __name__ == "__main__":
    program.run(main)
