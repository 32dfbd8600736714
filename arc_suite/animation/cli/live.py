"""A live view: episodes in a window in real time; keys set the command, the mouse pulls at the body."""

import queue
import time
from collections.abc import Callable

import glfw
import mujoco
import numpy as np

from arc_suite.animation.episodes import MAX_SECONDS_PER_PICTURE, Episodes
from arc_suite.envs.window import Window
from arc_suite.simulation.pictures import Decorated

_PRESS = 0.25  # of the body's own speed, by which an arrow changes the command
_ARROWS = {
    glfw.KEY_UP: (_PRESS, 0.0, 0.0),
    glfw.KEY_DOWN: (-_PRESS, 0.0, 0.0),
    glfw.KEY_LEFT: (0.0, 0.0, _PRESS),
    glfw.KEY_RIGHT: (0.0, 0.0, -_PRESS),
}
_PICTURE = 1.0 / 60.0  # s


class Live(Episodes):
    """Episodes one after another, and their pose in pictures.

    Attributes:
        paused: whether time stands still.
        shown: the decorated body of the window.
    """

    def __init__(self, environment, act: Callable):
        """Start the first episode; see `Episodes`."""
        super().__init__(environment, act)
        self.paused = False
        scene = environment.task.definition.scene
        self.shown = Decorated.from_body(scene.body, scene.arena)

    def press(self, key: int) -> None:
        """Pause, restart or set the command by a key, one of GLFW's numbers."""
        if key == glfw.KEY_SPACE:
            self.paused = not self.paused
        elif key == glfw.KEY_BACKSPACE:
            self.restart()
        elif key in _ARROWS:
            self.command((np.zeros(3) if self.desired is None else self.desired) + _ARROWS[key])

    def pose(self, share: float) -> None:
        """Pose the picture at a share, 0 to 1, of the latest control step."""
        model, data, simulated = self.shown.model.ptr, self.shown.data.ptr, self.environment.physics.data
        data.qpos[:], data.qvel[:], data.mocap_pos[:] = self.qpos(share), simulated.qvel, simulated.mocap_pos
        mujoco.mj_forward(model, data)
        self.shown.darken(self.environment.task.failed_legs())

    def text(self) -> str:
        """Return a line about the episode."""
        told = [f"return {self.episode_return:.0f} in {self.steps * self.control_timestep:.1f} s"]
        if self.desired is not None:
            told.append("forward {:+.2f}, turn {:+.2f}".format(*self.desired[[0, 2]]))
        return ", ".join(told + ["paused"] * self.paused)


def play(window: Window, live: Live, keys: queue.SimpleQueue) -> None:
    """Show an episode after another in real time, until the window is closed.

    A picture lies between the poses at the start and at the end of a control step.

    Args:
        window: on `live.shown`.
        live: the episodes.
        keys: those that were pressed, in their order.
    """
    last, ahead = time.monotonic(), 0.0
    while window.is_open:
        while not keys.empty():
            live.press(keys.get())
        now = time.monotonic()
        if not live.paused:
            ahead += min(now - last, MAX_SECONDS_PER_PICTURE)
        last = now
        while ahead >= live.control_timestep:
            live.pose(1.0)  # a pull ends where the body has come to, however seldom it is shown
            live.step(window.pulls())
            ahead -= live.control_timestep
        share = ahead / live.control_timestep
        live.pose(share)
        window.show(_PICTURE, live.markers(share), live.text())
