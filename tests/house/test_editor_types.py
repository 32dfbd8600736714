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
    *(("README", 0), ("README", 1), ("first_steps", 2), ("first_steps", 3), ("bodies", 0), ("bodies", 2)),
    *(("demonstrators", 1), ("directed", 0), ("modifiers", 0), ("study", 0), ("pages", 0), ("doors", 7)),
    *(("environments", 1), ("observations", 3), ("coming_from_dm_control", 0)),
)
# Those whose functions have no annotations, as people write them, and those that use what other packages leave open.
PLAIN_PROGRAMS = (
    *(("adding_a_task", 0), ("adding_a_task", 2), ("adding_a_task", 5), ("adding_a_robot", 0), ("observations", 1)),
    *(("doors", 0), ("doors", 2), ("doors", 5), ("doors", 6), ("coming_from_gymnasium", 0)),
)
PLAIN = ("--allow-untyped-defs", "--allow-untyped-calls", "--allow-incomplete-defs")
ARRAY = "numpy.ndarray[tuple[Any, ...], numpy.dtype[Any]]"
BLOCKS = f"typing.Mapping[str, {ARRAY}]"
SPECS = "arc_suite.envs.dm_types"
TIMESTEP = f"tuple[{SPECS}.StepType, float, float, {BLOCKS}, fallback={SPECS}.TimeStep]"
TYPES = {
    "environment": "arc_suite.envs.dm.Environment",
    "environment.task": "arc_suite.envs.dm.TaskRun",
    "environment.task.progress": "dict[str, float]",
    "environment.task.terms": "typing.Mapping[str, float]",
    "environment.task.body": "arc_suite.robots.spec.Body",
    "environment.task.random": "numpy.random.mtrand.RandomState",
    "environment.task.settings": "arc_suite.envs.task_view.TaskSettings",
    "environment.task.settings.parameters.duty_factor": "float",
    "environment.task.settings.weights": "typing.Mapping[str, float]",
    "environment.action_spec()": f"{SPECS}.BoundedArray",
    "environment.action_spec().minimum": ARRAY,
    "environment.action_spec().shape": "tuple[int, ...]",
    "environment.observation_spec()": f"typing.Mapping[str, {SPECS}.Array]",
    "environment.reward_spec()": f"{SPECS}.Array",
    "environment.close()": "None",
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
    "environment.reset().step_type": f"{SPECS}.StepType",
    "environment.reset().last()": "bool",
    "environment.snapshot()": f"dict[str, {ARRAY}]",
    "Demonstrator('queen')(environment.reset())": ARRAY,
    "Env('queen', 'walk').reset()": f"tuple[{ARRAY}, dict[str, Any]]",
    "Env('queen', 'walk').step([0.0] * 18)": f"tuple[{ARRAY}, float, bool, bool, dict[str, Any]]",
    "Env('queen', 'walk').action_space.shape": "tuple[int, ...]",
    "Env('queen', 'walk').task.progress": "dict[str, float]",
    "Env('queen', 'walk').physics": "arc_suite.simulation.physics.Physics",
    "Env('queen', 'walk').unwrapped": "arc_suite.envs.gym.Env",
    "Env('queen', 'walk').unwrapped.data": "arc_suite.simulation.annotations.MjData",
    "Env('queen', 'walk').unwrapped.data.qpos": ARRAY,
    "Env('queen', 'walk').unwrapped.model": "arc_suite.simulation.annotations.MjModel",
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
    "arc_suite.evaluation.MIN_RUNS": "int",
    "arc_suite.learning.train('queen').setup": "arc_suite.envs.setup.Setup",
    "arc_suite.animation.animate('queen', 'queen.glb')[0].name": "str",
    "arc_suite.Setup.of('queen').load()": "arc_suite.envs.dm.Environment",
    "animation.animate('queen', 'queen.glb')[0].name": "str",
    "animation.show(environment)": "arc_suite.animation.notebook.Inline",
}
# Names that are not there.
TYPOS = (
    "arc_suite.laod",
    "arc_suite.learning.trian",
    "suite.laod",
    "animation.anmate",
    "environment.rest",
    "environment.task.progres",
    "environment.physics.rendr",
    "environment.action_spec().minimun",
    "environment.reset().rewrd",
    "Env('queen', 'walk').stepp",
    "VectorEnv('queen', 'walk').stepp",
    "VectorEnv('queen', 'walk').task.progres",
)
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


def check(folder, files, *options):
    """The lines of mypy, strict, on files of a folder away from the clone."""
    environ = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "MYPYPATH")}
    command = [sys.executable, "-m", "mypy", "--strict", "--scripts-are-modules", "--python-executable", sys.executable]
    done = subprocess.run([*command, *options, *files], cwd=folder, env=environ, capture_output=True, text=True)
    return done.returncode, done.stdout


def check_as_editors_do(folder, mode="strict"):
    """The texts of pyright on the files of a folder away from the clone: errors, and types that it reveals."""
    pyright = shutil.which("pyright")
    if pyright is None:
        pytest.skip("no pyright: npm installs it")
    (folder / "pyrightconfig.json").write_text(json.dumps({"typeCheckingMode": mode}))
    command = [pyright, "--outputjson", "--pythonpath", sys.executable, "-p", str(folder)]
    diagnostics = json.loads(subprocess.run(command, capture_output=True, text=True).stdout)["generalDiagnostics"]
    texts = {"error": [], "information": []}
    for diagnostic in diagnostics:
        texts[diagnostic["severity"]].append(diagnostic["message"])
    return texts["error"], texts["information"]


def write_programs(folder, pages):
    """The names of files in a folder with programs of pages."""
    files = []
    for page, number in pages:
        blocks = [block for block in page_commands.blocks(page_commands.page(page)) if block.kind == "python"]
        files.append(f"{page}_{number}.py")
        (folder / files[-1]).write_text(blocks[number].text)
    assert len(files) == len(pages) >= 9
    return files


@pytest.fixture
def programs(tmp_path):
    """The files of the pages' programs in a folder."""
    return write_programs(tmp_path, PROGRAMS)


@pytest.fixture
def plain_programs(tmp_path):
    """The files of the pages' programs without annotations in a folder."""
    return write_programs(tmp_path, PLAIN_PROGRAMS)


@pytest.fixture
def revealing(tmp_path):
    """A program that reveals what users touch."""
    (tmp_path / "revealed.py").write_text(HEAD + "".join(f"reveal_type({expression})\n" for expression in TYPES))
    return ["revealed.py"]


@pytest.fixture
def misspelled(tmp_path):
    """A program of names that are not there."""
    (tmp_path / "misspelled.py").write_text(HEAD + "".join(f"print({typo})\n" for typo in TYPOS))
    return ["misspelled.py"]


def test_programs_of_the_pages_have_no_error(tmp_path, programs):
    status, lines = check(tmp_path, programs)
    assert status == 0, lines


def test_programs_without_annotations_have_no_error(tmp_path, plain_programs):
    status, lines = check(tmp_path, plain_programs, *PLAIN)
    assert status == 0, lines


def test_names_that_are_not_there_are_errors(tmp_path, misspelled):
    _, lines = check(tmp_path, misspelled)
    names = [typo.rpartition(".")[2] for typo in TYPOS]
    assert re.findall(r'error: .* has no attribute "(\w+)"', lines) == names, lines


def test_what_users_touch_has_a_type(tmp_path, revealing):
    status, lines = check(tmp_path, revealing)
    assert status == 0, lines
    assert dict(zip(TYPES, re.findall(r'Revealed type is "(.*)"', lines), strict=True)) == TYPES


def test_programs_of_the_pages_have_no_error_in_editors(tmp_path, programs):
    errors, _ = check_as_editors_do(tmp_path)
    assert [text for text in errors if not text.startswith(MATPLOTLIB)] == []


def test_programs_without_annotations_have_no_error_in_editors(tmp_path, plain_programs):
    errors, _ = check_as_editors_do(tmp_path, "basic")
    assert errors == []


def test_names_that_are_not_there_are_errors_in_editors(tmp_path, misspelled):
    errors, _ = check_as_editors_do(tmp_path, "basic")
    for typo in TYPOS:
        name = typo.rpartition(".")[2]
        assert any(f'"{name}"' in text for text in errors), name


def test_what_users_touch_has_a_type_in_editors(tmp_path, revealing):
    errors, texts = check_as_editors_do(tmp_path)
    types = [re.search(r'" is "(.*)"$', text, re.DOTALL)[1] for text in texts]
    assert errors == [] and len(types) == len(TYPES)
    assert not {"Any", "Unknown"} & set(types) and "Unknown" not in "".join(types)
