"""What the rows have the learner do: exploration, phases, what is held out of them, and the fence around prior data."""

import numpy as np
import pytest

jax = pytest.importorskip("jax", reason="of the extra agents: make check-agents")

from conftest import SHORT, small

from arc_suite import data
from arc_suite.agents import algorithms, off_policy
from arc_suite.agents import soft_actor_critic as sac
from arc_suite.agents.learner import Stage
from arc_suite.robots import ROBOTS


@pytest.fixture
def batches(monkeypatch):
    """The observations of every update, and whether the policy learned in it."""
    calls, update = [], off_policy._update

    def recording(row, state, sums, batch, noise, following):
        calls.append((np.array(batch.observations), noise.action is not None))
        return update(row, state, sums, batch, noise, following)

    monkeypatch.setattr(off_policy, "_update", recording)
    return calls


@pytest.fixture
def drawn(monkeypatch):
    """The environment steps at which the policy acted."""
    steps, act = [], off_policy._act
    monkeypatch.setattr(off_policy, "_act", lambda *inputs: steps.append(1) or act(*inputs))
    return steps


def rows_of(observations):
    return {row.tobytes() for row in observations}


def play(agent, steps):
    """Advance to a step, phases included."""
    while agent.step < steps:
        agent.advance(steps)


def test_actions_are_uniform_while_the_buffer_is_small(learner, drawn):
    """With 5000 in the row, in the steps 1 to 5001; here 20."""
    agent = learner(small("sac"))
    play(agent, 21)
    assert not drawn
    play(agent, 22)
    assert len(drawn) == 1
    actions = agent._replay.at(np.arange(21)).actions
    assert np.abs(actions).max() > 0.9 and abs(actions.mean()) < 0.1


def test_prior_data_in_the_same_buffer_end_exploration(learner, drawn):
    agent = learner(small("sacfd"))
    play(agent, 1)
    assert len(drawn) == 1


def test_the_fence(learner, batches):
    """Batches are uniform over prior and online data; however many steps, no prior transition is lost."""
    agent = learner(small("sacfd", batch=64, capacity=50), steps=10_000)
    prior = agent._prior.at(np.arange(len(agent._prior))).observations
    assert len(prior) == 1200
    play(agent, 120)
    assert len(agent._sources[0]) == len(prior) + 50
    assert np.array_equal(agent._prior.at(np.arange(len(prior))).observations, prior)
    known = rows_of(prior)
    shares = np.array([np.mean([row.tobytes() in known for row in batch]) for batch, _ in batches[60:]])
    expected = len(prior) / (len(prior) + 50)
    assert shares.mean() == pytest.approx(expected, abs=4.0 * np.sqrt(expected / len(shares) / 64))


def test_a_batch_of_each_source(learner, batches):
    agent = learner(small("speq_o2o"))
    play(agent, 30)
    known = rows_of(agent._prior.at(np.arange(len(agent._prior))).observations)
    for batch, _ in batches:
        assert [row.tobytes() in known for row in batch] == [False] * 8 + [True] * 8


@pytest.mark.parametrize("name", ["speq", "sope_eo", "speq_o2o", "sope"])
def test_phases_follow_the_update_of_their_step(name, learner, batches):
    agent = learner(small(name), steps=200)
    agent.advance(200)
    assert agent.step == 99, "the phase of step 100 is to come"
    assert [with_policy for _, with_policy in batches] == [True] * 100
    policy = np.array(agent._state.policy["mean"]["weight"])
    targets = np.array(agent._state.targets[0][0]["weight"])
    alpha = float(agent._state.log_alpha)
    play(agent, 100)
    count = len(batches) - 100
    assert not any(with_policy for _, with_policy in batches[100:])
    assert count == 60 or ("sope" in name and 40 <= count < 60)
    assert np.array_equal(policy, agent._state.policy["mean"]["weight"])
    assert alpha == float(agent._state.log_alpha)
    assert not np.array_equal(targets, agent._state.targets[0][0]["weight"])
    play(agent, 200)
    assert agent._phase is None, "the last phase comes before the end"
    assert len(batches) >= 2 * (100 + 40)


@pytest.mark.parametrize("name", ["sope_eo", "sope"])
def test_what_is_held_out(name, learner, batches):
    """A tenth of the online transitions, and as many of the prior ones; updates of the phase never see them."""
    agent = learner(small(name, phase_every=200, batch=16))
    agent.advance(200)
    held_out = agent._phase.held_out
    assert held_out == 20
    kept_apart = [source.at(order[:held_out]) for source, order in zip(agent._sources, agent._orders, strict=True)]
    assert len(kept_apart) == (2 if name == "sope" else 1)
    unseen = rows_of(np.concatenate([part.observations for part in kept_apart]))
    assert len(unseen) >= 0.9 * held_out * len(kept_apart)  # a start may occur twice
    play(agent, 200)
    seen = rows_of(np.concatenate([batch for batch, with_policy in batches if not with_policy]))
    assert not seen & unseen
    batches.clear()
    play(agent, 399)
    assert rows_of(np.concatenate([batch for batch, _ in batches])) & unseen, "afterwards they are there again"


def test_at_least_a_batch_is_held_out_and_at_least_one_is_not(learner):
    agent = learner(small("sope_eo", phase_every=30, batch=16, random_steps=100))
    agent.advance(30)
    assert agent._phase.held_out == 0, "30 transitions are not two batches: nothing judges the phase"
    agent = learner(small("sope_eo", phase_every=40, batch=16, random_steps=100))
    agent.advance(40)
    assert agent._phase.held_out == 16


def test_a_phase_ends_by_the_rule(learner, monkeypatch):
    looks = iter([-10.0, -11.0, -10.99, -10.98, -10.97, -20.0])
    monkeypatch.setattr(off_policy.OffPolicy, "_look", lambda self: next(looks))
    agent = learner(small("sope_eo", early_stop="sign_safe", phase_updates=1000))
    agent.advance(100)
    for updates in (20, 40):
        agent.advance(100)
        assert agent._phase.updates == updates
    agent.advance(100)
    assert agent._phase is None and agent._count["updates"] == 100 + 60


def test_what_the_policy_does_next_is_computed_once(learner, batches):
    """In a phase the policy rests, so that its distributions of all next observations are looked up."""
    agent = learner(small("sope"))
    agent.advance(100)
    for source, (mean, log_std) in zip(agent._sources, agent._following, strict=True):
        every = source.at(np.arange(len(source))).next_observations
        expected = sac.distribution(agent._state.policy, every)
        assert np.allclose(mean, expected[0], atol=1e-6)
        assert np.allclose(log_std, expected[1], atol=1e-6)


def test_networks_begin_as_published():
    """Xavier-uniform weights, zero biases, a layer norm that changes nothing, copies as targets, temperature 1."""
    row, size, joints = algorithms.algorithm("sac").row, 199, 18
    state = sac.begin(row, np.random.default_rng(0), size, joints)
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
    kept = sac.kept(np.random.default_rng(0), (3, 2, 2, 256, 256), dropout)
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
    ("name", "stage", "line"),
    [
        ("sac", {"prior": "arc_suite/tick/walk/x-v0"}, r"^prior: the algorithm takes no prior data, got 'arc_suite/"),
        ("sope", {"prior": None}, r"^prior: the algorithm takes prior data, the id of a dataset, got None$"),
        ("sope", {"task_kwargs": {"target_velocity": 0.2}}, r"^prior '.*': of the task \{.*\}, and not of \{.*0\.2\}$"),
        ("sope", {"prior": "arc_suite/tick/walk/none-v0"}, r"none-v0"),
    ],
)
def test_prior_data_that_do_not_fit(name, stage, line, learner):
    with pytest.raises(ValueError, match=line) as caught:
        learner(small(name), **stage)
    assert "\n" not in str(caught.value)


def test_prior_data_of_another_robot(prior, tmp_path):
    stage = Stage(ROBOTS["queen"], "walk", SHORT, 0, 100, tmp_path / "run", prior)
    with pytest.raises(ValueError, match=rf"^prior '{prior}': of tick, and not of queen$"):
        small("sope").module.begin(small("sope").row, stage)


def test_runs_share_the_files_of_prior_data(learner, tmp_path):
    """Read once, beside the folders of the runs."""
    first = learner(small("sope"), folder=tmp_path / "one")
    (folder,) = tmp_path.glob("prior-*")
    before = {path.name: path.stat().st_mtime_ns for path in folder.iterdir()}
    second = learner(small("sacfd"), folder=tmp_path / "two")
    assert {path.name: path.stat().st_mtime_ns for path in folder.iterdir()} == before
    every = np.arange(len(first._prior))
    for mine, theirs in zip(first._prior.at(every), second._prior.at(every), strict=True):
        assert np.array_equal(mine, theirs)


def test_prior_data_are_those_of_the_dataset(learner, prior):
    """Every transition, with its next observation; time limits go on, falls do not."""
    found = learner(small("sope"))._prior
    batch, start = found.at(np.arange(len(found))), 0
    for episode in data.open(prior):
        part = slice(start, start + episode.length)
        assert np.array_equal(batch.observations[part], episode.observations[:-1])
        assert np.array_equal(batch.next_observations[part], episode.observations[1:])
        assert np.array_equal(batch.actions[part], episode.actions)
        assert np.array_equal(batch.rewards[part], episode.rewards.astype(np.float32))
        assert np.array_equal(batch.goes_on[part], 1.0 - episode.terminations)
        start += episode.length
    assert start == len(found)
