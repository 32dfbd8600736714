"""Soft actor-critic (Haarnoja et al., 2018) as pure functions of plain pytrees.

One update has the order of the published code of the ARC-RL paper. The target uses the temperature of the update
before and an action of the present policy. Then come the gradients of the critics' loss, and of the policy's loss
with the critics of before; the steps of temperature, critics and policy; last the targets. The policy ascends the
mean of the critics, not their minimum. Dropout, before the layer norm, also acts in targets and policy loss.

Noise and dropout masks are inputs, so an update is a pure function.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax

from arc_suite.learning.agents import categorical, networks
from arc_suite.learning.agents.hyperparameters import SoftActorCritic
from arc_suite.learning.agents.replay import Transitions

CRITICS = 2
HIDDEN_LAYERS = 2
LOG_STD = (-20.0, 2.0)  # bounds of the logarithm of the policy's standard deviation

_TINY = 1e-6  # keeps the logarithm of the density finite where tanh saturates
_LOG_TWO_PI = math.log(2.0 * math.pi)


def update_hyperparameters(hp: SoftActorCritic) -> SoftActorCritic:
    """Return hyperparameters that differ only where updates do, so that compiled programs are shared."""
    names = "hidden", "learning_rate", "discount", "tau", "dropout", "target_entropy", "critics", "network"
    return SoftActorCritic(**{name: getattr(hp, name) for name in names})


class SacState(NamedTuple):
    """What an update changes.

    Attributes:
        policy: `trunk`, the hidden layers; `mean` and `log_std`, layers of their own on top.
        critics: networks of concatenated observation and action, to a value.
        targets: like the critics.
        log_alpha: logarithm of the temperature.
        moments: of Adam by what it moves: policy, critics, log_alpha.
    """

    policy: Mapping[str, Any]
    critics: tuple
    targets: tuple
    log_alpha: Any
    moments: Mapping[str, Any]


class Noise(NamedTuple):
    """The random inputs of an update.

    Attributes:
        next_action: (batch, *joints) standard normal, of the action in the target.
        action: (batch, *joints) standard normal, of the action in the policy's loss; None for critics alone.
        kept: (uses, critics, hidden layers, batch, hidden) booleans, the units that dropout keeps; uses are
            targets, critics' loss and policy's loss, if there is one; None without dropout.
    """

    next_action: Any
    action: Any
    kept: Any


def begin(hp: SoftActorCritic, random: np.random.Generator, size: int, joints: int) -> SacState:
    """Draw the networks for observations (size,) and actions (joints,), of a leg if legs share them."""
    hidden = [hp.hidden] * HIDDEN_LAYERS
    *trunk, mean = networks.mlp(random, (size, *hidden, joints), layer_norm=True, last_gain=hp.last_gain)
    log_std = networks.make_layer(networks.xavier(random, hp.hidden, joints, hp.last_gain))
    log_std["bias"] += np.float32(math.log(hp.initial_std))
    policy = {"trunk": tuple(trunk), "mean": mean, "log_std": log_std}
    critics = tuple(CRITIC_KINDS[hp.critics].draw(random, (size + joints, *hidden)) for _ in range(CRITICS))
    adam, log_alpha = optax.adam(hp.learning_rate), np.array(math.log(hp.initial_temperature), np.float32)
    moments = {"policy": adam.init(policy), "critics": adam.init(critics), "log_alpha": adam.init(log_alpha)}
    return jax.tree.map(jnp.array, SacState(policy, critics, critics, log_alpha, moments))


def draw_noise(
    hp: SoftActorCritic, random: np.random.Generator, batch: int, joints: tuple[int, ...], with_policy: bool
) -> Noise:
    """Draw the random inputs of an update, with the policy's loss or of critics alone."""
    next_action = random.standard_normal((batch, *joints), np.float32)
    action = random.standard_normal((batch, *joints), np.float32) if with_policy else None
    shape = (3 if with_policy else 2, CRITICS, HIDDEN_LAYERS, batch, hp.hidden)
    return Noise(next_action, action, draw_dropout_masks(random, shape, hp.dropout) if hp.dropout else None)


def draw_dropout_masks(random: np.random.Generator, shape: tuple[int, ...], dropout: float) -> np.ndarray:
    """Draw independent booleans of a shape, each False with the probability `dropout`.

    It draws the gaps between dropped units, which have a geometric distribution: for small `dropout` that takes a
    fraction of the time.
    """
    mask = np.ones(math.prod(shape), bool)
    expected, at = mask.size * dropout, -1
    while at < mask.size:
        gaps = random.geometric(dropout, int(expected + 4.0 * math.sqrt(expected)) + 8)
        places = at + np.cumsum(gaps)
        mask[places[places < mask.size]] = False
        at = places[-1]
    return mask.reshape(shape)


def action_distribution(hp: SoftActorCritic, policy, observations):
    """Return mean and logarithm of the standard deviation, (batch, *joints) each, of the normal under the tanh."""
    x = networks.apply_hidden_layers(policy["trunk"], observations, legs=hp.network == "legs")
    return networks.linear(policy["mean"], x), jnp.clip(networks.linear(policy["log_std"], x), *LOG_STD)


def sample_actions(mean, log_std, noise):
    """Return actions (batch, *joints) for standard normal noise, and the logarithm of their density (batch,)."""
    raw = mean + jnp.exp(log_std) * noise
    small = jnp.exp(-2.0 * jnp.abs(raw))
    slope = 4.0 * small / (1.0 + small) ** 2  # 1 - tanh(raw)^2, without its loss of digits where tanh saturates
    density = -0.5 * noise * noise - log_std - 0.5 * _LOG_TWO_PI - jnp.log(slope + _TINY)
    return jnp.tanh(raw), density.sum(axis=range(1, density.ndim))


def critic_values(hp: SoftActorCritic, critics, observations, actions, kept=None):
    """Return the values of actions, (...) of each critic.

    The first layer multiplies observations and actions apart, so the products with observations serve two losses
    and need no gradient of the inputs.
    """
    size, results = observations.shape[-1], []
    for index, (first, *others, last) in enumerate(critics):
        split = first["weight"][:size], first["weight"][size:]
        masks = None if kept is None else kept[index]
        x = observations @ split[0] + actions @ split[1] + first.get("bias", 0.0)
        if masks is not None:
            x = networks.drop_units(x, masks[0], hp.dropout)
        x = networks.normalize_and_activate(first, x, "relu")
        x = networks.share_between_legs(x) if hp.network == "legs" else x
        x = networks.apply_hidden_layers(others, x, "relu", None if masks is None else masks[1:], hp.dropout)
        results.append(
            CRITIC_KINDS[hp.critics].value(networks.body_outputs(networks.linear(last, x), hp.network == "legs"))
        )
    return results


def target_values(hp: SoftActorCritic, critics, batch: Transitions, next_actions, bonus, kept):
    """Return what critics of values learn, (batch,), from the target networks."""
    least = jnp.minimum(*critic_values(hp, critics, batch.next_observations, next_actions, kept))
    return batch.rewards + hp.discount * batch.goes_on * (least - bonus)


def squared_error_loss(hp: SoftActorCritic, critics, batch: Transitions, next_actions, target, kept):
    """Return the sum over the critics of the mean squared error; the mean of their values, and nothing that settles."""
    found = critic_values(hp, critics, batch.observations, batch.actions, kept)
    return sum(jnp.mean((value - target) ** 2) for value in found), (sum(found).mean() / CRITICS, None)


class CriticKind(NamedTuple):
    """A kind of critics.

    Attributes:
        draw: a critic, from a random generator and the sizes of the input and of the hidden layers.
        value: (...) from the output of a critic (..., outputs).
        targets: what critics learn, from hyperparameters, target networks, batch, the policy's next actions, the
            weighted logarithm of their density, and dropout masks.
        loss: of the critics, from hyperparameters, critics, batch, next actions, targets and dropout masks; with the
            mean value, and what `finish_step` takes.
        settled: the critics after a step of Adam, from them and what the loss found.
    """

    draw: Callable
    value: Callable
    targets: Callable
    loss: Callable
    settled: Callable


CRITIC_KINDS = {
    "squared": CriticKind(
        lambda random, sizes: networks.mlp(random, (*sizes, 1), layer_norm=True),
        lambda outputs: outputs[..., 0],
        target_values,
        squared_error_loss,
        lambda critics, found: critics,
    ),
    "categorical": CriticKind(
        categorical.draw_critic,
        categorical.mean_return,
        categorical.target_distribution,
        categorical.cross_entropy_loss,
        categorical.finish_step,
    ),
}


def policy_loss(hp: SoftActorCritic, policy, state: SacState, observations, noise, kept):
    """Return the mean of alpha log pi minus the mean of the critics, and the mean of log pi."""
    action, density = sample_actions(*action_distribution(hp, policy, observations), noise)
    value = sum(critic_values(hp, state.critics, observations, action, kept)) / CRITICS
    return jnp.mean(jnp.exp(state.log_alpha) * density - value), density.mean()


def update(
    hp: SoftActorCritic, state: SacState, batch: Transitions, noise: Noise, next_actions=None
) -> tuple[SacState, dict]:
    """Return the state after one update, and its metrics, scalars by name.

    Args:
        hp: hyperparameters.
        state: before.
        batch: transitions, with one leading axis.
        noise: random inputs; without `action`, the critics alone learn.
        next_actions: the policy's `distribution` at the next observations, if it is known; else None.
    """
    masks = (None, None, None) if noise.kept is None else noise.kept
    next_actions = (
        action_distribution(hp, state.policy, batch.next_observations) if next_actions is None else next_actions
    )
    next_actions, density = sample_actions(*next_actions, noise.next_action)
    kind = CRITIC_KINDS[hp.critics]
    target = kind.targets(hp, state.targets, batch, next_actions, jnp.exp(state.log_alpha) * density, masks[0])
    critic_gradient = jax.value_and_grad(kind.loss, argnums=1, has_aux=True)
    (critic_loss, (value, found)), gradient = critic_gradient(hp, state.critics, batch, next_actions, target, masks[1])
    critics, moments = _stepped(hp, "critics", state.critics, gradient, state.moments)
    critics = kind.settled(critics, found)
    metrics = {"critic_loss": critic_loss, "q": value}
    if noise.action is not None:
        policy_gradient = jax.value_and_grad(policy_loss, argnums=1, has_aux=True)
        (loss, density), gradient = policy_gradient(hp, state.policy, state, batch.observations, noise.action, masks[2])
        target_entropy = hp.target_entropy * math.prod(batch.actions.shape[1:])
        log_alpha, moments = _stepped(hp, "log_alpha", state.log_alpha, -target_entropy - density, moments)
        policy, moments = _stepped(hp, "policy", state.policy, gradient, moments)
        state = state._replace(policy=policy, log_alpha=log_alpha)
        metrics |= {"policy_loss": loss, "entropy": -density, "alpha": jnp.exp(log_alpha)}
    averaged = jax.tree.map(lambda target, critic: (1.0 - hp.tau) * target + hp.tau * critic, state.targets, critics)
    return state._replace(critics=critics, targets=averaged, moments=moments), metrics


def deterministic_layers(state: SacState) -> tuple[Mapping, ...]:
    """Return the layers of the deterministic policy, whose tanh is the action."""
    return *state.policy["trunk"], state.policy["mean"]


def _stepped(hp: SoftActorCritic, name: str, parameters, gradient, moments):
    """Parameters after a step of Adam, and all moments."""
    steps, moved = optax.adam(hp.learning_rate).update(gradient, moments[name])
    return optax.apply_updates(parameters, steps), {**moments, name: moved}
