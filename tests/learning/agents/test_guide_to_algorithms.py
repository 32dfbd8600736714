"""The guide to adding an algorithm: its code runs."""

import importlib.util
import pathlib
import re

import numpy as np
import programs
import pytest

ROOT = pathlib.Path(__file__).parents[3]
GUIDE = (ROOT / "docs" / "adding_an_algorithm.md").read_text()
MY_ALGORITHMS, RANDOM_SEARCH = re.findall(r"```python\n(.*?)```", GUIDE, re.DOTALL)
TRAIN_PATIENT, TRAIN_SEARCH, EVALUATE = re.findall(r"^arc-suite .*$", GUIDE, re.MULTILINE)


@pytest.fixture
def run(tmp_path):
    """Runs the guide's commands in the folder of its files, with other flags at the end."""
    (tmp_path / "my_algorithms.py").write_text(MY_ALGORITHMS)
    (tmp_path / "random_search.py").write_text(RANDOM_SEARCH)

    def command(text, *flags):
        done = programs.run(*text.split(), *flags, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return command


@pytest.mark.long
def test_a_new_learner(run, tmp_path):
    """It needs no JAX, resumes bit-exactly, and every program takes its policy."""
    short = ["--hp=directions=2", "--hp=horizon=20", "--evaluate_every=80", "--set", "time_limit=2"]
    for folder, steps in (("whole", []), ("broken", ["--minutes=0"]), ("broken", [])):
        run(TRAIN_SEARCH, *short, "--steps=160", "-o", f"runs/{folder}", *steps)
    whole, broken = ((tmp_path / "runs" / name / "checkpoint.npz") for name in ("whole", "broken"))
    with np.load(whole) as one, np.load(broken) as other:
        assert one["generation"] == other["generation"] == 2
        assert np.array_equal(one["weight"], other["weight"]) and one["weight"].any()
    (tmp_path / "runs" / "whole").rename(tmp_path / "runs" / "search")
    assert "\nleaper " in run(EVALUATE, "--episodes=1", "--set", "time_limit=2")


@pytest.mark.long
@pytest.mark.skipif(importlib.util.find_spec("jax") is None, reason="of the extra learn: make check-agents")
def test_new_hyperparameters(run, tmp_path):
    out = run(TRAIN_PATIENT, "--steps=50", "--hp=hidden=8", "--hp=batch=4", "--set", "time_limit=2")
    assert "\nruns/patient: finished, return " in out
