"""Proximal policy optimisation."""

import dataclasses
import shutil

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

pytest.importorskip("jax", reason="of the extra agents: make check-agents")

import jax

from arc_suite.agents import on_policy, run_folder
from arc_suite.agents import proximal_policy as ppo
from arc_suite.agents.algorithms import ALGORITHMS
from arc_suite.agents.hyperparameters import Imitation, ProximalPolicy
from arc_suite.agents.learner import Stage
from arc_suite.agents.training import Run, train
from arc_suite.policies import network
from arc_suite.robots import ROBOTS, generator

SMALL = ProximalPolicy(rows=4, horizon=8, minibatch=16, epochs=2, hidden=16)


def stage(tmp_path, robot="leaper", task="walk", steps=320, **settings):
    body = ROBOTS[robot] if isinstance(robot, str) else robot
    return Stage(body, task, settings, 3, steps, tmp_path)


def learned(learner, steps):
    while learner.step < steps:
        figures = learner.advance(steps)
    return figures


def weights(tree):
    return np.concatenate([np.ravel(leaf) for leaf in jax.tree.leaves(tree)])


@pytest.fixture
def imitated(tmp_path):
    """The folder of a short run of imitation."""
    definition = ALGORITHMS["imitation"]._replace(row=Imitation(rows=4, round=10, left_out=0, hidden=16, batch=64))
    settings = {"time_limit": 0.5}
    run = Run(ROBOTS["leaper"], "imitation", definition, "walk", settings, steps=80, evaluate_every=80)
    assert train(run, tmp_path / "imitated")
    return tmp_path / "imitated"


def test_advantages_are_discounted_sums_of_surprises_within_an_episode():
    row = ProximalPolicy(discount=0.9, trace=0.8)
    random = np.random.default_rng(0)
    rewards, values, following = random.normal(size=(3, 12, 5))
    terminated = random.uniform(size=(12, 5)) < 0.15
    ended = terminated | (random.uniform(size=(12, 5)) < 0.15)
    assert (ended & ~terminated).any() and terminated.any()
    found = ppo.advantages(row, rewards, values, following, terminated, ended)
    for step in range(12):
        for place in range(5):
            total, factor = 0.0, 1.0
            for later in range(step, 12):
                worth = 0.0 if terminated[later, place] else following[later, place]
                total += factor * (rewards[later, place] + 0.9 * worth - values[later, place])
                factor *= 0.9 * 0.8
                if ended[later, place]:
                    break
            assert found[step, place] == pytest.approx(total, abs=1e-12)


def batch(random, count=64, size=6, joints=3):
    arrays = random.normal(size=(count, size)), random.normal(size=(count, joints)), np.zeros((count, joints))
    return ppo.Batch(*(array.astype(np.float32) for array in (*arrays, random.normal(size=count), np.ones(count))))


def test_the_policy_moves_towards_what_earned_more_and_values_towards_returns():
    row, random = dataclasses.replace(SMALL, policy_rate=1e-3), np.random.default_rng(0)
    state = ppo.begin(row, random, 6, 3)
    given = batch(random)
    given = given._replace(means=np.asarray(ppo.mean_action(state.policy, given.observations)))
    before = np.asarray(ppo.value(state.values, given.observations))
    orders = np.tile(np.arange(64), (30, 1))
    after, divergence, _ = ppo.update(row, state, given, orders, (np.float32(0.5), np.float32(0.01)), True)
    moved = np.asarray(ppo.mean_action(after.policy, given.observations)) - given.means
    gained = (moved * (given.actions - given.means)).sum(axis=-1) * given.advantages
    assert gained.mean() > 0.0
    acted = moved[: row.rows * row.horizon]  # what follows are images
    assert divergence == pytest.approx((acted**2).sum(axis=-1).mean() / (2 * 0.5**2), rel=1e-3)
    values = np.asarray(ppo.value(after.values, given.observations))
    assert abs(values - 1.0).mean() < 0.8 * abs(before - 1.0).mean()


def test_nothing_is_gained_beyond_the_clip():
    """Where all ratios are beyond the clip on the side that pays, the policy has no gradient."""
    row, random = dataclasses.replace(SMALL, clip=0.2), np.random.default_rng(0)
    state = ppo.begin(row, random, 6, 3)
    given = batch(random)
    means = np.asarray(ppo.mean_action(state.policy, given.observations))
    given = given._replace(means=means + 1.0, actions=means, advantages=np.ones(64, np.float32))
    before = weights(state.policy)
    orders, numbers = np.arange(64)[None], (np.float32(0.5), np.float32(0.01))
    after, *_ = ppo.update(row, state, given, orders, numbers, True)
    assert_array_equal(weights(after.policy), before)


@pytest.mark.parametrize(("wanted", "factor"), [(1e-9, 1 / 1.5), (1e9, 1.5)])
def test_the_rate_follows_the_divergence(wanted, factor):
    random = np.random.default_rng(0)
    state, given = ppo.begin(SMALL, random, 6, 3), batch(random)
    orders, numbers = np.arange(64)[None], (np.float32(0.5), np.float32(wanted))
    after, *_ = ppo.update(SMALL, state, given, orders, numbers, True)
    assert after.rate == pytest.approx(SMALL.policy_rate * factor)


@pytest.mark.parametrize("task", ["walk", "steer"])
def test_it_goes_on_to_the_bit(tmp_path, task):
    given = stage(tmp_path, "tick", task)
    whole, first, second = (on_policy.begin(SMALL, given) for _ in range(3))
    learned(whole, 320)
    learned(first, 128)
    arrays = {name: array.copy() for name, array in first.arrays().items()}
    second.restore(arrays)
    assert second.step == 128
    learned(second, 320)
    for name, array in whole.arrays().items():
        assert_array_equal(second.arrays()[name], array, err_msg=name)


def test_every_step_counts_for_its_mirror_image_too(tmp_path):
    learner = on_policy.begin(SMALL, stage(tmp_path))
    learned(learner, 64)
    seen, _ = learner._acted(0.3)
    given, symmetry = learner._batch(seen), learner._environment.task.symmetry
    assert len(given.returns) == 2 * 32
    for name in ("advantages", "returns"):
        both = np.asarray(getattr(given, name))
        assert_array_equal(both[:32], both[32:])
    for name in ("actions", "means"):
        both = np.asarray(getattr(given, name))
        assert_array_equal(symmetry.action(both[:32]), both[32:])
    image = symmetry.observation(seen["observations"].reshape(32, -1))
    assert_array_equal(network.forward([learner._normaliser], image), given.observations[32:])
    # The normaliser has seen as much of the left as of the right.
    mean = symmetry.observation(learner._moments.mean)
    assert_allclose(mean, learner._moments.mean, atol=1e-9)


def test_a_body_without_a_mirror_image_learns_from_what_it_does(tmp_path):
    learner = on_policy.begin(SMALL, stage(tmp_path, generator.random_body(10)))
    learner.advance(320)
    seen, _ = learner._acted(0.3)
    assert len(learner._batch(seen).returns) == 32


def test_time_limits_of_the_rows_fall_on_different_steps(tmp_path):
    learner = on_policy.begin(SMALL, stage(tmp_path, time_limit=0.4, healthy_range=(-10.0, 10.0)))
    seen, _ = learner._acted(0.3)
    assert [np.flatnonzero(ended).tolist() for ended in seen["ended"].T] == [[7], [5], [3], [1]]
    assert not seen["terminated"].any()
    # After the last step of an episode comes its own last observation, not the next one's first.
    following = seen["following"][1, 3]
    assert not np.array_equal(following, seen["observations"][2, 3])
    clock = learner._environment.task.split(following)["gait_clock"]
    first = learner._environment.task.split(seen["observations"][2, 3])["gait_clock"]
    assert_allclose(first, (0.0, 1.0))
    assert clock[0] > 0.5


def test_an_episode_that_was_cut_off_is_worth_what_would_have_come(tmp_path):
    learner = on_policy.begin(SMALL, stage(tmp_path, time_limit=0.4, healthy_range=(-10.0, 10.0)))
    seen, _ = learner._acted(0.3)
    returns = np.asarray(learner._batch(seen).returns)[:32].reshape(8, 4)
    normalised = network.forward([learner._normaliser], seen["following"][1, 3][None])
    worth = np.asarray(ppo.value(learner._state.values, normalised))[0]
    row = learner._row
    expected = (1.0 - row.discount) * seen["rewards"][1, 3] + row.discount * worth
    assert returns[1, 3] == pytest.approx(expected, rel=1e-5)


def test_standard_deviation_falls_and_what_is_seen_is_normalised_for_part_of_the_run(tmp_path):
    learner = on_policy.begin(dataclasses.replace(SMALL, normalising=0.5), stage(tmp_path))
    figures = learner.advance(320)
    assert figures["std"] == SMALL.first_std
    learned(learner, 192)
    layer = learner.policy()[0]
    last = learned(learner, 320)
    assert_array_equal(learner.policy()[0].arrays[0], layer.arrays[0])
    assert last["std"] == pytest.approx(SMALL.first_std * (SMALL.last_std / SMALL.first_std) ** 0.9)


def test_it_starts_from_a_policy_and_lets_values_learn_first(tmp_path, imitated):
    row = dataclasses.replace(SMALL, start=str(imitated), warm_up=16)
    learner, start = on_policy.begin(row, stage(tmp_path)), network.load(imitated)
    observations = np.random.default_rng(0).normal(size=(5, sum(start.blocks.values()))).astype(np.float32)
    for _ in range(2):  # the warm-up
        assert_array_equal(network.forward(learner.policy(), observations), start.actions(observations))
        values = weights(learner._state.values)
        learner.advance(320)
        assert (weights(learner._state.values) != values).mean() > 0.3  # some inputs never move
    learner.advance(320)
    assert not np.array_equal(learner.policy()[1].arrays[0], start.layers[1].arrays[0])
    assert_array_equal(learner.policy()[0].arrays[0], start.layers[0].arrays[0])


def test_where_it_started_from_is_no_longer_needed(tmp_path, imitated):
    definition = ALGORITHMS["finetune"]._replace(row=dataclasses.replace(SMALL, start=str(imitated), warm_up=8))
    run = Run(ROBOTS["leaper"], "finetune", definition, "walk", {"time_limit": 0.5}, steps=96, evaluate_every=32)
    assert not train(run, tmp_path / "run", minutes=0.0)
    told = []

    def interrupting(step, figures):
        if step == 64:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train(run, tmp_path / "run", told=interrupting)
    shutil.rmtree(imitated)
    assert train(run, tmp_path / "run", told=lambda step, figures: told.append(step))
    assert told == [64, 64, 96, 96]


def test_a_start_that_does_not_fit_is_refused_in_one_line(tmp_path, imitated):
    observations = "a policy of walk for other observations than those of steer: command has 0 numbers, and not 6"
    for robot, task, row, message in (
        ("leaper", "steer", SMALL, f"{imitated}: {observations}"),
        ("leaper", "walk", dataclasses.replace(SMALL, hidden=32), f"{imitated}: expected 32 hidden units, got 16"),
        ("tick", "walk", SMALL, f"policy {imitated}: made for leaper, and not for tick"),
    ):
        with pytest.raises(ValueError) as error:
            on_policy.begin(dataclasses.replace(row, start=str(imitated)), stage(tmp_path, robot, task))
        assert str(error.value) == message
    with pytest.raises(ValueError, match=r"^start: expected the folder of a run whose policy is where learning "):
        on_policy.begin(ALGORITHMS["finetune"].row, stage(tmp_path))
    with pytest.raises(OSError, match="no such file"):
        on_policy.begin(dataclasses.replace(SMALL, start=str(tmp_path / "none")), stage(tmp_path))


def test_numbers_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match=r"^minibatch: expected at most the steps between updates, got 65$"):
        dataclasses.replace(SMALL, minibatch=65)
    with pytest.raises(ValueError, match=r"^rows: "):
        dataclasses.replace(SMALL, rows=0)


@pytest.mark.slow
def test_it_learns(tmp_path):
    """Standing still on the way to walking, in a minute: falls end."""
    row = dataclasses.replace(SMALL, rows=32, horizon=16, minibatch=256, hidden=64, epochs=4)
    row = dataclasses.replace(row, first_divergence=0.012, last_divergence=0.004)  # few steps tell less
    learner = on_policy.begin(row, stage(tmp_path, "tick", steps=30_000))
    first = learner.advance(30_000)
    last = learned(learner, 30_000)
    assert last["reward"] > first["reward"] + 0.1
    assert last["falls"] < first["falls"]


def test_a_run(tmp_path):
    definition = ALGORITHMS["ppo"]._replace(row=SMALL)
    run = Run(ROBOTS["tick"], "ppo", definition, "steer", {"time_limit": 0.5}, steps=64, evaluate_every=64)
    assert train(run, tmp_path / "run")
    assert len(run_folder.table(tmp_path / "run", "training")["reward"]) == 2
