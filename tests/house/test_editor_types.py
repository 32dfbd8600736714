"""Type checkers follow README's install line, and know what users touch; `make check-editor` runs this.

The environment has the packages of the line and mypy, and no path to the clone but that of the line.
"""

import os
import re
import subprocess
import sys

import page_commands
import pytest

pytest.importorskip("mypy")

# Page and number of a block of Python.
PROGRAMS = (
    *(("README", 0), ("README", 1), ("first_steps", 2), ("first_steps", 3), ("bodies", 0), ("demonstrators", 1)),
    *(
        ("directed", 0),
        ("modifiers", 0),
        ("study", 0),
        ("pages", 0),
        ("doors", 6),
        ("environments", 1),
        ("observations", 2),
    ),
)
ARRAY = "numpy.ndarray[tuple[Any, ...], numpy.dtype[Any]]"
BLOCKS = f"typing.Mapping[str, {ARRAY}]"
TIMESTEP = "arc_suite.envs.timestep.TimeStep"
TYPES = {
    "environment": "arc_suite.envs.dm.Environment",
    "environment.task": "arc_suite.envs.dm.TaskRun",
    "environment.task.progress": "dict[str, float]",
    "environment.task.terms": "typing.Mapping[str, float]",
    "environment.task.body": "arc_suite.robots.spec.Body",
    "environment.physics": "arc_suite.simulation.physics.Physics",
    "environment.reset()": TIMESTEP,
    "environment.step([0.0] * 18)": TIMESTEP,
    "environment.reset().observation": BLOCKS,
    "environment.reset().reward": "float",
    "environment.reset().last()": "bool",
    "environment.snapshot()": f"dict[str, {ARRAY}]",
    "Demonstrator('queen')(environment.reset())": ARRAY,
    "Env('queen', 'walk').reset()": f"tuple[{ARRAY}, dict[str, Any]]",
    "Env('queen', 'walk').step([0.0] * 18)": f"tuple[{ARRAY}, float, bool, bool, dict[str, Any]]",
    "VectorEnv('queen', 'walk').task.split": f"def (observation: {ARRAY}) -> collections.OrderedDict[str, {ARRAY}]",
    "ROBOTS['queen'].replace(name='king')": "arc_suite.robots.spec.Body",
    "arc_suite.ALL_TASKS": "tuple[tuple[str, str], ...]",
    "suite.ALL_TASKS": "tuple[tuple[str, str], ...]",
    "suite.load('queen', 'walk').reset()": TIMESTEP,
    "arc_suite.TASKS_BY_DOMAIN": "typing.Mapping[str, tuple[str, ...]]",
    "arc_suite.Setup.of('queen').load()": "arc_suite.envs.dm.Environment",
    "animation.show(environment)": "arc_suite.animation.notebook.Inline",
}
HEAD = """\
import arc_suite
from arc_suite import animation, suite
from arc_suite.cpg import Demonstrator
from arc_suite.envs.gym import Env
from arc_suite.envs.vector import VectorEnv
from arc_suite.robots import ROBOTS

environment = arc_suite.load("queen", "walk")
"""


def check(folder, files):
    """The lines of mypy, strict, on files of a folder away from the clone."""
    environ = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "MYPYPATH")}
    command = [sys.executable, "-m", "mypy", "--strict", "--scripts-are-modules", "--python-executable", sys.executable]
    done = subprocess.run([*command, *files], cwd=folder, env=environ, capture_output=True, text=True)
    return done.returncode, done.stdout


def test_programs_of_the_pages_have_no_error(tmp_path):
    files = []
    for page, number in PROGRAMS:
        blocks = [block for block in page_commands.blocks(page_commands.page(page)) if block.kind == "python"]
        files.append(f"{page}_{number}.py")
        (tmp_path / files[-1]).write_text(blocks[number].text)
    assert len(files) >= 10
    status, lines = check(tmp_path, files)
    assert status == 0, lines


def test_what_users_touch_has_a_type(tmp_path):
    (tmp_path / "revealed.py").write_text(HEAD + "".join(f"reveal_type({expression})\n" for expression in TYPES))
    status, lines = check(tmp_path, ["revealed.py"])
    assert status == 0, lines
    assert dict(zip(TYPES, re.findall(r'Revealed type is "(.*)"', lines), strict=True)) == TYPES
