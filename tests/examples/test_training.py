"""The training scripts run, and arc-suite evaluate judges what they save: `make check-sb3`."""

import json
import os
import pathlib
import subprocess
import sys

import programs
import pytest

pytest.importorskip("stable_baselines3", reason="of the extra `sb3`: make check-sb3")

ROOT = pathlib.Path(__file__).parents[2]
SCRIPTS = ROOT / "examples" / "training"


def run(script, *arguments, cwd):
    environ = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, SCRIPTS / script, *arguments], cwd=cwd, env=environ, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done


def test_sac_of_stable_baselines3(tmp_path):
    pytest.importorskip("matplotlib")
    done = run("sb3_sac.py", "--steps=704", "--checkpoints=1", "--episodes=1", "--output=tick", cwd=tmp_path)
    assert done.stderr == ""
    names = {"704.zip", "704_vecnormalize.pkl", "704.json", "curve.png"}
    assert {path.name for path in (tmp_path / "tick").iterdir()} == names
    report = json.loads((tmp_path / "tick" / "704.json").read_text())
    assert report["robots"]["tick"]["return"]["mean"] > 0.0


def test_ppo_of_stable_baselines3(tmp_path):
    pytest.importorskip("matplotlib")
    arguments = ("--task=steer", "--steps=128", "--checkpoints=1", "--episodes=1", "--output=tick")
    done = run("sb3_ppo.py", *arguments, cwd=tmp_path)
    assert done.stderr == ""
    names = {"128.zip", "128_vecnormalize.pkl", "128.json", "curve.png"}
    assert {path.name for path in (tmp_path / "tick").iterdir()} == names


def test_ppo_of_rsl_rl(tmp_path):
    pytest.importorskip("rsl_rl")
    run("rsl_rl_ppo.py", "--task=steer", "--steps=1536", cwd=tmp_path)
    (tmp_path / "rsl_rl_ppo.py").write_text((SCRIPTS / "rsl_rl_ppo.py").read_text())
    flags = ("--robot=tick", "--task=steer", "--policy=rsl_rl_ppo:make", "--episodes=1", "--set=time_limit=1")
    done = programs.arc_suite("evaluate", *flags, cwd=tmp_path)
    assert done.returncode == 0 and "\ntick " in done.stdout, done.stderr


def test_sac_of_sbx(tmp_path):
    pytest.importorskip("sbx")
    run("sbx_sac.py", "--steps=64", cwd=tmp_path)
    (tmp_path / "sbx_sac.py").write_text((SCRIPTS / "sbx_sac.py").read_text())
    done = programs.arc_suite(
        "evaluate", "--robot=tick", "--policy=sbx_sac:make", "--episodes=1", "--set=time_limit=1", cwd=tmp_path
    )
    assert done.returncode == 0 and "\ntick " in done.stdout, done.stderr
