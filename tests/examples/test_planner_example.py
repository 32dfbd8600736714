"""The planner of examples: what it foresees is what happens, and it earns more than its candidates do."""

import pathlib
import runpy

import numpy as np

import arc_suite

PLANNER = runpy.run_path(str(pathlib.Path(__file__).parents[2] / "examples" / "planner.py"))


def test_a_plan_comes_true():
    environment, random = arc_suite.load("tick", "walk"), np.random.default_rng(0)
    environment.reset(seed=0)
    start = environment.snapshot()
    action = PLANNER["planned"](environment, random, candidates=8)
    foreseen = PLANNER["held"](environment, start, action, 6)
    environment.restore(start)
    assert sum(environment.step(action).reward for _ in range(6)) == foreseen
    others = np.random.default_rng(0).uniform(-1.0, 1.0, (8, 18))
    assert foreseen == max(PLANNER["held"](environment, start, other, 6) for other in others)


def test_main_earns():
    environment, random = arc_suite.load("tick", "walk"), np.random.default_rng(0)
    environment.reset(seed=0)
    drawn = sum(environment.step(random.uniform(-1.0, 1.0, 18)).reward for _ in range(5))
    assert PLANNER["main"](steps=5) > drawn
