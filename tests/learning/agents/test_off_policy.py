"""Algorithms by soft actor-critic: exploration, phases, their validation sets, and prior data."""

import numpy as np
import pytest
from tiers import tiers

jax = pytest.importorskip("jax", reason="of the extra learn: make check-agents")

from conftest import SHORT, small

from arc_suite import data
from arc_suite.envs.setup import Setup
from arc_suite.learning.agents import algorithms, off_policy, priors
from arc_suite.learning.agents import soft_actor_critic as sac
from arc_suite.learning.agents.configuration import Configuration
from arc_suite.tasks import Walk


@pytest.fixture
def batches(monkeypatch):
    """The observations of every update, and whether the policy learned in it."""
    calls, update = [], off_policy.make_update

    def recording(hp, state, sums, batch, noise, next_actions):
        calls.append((np.array(batch.observations), noise.action is not None))
        return update(hp, state, sums, batch, noise, next_actions)

    monkeypatch.setattr(off_policy, "make_update", recording)
    return calls


@pytest.fixture
def acted(monkeypatch):
    """An entry for each action of the policy."""
    steps, act = [], off_policy.policy_actions
    monkeypatch.setattr(off_policy, "policy_actions", lambda *inputs: steps.append(1) or act(*inputs))
    return steps


def set_of(observations):
    return {each.tobytes() for each in observations}


def every(source):
    return source.transitions_at(np.arange(len(source)))


def test_actions_are_uniform_while_the_buffer_is_small(learner, acted):
    """With 5000 start steps in the steps 1 to 5001; here 20."""
    agent = learner("sac", small("sac"))
    agent.until(21)
    assert not acted
    agent.until(22)
    assert len(acted) == 1
    actions = agent.buffer.transitions_at(np.arange(21)).actions
    assert np.abs(actions).max() > 0.9 and abs(actions.mean()) < 0.1


def test_a_step_that_diverges_has_the_observation_before_as_the_next_one(learner):
    """The body does not come from anywhere into the model's default state."""
    agent = learner("sac", small("sac"))
    agent.until(5)
    agent.environment.batch.data.qvel[0, 0] = 1e11
    agent.until(7)
    stored = every(agent.buffer)
    is_same = (stored.next_observations == stored.observations).all(axis=-1)
    assert is_same.tolist() == [False] * 5 + [True, False]
    assert stored.rewards[5] == 0.0 and stored.goes_on[5] == 1.0
    assert not np.array_equal(stored.observations[6], stored.observations[5])


def test_prior_data_in_the_same_buffer_end_exploration(learner, acted):
    learner("sacfd", small("sacfd")).until(1)
    assert len(acted) == 1


def test_protected_prior_data(learner, batches):
    """Batches are uniform over prior and online data; no prior transition is overwritten."""
    agent = learner("sacfd", small("sacfd", batch=64, buffer_size=50))
    agent.advance()
    prior = every(agent.prior).observations
    assert len(prior) == 1200
    agent.until(120)
    assert len(agent.sources[0]) == len(prior) + 50
    assert np.array_equal(every(agent.prior).observations, prior)
    known = set_of(prior)
    shares = np.array([np.mean([each.tobytes() in known for each in batch]) for batch, _ in batches[60:]])
    expected = len(prior) / (len(prior) + 50)
    assert shares.mean() == pytest.approx(expected, abs=4.0 * np.sqrt(expected / len(shares) / 64))


def test_symmetric_sampling_takes_a_batch_of_each_source(learner, batches):
    agent = learner("speq_o2o", small("speq_o2o"))
    agent.until(30)
    known = set_of(every(agent.prior).observations)
    for batch, _ in batches:
        assert [each.tobytes() in known for each in batch] == [False] * 8 + [True] * 8


@pytest.mark.parametrize("name", tiers(["speq", "sope_eo", "speq_o2o", "sope"], lambda name: name == "sope"))
def test_phases_follow_the_update_of_their_step(name, learner, batches):
    agent = learner(name, small(name), steps=200)
    agent.until(99)
    agent.advance()
    assert agent.step == 99 and not agent.latest.is_complete, "the phase of step 100 is to come"
    assert [with_policy for _, with_policy in batches] == [True] * 100
    policy = np.array(agent.state.policy["mean"]["weight"])
    targets = np.array(agent.state.targets[0][0]["weight"])
    alpha = float(agent.state.log_alpha)
    agent.until(100)
    count = len(batches) - 100
    assert not any(with_policy for _, with_policy in batches[100:])
    assert count == 60 or ("sope" in name and 40 <= count < 60)
    assert np.array_equal(policy, agent.state.policy["mean"]["weight"])
    assert alpha == float(agent.state.log_alpha)
    assert not np.array_equal(targets, agent.state.targets[0][0]["weight"])
    agent.until(200)
    assert agent.phase is None, "the last phase comes before the end"
    assert len(batches) >= 2 * (100 + 40)


@pytest.mark.parametrize("name", tiers(["sope_eo", "sope"], lambda name: name == "sope"))
def test_validation_set(name, learner, batches):
    """A tenth of the online transitions, and as many of the prior ones; updates of the phase never see them."""
    agent = learner(name, small(name), evaluate_every=100)
    agent.advance()
    held_out = agent.phase.held_out
    assert held_out == 10
    parts = [
        source.transitions_at(order[:held_out]) for source, order in zip(agent.sources, agent.phase.orders, strict=True)
    ]
    assert len(parts) == (2 if name == "sope" else 1)
    unseen = set_of(np.concatenate([part.observations for part in parts]))
    assert len(unseen) >= 0.9 * held_out * len(parts)  # a start may occur twice
    agent.until(100)
    seen = set_of(np.concatenate([batch for batch, with_policy in batches if not with_policy]))
    assert not seen & unseen
    batches.clear()
    agent.until(199)
    assert set_of(np.concatenate([batch for batch, _ in batches])) & unseen, "they are sampled again afterwards"


def test_at_least_a_batch_is_held_out_and_at_least_one_is_not(learner):
    agent = learner("sope_eo", small("sope_eo", phase_every=40, batch=16, start_steps=100), evaluate_every=100)
    agent.advance()
    assert agent.phase.held_out == 16


def test_phases_without_two_batches_are_skipped(learner):
    """Of online or of prior transitions, as published."""
    agent = learner("sope_eo", small("sope_eo", phase_every=30, batch=16, start_steps=100), evaluate_every=100)
    agent.advance()
    assert agent.steps == 60 and agent.phase.held_out == 16, "30 transitions are not two batches"
    agent = learner("sope", small("sope", batch=601, phase_every=30), steps=40, evaluate_every=40)
    agent.until(40)
    assert agent.updates == 40, "1200 prior transitions are not two batches"


def test_a_phase_ends_by_the_rule(learner, monkeypatch):
    losses = iter([-10.0, -11.0, -10.99, -10.98, -10.97, -20.0])
    monkeypatch.setattr(off_policy, "validation_loss", lambda *inputs: next(losses))
    agent = learner("sope_eo", small("sope_eo", early_stop="sign_safe", phase_updates=1000), evaluate_every=100)
    for updates in (0, 20, 40):
        agent.advance()
        assert agent.phase.updates == updates
    agent.advance()
    assert agent.phase is None and agent.updates == 100 + 60


def test_the_policys_next_actions_are_cached_in_a_phase(learner):
    agent = learner("sope", small("sope"), evaluate_every=100)
    agent.advance()
    for source, (mean, log_std) in zip(agent.sources, agent.phase.next_actions, strict=True):
        expected = sac.action_distribution(agent.update_hp, agent.state.policy, every(source).next_observations)
        assert np.allclose(mean, expected[0], atol=1e-6)
        assert np.allclose(log_std, expected[1], atol=1e-6)


def test_networks_begin_as_published():
    """Xavier-uniform weights, zero biases, a layer norm that changes nothing, copies as targets, temperature 1."""
    hp, size, joints = algorithms.algorithm("sac").hyperparameters, 199, 18
    state = sac.begin(hp, np.random.default_rng(0), size, joints)
    shapes = [[(size + joints, 256), (256, 256), (256, 1)]] * 2 + [[(size, 256), (256, 256), (256, joints)]]
    policy = (*state.policy["trunk"], state.policy["mean"])
    for layers, expected in zip((*state.critics, policy), shapes, strict=True):
        assert [layer["weight"].shape for layer in layers] == expected
    for layer in (*state.critics[0], *state.critics[1], *policy, state.policy["log_std"]):
        weight = np.array(layer["weight"])
        bound = np.sqrt(6.0 / sum(weight.shape))
        assert 0.9 * bound < np.abs(weight).max() <= bound
        assert weight.std() == pytest.approx(bound / np.sqrt(3.0), rel=0.1)
        assert not np.array(layer["bias"]).any()
        assert np.all(np.array(layer.get("scale", 1.0)) == 1.0) and not np.any(np.array(layer.get("offset", 0.0)))
    assert not np.array_equal(state.critics[0][1]["weight"], state.critics[1][1]["weight"])
    for mine, theirs in zip(jax.tree.leaves(state.critics), jax.tree.leaves(state.targets), strict=True):
        assert np.array_equal(mine, theirs)
    assert float(state.log_alpha) == 0.0


@pytest.mark.parametrize("dropout", [0.01, 0.3])
def test_dropout_keeps_the_right_share_each_on_its_own(dropout):
    kept = np.asarray(sac.draw_dropout_masks(jax.random.key(0), (3, 2, 2, 256, 256), dropout))
    dropped = ~kept
    error = 5.0 * np.sqrt(dropout * (1.0 - dropout) / kept.size)
    assert dropped.mean() == pytest.approx(dropout, abs=error)
    flat = dropped.ravel()
    for lag in (1, 2, 256):
        assert (flat[:-lag] & flat[lag:]).mean() == pytest.approx(dropout**2, abs=error)
    error = 5.0 * np.sqrt(dropout * (1.0 - dropout) / 50_000)
    assert flat[:50_000].mean() == pytest.approx(dropout, abs=error)
    assert flat[-50_000:].mean() == pytest.approx(dropout, abs=error)


@pytest.mark.parametrize(
    ("name", "context", "line"),
    [
        ("sac", {"prior": "arc_suite/tick/walk/x-v0"}, r"^prior: the algorithm takes no prior data, got 'arc_suite/"),
        (
            "sope",
            {"prior": None},
            r"^prior: the algorithm needs the id of a dataset, which arc-suite collect makes, got None$",
        ),
        (
            "sope",
            {"setup": Setup.of("tick", "walk", {"target_velocity": 0.2})},
            r"^prior '.*': of tick, walk, \{.*\}, and not of tick, walk, \{.*0\.2\}$",
        ),
        ("sope", {"setup": Setup.of("queen", "walk", SHORT)}, r"^prior '.*': of tick, and not of queen$"),
        ("sope", {"prior": "arc_suite/tick/walk/none-v0"}, r"none-v0"),
    ],
)
def test_prior_data_that_do_not_fit(name, context, line, learner):
    with pytest.raises(ValueError, match=line) as caught:
        learner(name, small(name), **context).advance()
    assert "\n" not in str(caught.value)


def test_prior_data_of_another_version_of_the_task(learner, monkeypatch):
    monkeypatch.setattr(Walk, "version", 1)
    with pytest.raises(ValueError, match=r"^prior '.*': of version 0 of walk; 1 is installed$"):
        learner("sope", small("sope")).advance()


def test_prior_data_of_recover_have_the_falls_of_training(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    judged = Setup.of("tick", "recover")

    def open_prior(name, setup):
        data.collect(name, data.DatasetSettings(setup, "zero", (), steps=4), 2, threads=1)
        run = Configuration.of(judged, "sope", small("sope"), prior=name)
        return priors.open_replay(run.context(tmp_path / "run"), judged.definition)

    assert open_prior("arc_suite/learning-v0", judged.learning()).total == 8
    with pytest.raises(ValueError, match="^prior '.*': expected other fall_seed, time_limit than those of judges"):
        open_prior("arc_suite/judged-v0", judged)


def test_runs_share_the_files_of_prior_data(learner, tmp_path):
    first = learner("sope", small("sope"), folder=tmp_path / "one")
    first.advance()
    (folder,) = tmp_path.glob("prior-*")
    before = {path.name: path.stat().st_mtime_ns for path in folder.iterdir()}
    second = learner("sacfd", small("sacfd"), folder=tmp_path / "two")
    second.advance()
    assert {path.name: path.stat().st_mtime_ns for path in folder.iterdir()} == before
    for one, other in zip(every(first.prior), every(second.prior), strict=True):
        assert np.array_equal(one, other)


def test_prior_data_are_those_of_the_dataset(learner, prior):
    """Every transition, with its next observation; time limits bootstrap, falls do not."""
    agent = learner("sope", small("sope"))
    agent.advance()
    batch, start = every(agent.prior), 0
    for episode in data.open(prior):
        part = slice(start, start + episode.length)
        assert np.array_equal(batch.observations[part], episode.observations[:-1])
        assert np.array_equal(batch.next_observations[part], episode.observations[1:])
        assert np.array_equal(batch.actions[part], episode.actions)
        assert np.array_equal(batch.rewards[part], episode.rewards.astype(np.float32))
        assert np.array_equal(batch.goes_on[part], 1.0 - episode.terminations)
        start += episode.length
    assert start == len(agent.prior)
