"""`arc-suite evaluate`, run as a user runs it."""

import importlib.metadata
import json
import re

import programs
import pytest
from returns import RETURNS

from arc_suite.robots import ROBOTS


def evaluate(*arguments):
    return programs.arc_suite("evaluate", *arguments)


def test_table_of_all_robots():
    result = evaluate("--robot=all", "--policy=random", "--episodes=2")
    assert result.returncode == 0, result.stderr
    rows = {line.split()[0]: line for line in result.stdout.splitlines()[2:]}
    over_all = rows.pop("all", None)  # where the paper has all robots
    assert list(rows) == list(ROBOTS) and (over_all is None) == (RETURNS.keys() != ROBOTS.keys())
    if over_all:
        assert re.match(r"all +IQM of return / paper's cpg: 0\.\d{3} \[0\.\d{3}, 0\.\d{3}\]$", over_all)
    for robot, returns in RETURNS.items():
        assert rows[robot].split()[-1] == f"{returns.paper:.0f}"


@pytest.mark.slow
def test_figures_of_a_demonstrator():
    result = evaluate("--robot", "queen", "--policy", "cpg", "--preset", "medium", "--episodes", "2")
    assert result.returncode == 0, result.stderr
    fields = result.stdout.splitlines()[-1].split()
    assert fields[0] == "queen"
    assert result.stdout.splitlines()[0].split()[:4] == ["robot", "speed", "gait_compliance", "return"]
    assert float(fields[1]) == pytest.approx(0.5, abs=0.05)
    assert 0 < float(fields[2]) < 1
    assert float(fields[3]) == pytest.approx(RETURNS["queen"].medium, rel=0.015)
    iqm, low, high = (float(field.strip("[],")) for field in fields[6:9])
    assert low <= iqm <= high
    assert iqm == pytest.approx(RETURNS["queen"].medium, rel=0.015)
    assert fields[9] == "1000.0"


def test_json_holds_every_episode_and_the_versions(tmp_path):
    path = tmp_path / "evaluation.json"
    result = evaluate("--robot=leaper", "--policy=random", "--episodes=3", "--seed=5", f"--json={path}")
    assert result.returncode == 0, result.stderr
    report = json.loads(path.read_text())
    assert (report["policy"], report["preset"], report["seed"]) == ("random", None, 5)
    figures = report["robots"]["leaper"]
    totals = [episode["total"] for episode in figures["episodes"]]
    assert len(totals) == 3
    assert figures["return"]["mean"] == pytest.approx(sum(totals) / 3)
    assert figures["length"]["episodes"] == 3
    assert figures["expert_return"] == RETURNS["leaper"].paper
    for package in ("mujoco", "dm_control", "numpy"):
        assert report["versions"][package] == importlib.metadata.version(package)
    assert "arc_suite" in report["versions"]


def test_another_task_than_the_papers_has_no_expert(tmp_path):
    path = tmp_path / "evaluation.json"
    changed = ("--set=target_velocity=0.25", '--set=weights={"posture": -0.01}', "--set=gait=wave")
    result = evaluate("--robot=all", "--policy=random", "--episodes=1", *changed, f"--json={path}")
    assert result.returncode == 0, result.stderr
    rows = [line.split() for line in result.stdout.splitlines()[2:]]
    assert [(row[0], row[-1]) for row in rows] == [(robot, "-") for robot in ROBOTS]
    report = json.loads(path.read_text())
    assert report["task"] == "walk"
    assert report["task_kwargs"] == {"target_velocity": 0.25, "weights": {"posture": -0.01}, "gait": "wave"}
    assert "return_over_expert" not in report
    plain = evaluate("--robot=queen", "--policy=random", "--episodes=1").stdout.splitlines()[2].split()
    assert plain[-1] == f"{RETURNS['queen'].paper:.0f}"
    assert plain[3] != rows[0][3]


def test_json_is_refused_before_the_work_starts():
    result = evaluate("--json=/nowhere/a.json")
    assert (result.returncode, result.stdout) == (1, "")
    assert result.stderr == "arc-suite evaluate: cannot write /nowhere/a.json: no such file or directory\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([f"--seed={2**32 - 1}"], "seed: expected an integer from 0 to 4294967295, got 4294967304"),
        (["--episodes=0"], "flag --episodes=0: 0 is not an integer in the range [1, 100000]"),
        (
            ["--episodes=200000"],
            "flag --episodes=200000: 200000 is not an integer in the range [1, 100000]",
        ),
        (["--episodes=1e20"], "flag --episodes=1e20: invalid literal for int() with base 10: '1e20'"),
        (["--episode=3"], "Unknown command line flag 'episode'. Did you mean: episodes ?"),
        (["--set=time_limit=Infinity"], "time_limit: expected a finite number, as every episode must end, got inf"),
        (["queen"], "unexpected argument 'queen'; see --help"),
    ],
)
def test_bad_input_is_one_line_and_exit_status_1(arguments, message):
    result = evaluate(*arguments)
    assert result.returncode == 1
    assert result.stderr == f"arc-suite evaluate: {message}\n"
    assert result.stdout == ""


def test_help_shows_an_example_and_the_flags():
    result = evaluate("--help")
    assert "arc-suite evaluate --robot all --policy cpg" in result.stdout
    for flag in ("--robot", "--policy", "--preset", "--episodes", "--seed", "--json"):
        assert flag in result.stdout
