"""tools/style.py, run as a user runs it."""

import json
import os
import pathlib
import subprocess
import sys

import pytest

from arc_suite.style import METRICS

TOOL = pathlib.Path(__file__).parents[1] / "tools" / "style.py"
FROZEN = """
import numpy as np
def frozen(robot): return lambda time_step: np.zeros({"tick": 18, "leaper": 12}[robot])
def broken(robot): return lambda time_step: np.full(12, np.nan)
"""


def run(*arguments, path=""):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(path), os.environ.get("PYTHONPATH", "")])}
    return subprocess.run([sys.executable, TOOL, *arguments], capture_output=True, text=True, env=environment)


def test_report_of_two_policies(tmp_path):
    (tmp_path / "own_walkers.py").write_text(FROZEN)
    figures, folder = tmp_path / "style.json", tmp_path / "pictures" / "leaper"
    done = run(
        "--robot=leaper",
        "--compare=own_walkers:frozen",
        "--episodes=2",
        f"--json={figures}",
        f"--output={folder}",
        path=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0] == "leaper, 2 episodes, mean +- standard deviation"
    rows = {line[:18].strip(): line for line in lines}
    assert {name.replace("_", " ") for name in METRICS} <= rows.keys()
    speeds = [float(field) for field in next(line for line in lines if line.startswith("speed")).split()[2::3]]
    assert speeds == pytest.approx([0.59, 0.0], abs=0.03)
    assert lines.count("") == 3  # between heading, robot, and two tables of legs

    report = json.loads(figures.read_text(), parse_constant=pytest.fail)
    assert (report["robot"], report["episodes"], report["seed"]) == ("leaper", 2, 0)
    assert set(report["versions"]) == {"arc_suite", "mujoco", "dm_control", "numpy"}
    cpg, frozen = report["policies"]["cpg medium"], report["policies"]["own_walkers:frozen"]
    assert cpg["return"]["mean"] == pytest.approx(2610, abs=150)
    assert cpg["metrics"].keys() == METRICS.keys()
    assert cpg["metrics"]["stride_length"]["unit"] == "m"
    assert cpg["metrics"]["foot_slip"]["legs"].keys() == {"fl", "fr", "rl", "rr"}
    assert frozen["metrics"]["cost_of_transport"]["robot"]["mean"] is None
    assert frozen["metrics"]["torque"]["robot"]["mean"] == 0.0
    assert sorted(path.name for path in folder.iterdir()) == ["gait.png", "path.png", "reward.png", "speed.png"]


def test_pictures_without_matplotlib_say_what_to_install(tmp_path):
    (tmp_path / "matplotlib.py").write_text("raise ModuleNotFoundError(\"No module named 'matplotlib'\")")
    done = run(f"--output={tmp_path}", path=tmp_path)
    message = "pictures need matplotlib: pip install 'arc_suite[plot]' (No module named 'matplotlib')"
    assert (done.returncode, done.stderr) == (1, f"style.py: {message}\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--robot=quen"], "unknown robot 'quen'; did you mean 'queen'? (there are: queen, bastion, tick, leaper)"),
        (["--compare=cgp"], "unknown policy 'cgp'; did you mean 'cpg'? (there are: cpg, zero, random)"),
        (["--compare=cpg"], "--compare: expected another policy than 'cpg medium'"),
        (["--policy=own_walkers:froze"], "policy 'own_walkers:froze': module 'own_walkers' has no attribute 'froze'"),
        (["--policy=own_walkers:broken", "--robot=leaper"], "action[0]: expected a number from -1 to 1, got nan"),
        (["--json=nowhere/a.json"], "cannot write nowhere/a.json: no such file or directory"),
        ([f"--output={TOOL}"], f"cannot make folder {TOOL}: file exists"),
        (["--episodes=0"], "flag --episodes=0: 0 is not a positive integer"),
    ],
)
def test_bad_input_is_one_line_and_exit_status_1(tmp_path, arguments, message):
    (tmp_path / "own_walkers.py").write_text(FROZEN)
    done = run(*arguments, path=tmp_path)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == f"style.py: {message}"  # on a line that a progress bar has left
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_help_shows_an_example_and_the_flags():
    done = run("--help")
    assert "python tools/style.py --robot queen" in done.stdout
    for flag in ("--robot", "--policy", "--preset", "--compare", "--episodes", "--seed", "--json", "--output"):
        assert flag in done.stdout
