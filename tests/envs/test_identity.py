"""A body is itself and not its name: own bodies with names of the suite stay apart in ids, tables and files."""

import programs
import pytest

from arc_suite import evaluation, registry
from arc_suite.data import DatasetSettings
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors
from arc_suite.learning.studies import benchmark, results
from arc_suite.learning.studies.tables import run
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec_files import body_to_json

NAMES = ("queen", "spider", "varied_7")  # of a robot, of a packaged spec and of a body of a family
WORDS = {"queen": "queen", "spider": "spider", "varied_7": "varied:7"}


def impostor(name):
    return ROBOTS["tick"].replace(name=name)


@pytest.mark.parametrize("name", NAMES)
def test_names_of_the_suite_are_those_of_its_bodies(name):
    setup = Setup.of(WORDS[name])
    assert (setup.name, str(setup), setup.env_id) == (name, f"{name}, walk", f"arc_suite/{name}-walk-v0")
    assert Setup.of(setup.body) == setup
    assert DatasetSettings(setup, presets=("medium",)).dataset_id() == f"arc_suite/{name}/walk/cpg-medium-v0"


@pytest.mark.parametrize("name", NAMES)
def test_other_bodies_of_these_names_are_told_apart(name):
    setup = Setup.of(impostor(name))
    own = setup.name
    assert own.startswith(f"{name}_") and len(own) == len(name) + 7
    assert (str(setup), setup.env_id) == (f"{own}, walk", f"arc_suite/{own}-walk-v0")
    assert DatasetSettings(setup, presets=("medium",)).dataset_id() == f"arc_suite/{own}/walk/cpg-medium-v0"
    heavier = Setup.of(impostor(name).replace(density=9.0))
    assert heavier.name not in (own, name)
    assert Setup.from_dict(setup.to_dict()) == setup


def test_names_that_the_suite_lacks_stay():
    assert registry.distinct_name(impostor("beetle")) == "beetle"
    assert registry.distinct_name(impostor("varied_007x")) == "varied_007x"
    assert registry.distinct_name(impostor("few_legs")) == "few_legs"


def test_figures_of_the_paper_are_those_of_its_robots():
    own, real = Setup.of(impostor("queen")), Setup.of("queen")
    assert evaluation.paper_return(real) and evaluation.paper_return(own) is None
    assert (
        evaluation.published_returns(real, ["sac"], 10**6) and evaluation.published_returns(own, ["sac"], 10**6) == {}
    )
    assert anchors.committed_returns(real) and anchors.committed_returns(own) is None


def test_runs_and_scores_of_a_body_of_ones_own():
    mine = run(body_to_json(impostor("queen")), "sac", 1000)
    assert (
        mine.name == f"{Setup.of(impostor('queen')).name}-walk-sac-0" and mine.place != run("queen", "sac", 1000).place
    )
    result = results.RunResult(mine, *[None] * 7)
    assert not results.is_in_paper(result)
    score = benchmark.RunScore(mine.configuration.setup.name, "walk", 0, 1.0, 1.0, 1.0, 1.0, 1.0)
    assert not any(benchmark.group_by_place([score]).values())


def test_evaluate_prints_the_name_that_the_body_has(tmp_path):
    (tmp_path / "queen.json").write_text(body_to_json(impostor("queen")))
    arguments = (
        "evaluate",
        "--spec=queen.json",
        "--policy=cpg",
        "--preset=medium",
        "--episodes=1",
        "--set=time_limit=1",
    )
    out = programs.passed(programs.arc_suite(*arguments, cwd=tmp_path))
    assert f"{Setup.of(impostor('queen')).name}, medium" in out and "paper" not in out
