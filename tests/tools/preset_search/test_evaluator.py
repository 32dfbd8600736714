"""The evaluator of presets: episodes of one vector environment equal those of single ones."""

import gaitless
import gymnasium
import mujoco
import numpy as np
from numpy.testing import assert_allclose, assert_array_equal
from preset_search import Evaluator
from refusals import refused

from arc_suite.cpg import Demonstrator
from arc_suite.cpg.presets import PRESETS
from arc_suite.envs.setup import Setup


def test_evaluator_plays_the_episodes_of_ordinary_environments():
    presets = [PRESETS["leaper"][name] for name in ("slow", "fast")]
    score = Evaluator(Setup.of("leaper"), presets=2, episodes=2, steps=30)(presets, range(5, 7))
    environment = gymnasium.make("arc_suite/leaper-walk-v0")
    for index, preset in enumerate(presets):
        for episode in range(2):
            policy = Demonstrator("leaper", preset)
            observation, _ = environment.reset(seed=5 + episode)
            total, smoothness, tilt, axis = 0.0, 0.0, 0.0, np.zeros(3)
            for _ in range(30):
                action = policy.act(environment.unwrapped.task.split(observation))
                observation, reward, _, _, info = environment.step(action)
                total += reward
                smoothness += info["reward_smoothness"]
                mujoco.mju_rotVecQuat(axis, (0.0, 0.0, 1.0), observation[1:5].astype(float))
                tilt += axis[0] ** 2 + axis[1] ** 2
            assert_allclose(score.rewards[index, episode], total / 30, rtol=1e-12)
            assert_allclose(score.style["smoothness"][index, episode], smoothness / 30, rtol=1e-12)
            assert_allclose(score.style["tilt"][index, episode], tilt / 30, rtol=1e-4)
    assert not score.falls.any()


def test_evaluator_counts_falls_and_pays_nothing_after_them():
    medium = PRESETS["leaper"]["medium"]
    folding = medium._replace(stiffness=3.0, center={"knee": -120.0, "ankle": -120.0}, sweep=0.0)
    score = Evaluator(Setup.of("leaper"), presets=2, episodes=1, steps=60)([folding, medium], [0])
    assert_array_equal(score.falls, [[True], [False]])
    environment, policy = gymnasium.make("arc_suite/leaper-walk-v0"), Demonstrator("leaper", folding)
    (observation, _), total, fallen = environment.reset(seed=0), 0.0, False
    while not fallen:
        action = policy.act(environment.unwrapped.task.split(observation))
        observation, reward, fallen, _, _ = environment.step(action)
        total += reward
    assert_allclose(score.rewards[0, 0], total / 60, rtol=1e-12)
    assert np.isfinite(score.style["posture"]).all()
    assert score.tipping[0] == 1.0
    assert 0.0 < score.tipping[1] < 0.1


def test_first_steps_may_count_for_nothing():
    presets = [PRESETS["leaper"]["medium"]]
    whole, first, last = (
        Evaluator(Setup.of("leaper"), 1, 2, steps, skipped=skipped)(presets, range(2))
        for steps, skipped in ((30, 0), (12, 0), (30, 12))
    )
    assert_allclose(30 * whole.rewards, 12 * first.rewards + 18 * last.rewards, rtol=1e-12)
    for name, costs in whole.style.items():
        assert_allclose(30 * costs, 12 * first.style[name] + 18 * last.style[name], rtol=1e-9)


def test_the_evaluator_needs_the_terms_of_style():
    line = "task stay: expected a reward with terms posture and smoothness, got upright, control"
    with gaitless.registered(), refused(line):
        Evaluator(Setup.of("tick", "stay"), 1, 1, 5)


def test_some_steps_count():
    with refused("steps: expected an integer from 21, got 20"):
        Evaluator(Setup.of("tick"), 1, 1, 20, skipped=20)
