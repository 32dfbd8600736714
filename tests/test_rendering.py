"""Importing, simulating and failing to render where OpenGL is missing, each in a process of its own."""

import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parent.parent

# Imports, simulates and renders, and prints what came of it.
SCRIPT = """
import os
before = dict(os.environ)
import arc_suite
changed = {name: value for name, value in os.environ.items() if before.get(name) != value}
print("changed", changed, "removed", sorted(set(before) - set(os.environ)))
environment = arc_suite.load("tick", "walk", {"random": 0})
environment.reset()
print("reward", environment.step([0.0] * 18).reward > 0)
for _ in range(2):
    try:
        print("picture", environment.physics.render(height=48, width=64).shape)
    except arc_suite.rendering.RenderingUnavailable as error:
        print(f"{type(error).__name__}: {error}")
print("reward", environment.step([0.0] * 18).reward > 0)
"""

# Stands in for a machine on which no OpenGL library is installed: Python finds none of them.
WITHOUT_LIBRARIES = """
import ctypes
load = ctypes.CDLL.__init__
def refuse(self, name, *args, **kwargs):
    if "GL" in str(name) or "OSMesa" in str(name):
        raise OSError(f"{name}: cannot open shared object file: No such file or directory")
    load(self, name, *args, **kwargs)
ctypes.CDLL.__init__ = refuse
"""

REMEDY = "on Debian, apt-get install libegl1 libgl1 libgl1-mesa-dri and set MUJOCO_GL=egl"
NO_DRIVER = {"__EGL_VENDOR_LIBRARY_DIRS": "/nonexistent"}  # libEGL loads, and finds nobody to draw


def run(tmp_path, sitecustomize="", **variables):
    """Runs the script without a display; returns its lines, none of them on standard error."""
    unset = ("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL", "PYOPENGL_PLATFORM", "EGL_LOG_LEVEL")
    environ = {name: value for name, value in os.environ.items() if name not in unset}
    (tmp_path / "sitecustomize.py").write_text(sitecustomize)
    environ |= {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])} | variables
    done = subprocess.run(
        [sys.executable, "-W", "default::UserWarning", "-c", SCRIPT], env=environ, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, ""), done.stderr
    return done.stdout.splitlines()


def lines(outcome, changed=None):
    return [f"changed {changed or {}} removed []", "reward True", outcome, outcome, "reward True"]


def test_chooses_egl_where_there_is_no_display(tmp_path):
    assert run(tmp_path) == lines("picture (48, 64, 3)", {"MUJOCO_GL": "egl"})


def test_users_choice_stays(tmp_path):
    assert run(tmp_path, MUJOCO_GL="egl") == lines("picture (48, 64, 3)")


def test_display_that_does_not_answer_gives_way_to_egl(tmp_path):
    assert run(tmp_path, DISPLAY=":9876") == lines("picture (48, 64, 3)")


@pytest.mark.parametrize(
    ("sitecustomize", "variables", "changed", "message"),
    [
        (WITHOUT_LIBRARIES, {}, None, f"cannot render: the OpenGL library is missing; {REMEDY}"),
        (
            WITHOUT_LIBRARIES,
            {"MUJOCO_GL": "egl"},
            None,
            f"cannot render with MUJOCO_GL=egl: the OpenGL library is missing; {REMEDY}",
        ),
        (
            "",
            NO_DRIVER,
            {"MUJOCO_GL": "egl"},
            f"cannot render with MUJOCO_GL=egl: Cannot initialize a headless EGL display.; {REMEDY}",
        ),
        (
            "",
            NO_DRIVER | {"MUJOCO_GL": "egl"},
            None,
            f"cannot render with MUJOCO_GL=egl: Cannot initialize a headless EGL display.; {REMEDY}",
        ),
        (
            "",
            {"MUJOCO_GL": "disable"},
            None,
            "cannot render: MUJOCO_GL=disable turns it off; unset it, or set MUJOCO_GL=egl",
        ),
        (
            "",
            {"MUJOCO_GL": "glfw"},
            None,
            "cannot render with MUJOCO_GL=glfw: (65550) b'X11: The DISPLAY environment variable is missing'; " + REMEDY,
        ),
        (
            "",
            {"MUJOCO_GL": "vulkan"},
            None,
            "cannot render with MUJOCO_GL=vulkan: Environment variable MUJOCO_GL must be one of ['', '0', '1', "
            "'disable', 'disabled', 'egl', 'enable', 'enabled', 'false', 'glfw', 'off', 'on', 'osmesa', 'true']: "
            f"got 'vulkan'.; {REMEDY}",
        ),
    ],
    ids=["no library", "egl, no library", "no driver", "egl, no driver", "disable", "glfw, no display", "unknown"],
)
def test_simulates_without_opengl_and_says_what_is_missing(tmp_path, sitecustomize, variables, changed, message):
    assert run(tmp_path, sitecustomize, **variables) == lines(f"RenderingUnavailable: {message}", changed)
