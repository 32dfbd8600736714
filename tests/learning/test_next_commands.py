"""Commands after a training: those that a person wants next, for this very run."""

import pathlib
import shlex

import programs
import pytest

from arc_suite.animation import play_pages
from arc_suite.envs.setup import Setup
from arc_suite.learning.next_commands import has_built_pages, next_commands
from arc_suite.robots import ROBOTS
from arc_suite.tasks import TASKS

BLIND = {"exclude_blocks": ["contact_forces"]}


def commands(setup, folder="runs/mine", has_pages=True):
    return [command.removeprefix("arc-suite ") for command in next_commands(setup, pathlib.Path(folder), has_pages)]


def test_of_a_run():
    policy = "--policy runs/mine"
    expected = [f"evaluate {policy}", f"render {policy} -o mine.mp4", f"play {policy} -o mine.html"]
    assert commands(Setup.of("tick", "steer", BLIND)) == expected
    assert commands(Setup.of("spider", "walk")) == expected
    for setup in (Setup.of("tick", "stairs", BLIND), Setup.of("tick", "walk", BLIND | {"actions": "position"})):
        assert commands(setup) == [*expected[:2], f"view {policy}"]


def test_of_many_bodies():
    policy = "--policy runs/mine"
    expected = [f"transfer {policy}", f"render --spec spider {policy} -o mine.mp4"]
    assert commands(Setup.of("varied:0-3", "walk")) == [*expected, f"play --spec spider {policy} -o mine.html"]


def test_without_what_make_web_builds_the_last_opens_a_window(monkeypatch, tmp_path):
    policy = "--policy runs/mine"
    assert commands(Setup.of("tick", "walk"), has_pages=False)[2] == f"view {policy}"
    assert commands(Setup.of("varied:0-3", "walk"), has_pages=False)[2] == f"view --spec spider {policy}"
    for name in ("play", "view"):
        programs.passed(programs.arc_suite(name, "--policy", "runs/mine", "--version"))
    monkeypatch.setattr("arc_suite.learning.next_commands.source_path", lambda name: tmp_path / "cli" / f"{name}.py")
    assert not has_built_pages()
    (tmp_path / "web").mkdir()
    (tmp_path / "web" / "play.js").touch()
    assert has_built_pages()


def test_folders_are_quoted_and_modules_are_named_again(tmp_path, monkeypatch):
    (tmp_path / "icy.py").write_text(
        "import arc_suite\nfrom arc_suite.tasks.walk import Walk\n\n\nclass Ice(Walk):\n    '''Ice.'''\n\n"
        "    name = 'icy'\n\n\narc_suite.register(module=__name__, tasks=(Ice,))\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    try:
        setup = Setup.of("tick", "icy:icy", {"time_limit": 2})
        evaluate, _, view = commands(setup, "my runs/ice")
    finally:
        TASKS.pop("icy", None)
    flags = "--policy 'my runs/ice' --task icy:icy --set time_limit=2"
    assert (evaluate, view) == (f"evaluate {flags}", f"view {flags}")


@pytest.mark.parametrize("command", commands(Setup.of("tick", "walk")) + commands(Setup.of("varied:0-3", "walk")))
def test_programs_have_the_flags(command):
    programs.passed(programs.arc_suite(*shlex.split(command), "--version"))


@pytest.mark.slow
@pytest.mark.parametrize("task", TASKS)
def test_a_page_takes_what_is_said_to_be_played(task, monkeypatch):
    """As `play` itself judges: by blocks and actions."""
    setup = Setup.of("tick", task, BLIND if "contact_forces" in Setup.of("tick", task).definition.sizes else {})
    blocks = set(setup.definition.sizes)
    is_played = commands(setup)[2].startswith("play ")
    steer = Setup.of(ROBOTS["tick"], "steer").definition
    assert is_played == (blocks <= set(play_pages.PAGE_BLOCKS) and setup.definition.actions == steer.actions)
