"""The first updates of every algorithm, compared with a computation in float64 with gradients by hand."""

import numpy as np
import pytest
from soft_actor_critic_by_hand import ByHand, CategoricalByHand
from tiers import tiers

jax = pytest.importorskip("jax", reason="of the extra learn: make check-agents")

import jax.numpy as jnp

from arc_suite.learning.agents import algorithms, off_policy
from arc_suite.learning.agents import soft_actor_critic as sac
from arc_suite.learning.agents.hyperparameters import SoftActorCritic
from arc_suite.learning.agents.replay import Transitions

NAMES = [name for name, each in algorithms.ALGORITHMS.items() if isinstance(each.hyperparameters, SoftActorCritic)]
STEPS = 3
update = jax.jit(sac.update, static_argnums=0)


def by_hand(layers, heads=1):
    """A network of ours as one of the computation by hand, in float64."""
    hidden = layers[:-heads]
    plain = {"w": [each["weight"] for each in layers], "b": [each.get("bias", 0.0) for each in layers]}
    plain |= {"g": [each["scale"] for each in hidden], "h": [each["offset"] for each in hidden]}
    if "mean" in layers[0]:
        plain |= {"m": [each["mean"] for each in hidden], "v": [each["variance"] for each in hidden]}
    return {name: [np.asarray(array, float) for array in arrays] for name, arrays in plain.items()}


def of_policy(policy):
    return by_hand([*policy["trunk"], policy["mean"], policy["log_std"]], heads=2)


@pytest.fixture
def recorded(monkeypatch):
    """The inputs of the learner's updates: the state, and the arrays of batch and noise."""
    calls, learn = [], off_policy.make_update

    def recording(hp, state, sums, batch, noise, next_actions):
        copies = [None if part is None else np.array(part) for part in (*batch, *noise)]
        calls.append((jax.tree.map(np.array, state), copies))
        return learn(hp, state, sums, batch, noise, next_actions)

    monkeypatch.setattr(off_policy, "make_update", recording)
    return calls


def begun_by_hand(hp, state):
    """A learner by hand from the state before the first update."""
    numbers = hp.dropout, hp.learning_rate, hp.discount, hp.tau, hp.target_entropy
    alpha = np.exp(np.asarray(state.log_alpha, float))
    kind = {"squared": ByHand, "categorical": CategoricalByHand}[hp.critics]
    return kind(of_policy(state.policy), [by_hand(critic) for critic in state.critics], *numbers, alpha)


def differences(ours, reference):
    """Absolute differences of all numbers of two networks."""
    pairs = ((a, b) for k in reference for a, b in zip(ours[k], reference[k], strict=True))
    return np.concatenate([np.abs(a - b).ravel() for a, b in pairs])


def of_state(state, reference):
    """Absolute differences of all networks of a learner from those by hand."""
    pairs = [(of_policy(state.policy), reference.policy)]
    pairs += [(by_hand(ours), theirs) for ours, theirs in zip(state.critics, reference.critics, strict=True)]
    pairs += [(by_hand(ours), theirs) for ours, theirs in zip(state.targets, reference.targets, strict=True)]
    return np.concatenate([differences(*pair) for pair in pairs])


def cast(parts, kind):
    """Numbers in another precision; booleans, and what is None, stay."""
    return [part if part is None or part.dtype == bool else part.astype(kind) for part in parts]


@pytest.mark.parametrize(
    "name", tiers(NAMES, lambda name: name in ("sac", "sope", "xqc"), lambda name: name == "sac_parallel")
)
def test_first_three_updates(name, learner, recorded):
    """What it learns, in single precision, and the text of an update in double precision.

    Of a phase too, where the hp has any; it follows the update of the third step.
    """
    hp = algorithms.algorithm(name).hyperparameters
    # Three transitions are too few for a validation set.
    phases = {"phase_every": STEPS, "phase_updates": STEPS, "early_stop": "none"} if hp.phase_updates else {}
    few = {"num_envs": 8} if hp.num_envs > 1 else {}  # a step of all, with three updates
    agent = learner(name, phases | few)
    agent.until(STEPS)
    first = recorded[0][0]
    recorded = [parts for _, parts in recorded]
    reference = begun_by_hand(hp, first)
    updates = agent.step * hp.utd_ratio
    assert len(recorded) == updates + STEPS * bool(phases)
    assert len(recorded[0][2]) == (512 if hp.prior == "symmetric_sampling" else 256)

    with jax.enable_x64(True):
        state = jax.tree.map(lambda a: jnp.asarray(a, float if a.dtype.kind == "f" else None), first)
        for index, parts in enumerate(recorded):
            *batch, next_noise, noise, kept = cast(parts, float)
            is_last_of_step = (index + 1) % max(1, hp.utd_ratio) == 0
            assert (noise is None) == (index >= updates or not is_last_of_step)
            assert (kept is None) == (hp.dropout == 0.0)
            state, ours = update(hp, state, Transitions(*batch), sac.Noise(next_noise, noise, kept))
            reference.update(*batch, next_noise, noise, kept)
            assert float(ours["critic_loss"]) == pytest.approx(reference.critic_loss, rel=1e-9)
            if noise is not None:
                assert float(ours["policy_loss"]) == pytest.approx(reference.policy_loss, rel=1e-9)
        assert of_state(state, reference).max() < 1e-6
        assert float(state.log_alpha) == pytest.approx(float(reference.log_alpha["a"][0]), abs=1e-12)
    # More steps of Adam make of rounding what they like, and so do its first ones where a probability is near 0.
    if len(recorded) <= 2 * STEPS and hp.critics == "squared":
        assert of_state(agent.state, reference).max() < 3e-5
    assert float(agent.state.log_alpha) == pytest.approx(float(reference.log_alpha["a"][0]), rel=1e-6, abs=1e-6)


def test_losses_in_single_precision(learner, recorded):
    """Of one update, from the same numbers."""
    hp = algorithms.ALGORITHMS["speq"].hyperparameters
    agent = learner("speq", {})
    agent.until(1)
    first, parts = recorded[0]
    reference = begun_by_hand(hp, first)
    reference.update(*cast(parts, float))
    metrics = {name: float(value) for name, value in agent.sums.items()}
    assert metrics["critic_loss"] == pytest.approx(reference.critic_loss, rel=1e-5)
    assert metrics["policy_loss"] == pytest.approx(reference.policy_loss, rel=1e-5)


def test_what_an_update_leaves_out_shows(learner, recorded):
    """Each choice of the published code that others make otherwise moves the numbers by more than the tolerance."""
    hp = algorithms.ALGORITHMS["speq"].hyperparameters
    learner("speq", {}).until(2)
    first, parts = recorded[0][0], recorded[1][1]
    with jax.enable_x64(True):
        state = jax.tree.map(lambda a: jnp.asarray(a, float if a.dtype.kind == "f" else None), first)
        *batch, next_noise, noise, kept = cast(parts, float)
        batch, noise = Transitions(*batch), sac.Noise(next_noise, noise, kept)

        def after(batch=batch, noise=noise, state=state, hp=hp):
            flat = jax.tree.leaves(update(hp, state, batch, noise)[0][:4])
            return np.concatenate([np.ravel(leaf) for leaf in flat])

        moved_critics = update(hp, state, batch, noise._replace(action=None))[0].critics
        usual = after()
        for other in (
            after(batch=batch._replace(goes_on=0.0 * batch.goes_on)),
            after(noise=noise._replace(dropout_masks=np.ones_like(kept))),
            after(state=state._replace(log_alpha=state.log_alpha + 0.01)),
            after(state=state._replace(critics=moved_critics)),
        ):
            assert np.abs(other - usual).max() > 1e-4
