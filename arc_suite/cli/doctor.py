"""Examine this machine: can it simulate and render, and if not, what mends it.

  arc-suite doctor

Exit status 1 if something is wrong.
"""

import json
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from typing import NamedTuple

from arc_suite import versions
from arc_suite.cli.version import describe_suite
from arc_suite.simulation import opengl
from arc_suite.simulation.cores import usable_cores

_PICTURE_TIMEOUT = 120  # s, for the first picture
_PICTURE_CODE = "from arc_suite.cli import doctor; doctor.draw()"


class Finding(NamedTuple):
    """One line of the report.

    Attributes:
        subject: subject that was examined.
        state: state of the subject.
        remedy: for a problem; None if all is well.
    """

    subject: str
    state: str
    remedy: str | None = None


def main() -> int:
    """Print the report and return the exit status."""
    problems = 0
    for subject, state, remedy in examine():
        if remedy is None:
            print(f"{'ok':<8} {subject:<11} {state}", flush=True)
        else:
            problems += 1
            print(f"{'PROBLEM':<8} {subject:<11} {state}; {remedy}", flush=True)
    if problems == 0:
        print("all is well")
        return 0
    print(f"{problems} problem{'' if problems == 1 else 's'}")
    return 1


def examine() -> Iterator[Finding]:
    """Yield findings about the suite, system, packages, cores, OpenGL and pictures."""
    yield Finding("arc_suite", describe_suite().removeprefix("arc_suite "))
    yield Finding("system", f"{platform.platform()}, Python {platform.python_version()}")
    yield from _examine_packages()
    yield Finding("cores", f"{os.cpu_count()}; vector environments use {usable_cores()}")
    display = "a display" if opengl.has_display() else "no display"
    yield Finding("MUJOCO_GL", f"{os.environ.get('MUJOCO_GL', 'not set')}, {display}")
    yield _examine_picture()


def _examine_packages() -> Iterator[Finding]:
    remedies = {}
    for line in versions.problems():  # PACKAGE VERSION: REMEDY
        remedies[line.split()[0]] = line.partition(": ")[2]
    for package, required_version in versions.REQUIREMENTS.items():
        state = f"{versions.version_of(package) or 'not installed'}, made for {required_version}"
        yield Finding(package, state, remedies.get(package))


def _examine_picture() -> Finding:
    """Return whether another process can draw a picture: a driver's error may end the process that draws."""
    command = [sys.executable, "-c", _PICTURE_CODE]
    try:
        process = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=_PICTURE_TIMEOUT)
    except subprocess.TimeoutExpired:
        return Finding(
            "picture", f"none within {_PICTURE_TIMEOUT} s", "mend the OpenGL driver, or set MUJOCO_GL=osmesa"
        )
    if process.returncode == 0:
        return Finding("picture", json.loads(process.stdout.splitlines()[-1]))
    error_lines = process.stderr.strip().splitlines() or [f"the process ended with status {process.returncode}"]
    reason, _, remedy = error_lines[-1].partition("; ")
    return Finding("picture", reason, remedy or "mend the OpenGL driver, or set MUJOCO_GL to egl, osmesa or glfw")


def draw() -> None:
    """Draw a picture, and print what drew it, as JSON; the doctor runs this in another process."""
    from dm_control import _render

    from arc_suite.envs.dm import load

    physics = load("queen", "walk").physics
    try:
        picture = physics.render(48, 64)
    except opengl.RenderingUnavailable as error:
        sys.exit(str(error))
    if picture.std() < 1.0:
        sys.exit("the picture is blank")
    print(json.dumps(f"drawn by {_render.BACKEND}, {opengl.driver()}"))
