"""SAC in parallel environments: what an update sees, and how learning begins."""

import itertools

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from tiers import tiers

jax = pytest.importorskip("jax", reason="of the extra learn: make check-agents")

from conftest import small

from arc_suite.learning.agents import algorithms, off_policy
from arc_suite.learning.agents import soft_actor_critic as sac

NAME = "sac_parallel"


@pytest.fixture
def drawn(monkeypatch):
    """The batches of all updates, and whether the policy learned in them."""
    batches, update = [], off_policy.make_update

    def recording(hp, state, sums, batch, noise, next_actions):
        batches.append((jax.tree.map(np.array, batch), noise.action is not None))
        return update(hp, state, sums, batch, noise, next_actions)

    monkeypatch.setattr(off_policy, "make_update", recording)
    return batches


def test_its_hyperparameters():
    hp = algorithms.ALGORITHMS[NAME].hyperparameters
    expected = {"num_envs": 32, "utd_ratio": 0.375, "batch": 256, "learning_rate": 5e-4, "tau": 0.01, "n_step": 3}
    expected |= {"discount": 0.97, "reward_scale": 0.1, "initial_std": 0.3, "initial_temperature": 0.003}
    expected |= {"target_entropy": -0.6, "start_steps": 0, "prior": "none", "dropout": 0.0, "phase_updates": 0}
    expected |= {"symmetry_augmentation": True, "normalize": True, "exclude_blocks": ("contact_forces",)}
    assert {name: getattr(hp, name) for name in expected} == expected
    assert hp.updates_of_a_step == 12


def test_learning_begins_with_little_noise_around_zero():
    hp, size, joints = algorithms.ALGORITHMS[NAME].hyperparameters, 50, 18
    state = sac.begin(hp, np.random.default_rng(0), size, joints)
    observations = np.random.default_rng(1).standard_normal((64, size), np.float32)
    mean, log_std = sac.action_distribution(hp, state.policy, observations)
    assert np.abs(mean).max() < 0.1
    assert_allclose(np.exp(log_std), 0.3, rtol=0.1)
    assert float(np.exp(state.log_alpha)) == pytest.approx(0.003)


def test_the_policy_acts_from_the_first_step_and_updates_are_rarer_than_steps(learner, drawn):
    agent = learner(NAME, {"hidden": 16, "batch": 8})
    agent.until(64)
    assert agent.steps == 64 and agent.updates == len(drawn) == 24
    assert all(with_policy for _, with_policy in drawn)
    assert 0.2 < np.arctanh(agent.buffer.transitions_at(np.arange(32)).actions).std() < 0.4


@pytest.mark.parametrize(("n_step", "discounts"), [(1, {1.0}), (3, {1.0, np.float32(0.97), np.float32(0.97) ** 2})])
def test_what_an_update_sees(learner, drawn, n_step, discounts):
    """Rewards of its steps, scaled; inputs normalized, without contact forces; every other transition mirrored."""
    agent = learner(NAME, small(NAME, batch=64, start_steps=0, n_step=n_step))
    agent.until(200)
    task, (batch, _) = agent.task, drawn[-1]
    assert batch.observations.shape == (64, task.size) and "contact_forces" not in task.sizes
    ranges = np.array([[0, 200]])
    (places,), _ = off_policy.draw_update(agent.update_hp, 64, agent.inputs.joints, True, 0, agent.updates - 1, ranges)
    places = np.asarray(places)
    raw = agent.buffer.transitions_at(places, n_step, 0.97)
    assert_array_equal(batch.rewards, np.float32(0.1) * raw.rewards)
    assert_array_equal(batch.goes_on, raw.goes_on)
    assert set(np.unique(raw.goes_on)) - {0.0} == discounts
    mirrored = np.arange(64) % 2 == 1
    for name in ("observations", "next_observations"):
        whole = getattr(raw, name)
        whole = np.where(mirrored[:, None], agent.inputs.symmetry.observation(whole), whole)
        assert_array_equal(getattr(batch, name), agent.inputs(whole))
    actions = np.where(mirrored[:, None], agent.inputs.symmetry.action(raw.actions), raw.actions)
    assert_array_equal(batch.actions, actions)
    assert agent.inputs.moments.count == 2 * 200


@pytest.mark.parametrize(
    ("name", "network"),
    tiers(
        itertools.product((NAME, "xqc"), ("perceptron", "legs")),
        lambda name, network: (name == "xqc") == (network == "legs"),
    ),
)
def test_its_policy_takes_whole_observations(learner, name, network):
    agent = learner(name, small(name, network=network))
    found = agent.until(50)
    observations = agent.buffer.transitions_at(np.arange(50)).observations
    mean, _ = sac.action_distribution(agent.update_hp, agent.state.policy, agent.inputs(observations))
    assert_allclose(found.policy(observations), agent.inputs.body_actions(np.tanh(mean)), atol=1e-5)


@pytest.mark.parametrize("changes", [{}, {"n_step": 1}, {"symmetry_augmentation": False}])
def test_phases_and_prior_data_go_with_it(learner, prior, drawn, changes):
    """Transitions that are mirrored, or of several steps, have next actions of the policy that are not cached."""
    phases = {"phase_every": 95, "phase_updates": 40, "check_every": 20, "early_stop": "published", "batch": 16}
    agent = learner(NAME, small(NAME, prior="symmetric_sampling", **phases, **changes), prior=prior, evaluate_every=100)
    agent.advance()
    assert not agent.latest.is_complete and agent.usage.steps == 100 and agent.phase.next_actions is None
    agent.until(100)
    assert [with_policy for _, with_policy in drawn] == [True] * 20 + [False] * 40
    assert {len(batch.rewards) for batch, _ in drawn} == {32}


@pytest.mark.parametrize(
    ("changes", "line"),
    [
        ({"utd_ratio": 0.3}, r"^utd_ratio: expected a whole number of updates when 32 environments step, of each "),
        ({"utd_ratio": 1.5}, r"^utd_ratio: .* of each if it is above 1, got 1\.5$"),
        ({"utd_ratio": 0.0}, r"^utd_ratio: expected a whole number of updates"),
        ({"exclude_blocks": "contact_forces"}, r"^hyperparameter exclude_blocks: expected tuple like \('contact_fo"),
        ({"exclude_blocks": [3]}, r"^exclude_blocks: expected names of blocks, got \(3,\)$"),
        ({"initial_std": 0}, r"^initial_std: expected a number from 1e-06 to 1000, got 0$"),
    ],
)
def test_values_that_do_not_fit(changes, line):
    with pytest.raises(ValueError, match=line):
        algorithms.algorithm(NAME).with_hyperparameters(changes)


@pytest.mark.parametrize(
    ("num_envs", "utd_ratio", "updates"), [(100, 0.07, 7), (100, 0.29, 29), (3, 1 / 3, 1), (50, 0.14, 7), (4, 3.0, 12)]
)
def test_updates_of_a_step_are_whole_numbers_as_written(num_envs, utd_ratio, updates):
    changes = {"num_envs": num_envs, "utd_ratio": utd_ratio}
    hp = algorithms.algorithm(NAME).with_hyperparameters(changes).hyperparameters
    assert hp.updates_of_a_step == updates
    assert sum(count for count, _ in hp.update_groups()) == updates


def test_blocks_may_come_from_a_list():
    hp = algorithms.algorithm(NAME).with_hyperparameters({"exclude_blocks": ["posture"]}).hyperparameters
    assert hp.exclude_blocks == ("posture",)


def test_categorical_critics_take_no_dropout():
    with pytest.raises(ValueError, match=r"^dropout: expected 0 with categorical critics, got 0\.1$"):
        algorithms.algorithm("xqc").with_hyperparameters({"dropout": 0.1})
    with pytest.raises(ValueError, match=r"^unknown critics 'ranked'"):
        algorithms.algorithm("xqc").with_hyperparameters({"critics": "ranked"})
