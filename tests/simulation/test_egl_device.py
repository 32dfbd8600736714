"""A device of EGL that there is not: the cause and the range of devices."""

import subprocess
import sys

import pytest

CODE = """
import arc_suite
environment = arc_suite.load("tick", "walk")
environment.reset()
try:
    environment.physics.render(24, 32)
except arc_suite.simulation.opengl.RenderingUnavailable as error:
    print(error)
"""


@pytest.mark.parametrize("device", ["99", "abc", "-1"])
def test_devices_out_of_range(device, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "egl")
    monkeypatch.setenv("MUJOCO_EGL_DEVICE_ID", device)
    printed = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=True).stdout
    assert printed.startswith("cannot render: MUJOCO_EGL_DEVICE_ID: expected ")
    assert printed.endswith(f", got {device!r}; unset it to take any device\n")
