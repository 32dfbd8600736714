"""The evaluation protocol: seeded episodes and their figures."""

import contextlib

import numpy as np
import pytest
from returns import RETURNS

import arc_suite
from arc_suite import checks, data, evaluation, policies
from arc_suite.bodies import generator
from arc_suite.cpg import Demonstrator
from arc_suite.envs.setup import Setup
from arc_suite.evaluation import provenance


def test_episodes_are_seeded_and_sum_up_what_the_environment_says():
    environment = arc_suite.load("leaper", "walk", {"time_limit": 2.0})
    first, second, third = evaluation.episodes(environment, Demonstrator("leaper", "medium"), range(4, 7))
    assert evaluation.run(environment, Demonstrator("leaper", "medium"), 5) == second != first
    timestep, total, compliance, policy = environment.reset(6), 0.0, 0.0, Demonstrator("leaper", "medium")
    start = environment.physics.data.xpos[1, 0]  # of the torso's frame, as in the reward
    while not timestep.last():
        timestep = environment.step(policy(timestep))
        total += timestep.reward
        compliance += environment.task.terms["gait_bonus"]
    assert third.length == 40
    assert third.total == pytest.approx(total)
    assert third.progress.keys() == {"speed", "gait_compliance", "cost_of_transport"}
    assert third.progress["gait_compliance"] == pytest.approx(compliance / 40)
    assert third.progress["speed"] == pytest.approx((environment.physics.data.xpos[1, 0] - start) / 2.0)


def test_hashes_do_not_depend_on_print_options():
    """Those of a task and of a dataset's presets; all numbers of long arrays count."""
    setup = Setup.of("tick", "steer")
    record = data.DatasetSettings(setup, policy="cpg").provenance()
    with np.printoptions(precision=2, suppress=True, sign="+", threshold=2, legacy="1.13"):
        assert provenance.of_setup(setup) == provenance.of_setup(Setup.of("tick", "steer"))
        assert data.DatasetSettings(setup, policy="cpg").provenance() == record
        changed = checks.full_repr(np.arange(5000.0))
    assert changed == checks.full_repr(np.arange(5000.0)) and "2.500e+03" in changed


def test_policies_get_named_environments_and_the_reward_of_the_step_before():
    class Watching:
        def __init__(self):
            self.begun, self.rewards = [], []

        def reset(self, indices, seeds):
            self.begun.append((list(indices), list(seeds)))

        def act(self, observation, rewards):
            assert {name: block.shape for name, block in observation.items()} == {
                name: (1, size) for name, size in environment.task.sizes.items()
            }
            self.rewards.append(rewards)
            return np.full((1, 18), 0.1)

    environment, policy = arc_suite.load("tick", "steer", {"time_limit": 0.5}), Watching()
    steps = list(evaluation.rollout(environment, policy, seed=4))
    assert policy.begun == [([0], [4])]
    np.testing.assert_array_equal(policy.rewards, [[0.0], *([step.reward] for step in steps[1:-1])])
    episode = evaluation.run(environment, policy, seed=4)
    assert episode.progress.keys() == {"tracking", "fell", "gait_compliance", "cost_of_transport"}
    assert episode.total == sum(step.reward for step in steps[1:])


def test_watchers_see_every_step_in_the_environment():
    environment = arc_suite.load("tick", "walk", {"time_limit": 0.5})
    seen = []

    def watch(timestep):
        seen.append((timestep.reward, environment.physics.data.time))

    plain = evaluation.run(environment, Demonstrator("tick", "medium"), seed=4)
    episode = evaluation.run(environment, Demonstrator("tick", "medium"), seed=4, watchers=[watch, watch])
    assert episode == plain
    assert len(seen) == 2 * (1 + episode.length) and seen[0::2] == seen[1::2]
    assert seen[0][0] is None and sum(reward for reward, _ in seen[2::2]) == episode.total
    assert np.diff([time for _, time in seen[0::2]]) == pytest.approx(environment.control_timestep())


def test_returns_of_the_papers_demonstrators():
    for robot, returns in RETURNS.items():
        assert evaluation.paper_return(Setup.of(robot)) == returns.paper
        assert evaluation.paper_return(Setup.of(robot, "steer")) is None
        assert evaluation.paper_return(Setup.of(robot, "walk", {"gait": "wave"})) is None
    assert evaluation.paper_return(Setup.of(generator.generate(4, 2))) is None


def test_a_final_policy_is_judged_on_100_episodes():
    environment = arc_suite.load("tick", "walk", {"time_limit": 0.1})
    assert len(evaluation.episodes(environment, Demonstrator("tick", "medium"))) == 100


def test_episodes_that_need_not_end_are_one_line():
    setup, line = (
        Setup.of("tick", "walk", {"time_limit": np.inf}),
        r"^time_limit: expected a finite number, ",
    )
    environment = setup.load()
    with pytest.raises(ValueError, match=line):
        evaluation.episodes(environment, Demonstrator("tick", "medium"))
    assert len(list(evaluation.rollout(environment, Demonstrator("tick", "medium"), seed=0, max_steps=3))) == 4
    zero = policies.policy("zero", "tick", num_envs=2)
    with contextlib.closing(setup.make_vec(2)) as endless, pytest.raises(ValueError, match=line):
        evaluation.episodes_in_batch(endless, zero, range(2))
    with contextlib.closing(setup.make_vec(2, max_episode_steps=3, autoreset_mode="Disabled")) as cut:
        assert [episode.length for episode in evaluation.episodes_in_batch(cut, zero, range(2))] == [3, 3]
