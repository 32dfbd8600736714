"""`arc_suite.learning.train`: one call from a name to a policy that plays."""

import functools
import pathlib
import re
import tempfile

import interpreters
import numpy as np
import pytest
import tiny_studies  # noqa: F401 (the module of an algorithm that needs NumPy alone)
from refusals import refused
from tqdm import tqdm

from arc_suite import evaluation, learning, policies
from arc_suite.learning.agents import run_folder

RUN = {"robot": "tick", "algorithm": "tiny_studies:climb", "task_kwargs": {"time_limit": 0.2}, "evaluate_every": 20}
train = functools.partial(learning.train, **RUN, progress=functools.partial(tqdm, disable=True))


def test_its_policy_plays_and_earns_what_its_folder_says(tmp_path):
    metrics = {}
    policy = train(steps=40, folder=tmp_path / "run", on_metrics=lambda step, found: metrics.update(found))
    environment = policy.setup.load()
    earned = evaluation.run(environment, policy, seed=9003).total
    table = run_folder.table(tmp_path / "run", "evaluations")
    assert earned == table["return"][-7] and metrics["return"] == pytest.approx(table["return"][-10:].mean())
    stored = policies.policy(tmp_path / "run", "tick", task=environment.task.definition)
    assert evaluation.run(environment, stored, seed=9003).total == earned


def test_the_code_of_the_page(monkeypatch):
    page = pathlib.Path(__file__).parents[2] / "docs" / "agents.md"
    blocks = re.findall(r"```python\n(.*?)```", page.read_text(), re.DOTALL)
    monkeypatch.setattr(learning, "train", lambda robot, minutes: train(steps=20, minutes=minutes))
    names = {}
    for block in blocks:
        exec(compile(block, str(page), "exec"), names)
    assert np.isfinite(names["earned"])
    assert names["info"]["progress_speed"] > 0.3  # m/s, of the packaged policy
    assert names["low"] < names["mean"] < names["high"]


def test_without_a_folder_nothing_stays(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    policy = train(steps=20, seed=1)
    assert not list(tmp_path.iterdir())
    assert np.isfinite(policy.actions(np.zeros((1, policy.size)))).all()


def test_minutes_that_are_over_before_the_first_evaluation(tmp_path):
    """Training goes on to that evaluation; the same call does no more, and one with more minutes ends the run."""
    for _ in range(2):
        train(steps=60, folder=tmp_path / "run", minutes=0.0)
    assert run_folder.table(tmp_path / "run", "evaluations")["step"].max() == 20
    train(steps=60, folder=tmp_path / "run", minutes=5.0)
    assert run_folder.table(tmp_path / "run", "evaluations")["step"].max() == 60


def test_errors_are_one_line():
    with refused("unknown algorithm 'ppoo'; did you mean 'ppo'?", begins=True):
        learning.train("tick", algorithm="ppoo")
    with refused("minutes: expected a finite number of at least 0, got -1"):
        train(minutes=-1)


def test_the_import_is_light():
    code = "import sys, arc_suite.learning; print(sorted({'jax', 'minari', 'matplotlib'} & sys.modules.keys()))"
    assert interpreters.printed(code) == ["[]"]
