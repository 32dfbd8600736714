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

_KEY_CHANGE = 0.25  # of the body's own speed, by which an arrow key changes the command
_ARROW_CHANGES = {  # of the velocity by command: forward, left, turn
    glfw.KEY_UP: (_KEY_CHANGE, 0.0, 0.0),
    glfw.KEY_DOWN: (-_KEY_CHANGE, 0.0, 0.0),
    glfw.KEY_LEFT: (0.0, 0.0, _KEY_CHANGE),
    glfw.KEY_RIGHT: (0.0, 0.0, -_KEY_CHANGE),
}
_PICTURE_SECONDS = 1.0 / 60.0


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
        elif key in _ARROW_CHANGES:
            command = np.zeros(3) if self.desired is None else self.desired
            self.command(command + _ARROW_CHANGES[key])

    def pose(self, share: float) -> None:
        """Pose the body in the window at a share, 0 to 1, of the latest control step."""
        simulation_data = self.environment.physics.data
        model = self.shown.model.ptr
        data = self.shown.data.ptr
        data.qpos[:] = self.qpos(share)
        data.qvel[:] = simulation_data.qvel
        data.mocap_pos[:] = simulation_data.mocap_pos
        mujoco.mj_forward(model, data)
        self.shown.darken(self.environment.task.failed_legs())

    def text(self) -> str:
        """Return a line about the episode."""
        parts = [f"return {self.episode_return:.0f} in {self.steps * self.control_timestep:.1f} s"]
        if self.desired is not None:
            forward, _, turn = self.desired
            parts.append(f"forward {forward:+.2f}, turn {turn:+.2f}")
        if self.paused:
            parts.append("paused")
        return ", ".join(parts)


def play(window: Window, live: Live, keys: queue.SimpleQueue) -> None:
    """Show episodes one after another in real time, until the window is closed.

    A picture lies between the poses at the start and at the end of a control step.

    Args:
        window: on `live.shown`.
        live: the episodes.
        keys: those that were pressed, in their order.
    """
    last_time = time.monotonic()
    time_ahead = 0.0  # s that have passed since the latest control step
    while window.is_open:
        while not keys.empty():
            live.press(keys.get())
        now = time.monotonic()
        if not live.paused:
            time_ahead += min(now - last_time, MAX_SECONDS_PER_PICTURE)
        last_time = now
        while time_ahead >= live.control_timestep:
            live.pose(1.0)  # the mouse pulls at the body where the simulation has it, even if no picture shows it
            live.step(window.pulls())
            time_ahead -= live.control_timestep
        share = time_ahead / live.control_timestep
        live.pose(share)
        window.show(_PICTURE_SECONDS, live.markers(share), live.text())
