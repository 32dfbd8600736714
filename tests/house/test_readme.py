"""The README's code runs as it stands, and its tables say what is so."""

import pathlib
import re
import shlex

import gymnasium
import programs
import pytest
import test_layers

import arc_suite
from arc_suite import data
from arc_suite.cli import main
from arc_suite.envs.setup import Setup
from arc_suite.tasks import walk

ROOT = pathlib.Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
BLOCKS = re.findall(r"```python\n(.*?)```", README, re.DOTALL)

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "examples").glob("*.md"))]
_COMMAND = re.compile(r"(?:^|`)((?:python (?:tools/|-m arc_suite)|arc-suite )[^`\n]*(?:\n[^`\n]+(?=`))?)", re.MULTILINE)
SCHEMATIC = {"arc-suite PROGRAM --help", "arc-suite PROGRAM", "python -m arc_suite PROGRAM"}
COMMANDS = sorted({" ".join(text.split()) for page in PAGES for text in _COMMAND.findall(page.read_text())} - SCHEMATIC)


@pytest.fixture
def dataset(tmp_path, monkeypatch):
    """A little of what the README collects."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    settings = data.Settings(Setup.of("queen"), "cpg", ("tuned",))
    assert f"--verify {settings.dataset_id()}\n" in README
    data.collect(settings.dataset_id(), settings._replace(steps=5), episodes=1)


@pytest.mark.parametrize("block", BLOCKS, ids=range(len(BLOCKS)))
def test_code(block, dataset):
    exec(compile(block, "README.md", "exec"), {})


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_is_understood(command):
    """The program, its flags and their values are; what it does then, its own tests say."""
    program, *arguments = shlex.split(command)
    if program == "arc-suite":  # not on the path of every environment; the test of the wheel runs it
        arguments = ["-m", "arc_suite", *arguments]
    done = programs.run(*arguments, "--version", cwd=ROOT)
    assert (done.returncode, done.stderr) == (0, "")


def test_there_is_code():
    assert len(BLOCKS) >= 2
    assert len(COMMANDS) >= 20


@pytest.mark.parametrize("robot", arc_suite.TASKS_BY_DOMAIN)
def test_table_of_robots(robot):
    row = [cell.strip() for cell in re.search(rf"^\| `{robot}` (.*)\|$", README, re.MULTILINE).group(1).split("|")]
    environment = arc_suite.load(robot, "walk")
    task, model = environment.task, environment.physics.model.ptr
    size = sum(spec.shape[0] for spec in environment.observation_spec().values())
    parameters = task.settings.parameters
    assert row[2].split(" x ") == [str(len(task.body.legs)), str(len(task.body.legs[0].joints))]
    assert row[3:5] == [str(model.nu), str(model.nbody - 1)]
    mass = float(row[5].removesuffix(" kg"))
    assert mass == pytest.approx(model.body_mass.sum(), rel=0.01)
    assert row[6] == f"{task.body.torso.standing_height:.2f} m"
    assert row[7] == f"{parameters.target_velocity:.2f} m/s"
    assert row[8].split(", ")[1] == f"{parameters.gait_frequency} Hz"
    assert row[9] == str(size)


def test_table_of_terms():
    for name, weight in (walk.BONUSES | walk.COSTS).items():
        rows = re.findall(rf"^\| `{name}` \| (-?[\d.]+)[ ;]", README, re.MULTILINE)
        assert float(rows[-1]) == weight, name


def test_ids_are_registered():
    for name in re.findall(r"`(arc_suite/[a-z]+-walk-v0)`", README):
        assert name in gymnasium.registry


def test_every_program_is_told_of():
    for path in (ROOT / "tools").glob("*.py"):
        assert f"tools/{path.name}" in README or f"make {path.stem.replace('_', '-')}" in README, path
    for name in main.PROGRAMS:
        assert re.search(rf"(tools/(walk_)?{name}\.py|arc_suite\.{name}|arc-suite {name})\b", README), name


def test_the_map_names_every_room():
    (text,) = re.findall(r"```\n(tools/.*?)```", README, re.DOTALL)
    named = set(re.findall(r"\b(\w+)(?:/|\.py)", text)) - {"tools", "arc_suite"}
    assert named == set(test_layers.HEIGHTS) - {"__main__"}


def test_links_lead_somewhere():
    targets = re.findall(r"\]\((?!https?:)([^)#]+)", README)
    assert len(targets) > 10
    for target in targets:
        assert (ROOT / target).exists(), target
