"""`arc_suite.evaluation.evaluate`: what `arc-suite evaluate` prints and writes, as a value."""

import json

import numpy as np
import programs
import pytest
from networks import of_many_bodies
from refusals import refused

from arc_suite.bodies import generator
from arc_suite.evaluation import evaluate
from arc_suite.policies import network

SHORT = {"time_limit": 0.5}


def test_the_program_prints_and_writes_the_same(tmp_path):
    path = tmp_path / "a.json"
    flags = ("--robot=queen", "--episodes=2", "--seed=3", "--set=time_limit=0.5", f"--json={path}")
    heading, _, row = programs.passed(programs.arc_suite("evaluate", *flags)).splitlines()
    report = evaluate("cpg", "queen", task_kwargs=SHORT, episodes=2, seed=3, progress=iter)
    assert str(report).split() == f"{heading} {row}".split()
    written = json.loads(path.read_text())["robots"]["queen"]
    assert written["return"]["mean"] == report.returns.mean and written["preset"] == report.preset == "refined"
    assert written["episodes"][1]["total"] == report.episodes[1].total
    assert written["score"] == report.score and report.returns.episodes == 2
    zero, demonstrator, _ = written["anchors"].values()
    assert report.score == pytest.approx((report.returns.mean - zero) / (demonstrator - zero))


def test_policies_of_any_kind():
    body = generator.generate(4, 2)
    still = evaluate("zero", body, task_kwargs=SHORT, episodes=1)
    mine = evaluate(lambda timestep: np.zeros(8), body, task_kwargs=SHORT, episodes=1)
    assert mine.returns.mean == pytest.approx(still.zero) and mine.preset is None
    trained = network.load(network.PACKAGED / "tick-walk.npz")
    report = evaluate(trained, task_kwargs=SHORT, episodes=1)  # which brings its robot and task
    assert report.setup.body.name == "tick" and report.setup.task_kwargs == SHORT
    assert report.episodes == evaluate(network.PACKAGED / "tick-walk.npz", task_kwargs=SHORT, episodes=1).episodes


def test_policies_of_several_bodies_and_tasks_by_their_folder(tmp_path, monkeypatch):
    """They play in the first of their tasks, on a body that the caller names."""
    (tmp_path / "several").mkdir()
    network.save(tmp_path / "several" / network.FILE, of_many_bodies(task="steer,walk"))
    monkeypatch.chdir(tmp_path)
    report = evaluate("several", "tick", task_kwargs=SHORT, episodes=1)
    assert report.setup.task == "steer" and report.setup.task_kwargs == SHORT
    with refused("robot: expected a body, as the policy learned on several: random:0-1, steer+walk"):
        evaluate("several")


def test_what_does_not_fit_is_one_line():
    with refused("robot: expected a body, as the policy brings none"):
        evaluate("cpg")
    with refused("episodes: expected an integer from 1, got 0"):
        evaluate("cpg", "queen", episodes=0)
    with refused("policy: expected a name, a policy or a function of a TimeStep, got int"):
        evaluate(3, "queen")
    trained = network.load(network.PACKAGED / "tick-walk.npz")
    learned = trained._replace(training_seeds=(range(7, 9),))
    with refused("policy: learned from episodes of seeds 7 to 8; those below 10000 are evaluation's"):
        evaluate(learned, seed=5)
