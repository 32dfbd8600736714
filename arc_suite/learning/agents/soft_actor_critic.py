"""Soft actor-critic (Haarnoja et al., 2018) as pure functions of plain pytrees.

An update computes in the order of the published code of the ARC-RL paper:

1. the target, with an action of the present policy and the temperature of the update before;
2. the gradient of the critics' loss, and a step of the critics;
3. the gradient of the policy's loss with the critics of before, and steps of temperature and policy;
4. the step of the target networks towards the critics.

The policy ascends the mean of the critics, not their minimum. Dropout comes before the layer norm. It also acts in the
targets and in the policy's loss.

Noise and dropout masks are inputs of an update, and keys of JAX those of noise, so all are pure functions.
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
LOG_STD_RANGE = (-20.0, 2.0)  # of the logarithm of the policy's standard deviation

_TINY_SLOPE = 1e-6  # added to the slope of tanh: keeps the logarithm of the density finite where tanh saturates
_GAP_DEVIATIONS = 8  # standard deviations of the number of dropped units, up to which gaps are drawn
_TINY_UNIFORM = 1e-37  # keeps the logarithm of a uniform number finite
_LOG_TWO_PI = math.log(2.0 * math.pi)


class SacState(NamedTuple):
    """What an update changes.

    Attributes:
        policy: `trunk`, the hidden layers; `mean` and `log_std`, the two output layers.
        critics: networks that map a concatenated observation and action to a value.
        targets: the target networks, shaped as the critics.
        log_alpha: logarithm of the temperature.
        moments: states of Adam, by the parameters that it moves: policy, critics, log_alpha.
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
        dropout_masks: (uses, critics, hidden layers, batch, hidden) booleans, True for units that dropout keeps. The
            uses are targets, critics' loss and, if the policy learns too, its loss. None without dropout.
    """

    next_action: Any
    action: Any
    dropout_masks: Any


def begin(hp: SoftActorCritic, random: np.random.Generator, size: int, joints: int) -> SacState:
    """Draw the networks, and return the state before the first update.

    Args:
        hp: hyperparameters.
        random: generator to draw from.
        size: numbers of an observation; of a leg's view, if legs share the networks.
        joints: numbers of an action; of a leg's action, if legs share the networks.
    """
    hidden_sizes = [hp.hidden] * HIDDEN_LAYERS
    *trunk, mean = networks.mlp(random, (size, *hidden_sizes, joints), layer_norm=True, last_gain=hp.last_gain)
    log_std = networks.make_layer(networks.xavier(random, hp.hidden, joints, hp.last_gain))
    log_std["bias"] += np.float32(math.log(hp.initial_std))
    policy = {"trunk": tuple(trunk), "mean": mean, "log_std": log_std}
    draw_critic = CRITIC_KINDS[hp.critics].draw
    critics = tuple(draw_critic(random, (size + joints, *hidden_sizes)) for _ in range(CRITICS))
    log_alpha = np.array(math.log(hp.initial_temperature), np.float32)
    adam = optax.adam(hp.learning_rate)
    moments = {"policy": adam.init(policy), "critics": adam.init(critics), "log_alpha": adam.init(log_alpha)}
    state = SacState(policy, critics, targets=critics, log_alpha=log_alpha, moments=moments)
    return jax.tree.map(jnp.array, state)


def update_hyperparameters(hp: SoftActorCritic) -> SoftActorCritic:
    """Return hyperparameters that are equal wherever updates are, so that compiled programs are shared."""
    names = ("hidden", "learning_rate", "discount", "tau", "dropout", "target_entropy", "critics", "network")
    return SoftActorCritic(**{name: getattr(hp, name) for name in names})


def draw_noise(hp: SoftActorCritic, key, batch: int, joints: tuple[int, ...], with_policy: bool) -> Noise:
    """Draw the random inputs of an update.

    Args:
        hp: hyperparameters.
        key: key of JAX to draw from.
        batch: transitions of the update.
        joints: shape of an action.
        with_policy: whether the policy learns too; otherwise the critics alone.
    """
    next_action_key, action_key, mask_key = jax.random.split(key, 3)
    next_action = jax.random.normal(next_action_key, (batch, *joints))
    action = jax.random.normal(action_key, (batch, *joints)) if with_policy else None
    dropout_masks = None
    if hp.dropout:
        uses = 3 if with_policy else 2
        shape = (uses, CRITICS, HIDDEN_LAYERS, batch, hp.hidden)
        dropout_masks = draw_dropout_masks(mask_key, shape, hp.dropout)
    return Noise(next_action, action, dropout_masks)


def draw_dropout_masks(key, shape: tuple[int, ...], dropout: float):
    """Draw independent booleans of a shape, each False with the probability `dropout`.

    It draws the gaps between dropped units, which have a geometric distribution. For small `dropout` that takes a
    fraction of the time.
    """
    size = math.prod(shape)
    expected_drops = size * dropout
    draws = int(expected_drops + _GAP_DEVIATIONS * math.sqrt(expected_drops)) + _GAP_DEVIATIONS
    uniform = jax.random.uniform(key, (draws,), minval=_TINY_UNIFORM)
    gaps = jnp.ceil(jnp.log(uniform) / math.log1p(-dropout)).astype(jnp.int32)
    indices = jnp.cumsum(jnp.maximum(gaps, 1)) - 1
    mask = jnp.ones(size, bool).at[indices].set(False, mode="drop", indices_are_sorted=True, unique_indices=True)
    return mask.reshape(shape)


def update(
    hp: SoftActorCritic, state: SacState, batch: Transitions, noise: Noise, next_actions=None
) -> tuple[SacState, dict]:
    """Return the state after one update, and its metrics, scalars by name.

    Args:
        hp: hyperparameters.
        state: before the update.
        batch: transitions, with one leading axis.
        noise: random inputs; without `action`, the critics alone learn.
        next_actions: the policy's `action_distribution` at the next observations if it is known; otherwise None.
    """
    target_masks, critic_masks, policy_masks = _masks_by_use(noise)
    critic_kind = CRITIC_KINDS[hp.critics]

    # The target.
    if next_actions is None:
        next_actions = action_distribution(hp, state.policy, batch.next_observations)
    next_mean, next_log_std = next_actions
    next_action, next_density = sample_actions(next_mean, next_log_std, noise.next_action)
    bonus = jnp.exp(state.log_alpha) * next_density
    target = critic_kind.learning_targets(hp, state.targets, batch, next_action, bonus, target_masks)

    # The critics.
    critics_gradient = jax.value_and_grad(critic_kind.loss, argnums=1, has_aux=True)
    (critic_loss, (mean_value, statistics)), gradient = critics_gradient(
        hp, state.critics, batch, next_action, target, critic_masks
    )
    critics, moments = _adam_step(hp, "critics", state.critics, gradient, state.moments)
    critics = critic_kind.finish_step(critics, statistics)
    metrics = {"critic_loss": critic_loss, "q": mean_value}

    # Temperature and policy, with the critics of before.
    if noise.action is not None:
        policy_gradient = jax.value_and_grad(policy_loss, argnums=1, has_aux=True)
        (loss, density), gradient = policy_gradient(
            hp, state.policy, state, batch.observations, noise.action, policy_masks
        )
        target_entropy = hp.target_entropy * math.prod(batch.actions.shape[1:])
        log_alpha, moments = _adam_step(hp, "log_alpha", state.log_alpha, -target_entropy - density, moments)
        policy, moments = _adam_step(hp, "policy", state.policy, gradient, moments)
        state = state._replace(policy=policy, log_alpha=log_alpha)
        metrics |= {"policy_loss": loss, "entropy": -density, "alpha": jnp.exp(log_alpha)}

    # The target networks.
    targets = jax.tree.map(lambda target, critic: (1.0 - hp.tau) * target + hp.tau * critic, state.targets, critics)
    return state._replace(critics=critics, targets=targets, moments=moments), metrics


def _masks_by_use(noise: Noise):
    """Return the dropout masks of targets, critics' loss and policy's loss; None for what has none."""
    if noise.dropout_masks is None:
        return None, None, None
    policy_masks = noise.dropout_masks[2] if noise.action is not None else None
    return noise.dropout_masks[0], noise.dropout_masks[1], policy_masks


def _adam_step(hp: SoftActorCritic, name: str, parameters, gradient, moments):
    """Return parameters after a step of Adam, and all moments; those of `name` are the parameters' own."""
    steps, parameter_moments = optax.adam(hp.learning_rate).update(gradient, moments[name])
    return optax.apply_updates(parameters, steps), {**moments, name: parameter_moments}


def action_distribution(hp: SoftActorCritic, policy, observations):
    """Return the normal distribution of actions before the tanh.

    Returns:
        Its mean, and the logarithm of its standard deviation; (batch, *joints) each.
    """
    x = networks.apply_hidden_layers(policy["trunk"], observations, legs=hp.network == "legs")
    mean = networks.linear(policy["mean"], x)
    log_std = jnp.clip(networks.linear(policy["log_std"], x), *LOG_STD_RANGE)
    return mean, log_std


def sample_actions(mean, log_std, noise):
    """Return actions (batch, *joints) for standard normal noise, and the logarithm of their density (batch,)."""
    raw = mean + jnp.exp(log_std) * noise  # before the tanh
    decay = jnp.exp(-2.0 * jnp.abs(raw))
    slope = 4.0 * decay / (1.0 + decay) ** 2  # 1 - tanh(raw)^2, without its loss of digits where tanh saturates
    log_density = -0.5 * noise * noise - log_std - 0.5 * _LOG_TWO_PI - jnp.log(slope + _TINY_SLOPE)
    return jnp.tanh(raw), log_density.sum(axis=range(1, log_density.ndim))


def deterministic_layers(state: SacState) -> tuple[Mapping, ...]:
    """Return the layers of the deterministic policy, whose output's tanh is the action."""
    return *state.policy["trunk"], state.policy["mean"]


def policy_loss(hp: SoftActorCritic, policy, state: SacState, observations, noise, dropout_masks):
    """Return the mean of alpha log pi minus the mean of the critics, and the mean of log pi."""
    mean, log_std = action_distribution(hp, policy, observations)
    action, log_density = sample_actions(mean, log_std, noise)
    value = sum(critic_values(hp, state.critics, observations, action, dropout_masks)) / CRITICS
    return jnp.mean(jnp.exp(state.log_alpha) * log_density - value), log_density.mean()


def critic_values(hp: SoftActorCritic, critics, observations, actions, dropout_masks=None):
    """Return a list of the values (batch,) that each critic gives to actions.

    The first layer multiplies observations and actions separately. So the products with observations serve two losses,
    and need no gradient of the inputs.
    """
    legs = hp.network == "legs"
    size = observations.shape[-1]
    values = []
    for index, (first_layer, *hidden_layers, last_layer) in enumerate(critics):
        if dropout_masks is None:
            first_mask = None
            later_masks = None
        else:
            first_mask = dropout_masks[index][0]
            later_masks = dropout_masks[index][1:]
        observation_weight = first_layer["weight"][:size]
        action_weight = first_layer["weight"][size:]
        x = observations @ observation_weight + actions @ action_weight + first_layer.get("bias", 0.0)
        if first_mask is not None:
            x = networks.drop_units(x, first_mask, hp.dropout)
        x = networks.normalize_and_activate(first_layer, x, "relu")
        if legs:
            x = networks.share_between_legs(x)
        x = networks.apply_hidden_layers(hidden_layers, x, "relu", later_masks, hp.dropout)
        outputs = networks.body_outputs(networks.linear(last_layer, x), legs)
        values.append(CRITIC_KINDS[hp.critics].value_of_outputs(outputs))
    return values


class CriticKind(NamedTuple):
    """A kind of critics, as functions.

    Attributes:
        draw: returns a critic. It takes a random generator, and the sizes of the input and of the hidden layers.
        value_of_outputs: returns values (...) from the outputs (..., outputs) of a critic.
        learning_targets: returns what critics learn. It takes hyperparameters, target networks, batch, the policy's
            next actions, the logarithm of their density times the temperature, and dropout masks.
        loss: returns the loss of the critics, and a pair: their mean value, and statistics for `finish_step`. It takes
            hyperparameters, critics, batch, next actions, learning targets and dropout masks.
        finish_step: returns the final critics of an update. It takes the critics after a step of Adam and the
            statistics.
    """

    draw: Callable
    value_of_outputs: Callable
    learning_targets: Callable
    loss: Callable
    finish_step: Callable


def _draw_value_critic(random: np.random.Generator, sizes):
    return networks.mlp(random, (*sizes, 1), layer_norm=True)


def _single_output(outputs):
    return outputs[..., 0]


def target_values(hp: SoftActorCritic, target_networks, batch: Transitions, next_actions, bonus, dropout_masks):
    """Return the values (batch,) that critics of values learn, from the target networks.

    Args:
        hp: hyperparameters.
        target_networks: one for each critic.
        batch: transitions.
        next_actions: actions of the policy at the next observations.
        bonus: (batch,) the logarithm of the density of these actions times the temperature; it is subtracted.
        dropout_masks: as in `Noise`, of this use; None without dropout.
    """
    lowest = jnp.minimum(*critic_values(hp, target_networks, batch.next_observations, next_actions, dropout_masks))
    return batch.rewards + hp.discount * batch.goes_on * (lowest - bonus)


def squared_error_loss(hp: SoftActorCritic, critics, batch: Transitions, next_actions, target, dropout_masks):
    """Return the loss of critics of values, and a pair: their mean value, and None as there are no statistics.

    The loss is the sum over the critics of the mean squared error. It does not use `next_actions`.
    """
    values = critic_values(hp, critics, batch.observations, batch.actions, dropout_masks)
    loss = sum(jnp.mean((value - target) ** 2) for value in values)
    return loss, (sum(values).mean() / CRITICS, None)


def _keep_critics(critics, statistics):
    return critics


CRITIC_KINDS = {
    "squared": CriticKind(
        draw=_draw_value_critic,
        value_of_outputs=_single_output,
        learning_targets=target_values,
        loss=squared_error_loss,
        finish_step=_keep_critics,
    ),
    "categorical": CriticKind(
        draw=categorical.draw_critic,
        value_of_outputs=categorical.mean_return,
        learning_targets=categorical.target_distribution,
        loss=categorical.cross_entropy_loss,
        finish_step=categorical.finish_step,
    ),
}
