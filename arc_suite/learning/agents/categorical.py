"""Critics of XQC (Palenicek et al., "XQC: Well-conditioned optimization accelerates deep RL", 2025).

A critic gives the logits of a distribution over returns (Bellemare et al., 2017). Its hidden layers have a batch norm,
whose statistics are those of the batch's actions and of the policy's next actions together (Bhatt et al., 2024). After
each step the weights of a unit are projected on the unit sphere. Running statistics serve the policy's loss.
"""

from collections.abc import Mapping, Sequence

import jax
import jax.numpy as jnp
import numpy as np

from arc_suite.learning.agents import networks
from arc_suite.learning.agents.replay import Transitions

RETURN_COUNT = 101  # of returns with a probability, as published
MAX_RETURN = 5.0  # of a return after `reward_scale`, as published
MOMENTUM = 0.99  # of the running statistics


def draw_critic(random: np.random.Generator, sizes: Sequence[int]) -> tuple:
    """Draw a critic for the sizes of the input and of the hidden layers."""
    *hidden, last = networks.mlp(random, (*sizes, RETURN_COUNT), layer_norm=True)
    for layer in hidden:  # the norm takes a bias away
        bias = layer.pop("bias")
        layer |= {"mean": bias, "variance": np.ones_like(bias)}
    return _projected((*hidden, last))


def mean_return(logits):
    """Return the mean of the distribution with logits (..., COUNT), shape (...)."""
    return jax.nn.softmax(logits) @ _returns()


def target_distribution(hp, critics, batch: Transitions, next_actions, bonus, kept):
    """Return the distribution that critics learn, (batch, COUNT): that of the least critic, a control step before."""
    both = _both(batch, next_actions)
    least = jnp.stack([_joint(hp, critic, both)[0][len(next_actions) :] for critic in critics])
    least = jnp.take_along_axis(least, mean_return(least).argmin(axis=0)[None, :, None], axis=0)[0]
    ahead = (hp.discount * batch.goes_on)[:, None] * (_returns() - bonus[:, None])
    return project_distribution(jax.nn.softmax(least), batch.rewards[:, None] + ahead)


def project_distribution(probabilities, returns):
    """Return probabilities (batch, COUNT) of the fixed returns, from those of returns (batch, COUNT) between them.

    A probability goes to the two fixed returns around its own, in proportion to their closeness.
    """
    places = (returns.clip(-MAX_RETURN, MAX_RETURN) + MAX_RETURN) * ((RETURN_COUNT - 1) / (2.0 * MAX_RETURN))
    below = jnp.floor(places).astype(jnp.int32)
    share, rows = places - below, jnp.arange(len(places))[:, None]
    found = jnp.zeros_like(probabilities).at[rows, below].add(probabilities * (1.0 - share))
    return found.at[rows, (below + 1).clip(max=RETURN_COUNT - 1)].add(probabilities * share)


def cross_entropy_loss(hp, critics, batch: Transitions, next_actions, target, kept):
    """Return the sum over the critics of the mean cross-entropy; the mean value, and layers with statistics."""
    both, size = _both(batch, next_actions), len(next_actions)
    logits, layers = zip(*(_joint(hp, critic, both) for critic in critics), strict=True)
    losses = [-(target * jax.nn.log_softmax(each[:size])).sum(axis=-1).mean() for each in logits]
    return sum(losses), (jnp.mean(mean_return(jnp.stack(logits)[:, :size])), layers)


def finish_step(critics, layers):
    """Return the critics after a step: weights on the unit sphere, statistics moved towards those of the batch."""

    def moved(layer: Mapping, batch: Mapping) -> dict:
        return {**layer, **{k: MOMENTUM * layer[k] + (1.0 - MOMENTUM) * batch[k] for k in ("mean", "variance")}}

    hidden = [map(moved, critic[:-1], found) for critic, found in zip(critics, layers, strict=True)]
    return tuple(_projected((*layers, critic[-1])) for critic, layers in zip(critics, hidden, strict=True))


def _returns():
    """Returns with a probability, (COUNT,)."""
    return jnp.linspace(-MAX_RETURN, MAX_RETURN, RETURN_COUNT)


def _both(batch: Transitions, next_actions):
    """Inputs of critics, (2 batch, ..., size + joints): of the batch, then of the policy's next actions."""
    now, after = (batch.observations, batch.actions), (batch.next_observations, next_actions)
    return jnp.concatenate([jnp.concatenate(each, axis=-1) for each in (now, after)])


def _joint(hp, critic: Sequence[Mapping], x):
    """Logits for inputs x that are normalized together, and the hidden layers with the statistics of this batch."""
    found, axes, legs = [], range(x.ndim - 1), hp.network == "legs"
    for layer in critic[:-1]:
        x = networks.linear(layer, x)
        found.append({**layer, "mean": x.mean(axis=axes), "variance": x.var(axis=axes)})
        x = networks.normalize_and_activate(found[-1], x, "relu")
        x = networks.share_between_legs(x) if legs and len(found) == 1 else x
    return networks.body_outputs(networks.linear(critic[-1], x), legs), found


def _projected(critic: Sequence[Mapping]) -> tuple:
    """Layers whose weights have norm 1 over the inputs of each unit."""
    return tuple({**layer, "weight": layer["weight"] / ((layer["weight"] ** 2).sum(axis=0) ** 0.5)} for layer in critic)
