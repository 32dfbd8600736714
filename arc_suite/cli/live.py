"""A live view: episodes in a window in real time, which keys steer and the mouse disturbs."""

import queue
import time
from collections.abc import Callable

import glfw
import mujoco
import numpy as np

from arc_suite.markers import Marker
from arc_suite.simulation.pictures import Decorated, geom_of

_PRESS = 0.25  # of the body's own speed, by which an arrow changes the command
_ARROWS = {
    glfw.KEY_UP: (_PRESS, 0.0, 0.0),
    glfw.KEY_DOWN: (-_PRESS, 0.0, 0.0),
    glfw.KEY_LEFT: (0.0, 0.0, _PRESS),
    glfw.KEY_RIGHT: (0.0, 0.0, -_PRESS),
}
_ENDS = ("start", "end")  # of a mark
_LONGEST = 0.5  # s that a picture may stand for: a machine that is slower shows slow motion


class Live:
    """An episode after another, which keys steer and the mouse disturbs; and its picture.

    Attributes:
        paused: whether time stands still.
        wanted: (3,) the command that arrows have set; None before the first, and in a task that takes none.
        shown: the decorated body, for a window.
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
        """Start the next episode; what arrows have set still holds."""
        self._timestep, self._earned, self._steps = self._environment.reset(), 0.0, 0
        self._command()
        self._before, self._marks = self._qpos(), 2 * (self._asked(),)

    def press(self, key: int) -> None:
        """Do what a key, of GLFW's numbers, asks for."""
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
        self._marks = self._marks[1], self._asked()

    def pose(self, share: float) -> None:
        """Let the picture show what is a share of the latest control step after its start, 0 to 1."""
        model, data = self.shown.model.ptr, self.shown.data.ptr
        way, now = np.empty(model.nv), self._before.copy()
        mujoco.mj_differentiatePos(model, way, 1.0, self._before, self._qpos())
        mujoco.mj_integratePos(model, now, way, share)
        data.qpos[:], data.qvel[:] = now, self._environment.physics.data.qvel
        data.mocap_pos[:] = self._environment.physics.data.mocap_pos
        mujoco.mj_forward(model, data)

    def marks(self, share: float) -> list[Marker]:
        """Return what the task asks for, a share of the latest control step after its start, 0 to 1."""
        before, now = self._marks
        if [mark._replace(start=0, end=0) for mark in before] != [mark._replace(start=0, end=0) for mark in now]:
            return now
        return [
            mark._replace(**{end: (1.0 - share) * getattr(old, end) + share * getattr(mark, end) for end in _ENDS})
            for old, mark in zip(before, now, strict=True)
        ]

    def text(self) -> str:
        """Return a line about the episode."""
        told = [f"return {self._earned:.0f} in {self._steps * self.control_timestep:.1f} s"]
        if self.wanted is not None:
            told.append("ahead {:+.2f}, turn {:+.2f}".format(*self.wanted[[0, 2]]))
        return ", ".join(told + ["paused"] * self.paused)

    def _command(self) -> None:
        if self.wanted is not None:
            self._environment.command("command", self.wanted)

    def _asked(self) -> list[Marker]:
        return self._environment.task.marks(self._environment.physics)

    def _qpos(self) -> np.ndarray:
        return self._environment.physics.data.qpos.copy()


def play(
    window, live: Live, keys: queue.SimpleQueue, rate: float = 60.0, clock=time.perf_counter, sleep=time.sleep
) -> None:
    """Show an episode after another in real time, until the window is closed.

    A picture lies between the poses at the start and at the end of a control step.

    Args:
        window: of `mujoco.viewer.launch_passive`, of the model that is shown.
        live: what is shown.
        keys: those that were pressed, in their order.
        rate: pictures a second.
        clock: tells the time, s.
        sleep: waits for some time, s.
    """
    pause, last, ahead = 1.0 / rate, clock(), 0.0
    while window.is_running():
        now = clock()
        while not keys.empty():
            live.press(keys.get())
        if not live.paused:
            ahead += min(now - last, _LONGEST)
        last = now
        with window.lock():
            while ahead >= live.control_timestep:
                live.pose(1.0)  # a pull ends where the body has come to, however seldom it is shown
                live.step(pulls(live.shown, window.perturb))
                ahead -= live.control_timestep
            live.pose(ahead / live.control_timestep)
            marks = live.marks(ahead / live.control_timestep)
            window.user_scn.ngeom = len(marks)
            for mark, geom in zip(marks, window.user_scn.geoms, strict=False):
                geom_of(mark, geom)
        window.set_texts((None, mujoco.mjtGridPos.mjGRID_BOTTOMLEFT, live.text(), None))
        window.sync()
        sleep(max(0.0, pause - (clock() - now)))


def pulls(shown: Decorated, perturb: mujoco.MjvPerturb) -> np.ndarray:
    """Return the forces and torques (bodies, 6) with which the mouse pulls at what is shown."""
    model, data = shown.model.ptr, shown.data.ptr
    data.xfrc_applied[:] = 0.0
    if perturb.active and perturb.select > 0:
        mujoco.mjv_applyPerturbForce(model, data, perturb)
    return data.xfrc_applied.copy()
