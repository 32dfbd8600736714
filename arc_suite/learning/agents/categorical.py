"""Critics of XQC (Palenicek et al., "XQC: Well-conditioned optimization accelerates deep RL", 2025).

A critic gives the logits of a distribution over fixed returns (Bellemare et al., 2017). Its hidden layers have a batch
norm. In the critics' loss the statistics of the norm are those of the batch's actions and of the policy's next actions
together (Bhatt et al., 2024); in the policy's loss they are running means. After each step the weights of every unit
are projected onto the unit sphere.
"""

from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.learning.agents import networks
from arc_suite.learning.agents.replay import Transitions

RETURN_COUNT = 101  # fixed returns that have a probability, as published
MAX_RETURN = 5.0  # the highest of them and minus the lowest, after `reward_scale`, as published
MOMENTUM = 0.99  # of the running statistics


def draw_critic(random: np.random.Generator, sizes: Sequence[int]) -> tuple:
    """Draw a critic for the sizes of the input and of the hidden layers."""
    *hidden_layers, last_layer = networks.mlp(random, (*sizes, RETURN_COUNT), layer_norm=True)
    for layer in hidden_layers:
        zeros = layer.pop("bias")  # a batch norm would remove any bias
        layer["mean"] = zeros
        layer["variance"] = np.ones_like(zeros)
    return _project_weights((*hidden_layers, last_layer))


def mean_return(logits):
    """Return the mean (...) of the distribution with logits (..., RETURN_COUNT)."""
    return jax.nn.softmax(logits) @ _fixed_returns()


def target_distribution(hp, target_networks, batch: Transitions, next_actions, bonus, dropout_masks):
    """Return the distributions (batch, RETURN_COUNT) that critics learn.

    Of the distributions that the target networks give to the next actions, that with the lowest mean is moved back by
    a control step.

    Args:
        hp: hyperparameters.
        target_networks: one for each critic.
        batch: transitions.
        next_actions: actions of the policy at the next observations.
        bonus: (batch,) the logarithm of the density of these actions times the temperature; it is subtracted.
        dropout_masks: not used, as categorical critics have no dropout.
    """
    inputs = _joint_inputs(batch, next_actions)
    next_logits = jnp.stack([_joint_logits(hp, network, inputs)[0][len(next_actions) :] for network in target_networks])
    lowest = mean_return(next_logits).argmin(axis=0)
    lowest_logits = jnp.take_along_axis(next_logits, lowest[None, :, None], axis=0)[0]
    discounted = (hp.discount * batch.goes_on)[:, None] * (_fixed_returns() - bonus[:, None])
    return project_distribution(jax.nn.softmax(lowest_logits), batch.rewards[:, None] + discounted)


def project_distribution(probabilities, returns):
    """Return probabilities (batch, RETURN_COUNT) of the fixed returns.

    Each probability goes to the two fixed returns around its own return, in proportion to their closeness.

    Args:
        probabilities: (batch, RETURN_COUNT)
        returns: (batch, RETURN_COUNT) returns that have these probabilities.
    """
    positions = (returns.clip(-MAX_RETURN, MAX_RETURN) + MAX_RETURN) * ((RETURN_COUNT - 1) / (2.0 * MAX_RETURN))
    below = jnp.floor(positions).astype(jnp.int32)
    above = (below + 1).clip(max=RETURN_COUNT - 1)
    share_above = positions - below
    transitions = jnp.arange(len(positions))[:, None]
    projected = jnp.zeros_like(probabilities).at[transitions, below].add(probabilities * (1.0 - share_above))
    return projected.at[transitions, above].add(probabilities * share_above)


def cross_entropy_loss(hp, critics, batch: Transitions, next_actions, target, dropout_masks):
    """Return the loss of the critics, and a pair: their mean value, and hidden layers with the batch's statistics.

    The loss is the sum over the critics of the mean cross-entropy. `dropout_masks` are not used.
    """
    inputs = _joint_inputs(batch, next_actions)
    size = len(next_actions)
    outputs = [_joint_logits(hp, critic, inputs) for critic in critics]
    logits = [critic_logits for critic_logits, _ in outputs]
    batch_layers = tuple(layers for _, layers in outputs)
    losses = [-(target * jax.nn.log_softmax(critic_logits[:size])).sum(axis=-1).mean() for critic_logits in logits]
    mean_value = jnp.mean(mean_return(jnp.stack(logits)[:, :size]))
    return sum(losses), (mean_value, batch_layers)


def finish_step(critics, batch_layers):
    """Return the critics after a step: weights on the unit sphere, and statistics moved towards those of the batch.

    Args:
        critics: after a step of Adam.
        batch_layers: of each critic the hidden layers with the batch's statistics, as `cross_entropy_loss`
            returns.
    """
    finished_critics = []
    for critic, layers_of_batch in zip(critics, batch_layers, strict=True):
        *hidden_layers, last_layer = critic
        hidden_layers = [
            _move_statistics(layer, batch_layer)
            for layer, batch_layer in zip(hidden_layers, layers_of_batch, strict=True)
        ]
        finished_critics.append(_project_weights((*hidden_layers, last_layer)))
    return tuple(finished_critics)


def _move_statistics(layer: Mapping, batch_layer: Mapping) -> dict:
    """Return a layer whose running statistics have moved towards those of a batch."""
    statistics = {name: MOMENTUM * layer[name] + (1.0 - MOMENTUM) * batch_layer[name] for name in ("mean", "variance")}
    return {**layer, **statistics}


def _fixed_returns():
    """Return the returns that have a probability, (RETURN_COUNT,)."""
    return jnp.linspace(-MAX_RETURN, MAX_RETURN, RETURN_COUNT)


def _joint_inputs(batch: Transitions, next_actions):
    """Return inputs of critics (2 batch, ..., size + joints): of the batch, then of the policy's next actions."""
    inputs = jnp.concatenate([batch.observations, batch.actions], axis=-1)
    next_inputs = jnp.concatenate([batch.next_observations, next_actions], axis=-1)
    return jnp.concatenate([inputs, next_inputs])


def _joint_logits(hp, critic: Sequence[Mapping], x):
    """Return the logits for inputs x that are normalized together, and the hidden layers with their statistics."""
    legs = hp.network == "legs"
    batch_axes = range(x.ndim - 1)
    *hidden_layers, last_layer = critic
    batch_layers = []
    for index, layer in enumerate(hidden_layers):
        x = networks.linear(layer, x)
        batch_layer = {**layer, "mean": x.mean(axis=batch_axes), "variance": x.var(axis=batch_axes)}
        batch_layers.append(batch_layer)
        x = networks.normalize_and_activate(batch_layer, x, "relu")
        if legs and index == 0:
            x = networks.share_between_legs(x)
    return networks.body_outputs(networks.linear(last_layer, x), legs), batch_layers


def _project_weights(critic: Sequence[Mapping]) -> tuple:
    """Return layers whose weights have norm 1 over the inputs of each unit."""
    layers = []
    for layer in critic:
        norms = (layer["weight"] ** 2).sum(axis=0) ** 0.5
        layers.append({**layer, "weight": layer["weight"] / norms})
    return tuple(layers)
