"""The live view: what keys and the mouse do, its pace, and the real window where there is an X server to be had."""

import contextlib
import os
import queue
import shutil
import subprocess
import sys
import types

import glfw
import mujoco
import numpy as np
import programs
import pytest

import arc_suite
from arc_suite.animation.cli import live
from arc_suite.envs import window
from arc_suite.policies import alone, policy


def playing(task="steer"):
    environment = arc_suite.load("tick", task, {"random": 0})
    preset = "steered" if task == "steer" else "tuned"
    return environment, live.Live(environment, alone(policy("cpg", "tick", preset)))


class Viewer:
    """Stands in for MuJoCo's, and is closed after some pictures; each takes a while to come."""

    def __init__(self, pictures, seconds=1.0 / 60.0, at=None):
        self.left, self.seconds, self.at = pictures, seconds, at or {}
        self.time, self.texts, self.shown = 0.0, [], 0
        self.perturb, self.cam = mujoco.MjvPerturb(), mujoco.MjvCamera()
        self.user_scn = mujoco.MjvScene(mujoco.MjModel.from_xml_string("<mujoco/>"), 10)

    def is_running(self):
        return self.shown < self.left

    def lock(self):
        return contextlib.nullcontext()

    def set_texts(self, text):
        self.texts.append(text[2])

    def sync(self):
        self.shown += 1
        self.time += self.seconds
        self.at.get(self.shown, lambda: None)()

    def close(self):
        self.left = 0


def opened(monkeypatch, shown, viewer=None, camera_id=-1):
    """A window whose viewer is a stand-in, and time the viewer's."""
    viewer = viewer or Viewer(1)
    launched = types.SimpleNamespace(launch_passive=lambda model, data, **flags: viewer)
    monkeypatch.setattr(mujoco, "viewer", launched, raising=False)
    monkeypatch.setattr("arc_suite.simulation.opengl.require_window", lambda instead: None)
    clock = types.SimpleNamespace(monotonic=lambda: viewer.time, sleep=lambda seconds: None)
    monkeypatch.setattr(window, "time", clock), monkeypatch.setattr(live, "time", clock)
    return window.Window(shown.shown, camera_id)


@pytest.fixture
def play(monkeypatch):
    def play(shown, viewer, keys=None):
        live.play(opened(monkeypatch, shown, viewer), shown, keys or queue.SimpleQueue())

    return play


def test_it_keeps_real_time_where_the_machine_is_not_slow(play):
    for seconds in (1.0 / 60.0, 0.02, 0.3):
        environment, shown = playing()
        play(shown, Viewer(round(2.0 / seconds) + 1, seconds))
        assert environment.physics.time() == pytest.approx(2.0, abs=0.35 if seconds > 0.05 else 0.051)
    environment, shown = playing()
    play(shown, Viewer(4, 5.0))
    assert environment.physics.time() == pytest.approx(3 * 0.5)


def test_pictures_lie_between_control_steps():
    environment, shown = playing("walk")
    for _ in range(20):
        shown.step(np.zeros((environment.physics.model.nbody, 6)))
    poses = []
    for share in (0.0, 0.5, 1.0):
        shown.pose(share)
        poses.append(shown.shown.data.qpos.copy())
    np.testing.assert_allclose(poses[2], environment.physics.data.qpos, atol=1e-12)
    np.testing.assert_allclose(poses[1][:3], 0.5 * (poses[0] + poses[2])[:3], atol=1e-12)
    np.testing.assert_allclose(poses[1][7:], 0.5 * (poses[0] + poses[2])[7:], atol=1e-12)
    assert abs(poses[2] - poses[0]).max() > 1e-3


def test_space_pauses_and_backspace_restarts(play):
    environment, shown = playing()
    keys = queue.SimpleQueue()
    at = {
        30: lambda: keys.put(glfw.KEY_SPACE),
        90: lambda: keys.put(glfw.KEY_SPACE),
        150: lambda: keys.put(glfw.KEY_BACKSPACE),
    }
    viewer = Viewer(152, at=at)
    play(shown, viewer, keys)
    assert viewer.texts[29].startswith("return") and "paused" not in viewer.texts[29]
    assert len(set(viewer.texts[31:90])) == 1 and viewer.texts[60].endswith("paused")
    assert viewer.texts[91:150][-1] != viewer.texts[91]
    assert float(viewer.texts[-1].split()[3]) <= 0.1


def test_arrows_command():
    environment, shown = playing()
    wanted = lambda: environment.task.memory.core.desired  # noqa: E731
    assert shown.desired is None  # the task's own schedule
    for key in (glfw.KEY_UP, glfw.KEY_UP, glfw.KEY_LEFT):
        shown.press(key)
    np.testing.assert_array_equal(wanted(), (0.5, 0.0, 0.25))
    assert "forward +0.50, turn +0.25" in shown.text()
    shown.restart()
    np.testing.assert_array_equal(wanted(), (0.5, 0.0, 0.25))
    for _ in range(9):
        shown.press(glfw.KEY_DOWN)
    for _ in range(2):
        shown.press(glfw.KEY_RIGHT)
    np.testing.assert_array_equal(wanted(), (-1.0, 0.0, -0.25))


def test_markers_of_the_task_are_shown(play):
    environment, shown = playing()
    shown.press(glfw.KEY_UP)
    viewer = Viewer(40)
    play(shown, viewer)
    markers = environment.task.markers(environment.physics)
    assert viewer.user_scn.ngeom == len(markers) == 2  # no arrow turns
    before, middle, after = (shown.markers(share)[1].end for share in (0.0, 0.5, 1.0))
    np.testing.assert_allclose(middle, 0.5 * (before + after))
    np.testing.assert_allclose(after, markers[1].end)
    assert (before != after).any()


def test_arrows_do_nothing_where_the_task_takes_no_command():
    _, shown = playing("walk")
    shown.press(glfw.KEY_UP)
    assert shown.desired is None and "forward" not in shown.text()


def test_the_mouse_pulls_at_the_body(monkeypatch):
    environment, shown = playing("walk")
    pulled = opened(monkeypatch, shown, viewer := Viewer(1))
    shown.pose(1.0)
    model, data = shown.shown.model.ptr, shown.shown.data.ptr
    perturb, scene = viewer.perturb, mujoco.MjvScene(model, 1000)
    assert not pulled.pulls().any()
    options, camera = mujoco.MjvOption(), mujoco.MjvCamera()
    mujoco.mjv_updateScene(model, data, options, perturb, camera, mujoco.mjtCatBit.mjCAT_ALL, scene)
    perturb.select = model.body("torso").id
    mujoco.mjv_initPerturb(model, data, scene, perturb)
    perturb.active, perturb.refselpos = mujoco.mjtPertBit.mjPERT_TRANSLATE, data.xipos[1] + (0.0, 0.5, 0.0)
    forces = pulled.pulls()
    assert forces[1, 1] > 0.0 and not forces[2:].any()
    before = environment.physics.data.qpos[1]
    for _ in range(10):
        shown.step(pulled.pulls())
        shown.pose(1.0)
    assert environment.physics.data.qpos[1] - before > 0.01
    perturb.active = 0
    shown.step(pulled.pulls())
    assert not environment.physics.data.xfrc_applied.any()


def test_a_pull_follows_the_body_between_pictures(play):
    """However slow the display is, the force is that of where the body stands at each control step."""
    environment, shown = playing("walk")
    forces, step = [], shown.step
    shown.step = lambda pulled: (forces.append(pulled[1, 1]), step(pulled))
    shown.pose(1.0)
    viewer, model, data = Viewer(4, 0.4), shown.shown.model.ptr, shown.shown.data.ptr
    viewer.perturb.select, viewer.perturb.active = model.body("torso").id, mujoco.mjtPertBit.mjPERT_TRANSLATE
    viewer.perturb.refselpos, viewer.perturb.localmass = data.xipos[1] + (0.0, 0.2, 0.0), 0.08
    play(shown, viewer)
    assert len(forces) == 24
    assert len(set(forces)) == 24


def test_a_window_begins_with_the_camera_that_is_named_and_stays_closed(monkeypatch):
    _, shown = playing("walk")
    model = shown.shown.model.ptr
    for camera_id, index in (("profile", model.camera("profile").id), (1, 1), (-1, -1)):
        begun = opened(monkeypatch, shown, viewer := Viewer(9), camera_id)
        assert viewer.cam.fixedcamid == index
        assert (viewer.cam.trackbodyid == model.body("torso").id) == (index == -1)
    begun.show(0.05)
    begun.close(), begun.close()
    begun.show(0.05)
    assert not begun.is_open and viewer.shown == 1


def test_a_fall_begins_the_next_episode():
    environment = arc_suite.load("tick", "walk", {"random": 0, "time_limit": 0.5})
    shown = live.Live(environment, alone(policy("zero", "tick")))
    for _ in range(10):
        shown.step(np.zeros((environment.physics.model.nbody, 6)))
    assert environment.physics.time() == pytest.approx(0.5)
    shown.step(np.zeros((environment.physics.model.nbody, 6)))
    assert environment.physics.time() == 0.0


def run(code, **environment):
    kept = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, *code]
    return subprocess.run(command, env=kept | environment, capture_output=True, text=True, timeout=300)


@pytest.mark.slow
def test_without_a_display_a_line_says_what_does_without():
    done = run(["-m", "arc_suite", "view", "--robot=tick"])
    programs.refused(done, "arc-suite view: ")
    assert "arc-suite render -o walk.html" in done.stderr


IN_A_WINDOW = """
import sys
import glfw, gymnasium, numpy as np
from arc_suite.animation.cli import live
from arc_suite.cli import program
from arc_suite.envs import window

class Closed(window.Window):
    def __init__(self, shown, pressed, **kwargs):
        super().__init__(shown, pressed=pressed, **kwargs)
        self.poses, self.press = [], pressed
    def show(self, *args):
        super().show(*args)
        self.poses.append(self._data.qpos.copy())
        if len(self.poses) == 8:
            self.press(glfw.KEY_UP)
        if len(self.poses) == 30:
            print(abs(self.poses[-1] - self.poses[0]).max() > 0.01)
            self.close()

env = gymnasium.make("arc_suite/tick-walk-v0", render_mode="human", camera_id="profile")
env.reset(seed=0)
for _ in range(10):
    env.step(np.zeros(18))
human = env.unwrapped._window
print(human.is_open, env.render())
env.close()
print(human.is_open)
sys.modules["arc_suite.envs.window"].Window = Closed
from arc_suite.animation.cli import view
program.run(view.main, "view", ["--robot=tick", "--task=steer"])
"""


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("Xvfb"), reason="no Xvfb here: Debian's package xvfb")
def test_the_real_window_of_an_environment_and_of_the_view():
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "640x480x24"], pass_fds=[write], stderr=subprocess.DEVNULL
    )
    try:
        os.close(write)
        display = os.read(read, 16).decode().strip()
        done = run(["-c", IN_A_WINDOW], DISPLAY=f":{display}")
    finally:
        server.terminate()
        server.wait()
        os.close(read)
    assert done.stdout == "True None\nFalse\nTrue\n", done.stderr
    assert done.returncode == 0
