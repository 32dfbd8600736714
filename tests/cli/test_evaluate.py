"""`arc-suite evaluate`, run as a user runs it."""

import importlib.metadata
import json
import pathlib
import re

import programs
import pytest
from returns import RETURNS

from arc_suite import policies
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors, reports, statistics
from arc_suite.robots import ROBOTS

FOOTNOTE = "The cost of transport is high where motors are strong: "


def evaluate(*arguments):
    return programs.arc_suite("evaluate", *arguments)


def evaluated(*arguments):
    """Return the lines that the program prints, without the footnote of robots with strong motors."""
    lines = programs.passed(evaluate(*arguments)).splitlines()
    return [line for line in lines if not line.startswith(FOOTNOTE)]


def test_table_of_all_robots(tmp_path):
    path = tmp_path / "a.json"
    short = ("--policy=random", "--episodes=2", "--set=time_limit=5")
    head, _, *rows = evaluated("--robot=all", *short, f"--json={path}")
    heads = "robot speed gait_compliance cost_of_transport return +- std zero score IQM [95 % interval] steps"
    assert head.split() == heads.split()
    assert [row.split()[0] for row in rows] == list(ROBOTS)
    reports = json.loads(path.read_text())["robots"]
    for row in rows:  # standing earns more than a fall
        total, zero = float(row.split()[4]), float(row.split()[7])
        assert zero == pytest.approx(reports[row.split()[0]]["zero_return"], abs=0.05)
        assert float(row.split()[8]) == pytest.approx(reports[row.split()[0]]["score"], abs=0.005)
        assert total < zero == pytest.approx(163.0, abs=20.0)


@pytest.mark.parametrize("body", ["--spec=spider", "--legs=7"])
def test_a_body_of_the_users_has_a_score(body):
    """Of its demonstrator against standing still, in the same episode."""
    *_, row = evaluated(body, "--episodes=1", "--set=time_limit=2")
    assert float(row.split()[9]) == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize(("robot", "strength"), [("queen", None), ("leaper", 137)])
def test_costs_of_transport_of_strong_motors_have_a_footnote(robot, strength):
    last = programs.passed(evaluate(f"--robot={robot}", "--episodes=1", "--set=time_limit=0.5")).splitlines()[-1]
    line = f"{FOOTNOTE}{robot} ({strength} times weight times height). Compare policies of one body."
    assert last == line if strength else last.startswith(robot)


@pytest.mark.release
def test_the_papers_returns_stand_beside_medium_alone(tmp_path):
    path = tmp_path / "a.json"
    head, _, *rows = evaluated("--robot=all", "--preset=medium", "--episodes=1", f"--json={path}")
    assert head.endswith("steps  paper's cpg")
    rows = {line.split()[0].strip(","): line for line in rows}
    over_all = rows.pop("all", None)  # where the paper has all robots
    assert list(rows) == list(ROBOTS) and (over_all is None) == (RETURNS.keys() != ROBOTS.keys())
    if over_all:
        assert re.match(r"all +IQM of return / paper's cpg: 1\.0\d\d \[\d\.\d{3}, \d\.\d{3}\]$", over_all)
        assert json.loads(path.read_text())["return_over_paper"]["iqm"] == pytest.approx(1.0, abs=0.05)
    for robot, returns in RETURNS.items():
        assert rows[robot].split()[-1] == f"{returns.paper:.0f}"


def test_the_preset_is_the_one_that_suits_task_and_body(tmp_path):
    path = tmp_path / "a.json"
    for arguments, preset in (
        (["--robot=queen"], "refined"),
        (["--legs=4"], "straight"),
        (["--robot=leaper", "--task=rough"], "climbing"),
        (["--robot=queen", "--preset=slow"], "slow"),
    ):
        lines = evaluated(*arguments, "--episodes=1", "--set=time_limit=0.5", f"--json={path}")
        ((name, report),) = json.loads(path.read_text())["robots"].items()
        assert lines[2].startswith(f"{name}, {preset} ") and report["preset"] == preset


@pytest.mark.parametrize(
    ("score", "metrics", "preset", "line"),
    [
        (
            0.9,
            {"distance": 0.2, "tracking": 0.9},
            None,
            ", climbing, whose distance may be as low: see --policy cpg --",
        ),
        (0.9, {"tracking": 0.2}, "climbing", "score 0.90 with tracking 0.20: score 1 is the return of the best dem"),
        (0.4, {"distance": 0.2}, None, None),
        (0.9, {"distance": 0.6, "tracking": 0.1}, None, None),
        (0.9, {"speed": 0.1}, None, None),
        (None, {"distance": 0.2}, None, None),
    ],
)
def test_a_caution_names_the_demonstrator(score, metrics, preset, line):
    means = {name: statistics.summary([value]) for name, value in metrics.items()}
    setup = Setup.of("queen", "rough")
    values = {"returns": means, "zero": 0.0, "length": means, "paper_return": None, "episodes": ()}
    scale = anchors.Anchors(0.0, 1.0, "climbing")
    report = reports.Report(setup, preset, score=score, progress=means, scale=scale, **values)
    assert line in report.caution if line else report.caution == ""


def test_a_demonstrator_that_earns_what_standing_still_does_gives_no_score(tmp_path):
    path = tmp_path / "a.json"
    place = ("--robot=leaper", "--task=rough", "--episodes=1", "--set=time_limit=0.5", f"--json={path}")
    *_, row, line = evaluated(*place)
    reason = r"the best demonstrator, \w+, earns -?\d+\.\d, and standing still \d+\.\d"
    assert " - " in row and re.fullmatch(f"leaper, climbing: no score: {reason}", line)
    report = json.loads(path.read_text())["robots"]["leaper"]
    assert report["score"] is None and re.fullmatch(reason, report["no_score"])


@pytest.mark.slow
def test_figures_of_a_demonstrator():
    lines = evaluated("--robot", "queen", "--policy", "cpg", "--preset", "medium", "--episodes", "2")
    fields = lines[-1].split()
    assert fields[:2] == ["queen,", "medium"]
    assert float(fields[2]) == pytest.approx(0.5, abs=0.05)
    assert 0 < float(fields[3]) < 1
    assert float(fields[5]) == pytest.approx(RETURNS["queen"].medium, rel=0.015)
    assert float(fields[8]) == pytest.approx(1635.0, rel=0.015)
    assert 0.1 < float(fields[9]) < 0.3
    assert float(fields[10]) == pytest.approx(RETURNS["queen"].medium, rel=0.015)
    assert fields[11:] == ["[-]", "1000.0", f"{RETURNS['queen'].paper:.0f}"]


def test_json_holds_every_episode_and_the_versions(tmp_path):
    path = tmp_path / "evaluation.json"
    evaluated("--robot=leaper", "--policy=random", "--episodes=3", "--seed=5", f"--json={path}")
    report = json.loads(path.read_text())
    assert (report["policy"], report["seed"]) == ("random", 5)
    figures = report["robots"]["leaper"]
    assert figures["preset"] is None
    totals = [episode["total"] for episode in figures["episodes"]]
    assert len(totals) == 3
    assert figures["return"]["mean"] == pytest.approx(sum(totals) / 3)
    assert figures["length"]["episodes"] == 3
    assert figures["paper_return"] == RETURNS["leaper"].paper
    for package in ("mujoco", "dm_control", "numpy"):
        assert report["versions"][package] == importlib.metadata.version(package)
    assert "arc_suite" in report["versions"]


def test_another_task_than_the_papers_has_no_return_of_the_paper(tmp_path):
    path = tmp_path / "evaluation.json"
    changed = ("--set=target_velocity=0.25", '--set=weights={"posture": -0.01}', "--set=gait=wave")
    short = ("--policy=random", "--episodes=1", "--set=time_limit=5")
    rows = [line.split() for line in evaluated("--robot=all", *short, *changed, f"--json={path}")[2:]]
    assert [row[0] for row in rows] == list(ROBOTS)
    report = json.loads(path.read_text())
    settings = {"target_velocity": 0.25, "weights": {"posture": -0.01}, "gait": "wave", "time_limit": 5}
    assert (report["task"], report["task_kwargs"]) == ("walk", settings)
    assert "return_over_paper" not in report
    assert {figures["paper_return"] for figures in report["robots"].values()} == {None}
    assert evaluated("--robot=queen", *short)[2].split()[4] != rows[0][4]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([f"--seed={2**32 - 1}"], "seed: expected an integer from 0 to 4294967295, got 4294967394"),
        (["--json=/nowhere/a.json"], "cannot write /nowhere/a.json: no such file or directory"),
        (["--episodes=0"], "flag --episodes=0: expected an integer in the range [1, 100000]"),
        (["--episodes=1e20"], "flag --episodes=1e20: expected an integer in the range [1, 100000]"),
        (["--set=time_limit=Infinity"], "time_limit: expected a finite number, as every episode must end, got inf"),
    ],
)
def test_bad_input_is_one_line_and_exit_status_1(arguments, message):
    programs.refused(evaluate(*arguments), f"arc-suite evaluate: {message}\n")


@pytest.mark.slow
def test_standing_still_has_score_0(tmp_path):
    path = tmp_path / "zero.json"
    lines = evaluated("--robot=tick", "--policy=zero", "--episodes=2", f"--json={path}")
    report = json.loads(path.read_text())["robots"]["tick"]
    assert abs(float(lines[-1].split()[8])) < 0.02
    setup = Setup.of("tick")
    scale = anchors.anchors(setup, range(2))
    assert report["zero_return"] == pytest.approx(anchors.committed_returns(setup)["zero"][:2].mean())
    assert report["score"] == pytest.approx(scale.score(report["return"]["mean"]))


def test_the_return_of_standing_still_is_that_of_the_first_ten_episodes(tmp_path):
    path = tmp_path / "zero.json"
    evaluated("--robot=tick", "--policy=zero", "--episodes=11", "--set=time_limit=0.5", f"--json={path}")
    report = json.loads(path.read_text())["robots"]["tick"]
    assert report["zero_return"] == pytest.approx(sum(each["total"] for each in report["episodes"][:10]) / 10)


@pytest.mark.slow
def test_a_folder_may_have_the_name_of_an_algorithm(tmp_path):
    (tmp_path / "sac").mkdir()
    packaged = pathlib.Path(policies.__file__).parent / "packaged" / "tick-walk.npz"
    (tmp_path / "sac" / "policy.npz").write_bytes(packaged.read_bytes())
    done = programs.arc_suite("evaluate", "--robot=tick", "--policy=sac", "--episodes=1", cwd=tmp_path)
    assert programs.passed(done)
