"""Rendering: one context for all, next to other users of OpenGL, and one line where OpenGL is missing."""

import concurrent.futures
import errno
import os
import sys

import interpreters
import numpy as np
import pytest

import arc_suite
from arc_suite import models
from arc_suite.robots import ROBOTS
from arc_suite.simulation import opengl, pictures

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
    except arc_suite.simulation.opengl.RenderingUnavailable as error:
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
UNSET = dict.fromkeys(("DISPLAY", "WAYLAND_DISPLAY", "MUJOCO_GL", "PYOPENGL_PLATFORM", "EGL_LOG_LEVEL"))
EGL = {"MUJOCO_GL": "egl"}
FAST = pictures.QUALITIES["fast"]
PICTURE = "picture (48, 64, 3)"
NO_LIBRARY, NO_EGL = "the OpenGL library is missing", "Cannot initialize a headless EGL display"
NO_DISPLAY = "(65550) b'X11: The DISPLAY environment variable is missing'"
UNKNOWN = (
    "Environment variable MUJOCO_GL must be one of ['', '0', '1', 'disable', 'disabled', 'egl', 'enable', 'enabled', "
    "'false', 'glfw', 'off', 'on', 'osmesa', 'true']: got 'vulkan'"
)
OTHER_PLATFORM = (
    "Cannot use EGL rendering platform. The PYOPENGL_PLATFORM environment variable is set to 'glx' "
    "(should be either unset or 'egl')"
)


def cannot(cause, chosen="", remedy=REMEDY):
    """The error of a picture for a cause, with a value of MUJOCO_GL."""
    return f"RenderingUnavailable: cannot render{chosen and f' with MUJOCO_GL={chosen}'}: {cause}; {remedy}"


DISABLED = "RenderingUnavailable: cannot render: MUJOCO_GL=disable turns it off; unset it, or set MUJOCO_GL=egl"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sitecustomize", "variables", "changed", "outcome"),
    [
        ("", {}, EGL, PICTURE),
        ("", EGL, {}, PICTURE),
        ("", {"DISPLAY": ":9876"}, {}, PICTURE),
        (WITHOUT_LIBRARIES, {}, {}, cannot(NO_LIBRARY)),
        (WITHOUT_LIBRARIES, EGL, {}, cannot(NO_LIBRARY, "egl")),
        ("", NO_DRIVER, EGL, cannot(NO_EGL, "egl")),
        ("", NO_DRIVER | EGL, {}, cannot(NO_EGL, "egl")),
        ("", {"MUJOCO_GL": "disable"}, {}, DISABLED),
        ("", {"MUJOCO_GL": "glfw"}, {}, cannot(NO_DISPLAY, "glfw")),
        ("", {"MUJOCO_GL": "vulkan"}, {}, cannot(UNKNOWN, "vulkan", "unset it, or set MUJOCO_GL=egl")),
        ("", EGL | {"PYOPENGL_PLATFORM": "glx"}, {}, cannot(OTHER_PLATFORM, "egl", "unset PYOPENGL_PLATFORM")),
    ],
)
def test_egl_where_no_display_answers_and_what_is_missing(tmp_path, sitecustomize, variables, changed, outcome):
    """The user's choice stays, and without OpenGL everything is simulated."""
    (tmp_path / "sitecustomize.py").write_text(sitecustomize)
    options, variables = ("-W", "default::UserWarning"), UNSET | variables
    lines = interpreters.printed(SCRIPT, folder=tmp_path, options=options, **variables)
    assert lines == [f"changed {changed} removed []", "reward True", outcome, outcome, "reward True"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("order", "variables"),
    [(("arc_suite", "mujoco, dm_control.suite"), {}), (("dm_control.suite, mujoco", "arc_suite"), EGL)],
)
def test_renderers_of_others_work_where_this_import_comes_first(order, variables):
    code = f"""
import {order[0]}
import {order[1]}
print(dm_control.suite.load("cartpole", "swingup").physics.render(24, 32).shape)
model = mujoco.MjModel.from_xml_string("<mujoco/>")
with mujoco.Renderer(model, 24, 32) as renderer:
    print(renderer.render().shape)
"""
    assert interpreters.printed(code, **UNSET | variables) == ["(24, 32, 3)"] * 2


@pytest.mark.parametrize(
    "error",
    [
        MemoryError("no memory for a framebuffer"),
        OSError(errno.EMFILE, "Too many open files"),
        RuntimeError("can't start new thread"),
    ],
)
def test_what_no_package_cures_names_none(error):
    with pytest.raises(opengl.RenderingUnavailable) as caught, opengl._errors():
        raise error
    assert str(caught.value).endswith(str(error)) and "apt-get" not in str(caught.value)


@pytest.mark.slow
def test_where_there_is_no_egl_the_remedy_is_another(monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setenv("MUJOCO_GL", "egl")
    remedy = ": egl; unset MUJOCO_GL: pictures are drawn by GLFW here$"
    with pytest.raises(opengl.RenderingUnavailable, match=remedy), opengl._errors():
        raise RuntimeError("invalid value for environment variable MUJOCO_GL: egl")


def test_import_opens_nothing():
    code = (
        "import sys, threading, arc_suite, dm_control.suite\n"
        "environment = arc_suite.load('tick', 'walk')\n"
        "print(threading.active_count(), sorted(m for m in sys.modules if m.startswith('dm_control._render')))\n"
        "environment.physics.render(32, 32)\n"
        "print(threading.active_count(), sys.modules['dm_control._render'].BACKEND)"
    )
    assert interpreters.printed(code) == ["1 ['dm_control._render']", "2 egl"]


# Draws next to other users of OpenGL in this process, and leaves all of it to the interpreter's exit.
NEIGHBORS = """
import sys
if sys.argv[1] == "first":
    import dm_control.suite
import arc_suite
import dm_control.suite
import numpy as np
other = dm_control.suite.load("cartpole", "swingup", {"random": 0}); other.reset()
environment = arc_suite.load("tick", "walk", {"random": 0}); environment.reset()
pictures = [(environment.physics.render(48, 64), other.physics.render(48, 64)) for _ in range(3)]
for ours, others in pictures:
    assert np.array_equal(ours, pictures[0][0]) and np.array_equal(others, pictures[0][1])
assert pictures[0][0].std() > 5 < pictures[0][1].std()
import dm_control._render
print(dm_control._render.BACKEND)
"""


@pytest.mark.long
@pytest.mark.parametrize("order", ["first", "last"])
def test_dm_control_draws_in_the_same_process(order):
    assert interpreters.printed(NEIGHBORS, order, **EGL) == ["egl"]


@pytest.mark.long
def test_pictures_are_those_of_a_context_of_ones_own():
    from dm_control.mujoco import Physics  # after arc_suite, which chooses the backend

    environments = [arc_suite.load(robot, "walk", {"random": 0}) for robot in ("queen", "tick")]
    for environment in environments:
        environment.reset()
    for height, width in ((120, 60), (60, 120)):  # grows in one direction, then in the other
        for environment in environments:
            own = Physics.from_xml_string(models.assemble(environment.task.body, decorated=True).to_xml_string())
            drawing = own.model.vis.quality
            (drawing.numslices, drawing.numstacks), drawing.shadowsize = FAST.faces, FAST.shadows
            drawing.offsamples = 0
            own.set_state(environment.physics.get_state())
            own.forward()
            drawn = own.render(FAST.scale * height, FAST.scale * width, "portrait")
            picture = environment.physics.render(height, width, "portrait")
            np.testing.assert_array_equal(picture, pictures.shrink(drawn, FAST.scale))
            picture = environment.physics.render(height, width, "portrait", depth=True)
            np.testing.assert_array_equal(picture, own.render(height, width, "portrait", depth=True))
            own.free()


@pytest.mark.long
def test_threads_draw_what_one_thread_draws():
    def pictures(robot):
        environment = arc_suite.load(robot, "walk", {"random": 0})
        environment.reset()
        size = environment.action_spec().shape
        return [(environment.step(np.zeros(size)).reward, environment.physics.render(48, 64)) for _ in range(3)]

    robots = [*ROBOTS]
    with concurrent.futures.ThreadPoolExecutor(len(robots)) as pool:
        together = list(pool.map(pictures, robots))
    for robot, drawn in zip(robots, together, strict=True):
        for (reward, picture), (own_reward, own_picture) in zip(drawn, pictures(robot), strict=True):
            assert reward == own_reward
            np.testing.assert_array_equal(picture, own_picture)


def test_a_callback_may_draw():
    environment = arc_suite.load("tick", "walk")
    environment.reset()
    inner = []
    environment.physics.render(48, 64, scene_callback=lambda *_: inner.append(environment.physics.render(24, 32)))
    assert inner[0].shape == (24, 32, 3)


@pytest.mark.slow
def test_pictures_while_the_interpreter_ends_are_refused():
    code = (
        "import atexit, sys, arc_suite\n"
        "environment = arc_suite.load('tick', 'walk')\n"
        "def late():\n"
        "    try: environment.physics.render(32, 32)\n"
        "    except arc_suite.simulation.opengl.RenderingUnavailable as error: print(error)\n"
        "atexit.register(late)\n"
        "environment.physics.render(32, 32)\n"
    )
    assert interpreters.printed(code) == ["cannot render: the interpreter is ending, and has closed OpenGL"]


def test_mistakes_in_drawing_arrive_as_they_are():
    environment = arc_suite.load("tick", "walk")
    environment.reset()
    with pytest.raises(ValueError, match="cannot both be `True`"):
        environment.physics.render(48, 64, depth=True, segmentation=True)
    with pytest.raises(ZeroDivisionError):
        environment.physics.render(48, 64, scene_callback=lambda *_: 1 / 0)
    assert environment.physics.render(48, 64).std() > 5


# Memory of many environments that render; what the interpreter and the first picture take is in the first figure.
MANY = """
import sys, arc_suite
def memory():  # MB
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * 4096 / 1e6
kept = []
for count in map(int, sys.argv[1:]):
    while len(kept) < count:
        kept.append(arc_suite.load("queen", "walk"))
        kept[-1].reset()
        kept[-1].physics.render(480, 640)
    print(count, memory())
"""


@pytest.mark.long
@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="reads memory from Linux's /proc")
def test_a_further_rendering_environment_costs_little():
    few, many = (float(line.split()[1]) for line in interpreters.printed(MANY, "2", "12"))
    assert (many - few) / 10 < 8


@pytest.mark.parametrize("device", ["99", "abc", "-1", "9" * 5000])
def test_devices_out_of_range(device):
    _, _, first, again, _ = interpreters.printed(SCRIPT, **EGL, MUJOCO_EGL_DEVICE_ID=device)
    assert first.startswith("RenderingUnavailable: cannot render: MUJOCO_EGL_DEVICE_ID: expected ")
    assert first.endswith(f", got {device[:300]!r}; unset it to take any device") and again == first


@pytest.mark.parametrize("device", ["", " "])
def test_an_empty_device_is_to_be_unset(device):
    _, _, first, again, _ = interpreters.printed(SCRIPT, **EGL, MUJOCO_EGL_DEVICE_ID=device)
    line = "cannot render: MUJOCO_EGL_DEVICE_ID is set, but empty; unset it to take any device"
    assert first == again == f"RenderingUnavailable: {line}"


LAUNCH = """
import io, sys
{imports}
environment = arc_suite.load("queen", "walk")
sys.stderr = io.StringIO()
try:
    viewer.launch(environment)
except arc_suite.simulation.opengl.RenderingUnavailable as error:
    print(error, sys.stderr.getvalue().count("Traceback"))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "imports",
    ["import arc_suite\nfrom dm_control import viewer", "from dm_control import viewer\nimport arc_suite"],
    ids=["later", "earlier"],
)
def test_the_viewer_of_dm_control_without_a_display_is_one_error_with_the_cure(imports):
    (line,) = interpreters.printed(LAUNCH.format(imports=imports), **UNSET, PYTHONWARNINGS="ignore")
    assert line == f"cannot open a window: {NO_DISPLAY}; arc-suite render --robot ROBOT -o walk.mp4 films a walk 0"
