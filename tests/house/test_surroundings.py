"""The suite keeps to itself: no files, no network, no side effects."""

import os
import subprocess
import sys

import interpreters
import pytest

# Uses everything, with an accident that MuJoCo warns of, while the network is cut off.
SCRIPT = """
import socket
def refuse(*args, **kwargs):
    raise AssertionError("the network was used")
socket.socket.connect = socket.create_connection = socket.getaddrinfo = refuse
import absl.logging, gymnasium
import numpy as np
import arc_suite
absl.logging.set_verbosity("error")  # of MuJoCo's warnings
jobs = [(robot, "walk", {}) for robot in arc_suite.TASKS_BY_DOMAIN] + [("tick", "steer", {"arena": "bumps"})]
for robot, task, settings in jobs:
    environment = arc_suite.load(robot, task, settings | {"on_divergence": "truncate"})
    environment.reset()
    environment.physics.data.qvel[:] = np.nan
    assert environment.step(np.zeros(environment.action_spec().shape)).last()
    environment.physics.forward()
    environment.physics.render(32, 32)
    kwargs = {"task_kwargs": settings, "render_mode": "rgb_array", "width": 32, "height": 32}
    env = gymnasium.make(f"arc_suite/{robot}-{task}-v0", **kwargs)
    env.reset(); env.step(env.action_space.sample()); env.render(); env.close()
    envs = gymnasium.make_vec(f"arc_suite/{robot}-{task}-v0", num_envs=2, **kwargs)
    envs.reset()
    envs.batch.data.qpos[0, 0] = np.inf
    envs.step(envs.action_space.sample()); envs.render(); envs.close()
"""


@pytest.mark.long
def test_no_file_appears_and_nothing_is_downloaded(tmp_path):
    home, work = tmp_path / "home", tmp_path / "work"
    home.mkdir(), work.mkdir()
    surroundings = {name: None for name in os.environ if name.startswith("XDG_")}
    surroundings |= {"HOME": str(home), "PYTHONDONTWRITEBYTECODE": "1"}
    interpreters.printed(SCRIPT, folder=work, **surroundings)
    assert sorted(tmp_path.rglob("*")) == [home, work]


# What an import may change: MUJOCO_GL, and what it registers with Gymnasium.
IMPORT = """
import locale, logging, os, random, signal, sys, threading, warnings
import dm_control.suite, gymnasium, numpy
def state():
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGCHLD)}
    return {
        "environ": dict(os.environ), "path": list(sys.path), "folder": os.getcwd(), "signals": handlers,
        "filters": list(warnings.filters), "print": numpy.get_printoptions(), "errors": numpy.geterr(),
        "random": random.getstate(), "numpy": str(numpy.random.get_state()), "locale": locale.setlocale(locale.LC_ALL),
        "level": logging.getLogger().level, "handlers": list(logging.getLogger().handlers), "hook": sys.excepthook,
        "threads": threading.active_count(), "recursion": sys.getrecursionlimit(),
        "ids": sorted(name for name in gymnasium.registry if not name.startswith("arc_suite/")),
    }
before = state()
import arc_suite
print([name for name, value in state().items() if value != before[name]])
"""


def test_import_has_no_side_effect_but_registration():
    assert interpreters.printed(IMPORT, MUJOCO_GL="egl") == ["[]"]


MAKES = "import gymnasium, arc_suite; gymnasium.make('arc_suite/tick-walk-v0')"


@pytest.mark.parametrize(
    ("script", "file", "text"),
    [
        ("play.py", "gym.py", "def f(:"),
        ("gym.py", "gym.py", MAKES),
        ("play.py", "gym/__init__.py", "raise RuntimeError('mine')"),
        ("play.py", "shimmy.py", ""),
        ("play.py", "mujoco.py", ""),
    ],
)
def test_a_users_file_that_hides_a_package_is_named(script, file, text, tmp_path):
    (tmp_path / script).write_text(MAKES)
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).write_text(text)
    environ = os.environ | {"PYTHONPATH": str(interpreters.ROOT)}
    done = subprocess.run([sys.executable, script], cwd=tmp_path, env=environ, capture_output=True, text=True)
    line = f"ImportError: cannot import arc_suite: {tmp_path / file} hides a package of the same name: rename it"
    assert done.stderr.splitlines()[-1] == line


def test_a_users_file_that_hides_nothing_is_not_named(tmp_path):
    (tmp_path / "gym.py").write_text("")
    assert interpreters.printed(f"{MAKES}; print('made')", folder=tmp_path) == ["made"]
