"""The evaluation protocol: seeds, and how figures are summed up."""

import numpy as np
import pytest
from returns import RETURNS

import arc_suite
from arc_suite import evaluation, versions
from arc_suite.cpg import Demonstrator


def test_episodes_are_seeded_and_sum_up_what_the_environment_says():
    environment = arc_suite.load("leaper", "walk", {"time_limit": 2.0})
    first, second, third = evaluation.episodes(environment, Demonstrator("leaper"), range(4, 7))
    assert evaluation.run(environment, Demonstrator("leaper"), 5) == second != first
    timestep, total, compliance, policy = environment.reset(6), 0.0, 0.0, Demonstrator("leaper")
    start = environment.physics.data.xpos[1, 0]  # of the torso's frame, as in the reward
    while not timestep.last():
        timestep = environment.step(policy(timestep))
        total += timestep.reward
        compliance += environment.task.terms["gait_bonus"]
    assert third.length == 40
    assert third.total == pytest.approx(total)
    assert third.progress.keys() == {"speed", "gait_compliance"}
    assert third.progress["gait_compliance"] == pytest.approx(compliance / 40)
    assert third.progress["speed"] == pytest.approx((environment.physics.data.xpos[1, 0] - start) / 2.0)


def test_policies_get_named_rows_and_the_reward_of_the_step_before():
    class Watching:
        def __init__(self):
            self.begun, self.rewards = [], []

        def begin(self, rows, seeds):
            self.begun.append((list(rows), list(seeds)))

        def act(self, observation, rewards):
            assert {name: block.shape for name, block in observation.items()} == {
                name: (1, size) for name, size in environment.task.definition.blocks.items()
            }
            self.rewards.append(rewards)
            return np.full((1, 18), 0.1)

    environment, policy = arc_suite.load("tick", "steer", {"time_limit": 0.5}), Watching()
    steps = list(evaluation.rollout(environment, policy, seed=4))
    assert policy.begun == [([0], [4])]
    np.testing.assert_array_equal(policy.rewards, [[0.0], *([step.reward] for step in steps[1:-1])])
    episode = evaluation.run(environment, policy, seed=4)
    assert episode.progress.keys() == {"tracking", "gait_compliance"}
    assert episode.total == sum(step.reward for step in steps[1:])


def test_returns_of_the_papers_demonstrators():
    for robot, returns in RETURNS.items():
        assert evaluation.expert_return("walk", robot) == returns.paper
        assert evaluation.expert_return("steer", robot) is None
    assert evaluation.expert_return("walk", "spider") is None


def test_the_protocol_is_ten_episodes():
    environment = arc_suite.load("tick", "walk", {"time_limit": 0.1})
    assert len(evaluation.episodes(environment, Demonstrator("tick"))) == 10


def test_rollouts_stop_early():
    environment = arc_suite.load("tick", "walk")
    steps = list(evaluation.rollout(environment, Demonstrator("tick"), seed=0, max_steps=3))
    assert [step.first() for step in steps] == [True, False, False, False]


def test_interquartile_mean_cuts_a_quarter_at_either_end():
    assert evaluation.interquartile_mean([100.0, 2.0, 4.0, -50.0]) == 3.0
    assert evaluation.interquartile_mean(np.arange(10.0)) == 4.5  # 2 and 7 are the outermost that count
    assert evaluation.interquartile_mean([0, 0, 3, 3, 3, 3, 3, 9, 9, 90]) == 4.0
    assert evaluation.interquartile_mean([1.0, 2.0, 6.0]) == 3.0  # too few to cut any
    np.testing.assert_array_equal(evaluation.interquartile_mean([[4, 3, 2, 1], [0, 0, 8, 0]]), [2.5, 0.0])


def test_interval_holds_most_of_the_resamples():
    values = np.random.default_rng(1).normal(10.0, 2.0, 400)
    iqm, (low, high) = evaluation.iqm_and_interval([values])
    assert low < iqm < high
    # The interquartile mean of n normal values deviates by about 1.09 sigma / sqrt(n).
    assert high - low == pytest.approx(2 * 1.96 * 1.09 * 2.0 / 20.0, rel=0.15)
    assert evaluation.iqm_and_interval([values]) == (iqm, (low, high))


def test_interval_resamples_within_strata():
    iqm, interval = evaluation.iqm_and_interval([[0.0] * 4, [1.0] * 4])
    assert (iqm, interval) == (0.5, (0.5, 0.5))
    _, (low, high) = evaluation.iqm_and_interval([[0.0] * 4 + [1.0] * 4])
    assert low < 0.5 < high


def test_summary():
    summary = evaluation.summary([1.0, 2.0, 3.0, 10.0])
    assert summary.mean == 4.0
    assert summary.deviation == pytest.approx(np.sqrt((9 + 4 + 1 + 36) / 4))
    assert summary.iqm == 2.5
    assert 1.0 <= summary.interval[0] <= 2.5 <= summary.interval[1] <= 10.0
    assert summary.episodes == 4


@pytest.mark.filterwarnings("error")
def test_summary_of_what_is_undefined_or_infinite():
    assert evaluation.summary([np.nan, 3.0]) == (3.0, 0.0, 3.0, (3.0, 3.0), 1)
    assert np.isnan(evaluation.summary([np.nan]).mean)
    assert evaluation.summary([np.nan]).episodes == 0
    infinite = evaluation.summary([np.inf, 3.0])
    assert infinite.mean == infinite.iqm == infinite.interval[1] == np.inf
    assert infinite.interval[0] == 3.0
    assert np.isnan(infinite.deviation)


def test_versions():
    import mujoco

    found = versions.recorded()
    assert list(found) == ["arc_suite", "mujoco", "dm_control", "numpy"]
    assert found["mujoco"] == mujoco.__version__
    assert found["numpy"] == np.__version__
