"""Watch a robot live: pull at it with the mouse, steer it with the arrow keys.

  arc-suite view --robot queen
  arc-suite view --robot tick --task steer
  arc-suite view --spec examples/spider.json --set arena=bumps

Double-click a part and drag with Ctrl held to pull at it; drag without Ctrl to turn the camera. Space pauses,
backspace restarts. In a task that takes a command, such as steer, the arrow keys set it: ahead and back, and
turning left and right; until the first of them the task's own schedule holds. A fall begins the next episode.
"""

import contextlib
import math
import queue
import threading
from collections.abc import Callable, Iterator

import glfw
import mujoco
from absl import flags

import arc_suite
from arc_suite import policies
from arc_suite.cli.flags import ROBOT_HELP, define_body, define_task, only_body, task
from arc_suite.cli.live import Live, play
from arc_suite.cpg import suited_preset
from arc_suite.models.outline import outline
from arc_suite.simulation import opengl

_RATE = 60.0  # pictures a second, where the display does not tell its own
_PATIENCE = 10.0  # s, for the window to close
_DISTANCE = 4.0  # of the camera, of the farthest that the body reaches

FLAGS = flags.FLAGS
define_body()
define_task()
_ROBOT = flags.DEFINE_string("robot", "queen", f"{ROBOT_HELP}.")
flags.DEFINE_string("policy", "cpg", policies.HELP)
flags.DEFINE_string("preset", None, f"{policies.PRESET_HELP} [default: that which suits the task]")
flags.DEFINE_integer("seed", 0, "Seed of the start of the first episode and of the random policy.", 0, 2**32 - 1)


def main() -> None:
    """Open the window and play until it is closed."""
    body = only_body(_ROBOT)
    name, settings = task()
    environment = arc_suite.load(body, name, {"time_limit": math.inf} | settings | {"random": FLAGS.seed})
    definition = environment.task.definition
    policy = policies.policy(FLAGS.policy, body, FLAGS.preset or suited_preset(definition), task=definition)
    live = Live(environment, policies.alone(policy, FLAGS.seed))
    opengl.require_window("`arc-suite render -o walk.html` writes a page that plays in any browser")
    keys = queue.SimpleQueue()
    with opened(live, keys.put) as window:
        window.cam.type = mujoco.mjtCamera.mjCAMERA_TRACKING
        window.cam.trackbodyid = live.shown.model.ptr.body("torso").id
        window.cam.distance = _DISTANCE * abs(outline(body)).max()
        window.cam.azimuth, window.cam.elevation = 140.0, -15.0
        play(window, live, keys, rate())


@contextlib.contextmanager
def opened(live: Live, pressed: Callable[[int], None]) -> Iterator:
    """Open a window that shows what is live; yield it.

    Args:
        live: what is shown.
        pressed: called with each key.
    """
    from mujoco import viewer  # which initializes GLFW where there is a display, and complains where not

    model, data = live.shown.model.ptr, live.shown.data.ptr
    others = set(threading.enumerate())
    with viewer.launch_passive(model, data, key_callback=pressed, show_left_ui=False, show_right_ui=False) as window:
        yield window
    # Were the process to end while the window's thread still draws, it would crash.
    for thread in set(threading.enumerate()) - others:
        thread.join(_PATIENCE)


def rate() -> float:
    """Return how many pictures a second the display shows."""
    monitor = glfw.get_primary_monitor()
    return (monitor and glfw.get_video_mode(monitor).refresh_rate) or _RATE
