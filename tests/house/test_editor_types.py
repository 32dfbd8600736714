"""Type checkers follow README's install line, and know what users touch; `make check-editor` runs this.

The environment has the packages of the line and mypy, and no path to the clone but that of the line. Node has pyright,
which is what editors run.
"""

import json
import os
import re
import shutil
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
    "environment.task.random": "numpy.random.mtrand.RandomState",
    "environment.physics": "arc_suite.simulation.physics.Physics",
    "environment.physics.data": "arc_suite.simulation.annotations.Data",
    "environment.physics.data.qpos": ARRAY,
    "environment.physics.data.time": "float",
    "environment.physics.model": "arc_suite.simulation.annotations.Model",
    "environment.physics.model.body_mass": ARRAY,
    "environment.physics.named.data.xpos['torso']": ARRAY,
    "environment.physics.render()": ARRAY,
    "environment.physics.time()": "float",
    "environment.control_timestep()": "float",
    "environment.reset()": TIMESTEP,
    "environment.step([0.0] * 18)": TIMESTEP,
    "environment.reset().observation": BLOCKS,
    "environment.reset().reward": "float",
    "environment.reset().last()": "bool",
    "environment.snapshot()": f"dict[str, {ARRAY}]",
    "Demonstrator('queen')(environment.reset())": ARRAY,
    "Env('queen', 'walk').reset()": f"tuple[{ARRAY}, dict[str, Any]]",
    "Env('queen', 'walk').step([0.0] * 18)": f"tuple[{ARRAY}, float, bool, bool, dict[str, Any]]",
    "Env('queen', 'walk').action_space.shape": "tuple[int, ...]",
    "Env('queen', 'walk').task.progress": "dict[str, float]",
    "VectorEnv('queen', 'walk').reset()": f"tuple[{ARRAY}, dict[str, Any]]",
    "VectorEnv('queen', 'walk').single_action_space.shape": "tuple[int, ...]",
    "VectorEnv('queen', 'walk').task.progress": BLOCKS,
    "arc_suite.symmetry('queen', 'walk').action.signs": ARRAY,
    "VectorEnv('queen', 'walk').task.split": f"def (observation: {ARRAY}) -> collections.OrderedDict[str, {ARRAY}]",
    "ROBOTS['queen'].replace(name='king')": "arc_suite.robots.spec.Body",
    "arc_suite.ALL_TASKS": "tuple[tuple[str, str], ...]",
    "suite.ALL_TASKS": "tuple[tuple[str, str], ...]",
    "suite.load('queen', 'walk').reset()": TIMESTEP,
    "arc_suite.TASKS_BY_DOMAIN": "typing.Mapping[str, tuple[str, ...]]",
    "arc_suite.Setup.of('queen').load()": "arc_suite.envs.dm.Environment",
    "animation.animate('queen', 'queen.glb')[0].name": "str",
    "animation.show(environment)": "arc_suite.animation.notebook.Inline",
}
MATPLOTLIB = 'Type of "plot" is partially unknown'  # its own types are open
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


def check_as_editors_do(folder):
    """The texts of pyright, strict, on the files of a folder away from the clone: errors, and types that it reveals."""
    pyright = shutil.which("pyright")
    if pyright is None:
        pytest.skip("no pyright: npm installs it")
    (folder / "pyrightconfig.json").write_text(json.dumps({"typeCheckingMode": "strict"}))
    command = [pyright, "--outputjson", "--pythonpath", sys.executable, "-p", str(folder)]
    diagnostics = json.loads(subprocess.run(command, capture_output=True, text=True).stdout)["generalDiagnostics"]
    texts = {"error": [], "information": []}
    for diagnostic in diagnostics:
        texts[diagnostic["severity"]].append(diagnostic["message"])
    return texts["error"], texts["information"]


@pytest.fixture
def programs(tmp_path):
    """The files of the pages' programs in a folder."""
    files = []
    for page, number in PROGRAMS:
        blocks = [block for block in page_commands.blocks(page_commands.page(page)) if block.kind == "python"]
        files.append(f"{page}_{number}.py")
        (tmp_path / files[-1]).write_text(blocks[number].text)
    assert len(files) >= 10
    return files


@pytest.fixture
def revealing(tmp_path):
    """A program that reveals what users touch."""
    (tmp_path / "revealed.py").write_text(HEAD + "".join(f"reveal_type({expression})\n" for expression in TYPES))
    return ["revealed.py"]


def test_programs_of_the_pages_have_no_error(tmp_path, programs):
    status, lines = check(tmp_path, programs)
    assert status == 0, lines


def test_what_users_touch_has_a_type(tmp_path, revealing):
    status, lines = check(tmp_path, revealing)
    assert status == 0, lines
    assert dict(zip(TYPES, re.findall(r'Revealed type is "(.*)"', lines), strict=True)) == TYPES


def test_programs_of_the_pages_have_no_error_in_editors(tmp_path, programs):
    errors, _ = check_as_editors_do(tmp_path)
    assert [text for text in errors if not text.startswith(MATPLOTLIB)] == []


def test_what_users_touch_has_a_type_in_editors(tmp_path, revealing):
    errors, texts = check_as_editors_do(tmp_path)
    types = [re.search(r'" is "(.*)"$', text, re.DOTALL)[1] for text in texts]
    assert errors == [] and len(types) == len(TYPES)
    assert not {"Any", "Unknown"} & set(types) and "Unknown" not in "".join(types)
