"""The code of the README and of the pages, their commands and tables agree with the suite."""

import math
import pathlib
import re
import shlex
import tomllib

import package_page
import page_commands
import programs
import pytest
from tiers import tiers

import arc_suite
from arc_suite import data
from arc_suite.animation import pages
from arc_suite.cli import main
from arc_suite.envs.setup import Setup
from arc_suite.robots import gaits
from arc_suite.tasks import TASKS

ROOT = pathlib.Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "examples").glob("*.md"))]

# Pages whose code needs files or packages of its own; tests of their own run it.
ELSEWHERE = {"adding_a_robot", "adding_a_task", "adding_an_algorithm", "adding_an_arena", "modifiers"}
ELSEWHERE |= {
    "agents",
    "coming_from_gymnasium",
    "coming_from_dm_control",
    "clients",
    "doors",
    "evolving",
    "first_steps",
    "gpu",
    "imported",
    "study",
}
BLOCKS = [
    pytest.param(block, id=f"{page.stem}{place}", marks=() if page.stem == "README" else pytest.mark.slow)
    for page in PAGES
    if page.stem not in ELSEWHERE
    for place, block in enumerate(re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL))
]

SCHEMATIC = {"arc-suite --help", "arc-suite PROGRAM --help", "arc-suite PROGRAM", "python -m arc_suite PROGRAM"}
BLENDER = {"python tools/to_fbx.py queen.glb queen.fbx"}  # make check-blender
OF_ANOTHER_PACKAGE = re.compile(r"arc-suite (measuring:)?count_joints")  # test_doors has the package
COMMANDS = {text for page in PAGES for text in page_commands.commands(page.read_text())}
COMMANDS = sorted(text for text in COMMANDS - SCHEMATIC - BLENDER if not OF_ANOTHER_PACKAGE.match(text))


def _page(name):
    return (ROOT / "docs" / f"{name}.md").read_text()


def _rows(page, first):
    """Return the cells of the table of a page whose heading begins with `first`, by the first cell without markup."""
    (table,) = re.findall(rf"^\| {re.escape(first)}[^\n]*\n\|[-|]+\n((?:\|[^\n]*\n)+)", page, re.MULTILINE)
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    return {re.search(r"[a-z]\w*", row[0])[0]: row[1:] for row in cells}


@pytest.fixture
def dataset(tmp_path, monkeypatch):
    """A little of what the page of datasets collects."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    settings = data.DatasetSettings(Setup.of("queen"), "cpg", ("tuned",))
    assert f"--verify {settings.dataset_id()}\n" in _page("datasets")
    data.collect(settings.dataset_id(), settings._replace(steps=5), episodes=1)


@pytest.mark.parametrize("block", BLOCKS)
def test_code(block, dataset, monkeypatch, tmp_path):
    for folder in ("examples", "studies"):  # whose files pages name
        (tmp_path / folder).symlink_to(ROOT / folder)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pages, "viewer_script", lambda: "")  # which needs Node
    exec(compile(block, "page.md", "exec"), {})


@pytest.mark.parametrize("command", tiers(COMMANDS, lambda command: command in " ".join(README.split())))
def test_a_command_is_understood(command):
    """Programs accept the flags and their values; tests of the programs run them."""
    program, *arguments = shlex.split(command)
    if program == "arc-suite":  # not on the path of every environment; the test of the wheel runs it
        arguments = ["-m", "arc_suite", *arguments]
    is_checker = program == "python" and arguments[0] == "tools/plainness.py"  # runs without the package
    if command not in ("arc-suite --version", "arc-suite help train"):  # which take no flag
        arguments.append("--help" if is_checker else "--version")
    programs.passed(programs.run(*arguments, cwd=ROOT))


def test_there_is_code():
    assert len(re.findall("```python", README)) == 2
    assert len(BLOCKS) >= 6
    assert len(COMMANDS) >= 20


def test_table_of_robots():
    table = _rows(README, "robot | body")
    assert list(table) == list(arc_suite.TASKS_BY_DOMAIN)
    for robot, (_, legs, mass, height, speed, gait) in table.items():
        environment = arc_suite.load(robot, "walk")
        task, model = environment.task, environment.physics.model.ptr
        parameters = task.settings.parameters
        assert legs == f"{len(task.body.legs)} x {len(task.body.legs[0].joints)}"
        assert float(mass.removesuffix(" kg")) == pytest.approx(model.body_mass.sum(), rel=0.01)
        assert height == f"{task.body.torso.standing_height:.2f} m"
        assert speed == f"{parameters.target_velocity:.2f} m/s"
        offsets = {"tripod": gaits.TRIPOD, "trot": gaits.TROT}[gait]
        assert parameters.phase_offsets == pytest.approx([2.0 * math.pi * offset for offset in offsets])


def test_table_of_tasks():
    assert set(_rows(README, "task |")) == set(TASKS)


def test_table_of_returns():
    results = _rows(_page("results"), "robot | `zero` | published `medium`")
    for robot, returns in _rows(README, "robot | standing").items():
        standing, _, medium, _, best, _, ppo, paper = (round(float(cell.split()[0])) for cell in results[robot])
        assert returns == [str(value) for value in (standing, medium, best, ppo, paper)]


def test_the_text_for_package_indexes_is_made_from_the_readme():
    """By python tools/package_page.py."""
    page = package_page.page(README)
    assert package_page.PAGE.read_text() == page
    assert "](docs/" not in page and "make demo" not in page and "pip install 'arc_suite[learn,animate]'" in page


def test_every_program_has_a_row():
    page = _page("programs")
    for name in main.PROGRAMS:
        assert f"| `arc-suite {name}" in page, name
    for path in (ROOT / "tools").glob("*.py"):
        same = path.stem in main.PROGRAMS  # build_model
        assert same or f"tools/{path.name}" in page or f"make {path.stem.replace('_', '-')}" in page, path


def test_the_map_names_every_room():
    (text,) = re.findall(r"```\n(tools/.*?)```", _page("contributing"), re.DOTALL)
    named = set(re.findall(r"\b(\w+)(?:/|\.py)", text)) - {"tools", "build_model", "arc_suite"}
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    layers = next(contract["layers"] for contract in contracts if contract["type"] == "layers")
    assert named == {room for layer in layers for room in layer.split(" | ")}
