"""What has become of runs: the score to stop at, and when it was reached."""

import numpy as np
import pytest
from refusals import refused

from arc_suite.envs.setup import Setup
from arc_suite.evaluation import anchors
from arc_suite.learning import outcomes
from arc_suite.learning.agents.configuration import Configuration


def test_the_return_of_a_score():
    run = Configuration.of(Setup.of("tick", "walk"))
    scale = anchors.anchors(run.setup)
    assert outcomes.return_of_score(run, 0.5) == pytest.approx((scale.zero + scale.demonstrator) / 2.0)


def test_a_task_without_a_demonstrator_has_no_scores(monkeypatch):
    monkeypatch.setattr(anchors, "anchors", lambda *_: anchors.Anchors(1628.0))
    with refused("score 0.9: tick, walk has no scores: no demonstrator suits body and task"):
        outcomes.return_of_score(Configuration.of(Setup.of("tick", "walk")), 0.9)


def test_when_a_return_was_reached(tmp_path):
    lines = [f"{step},{step + noise}" for step in (100, 200, 300) for noise in (-10, 10)]
    (tmp_path / "evaluations.csv").write_text("\n".join(["step,return", *lines, ""]))
    (tmp_path / "times.csv").write_text("step,wall_seconds,cpu_seconds\n100,3.2,3.0\n200,7.6,5.4\n300,9.0,8.0\n")
    steps = [outcomes.first_step_above(tmp_path, level) for level in (-np.inf, 200.0, 200.5, 301.0)]
    assert steps == [100, 200, 300, None]
    assert outcomes.when(tmp_path, 200) == "at step 200, after 8 s (5 s of CPU time)"
    assert outcomes.first_step_above(tmp_path / "none", 0.0) is None


def test_each_figure_of_the_latest_evaluation_has_its_name(tmp_path):
    run = Configuration.of(Setup.of("tick", "walk"))
    scale = anchors.anchors(run.setup)
    (tmp_path / "evaluations.csv").write_text("step,return\n100,1000.0\n100,3000.0\n")
    zero_error, best_error = scale.errors
    assert outcomes.latest_result(run, tmp_path) == (
        f"return 2000.0 at step 100, deviation 1000.0, score {scale.score(2000.0):.2f} (standing still "
        f"{scale.zero:.1f}, demonstrator refined {scale.demonstrator:.1f}, standard errors {zero_error:.1f} and "
        f"{best_error:.1f}, over other seeds)"
    )
