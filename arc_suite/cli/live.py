"""A live view: episodes in a window in real time; keys set the command, the mouse pulls at the body."""

import queue
import time
from collections.abc import Callable

import glfw
import mujoco
import numpy as np

from arc_suite.envs.window import Window
from arc_suite.markers import Marker
from arc_suite.simulation.pictures import Decorated

_PRESS = 0.25  # of the body's own speed, by which an arrow changes the command
_ARROWS = {
    glfw.KEY_UP: (_PRESS, 0.0, 0.0),
    glfw.KEY_DOWN: (-_PRESS, 0.0, 0.0),
    glfw.KEY_LEFT: (0.0, 0.0, _PRESS),
    glfw.KEY_RIGHT: (0.0, 0.0, -_PRESS),
}
_ENDS = ("start", "end")  # of a debug marker
_PICTURE = 1.0 / 60.0  # s
_LONGEST = 0.5  # s of simulated time for one picture; a slower machine shows slow motion


class Live:
    """Episodes one after another, and their pose in pictures.

    Attributes:
        paused: whether time stands still.
        wanted: (3,) command set by the arrow keys; None before the first, and in a task without a command.
        shown: the decorated body of the window.
    """

    def __init__(self, environment, act: Callable):
        """Start the first episode.

        Args:
            environment: of `arc_suite.load`.
            act: maps a `TimeStep` to an action.
        """
        self._environment, self._act = environment, act
        self._steered = environment.task.definition.commands.get("command") == 3
        self.paused, self.wanted = False, None
        scene = environment.task.definition.scene
        self.shown = Decorated.from_body(scene.body, scene.arena)
        self.control_timestep = environment.control_timestep()
        self.restart()

    def restart(self) -> None:
        """Start the next episode, with the command that the arrow keys have set."""
        self._timestep, self._earned, self._steps = self._environment.reset(), 0.0, 0
        self._command()
        self._before, self._markers = self._qpos(), 2 * (self._asked(),)

    def press(self, key: int) -> None:
        """Pause, restart or set the command by a key, one of GLFW's numbers."""
        if key == glfw.KEY_SPACE:
            self.paused = not self.paused
        elif key == glfw.KEY_BACKSPACE:
            self.restart()
        elif key in _ARROWS and self._steered:
            wanted = np.zeros(3) if self.wanted is None else self.wanted
            self.wanted = (wanted + _ARROWS[key]).clip(-1.0, 1.0)
            self._command()

    def step(self, forces: np.ndarray) -> None:
        """Advance by a control step, or start the next episode where the last one has ended.

        Args:
            forces: (bodies, 6) force, N, and torque, N m, on every body of the model, in the world.
        """
        if self._timestep.last():
            self.restart()
            return
        self._before = self._qpos()
        self._environment.physics.data.xfrc_applied[:] = forces
        self._timestep = self._environment.step(self._act(self._timestep))
        self._earned += self._timestep.reward
        self._steps += 1
        self._markers = self._markers[1], self._asked()

    def pose(self, share: float) -> None:
        """Pose the picture at a share, 0 to 1, of the latest control step."""
        model, data = self.shown.model.ptr, self.shown.data.ptr
        way, now = np.empty(model.nv), self._before.copy()
        mujoco.mj_differentiatePos(model, way, 1.0, self._before, self._qpos())
        mujoco.mj_integratePos(model, now, way, share)
        data.qpos[:], data.qvel[:] = now, self._environment.physics.data.qvel
        data.mocap_pos[:] = self._environment.physics.data.mocap_pos
        mujoco.mj_forward(model, data)

    def markers(self, share: float) -> list[Marker]:
        """Return the task's debug markers at a share, 0 to 1, of the latest control step."""
        before, now = self._markers
        if [each._replace(start=0, end=0) for each in before] != [each._replace(start=0, end=0) for each in now]:
            return now
        return [
            new._replace(**{end: (1.0 - share) * getattr(old, end) + share * getattr(new, end) for end in _ENDS})
            for old, new in zip(before, now, strict=True)
        ]

    def text(self) -> str:
        """Return a line about the episode."""
        told = [f"return {self._earned:.0f} in {self._steps * self.control_timestep:.1f} s"]
        if self.wanted is not None:
            told.append("forward {:+.2f}, turn {:+.2f}".format(*self.wanted[[0, 2]]))
        return ", ".join(told + ["paused"] * self.paused)

    def _command(self) -> None:
        if self.wanted is not None:
            self._environment.command("command", self.wanted)

    def _asked(self) -> list[Marker]:
        return self._environment.task.markers(self._environment.physics)

    def _qpos(self) -> np.ndarray:
        return self._environment.physics.data.qpos.copy()


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
            ahead += min(now - last, _LONGEST)
        last = now
        while ahead >= live.control_timestep:
            live.pose(1.0)  # a pull ends where the body has come to, however seldom it is shown
            live.step(window.pulls())
            ahead -= live.control_timestep
        share = ahead / live.control_timestep
        live.pose(share)
        window.show(_PICTURE, live.markers(share), live.text())
