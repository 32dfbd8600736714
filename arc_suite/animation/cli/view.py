"""Watch a robot live: pull at it with the mouse, steer it with the arrow keys.

  arc-suite view --robot queen
  arc-suite view --robot tick --task steer
  arc-suite view --spec spider --set arena=bumps

Double-click a part and drag with Ctrl held to pull at it; drag without Ctrl to turn the camera. Space pauses,
backspace restarts. In a task with a command, such as steer, the arrow keys set it: forward and back, turn left
and right. Until the first of them the task's own schedule holds. A fall begins the next episode.
"""

import contextlib
import math
import queue

from absl import flags

import arc_suite
from arc_suite import policies
from arc_suite.animation.cli.live import Live, play
from arc_suite.cli.flags import define_walk, only_setup, policy_name, preset_from_flags
from arc_suite.envs.window import Window

_ALTERNATIVE = "`arc-suite render -o walk.html` writes a page that plays in any browser"

FLAGS = flags.FLAGS
define_walk()


def main() -> None:
    """Open the window and play until it is closed."""
    setup = only_setup()
    settings = {"time_limit": math.inf} | setup.task_kwargs
    environment = arc_suite.load(setup.body, setup.task, settings)
    task = environment.task.definition
    policy = policies.policy(policy_name(FLAGS.policy), setup.body, preset_from_flags(), task=task)
    live = Live(environment, policies.alone(policy))
    keys = queue.SimpleQueue()
    window = Window(live.shown, pressed=keys.put, instead=_ALTERNATIVE)
    with contextlib.closing(window):
        play(window, live, keys)
