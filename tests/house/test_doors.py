"""The guide to parts of other packages: its code runs, from a folder that is not the suite's."""

import configparser
import json
import os
import re
import subprocess
import sys
import tomllib

import programs
import pytest
from interpreters import ROOT, printed
from packaging.requirements import Requirement

GUIDE = (ROOT / "docs" / "doors.md").read_text()
SHUFFLING, USING_A_LAW, GALES, USING_A_MODIFIER, _, GESTURING, THRIFTY, JOINT_COUNTER, MEASURING = re.findall(
    r"```python\n(.*?)```", GUIDE, re.DOTALL
)
EVALUATE, COLLECT, _, _, ANIMATE, DESIGN, COUNT, _ = re.findall(r"^arc-suite .*$", GUIDE, re.MULTILINE)
ENTRY_POINT, PYPROJECT = re.findall(r"```toml\n(.*?)```", GUIDE, re.DOTALL)


@pytest.fixture
def folder(tmp_path):
    """Write the guide's files, and return their folder."""
    files = {"shuffling": SHUFFLING, "gales": GALES, "gesturing": GESTURING, "thrifty": THRIFTY}
    files |= {"joint_counter": JOINT_COUNTER, "measuring": MEASURING}
    for name, text in files.items():
        (tmp_path / f"{name}.py").write_text(text)
    return tmp_path


@pytest.fixture
def run(folder, monkeypatch):
    """Return a function that runs a command of the guide in that folder, with other flags at the end."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(folder / "datasets"))
    return lambda command, *flags: programs.run(*command.split(), *flags, cwd=folder)


def test_a_law_moves_any_body(folder):
    checks = """
from arc_suite import evaluation
for body in ("queen", "spider", "varied:3"):
    environment = arc_suite.load(body, "walk", {"time_limit": 10.0})
    speeds = [
        evaluation.run(environment, Demonstrator(environment, preset), seed=0).progress["speed"]
        for preset in ("shuffling:shuffle", shuffling.Shuffle(reach=0.2))
    ]
    assert 0.05 < speeds[0] < speeds[1], (body, speeds)
"""
    assert printed(USING_A_LAW + checks, folder=folder) == []


def test_programs_take_a_law(run, folder):
    done = run(EVALUATE, "--episodes=1", "--set=time_limit=1")
    assert "\nqueen, shuffling:shuffle  " in programs.passed(done)
    done = run(COLLECT, "--episodes=2", "--steps=20")
    assert done.stdout.startswith("arc_suite/queen/walk/cpg-shuffling_shuffle-20steps-v0: 2 episodes"), done.stderr
    done = run(EVALUATE.replace(":shuffle", ":shufle"), "--episodes=1")
    line = "law 'shufle': shuffling registers no such law by arc_suite.register; did you mean 'shuffle'?\n"
    programs.refused(done, f"arc-suite evaluate: {line}")


def test_a_robot_brings_presets_of_a_law(folder):
    code = """
import arc_suite, shuffling
from arc_suite.cpg.selection import presets_of
from arc_suite.robots import ROBOTS
body = ROBOTS["tick"].replace(name="ticker")
arc_suite.register(body=body, presets={"shuffle": shuffling.Shuffle(reach=0.1)})
print(presets_of(body)["shuffle"].reach, presets_of(ROBOTS["tick"])["shuffle"].reach)
law = arc_suite.cpg.Demonstrator("ticker", "shuffling:shuffle").law
print(type(law).__name__, law.sweep.max() < arc_suite.cpg.Demonstrator("tick", "shuffle").law.sweep.max())
"""
    assert printed(code, folder=folder) == ["0.1 0.15", "ShuffleLaw True"]


MODIFIED = """
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import conformance
setup = Setup.of("tick", "walk", {"wind": 0.2, "kicks": 1.0})
print(setup.to_dict()["task_kwargs"], conformance.difference(setup, 20))
wind = environment.task.privileged["wind"]
import numpy as np
print(round(float(np.hypot(*wind)), 9), len(environment.task.definition.changes))
plain = arc_suite.load("queen", "steer", {"kicks": 1.0, "random": 3})
windy = arc_suite.load("queen", "steer", {"kicks": 1.0, "random": 3, "wind": 0.1})
one, other = plain.reset(), windy.reset()
print(all((one.observation[name] == other.observation[name]).all() for name in one.observation))
other = windy.step(np.zeros(18))
print((plain.step(np.zeros(18)).observation["velocities"] != other.observation["velocities"]).any())
symmetry = windy.task.definition.symmetry
"""


def test_a_modifier_blows_on_any_task(folder):
    """In a batch as alone, among the suite's own; and the stream of seeds gives what it gave without it."""
    *_, settings, numbers, is_same_start, is_pushed = printed(USING_A_MODIFIER + MODIFIED, folder=folder)
    assert settings == "{'gales:wind': 0.2, 'kicks': 1.0} None"
    assert (numbers, is_same_start, is_pushed) == ("0.2 13", "True", "True")


def test_programs_take_a_modifier(run):
    done = run("arc-suite evaluate --robot tick --set gales:wind=0.2", "--episodes=1", "--set=time_limit=1")
    assert "\ntick, " in programs.passed(done)
    line = "arc-suite evaluate: wind: expected a number from 0 to 1, got 2"
    programs.refused(run("arc-suite evaluate --robot tick --set gales:wind=2", "--episodes=1"), line)


REFUSED = """
import arc_suite, numpy as np
from arc_suite import registration
from arc_suite.tasks.modifiers import Modifier
from typing import NamedTuple

def refused(**parts):
    try:
        arc_suite.register(**parts)
    except ValueError as error:
        print(error)

class Fields(NamedTuple):
    gravity: float

class Plain(Modifier):
    defaults = {"gravity": 1.0}

class Empty(Fields, Modifier):
    pass

class Taken(Fields, Modifier):
    defaults = {"time_limit": 1.0}

class Again(Fields, Modifier):
    defaults = {"kicks": 1.0}

refused(modifiers=(Plain,))
refused(modifiers=(Empty,))
refused(modifiers=(Taken,))
refused(modifiers=(Again,))
"""


def test_mistakes_in_a_modifier_are_one_line(folder):
    plain, empty, taken, again = printed(REFUSED, folder=folder)
    assert plain.startswith("modifiers: expected NamedTuples that inherit from arc_suite.tasks.modifiers.Modifier, got")
    assert empty == "modifier Empty: expected settings in its `defaults`, got none"
    assert taken == "modifier Taken: time_limit is a setting of tasks; choose another name"
    assert again == "modifier 'kicks' is already registered; choose another name"


@pytest.mark.slow
def test_clips_are_animated(run, folder):
    lines = programs.passed(run(ANIMATE)).splitlines()
    assert [line.split()[0] for line in lines[1:4]] == ["walk", "creep", "bow"]
    found = json.loads((folder / "queen.clips.json").read_text())
    named = found["clips"]
    assert named["creep_loop"]["forward_speed"] < 0.5 * named["walk_loop"]["forward_speed"]


@pytest.mark.slow
def test_bodies_are_searched_for_a_goal_along_an_axis(run, folder):
    done = run(DESIGN, "--bodies=20", "--steps=30", "--nopages", "--processes=1")
    _, header, *rows, _ = programs.passed(done).splitlines()
    assert "speed by power, (m/s)/(W/kg)" in header and all("_stretch" in row.split()[0] for row in rows)
    report = json.loads((folder / "thrifty" / "design.json").read_text())
    best = report["elites"][0]
    assert report["goal"] == "thrifty:thrift" and report["map"]["names"] == ["legs", "thrifty:stretch"]
    assert f"{best['second']['speed'] / best['second']['power']:.3f}" in rows[0]
    done = run(DESIGN.replace(":thrift ", ":thrit "))
    line = "goal 'thrit': thrifty registers no such goal by arc_suite.register; did you mean 'thrift'?\n"
    programs.refused(done, f"arc-suite design: {line}")


def test_a_program_runs_by_its_module(run):
    assert programs.passed(run(COUNT)) == "queen has 18 joints\n"
    text = programs.passed(run(COUNT, "--help"))
    assert text.startswith("Count the joints of a body.\n\n  arc-suite measuring:count_joints") and "--robot=" in text
    programs.refused(run(COUNT, "--robot=nobody"), "arc-suite measuring:count_joints: unknown robot 'nobody'")


def installed(folder, name="legs-kit", entries=None):
    """Install programs as a package does: metadata with entry points, by default that of the guide."""
    (group,) = re.findall(r'"(.*)"\]', ENTRY_POINT)
    (entry,) = re.findall(r"\n(.*)\n", ENTRY_POINT)
    metadata = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(f"[{group}]\n{entries or entry.replace(chr(34), '')}\n")
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}


def test_the_package_of_the_guide_has_its_modules_and_the_address_of_the_suite(folder):
    fields = tomllib.loads(PYPROJECT)
    assert all((folder / f"{name}.py").exists() for name in fields["tool"]["setuptools"]["py-modules"])
    assert fields["project"]["entry-points"] == tomllib.loads(ENTRY_POINT)["project"]["entry-points"]
    (requirement,) = map(Requirement, fields["project"]["dependencies"])
    (address,) = re.findall(r"^(?:# )?url = (\S+)$", (ROOT / "setup.cfg").read_text(), re.MULTILINE)
    assert (requirement.name, requirement.url) == ("arc_suite", f"git+{address}@main")
    extras = configparser.ConfigParser()
    extras.read(ROOT / "setup.cfg")
    assert requirement.extras <= set(extras["options.extras_require"])


def command(environ, *arguments):
    """Run `arc-suite` in an interpreter of its own."""
    done = [sys.executable, "-c", "import arc_suite_command; arc_suite_command.main()", *arguments]
    return subprocess.run(done, env=environ, capture_output=True, text=True)


def test_an_installed_program_has_a_name(folder):
    environ = installed(folder)
    assert programs.passed(command(environ, "count_joints", "--robot=tick")) == "tick has 18 joints\n"
    line = "arc-suite: unknown program 'count_joint'; did you mean 'count_joints'? (there are: build_model, "
    programs.refused(command(environ, "count_joint"), line)


def test_help_lists_an_installed_program_and_imports_nothing(folder):
    environ = installed(folder)
    (folder / "measuring.py").write_text("raise SystemExit('imported')\n")
    lines = programs.passed(command(environ, "--help")).splitlines()
    assert "  count_joints  of the package legs-kit" in lines


def test_help_tells_of_programs_whose_names_run_others(folder):
    installed(folder)
    environ = installed(folder, "other-kit", "count_joints = measuring:count_joints\nevaluate = measuring")
    lines = programs.passed(command(environ, "--help")).splitlines()
    assert lines[-2:] == [
        f"{name} of the package other-kit has the name of another program; run it as arc-suite measuring:{name}."
        for name in ("count_joints", "evaluate")
    ]


def test_an_entry_point_may_name_an_attribute(folder):
    environ = installed(folder, entries="count_joints = measuring:count_joints")
    assert programs.passed(command(environ, "count_joints", "--robot=tick")) == "tick has 18 joints\n"


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (
            '{"count_joints": "nowhere"}',
            "program 'count_joints': cannot import 'nowhere': No module named 'nowhere'; st",
        ),
        (
            '{"count_joints": "json.tool_"}',
            "program 'count_joints': cannot import 'json.tool_': module 'json' has no",
        ),
        (
            '{"count_joints": "json"}',
            "program 'measuring:count_joints': expected a module with a docstring and a fun",
        ),
        ('{"doctor": "joint_counter"}', "program 'count_joints': measuring registers no such program by arc_suite.reg"),
    ],
)
def test_a_program_that_is_none_is_one_line(run, folder, text, line):
    (folder / "measuring.py").write_text(f"import arc_suite\narc_suite.register(module=__name__, programs={text})\n")
    programs.refused(run(COUNT), f"arc-suite: {line}")


def test_a_program_of_another_package_takes_no_name_of_the_suite(run, folder):
    (folder / "measuring.py").write_text(MEASURING.replace("count_joints", "doctor"))
    line = "program 'doctor': the suite has one of this name, and measuring registers another\n"
    programs.refused(run("arc-suite measuring:doctor"), f"arc-suite: {line}")
    assert run("arc-suite doctor --version").returncode == 0
