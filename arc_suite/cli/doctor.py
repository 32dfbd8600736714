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
from arc_suite.simulation import opengl
from arc_suite.simulation.cores import usable_cores

_PATIENCE = 120  # s, for the first picture
_PICTURE = "from arc_suite.cli import doctor; doctor.draw()"


class Finding(NamedTuple):
    """One line of the report.

    Attributes:
        subject: what was looked at.
        found: what it is.
        remedy: what to do about it; None if all is well.
    """

    subject: str
    found: str
    remedy: str | None = None


def findings() -> Iterator[Finding]:
    """Examine everything, one thing after the other."""
    yield Finding("system", f"{platform.platform()}, Python {platform.python_version()}")
    yield from _packages()
    yield Finding("cores", f"{os.cpu_count()}; vector environments use {usable_cores()}")
    display = "a display" if opengl.has_display() else "no display"
    yield Finding("MUJOCO_GL", f"{os.environ.get('MUJOCO_GL', 'not set')}, {display}")
    yield _picture()


def _packages() -> Iterator[Finding]:
    wrong = {line.split()[0]: line.partition(": ")[2] for line in versions.problems()}
    for package, needed in versions.REQUIREMENTS.items():
        found = f"{versions.version_of(package) or 'not installed'}, made for {needed}"
        yield Finding(package, found, wrong.get(package))


def _picture() -> Finding:
    command = [sys.executable, "-c", _PICTURE]
    try:
        done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=_PATIENCE)
    except subprocess.TimeoutExpired:
        return Finding("picture", f"none within {_PATIENCE} s", "mend the OpenGL driver, or set MUJOCO_GL=osmesa")
    if done.returncode == 0:
        return Finding("picture", json.loads(done.stdout.splitlines()[-1]))
    *_, last = done.stderr.strip().splitlines() or [f"the process ended with status {done.returncode}"]
    reason, _, remedy = last.partition("; ")
    return Finding("picture", reason, remedy or "mend the OpenGL driver, or set MUJOCO_GL to egl, osmesa or glfw")


def draw() -> None:
    """Draw a picture and print, as JSON, what it was drawn with; the doctor runs this in a process of its own."""
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


def main() -> int:
    """Print the report and return the exit status."""
    problems = 0
    for subject, found, remedy in findings():
        sign, line = ("ok", found) if remedy is None else ("PROBLEM", f"{found}; {remedy}")
        print(f"{sign:<8} {subject:<11} {line}", flush=True)
        problems += remedy is not None
    print(f"{problems} problem{'s' * (problems > 1)}" if problems else "all is well")
    return int(problems > 0)
