"""The model card of a run: what it says, from a run of an algorithm that needs NumPy alone."""

import json
import pathlib
import re
import types

import programs
import pytest
import tiny_studies

from arc_suite import learning
from arc_suite.learning import cards
from arc_suite.learning.agents import configuration, run_folder

SETTINGS = {"time_limit": 0.25}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("runs") / "climber"
    learning.train("tick", algorithm="tiny_studies:climb", task_kwargs=SETTINGS, steps=20, folder=path)
    return path


@pytest.fixture(scope="module")
def run(folder):
    return configuration.read(folder / "config.json")


def test_a_card_says_what_a_hub_and_a_reader_want(run, folder, monkeypatch):
    monkeypatch.setattr(cards, "_draw", lambda run, folder: None)
    assert cards.write(run, folder) == folder / "README.md"
    card = (folder / "README.md").read_text()
    head = card.split("---")[1]
    fields = dict(line.split(": ", 1) for line in head.strip().splitlines())
    assert json.loads(fields["license"]) == "apache-2.0" and "walk" in json.loads(fields["tags"])
    returns = run_folder.latest_returns(run_folder.table(folder, "evaluations"))
    (result,) = json.loads(fields["model-index"])[0]["results"]
    assert result["metrics"][0]["value"] == pytest.approx(returns.mean(), abs=0.05)
    mean, low, high = map(float, re.search(r"return \| ([\d.]+), 95 % interval \[([\d.]+), ([\d.]+)\]", card).groups())
    assert low <= mean <= high and mean == pytest.approx(returns.mean(), abs=0.05)
    assert "| steps | 20 of 20 |" in card and '| settings | `{"time_limit": 0.25}` |' in card
    assert re.search(r"\| score \| -?\d\.\d\d, 95 % interval \[", card)
    assert f"arc-suite evaluate --policy {folder}" in card and f"\n{run.command}\n" in card
    assert re.search(r"policy, sha256 \| `[0-9a-f]{64}`", card) and "| mujoco | 3." in card
    assert "](picture.png)" not in card  # which was not drawn


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "several", "of_suite"),
    [("tick", False, True), ("spider", False, True), ("varied:0-9", True, True), ("dachs", False, False)],
)
def test_bodies_of_others_have_licenses_of_their_own(name, several, of_suite):
    run = types.SimpleNamespace(setup=types.SimpleNamespace(name=name, several=several))
    assert cards._is_of_suite(run) == of_suite
    assert ("looks are the suite's" in cards._license_text(run)) == of_suite
    assert (f"`{name}` is no robot of the suite" in cards._license_text(run)) != of_suite


def test_the_program_draws_the_policy(folder):
    module_folder = pathlib.Path(tiny_studies.__file__).parent
    done = programs.run("-m", "arc_suite", "card", str(folder), "--modules=tiny_studies", path=module_folder)
    assert programs.passed(done) == f"wrote {folder / 'README.md'}\n"
    assert (folder / "picture.png").stat().st_size > 5000
    assert "![picture.png](picture.png)" in (folder / "README.md").read_text()


def test_what_is_no_run_is_one_line(tmp_path):
    programs.refused(programs.arc_suite("card"), "arc-suite card: expected the folder of a run, such as")
    line = f"arc-suite card: {tmp_path}: no folder of a run\n"
    programs.refused(programs.arc_suite("card", str(tmp_path)), line)
