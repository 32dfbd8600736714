"""Ctrl-C and SIGTERM at any moment: one line, 130 or 143, no process that goes on, no half file."""

import importlib.util
import os
import pathlib
import random
import signal
import subprocess
import sys
import time

import pytest

from arc_suite.cli.programs import PROGRAMS

TESTS = pathlib.Path(__file__).parents[1]
STATUSES = {signal.SIGINT: 130, signal.SIGTERM: 143}
BEGIN = "import arc_suite_command; print('begun', flush=True); arc_suite_command.main()"
TINY = ("--robot=tick", "--algorithm=tiny_studies:climb", "--steps=1000000")
NETWORK = ("--robot=tick", "--algorithm=ppo", "--steps=1000000")

# Flags of programs, and the file that they write.
COMMANDS = {
    "train": (NETWORK if importlib.util.find_spec("jax") else TINY, None),
    "study": (("tiny_studies:PAIR", "--jobs=2"), None),
    "benchmark": (("samples", "--algorithm=tiny_studies:climb", "--places=tick-walk", "--seeds=1"), None),
    "design": (("--around=tick", "--goal=speed", "--bodies=40", "--nopages", "--processes=2", "--output=a"), None),
    "collect": (("--robot=tick", "--episodes=40", "--num_envs=2"), None),
    "transfer": (("--families=random", "--output=a.csv"), "a.csv"),
    "evaluate": (("--robot=tick", "--episodes=20", "--json=a.json"), "a.json"),
    "style": (("--robot=tick", "--episodes=4", "--save=a.npz"), "a.npz"),
    "render": (("--robot=tick", "--policy=zero", "--steps=1000", "--output=a.mp4"), "a.mp4"),
    "animate": (("--robot=queen", "--output=a.glb"), "a.glb"),
    "build_model": (("--robot=queen", "--output=a.xml"), "a.xml"),
    "import": ((str(TESTS / "fixtures" / "robots" / "go2_like.xml"), "--output=a.json"), "a.json"),
    "check": (("spider", "--walk"), None),
    "doctor": ((), None),
    "settings": ((), None),
}
if (TESTS.parent / "arc_suite" / "animation" / "web" / "viewer.js").exists():
    COMMANDS["play"] = (("--robot=all", "--output=a.html"), "a.html")
if importlib.util.find_spec("viser"):
    COMMANDS["studio"] = ((), None)


def interrupt(program, seconds, number, folder):
    """Send a signal to a program and its children some time after its first line of Python, as terminals do."""
    flags, output = COMMANDS[program]
    folder.mkdir()
    paths = (TESTS.parent, TESTS / "fixtures")
    environ = os.environ | {"HOME": str(folder / "home"), "PYTHONPATH": os.pathsep.join(map(str, paths))}
    process = subprocess.Popen(
        [sys.executable, "-c", BEGIN, program, *flags],
        cwd=folder,
        env=environ,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout.readline() == "begun\n"
    time.sleep(seconds)
    os.killpg(process.pid, number)
    printed, errors = process.communicate(timeout=120)
    place = f"{program}, {signal.Signals(number).name} after {seconds:.2f} s: {process.returncode}, {errors!r}"
    # Python's own end, after the work, gives signals their default effect.
    has_ended_before = process.returncode in (0, -number)
    if has_ended_before:
        assert errors == "", place
    else:
        assert process.returncode == STATUSES[number], place
        if number == signal.SIGTERM and "stopped; the same command resumes it" in printed:
            assert errors == "", place
        else:
            assert errors.startswith("arc-suite") and "interrupted" in errors and errors.count("\n") == 1, place
    assert wait_for_processes(folder) == [], place
    files = [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]
    assert [path for path in files if path.name.startswith(".") and "home" not in path.parts] == [], place
    if output is not None:
        assert (folder / output).exists() == has_ended_before, place


def wait_for_processes(folder):
    """Return the processes that still work in a folder after a while."""
    deadline = time.monotonic() + 10.0
    while True:
        found = [path for path in pathlib.Path("/proc").glob("[0-9]*/cwd") if works_in(path, folder)]
        if not found or time.monotonic() > deadline:
            return found
        time.sleep(0.05)


def works_in(path, folder):
    try:
        return os.readlink(path) == str(folder)
    except OSError:  # it has ended, or belongs to somebody else
        return False


def cases(count):
    draws = random.Random(0)
    order = count // len(COMMANDS) * [*COMMANDS] + draws.sample(list(COMMANDS), count % len(COMMANDS))
    return [(program, draws.uniform(0.0, 4.0), draws.choice(list(STATUSES))) for program in order]


@pytest.mark.skipif(not os.path.exists("/proc/self/cwd"), reason="reads Linux's /proc")
@pytest.mark.parametrize(("program", "seconds", "number"), [("render", 3.0, signal.SIGINT), *cases(2)])
def test_an_interrupt_is_one_line_and_leaves_nothing_half_done(program, seconds, number, tmp_path):
    interrupt(program, seconds, number, tmp_path.resolve() / "work")


@pytest.mark.release
@pytest.mark.skipif(not os.path.exists("/proc/self/cwd"), reason="reads Linux's /proc")
def test_interrupts_at_random_moments_of_all_programs(tmp_path):
    for index, (program, seconds, number) in enumerate(cases(len(COMMANDS))):
        interrupt(program, seconds, number, tmp_path.resolve() / f"{index}")


def test_all_programs_are_interrupted_here():
    """Except those that need a window, a run or a motion, or print alone, or perhaps an extra or `make web`."""
    assert set(PROGRAMS) - set(COMMANDS) - {"studio", "play"} == {"view", "export", "motion", "card", "completion"}


# What becomes of an interrupt that foreign code receives: name of a function, and the line.
LOSSES = """
import atexit, os, signal, time
from arc_suite.cli import program

def plain():
    os.kill(os.getpid(), NUMBER)

def resumed():
    with program.resumable("runs/here"):
        os.kill(os.getpid(), NUMBER)

def converted():
    try:
        os.kill(os.getpid(), NUMBER)
    except KeyboardInterrupt:
        raise RuntimeError("of a callback") from None

def described():
    try:
        os.kill(os.getpid(), NUMBER)
    except BaseException as error:  # as PyMJCF does
        raise type(error)("during initialization of attribute 'class' of element <motor>: ") from None

class Destructible:
    def __del__(self):
        os.kill(os.getpid(), NUMBER)

def lost():
    Destructible()
    time.sleep(60.0)

def late():
    atexit.register(os.kill, os.getpid(), NUMBER)
"""


@pytest.mark.parametrize("number", STATUSES)
@pytest.mark.parametrize("loss", ["plain", "resumed", "converted", "described", "lost", "late"])
def test_interrupts_are_not_lost(loss, number, tmp_path):
    script = tmp_path / "work.py"
    script.write_text(f"NUMBER = {int(number)}\n{LOSSES}\nprogram.guard({loss}, 'arc-suite study')\n")
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, timeout=60)
    reason = "interrupted; the same command resumes runs/here" if loss == "resumed" else "interrupted"
    assert (done.returncode, done.stderr) == (STATUSES[number], f"arc-suite study: {reason}\n")


@pytest.mark.parametrize("number", STATUSES)
@pytest.mark.parametrize("command", [("-m", "arc_suite"), ("-c", "import arc_suite_command; arc_suite_command.main()")])
def test_imports_can_be_interrupted(command, number, tmp_path):
    """A module that the package imports is in the way: it sends the signal."""
    (tmp_path / "mujoco.py").write_text(f"import os\nos.kill(os.getpid(), {int(number)})\n")
    paths = os.pathsep.join([str(tmp_path), str(TESTS.parent)])
    environ = os.environ | {"PYTHONPATH": paths}
    done = subprocess.run([sys.executable, *command, "doctor"], env=environ, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (STATUSES[number], "", "arc-suite: interrupted\n")
