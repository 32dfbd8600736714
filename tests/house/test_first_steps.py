"""The roads of newcomers and the commands of pages: quick ones run here, others by `make check-first-steps`."""

import re
import shlex

import check_first_steps
import page_commands
import programs
import pytest
from page_commands import ROOT, page, sections

MAKEFILE = (ROOT / "Makefile").read_text()


@pytest.mark.parametrize("name", check_first_steps.ROADS)
def test_the_pages_have_what_a_road_takes(name):
    for stem, what in check_first_steps.ROADS[name]:
        if what.startswith("make "):
            assert f"`{what}`" in page(stem) and re.search(rf"^{what[5:]}:", MAKEFILE, re.MULTILINE)
        else:
            assert list(page_commands.blocks(sections(page(stem))[what])), (stem, what)


def test_a_road_ends_with_what_it_leaves(tmp_path, monkeypatch):
    assert check_first_steps.GOALS.keys() == check_first_steps.ROADS.keys()
    (tmp_path / "runs" / "tick-walk-ppo-0").mkdir(parents=True)
    policy = tmp_path / "runs/tick-walk-ppo-0/policy.npz"
    policy.write_bytes((ROOT / "arc_suite/policies/packaged/tick-walk.npz").read_bytes())
    (tmp_path / "tick.mp4").touch()
    assert check_first_steps.find_unmet_goal("learner", tmp_path) == "it leaves no tick.mp4"
    (tmp_path / "tick.mp4").write_bytes(b"a film")
    assert check_first_steps.find_unmet_goal("learner", tmp_path) == ""
    monkeypatch.setattr(check_first_steps, "measure_gain", lambda run: -1.5)
    line = "runs/tick-walk-ppo-0/policy.npz earns 1.5 less than a body that stands still"
    assert check_first_steps.find_unmet_goal("learner", tmp_path) == line


def test_a_road_goes_after_the_one_that_it_needs():
    assert check_first_steps.list_roads(["researcher"]) == ["learner", "researcher"]
    assert check_first_steps.list_roads([]) == list(check_first_steps.ROADS)


def test_the_environment_has_the_extras_of_the_front_page():
    (extras,) = re.findall(r"pip install -e '\.\[(.*)\]'", page("README"))
    assert f"check-first-steps: EXTRAS := {extras}\n" in MAKEFILE


def test_blocks_and_commands_of_a_text():
    text = (
        "# Title\n```sh\na b  # why\nc \\\n  d\n```\n## Next\nSave this as `x.py`:\n```python\n# No heading\n1\n```\n"
    )
    assert list(sections(text)) == ["Title", "Next"]
    (block,) = page_commands.blocks(sections(text)["Title"])
    assert block.commands == ["a b", "c d"] and block.file is None
    assert next(page_commands.blocks(sections(text)["Next"])).file == "x.py"


# Why a command of arc-suite is not run here: the first that fits.
NOT_HERE = {
    r"\S+$|-|PROGRAM": "a name or a sketch",
    r"train|study|benchmark|export": "learners need JAX: make check-first-steps, make check-agents",
    r"view|studio|doctor": "they wait for people; their tests run them",
    r"play|\S+ .*\.html": "pages need the viewer that Node builds: make check-play",
    r"\S+ .*(go2|ppo\.zip|\.json|theirs|\.png:|RUN|FOLDER|FILE|ID\b)": "a file of the reader",
    r"\S+ .*runs/(?!tick-walk-ppo-0)": "a run of a learner",
    r"\S+ .*(--checkpoint|--quality|--verify)": "what another command left",
    r".*\w+:[a-z]": "a module that the page's own test saves",
    r"render (?!.* (-o|--output) )": "without a file to write",
    r"design": "a search of minutes; one that is too short breaks its constraints",
}
EVERY = [
    command
    for path in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    for command in page_commands.commands(path.read_text())
    if command.startswith("arc-suite ") and not any(re.match(f"arc-suite ({each})", command) for each in NOT_HERE)
]


@pytest.mark.release
@pytest.mark.parametrize("command", dict.fromkeys(EVERY))
def test_a_quick_command_runs(command, tmp_path, monkeypatch):
    """With one episode in place of many."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    run = tmp_path / "runs" / "tick-walk-ppo-0"  # in place of minutes of training
    run.mkdir(parents=True)
    (run / "policy.npz").write_bytes((ROOT / "arc_suite/policies/packaged/tick-walk.npz").read_bytes())
    _, *arguments = shlex.split(page_commands.shorten(command))
    done = programs.arc_suite(*arguments, cwd=tmp_path)
    assert done.returncode == 0, done.stderr


def test_most_commands_are_quick():
    assert len(set(EVERY)) >= 20
    assert not [command for command in EVERY if re.search(r"\b[A-Z]{2,}\b", command)]  # in place of a name
