"""`arc-suite style`, run as a user runs it."""

import json
import pathlib

import programs
import pytest

from arc_suite import data, style
from arc_suite.envs.setup import Setup
from arc_suite.robots import ROBOTS
from arc_suite.robots.spec_files import EXAMPLES
from arc_suite.style import METRICS

ROOT = pathlib.Path(__file__).parents[3]
SPIDER = EXAMPLES["spider"]
FROZEN = """
import numpy as np
def frozen(robot): return lambda time_step: np.zeros({"tick": 18, "leaper": 12}[robot])
def broken(robot): return lambda time_step: np.full(12, np.nan)
"""


def run(*arguments, cwd=None):
    return programs.arc_suite("style", *arguments, cwd=cwd)


def told(*arguments, cwd=None):
    """Return the lines that the program prints."""
    return programs.passed(run(*arguments, cwd=cwd)).splitlines()


@pytest.mark.long
def test_report_of_two_policies(tmp_path):
    (tmp_path / "own_walkers.py").write_text(FROZEN)
    figures, folder = tmp_path / "style.json", tmp_path / "pictures" / "leaper"
    asked = ("--robot=leaper", "--preset=medium", "--compare=own_walkers:frozen", "--episodes=2")
    lines = told(*asked, f"--json={figures}", f"--output={folder}", cwd=tmp_path)
    assert lines[1].split() == ["leaper", "unit", "prescribed", "cpg", "medium", "own_walkers:frozen"]
    rows = {line[:18].strip(): line[18:].split() for line in reversed(lines)}
    assert {name.replace("_", " ") for name in METRICS} <= rows.keys()
    assert rows["speed"][:2] == ["m/s", "0.600"]
    assert [float(field) for field in rows["speed"][2::3]] == pytest.approx([0.59, 0.0], abs=0.03)
    assert rows["duty factor"][0] == "0.600"
    assert rows["foot slip"][-1] == "-"
    assert "own_walkers:frozen: foot slip, cost of transport: -, as the robot gets nowhere" in lines
    assert lines.count("") == 3  # above the robot's table, and two of legs

    report = json.loads(figures.read_text(), parse_constant=pytest.fail)
    assert list(report["robots"]) == ["leaper"]
    assert set(report["versions"]) == {"arc_suite", "mujoco", "dm_control", "numpy"}
    cpg, frozen = report["robots"]["leaper"].values()
    assert cpg["seeds"] == frozen["seeds"] == [0, 1]
    assert cpg["return"]["mean"] == pytest.approx(2610, abs=150)
    assert cpg["metrics"].keys() == METRICS.keys()
    assert cpg["metrics"]["stride_length"]["unit"] == "m"
    assert cpg["metrics"]["stride_length"]["prescribed"] == 0.5
    assert cpg["metrics"]["foot_slip"]["legs"].keys() == {"fl", "fr", "rl", "rr"}
    assert frozen["metrics"]["cost_of_transport"]["robot"]["mean"] is None
    assert frozen["metrics"]["torque"]["robot"]["mean"] == 0.0
    assert sorted(path.name for path in folder.iterdir()) == ["gait.png", "path.png", "reward.png", "speed.png"]


@pytest.mark.release
def test_a_saved_body_beside_a_policy(tmp_path):
    saved, figures = tmp_path / "spider.npz", tmp_path / "style.json"
    told(f"--spec={SPIDER}", "--episodes=2", "--seed=4", f"--save={saved}", f"--json={figures}")
    assert [(track.body.name, track.seed) for track in style.load(saved)] == [("spider", 4), ("spider", 5)]

    recorded = json.loads(figures.read_text())["robots"]["spider"]["cpg"]

    told(f"--policy={saved}", "--compare=zero", "--episodes=3", f"--json={figures}")
    report = json.loads(figures.read_text())["robots"]["spider"]
    assert report["spider.npz"] == recorded
    assert (recorded["seeds"], report["zero"]["seeds"]) == ([4, 5], [0, 1, 2])
    assert report["zero"]["return"]["episodes"] == 3
    told(f"--spec={SPIDER}", f"--policy={saved}", "--episodes=1")
    twin = tmp_path / "twin" / "spider.npz"
    twin.parent.mkdir()
    twin.write_bytes(saved.read_bytes())
    twins = told(f"--policy={saved}", f"--compare={twin}", "--episodes=1")
    assert twins[1].split()[-2:] == [str(saved), str(twin)]
    for robot in ("tick", "all"):
        message = f"{saved}: expected tracks of {'queen' if robot == 'all' else robot}, got those of spider"
        programs.refused(run(f"--policy={saved}", f"--robot={robot}"), f"arc-suite style: {message}\n")


@pytest.mark.release
def test_a_dataset_beside_its_demonstrator(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    settings = data.DatasetSettings(Setup.of("tick"), "cpg", ("medium",), 0.2, steps=50)
    data.collect("arc_suite/tick/noisy-v0", settings, episodes=2)
    compare = ("--compare=cpg", "--compare_preset=medium")
    lines = told("--policy=arc_suite/tick/noisy-v0", *compare, "--episodes=2", f"--output={tmp_path}")
    assert lines[1].split() == ["tick", "unit", "prescribed", "arc_suite/tick/noisy-v0", "cpg", "medium"]
    change = next(line for line in lines if line.startswith("action change")).split()[2::3]
    assert float(change[0]) > float(change[1]) + 0.05


@pytest.mark.long
@pytest.mark.parametrize(("task", "preset"), [("steer", "steered"), ("staying:stay", "medium")])
def test_other_tasks(tmp_path, task, preset):
    fixtures = (ROOT / "tests" / "fixtures" / "gaitless.py").read_text()
    registering = "import arc_suite\narc_suite.register(module=__name__, tasks=(Stay,))\n"
    (tmp_path / "staying.py").write_text(fixtures + registering)
    saved, figures, folder = tmp_path / "tick.npz", tmp_path / "style.json", tmp_path / "pictures"
    asked = (f"--task={task}", "--set=time_limit=2", "--set=arena=bumps", "--episodes=1")
    files = (f"--save={saved}", f"--json={figures}", f"--output={folder}")
    lines = told("--robot=tick", f"--preset={preset}", *asked, *files, cwd=tmp_path)
    report = json.loads(figures.read_text(), parse_constant=pytest.fail)
    assert (report["task"], report["task_kwargs"]) == (task, {"time_limit": 2, "arena": "bumps"})
    recorded = report["robots"]["tick"][f"cpg {preset}"]
    measured = recorded["metrics"].keys()
    assert recorded["length"]["mean"] == 40
    names, rows = ["path.png", "reward.png", "speed.png"], {line[:18].strip() for line in lines}
    if task == "steer":
        assert measured == METRICS.keys() and "tracking" in rows
        names = ["gait.png", *names]
    else:
        assert measured == {name for name, metric in METRICS.items() if not metric.of_gait}
        assert "gait compliance" not in rows
    assert sorted(path.name for path in folder.iterdir()) == names

    # What was saved tells its task and settings; the same episode again gives the same figures.
    compare = (f"--policy={saved}", "--compare=cpg", f"--compare_preset={preset}", f"--json={figures}")
    again = run(*compare, "--episodes=1", cwd=tmp_path)
    if task == "steer":
        programs.passed(again)
        report = json.loads(figures.read_text())
        assert (report["task"], report["task_kwargs"]) == ("steer", {"time_limit": 2, "arena": "bumps"})
        assert list(report["robots"]["tick"].values()) == [recorded, recorded]
    else:  # a file imports nothing
        refusal = f"task {task!r}: files import nothing; import 'staying' first"
        programs.refused(again, f"arc-suite style: {saved}: {refusal}\n")
        told(*compare, *asked, cwd=tmp_path)
        assert list(json.loads(figures.read_text())["robots"]["tick"].values()) == [recorded, recorded]
    other = run(f"--policy={saved}", "--set=arena=flat", f"--task={task}", cwd=tmp_path)
    name = task.rpartition(":")[2]
    found = f'got those of tick, {name}, {{"arena": "bumps", "time_limit": 2}}\n'
    programs.refused(other, f'arc-suite style: {saved}: expected tracks of tick, {name}, {{"arena": "flat"}}, {found}')


@pytest.mark.release
def test_all_robots(tmp_path):
    lines = told("--robot=all", "--policy=random", "--episodes=1", f"--output={tmp_path}")
    headings = [line.split(maxsplit=1)[0] for line in lines if "prescribed" in line]
    assert headings == [name for robot in ROBOTS for name in (robot, f"{robot},")]
    assert sorted(str(path.relative_to(tmp_path)) for path in tmp_path.glob("*/*")) == sorted(
        f"{robot}/{name}.png" for robot in ROBOTS for name in ("gait", "path", "reward", "speed")
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--compare=cgp"], "unknown policy 'cgp'; did you mean 'cpg'? (there are: cpg, zero, random, ppo, universal)"),
        (["--compare=cpg"], "--compare: expected another one than 'cpg'"),
        (["--compare=none.npz"], "cannot read none.npz: no such file or directory"),
        (
            ["--policy=runs/none"],
            "cannot read runs/none: no such file; the id of a dataset ends in a version, such as runs/none-v0",
        ),
        (["--page=a.htm"], "--page=a.htm: expected a file that ends in .html"),
        (["--save=tracks.json"], "--save=tracks.json: expected a file that ends in .npz"),
        (["--save=a.npz", "--robot=all"], f"--save=a.npz: expected one robot, got {', '.join(ROBOTS)}"),
        (["--save=nowhere/a.npz"], "cannot write nowhere/a.npz: no such file or directory"),
        (
            ["--policy=own_walkers:froze"],
            "policy 'own_walkers:froze': module 'own_walkers' has no attribute 'froze'; did you mean 'frozen'?",
        ),
        (
            ["--compare=own_walkers:broken", "--robot=leaper", "--episodes=1"],
            "policy 'own_walkers:broken': episode of seed 0, step 0: "
            "action[0]: expected a number from -1 to 1, got nan",
        ),
        ([f"--seed={2**32 - 1}"], "seed: expected an integer from 0 to 4294967295, got 4294967296"),
        (["--json=nowhere/a.json"], "cannot write nowhere/a.json: no such file or directory"),
        ([f"--output={SPIDER}"], f"--output={SPIDER}: expected a folder, got the name of a file"),
    ],
)
def test_bad_input_is_one_line_and_exit_status_1(tmp_path, arguments, message):
    (tmp_path / "own_walkers.py").write_text(FROZEN)
    programs.refused(run(*arguments, cwd=tmp_path), f"arc-suite style: {message}\n")
