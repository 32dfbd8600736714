"""`arc-suite collect`, run as a user runs it."""

import pathlib
import subprocess
import sys

import programs
import pytest

from arc_suite import data
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS

ID = "arc_suite/queen/walk/cpg-refined-20steps-v0"


@pytest.fixture(autouse=True)
def root(tmp_path, monkeypatch):
    """Where Minari keeps datasets."""
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    monkeypatch.setenv("COLUMNS", "200")  # of the tables that Minari's command prints
    return tmp_path / "datasets"


def run(*arguments):
    return programs.arc_suite("collect", *arguments)


@pytest.mark.slow
def test_collect_continue_verify_and_minaris_own_command(root):
    out = programs.passed(run("--steps=20", "--episodes=3"))  # no progress bar where nobody watches
    total = sum(summary["return"] for summary in data.open(ID).summaries()) / 3
    assert out.startswith(f"{ID}: 3 episodes, return {total:.1f}, deviation ")
    assert out.endswith(f", length 20.0, 0.1 MB in {root / ID}\n")
    line = f"{ID}: has 3 episodes already; --episodes=3 asks for no more\n"
    assert programs.passed(run("--steps=20", "--episodes=3")) == line
    assert programs.passed(run(f"--verify={ID}")) == f"{ID}: 3 episodes replayed, all bit-equal\n"
    minari = pathlib.Path(sys.executable).with_name("minari")
    listed = subprocess.run([minari, "list", "local"], capture_output=True, text=True, check=True).stdout
    assert ID in listed
    shown = subprocess.run([minari, "show", ID], capture_output=True, text=True, check=True).stdout
    assert "arc_suite/queen-walk-v0" in shown


@pytest.mark.slow
def test_a_mixture_with_noise_on_a_body_made_to_order():
    done = run("--legs=4", "--links=2", "--preset=slow,fast", "--noise=0.1", "--steps=10", "--episodes=2")
    dataset_id = "arc_suite/walker_4x2/walk/cpg-slow-fast-noise0_1-10steps-v0"
    assert programs.passed(done).startswith(f"{dataset_id}: 2 episodes")
    assert len(data.open(dataset_id).settings.setup.body.legs) == 4
    line = f"arc-suite collect: dataset {dataset_id!r} holds episodes of walker_4x2, and not of queen\n"
    programs.refused(run(f"--verify={dataset_id}", "--robot=queen"), line)


@pytest.mark.long
def test_datasets_have_other_falls_than_judges(root):
    flags = ["--robot=tick", "--task=recover", "--policy=zero", "--episodes=1", "--steps=3", "--id=arc_suite/falls-v0"]
    programs.passed(run(*flags))
    assert data.open("arc_suite/falls-v0").settings.setup == Setup.of("tick", "recover").learning()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--robot=all", "--id=some-v0"], f"--id=some-v0: names one dataset, and --robot=all makes {len(ROBOTS)}"),
        (["--episodes=4294967296"], "flag --episodes=4294967296: expected an integer in the range [1, 100000]"),
        (
            ["--id=queen/cpg"],
            "dataset id 'queen/cpg': expected names of letters, digits, '-' and '_' with '/' between, two characters "
            "at least before the last '/', and a version at the end alone, such as 'queen/cpg-v0'",
        ),
        (["--id="], "--id=: expected a value, got none"),
        (["--preset=expert"], "--preset=expert: is a quality of a run's policy, as in --policy RUN --quality expert"),
        (["--noise=-1"], "flag --noise=-1: expected a non-negative number"),
    ],
)
def test_bad_input_is_one_line_and_exit_status_1(root, arguments, message):
    programs.refused(run("--episodes=2", *arguments), f"arc-suite collect: {message}\n")
    assert not root.exists()


def test_an_unknown_dataset_is_one_line_with_the_folder(root):
    line = f"arc-suite collect: unknown dataset 'arc_suite/queen/cpg-v0': there are none in {root}\n"
    programs.refused(run("--verify=arc_suite/queen/cpg-v0"), line)


@pytest.mark.parametrize(("limit", "steps"), [pytest.param(50.5, 1010, marks=pytest.mark.release), (0.25, 5)])
def test_episodes_last_as_long_as_those_of_the_task(root, limit, steps):
    own = ("--robot=tick", "--policy=zero", "--episodes=1", f"--set=time_limit={limit}", "--id=arc_suite/limit-v0")
    done = programs.passed(run(*own, "--set=healthy_range=[0, 1]"))
    assert f"length {steps:.1f}, " in done


def test_no_more_steps_than_the_task_has(root):
    needed = "longer ones need task_kwargs={'time_limit': 50.05}, too"
    message = f"max_episode_steps: episodes of this task end after 1000 steps, got 1001; {needed}"
    programs.refused(run("--steps=1001"), f"arc-suite collect: {message}\n")
    message = "time_limit: expected a finite one, or --steps, as every episode of a dataset must end"
    programs.refused(run("--set=time_limit=Infinity"), f"arc-suite collect: {message}\n")
