"""Proximal policy optimization (Schulman et al., "Proximal policy optimization algorithms", 2017), pure functions.

The policy is a normal distribution around a network's output, with a given standard deviation. Random numbers are
inputs.
"""

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax

from arc_suite.learning.agents.architectures import Architecture
from arc_suite.learning.agents.hyperparameters import ProximalPolicy

_MOST_RATE, _LEAST_RATE = 1e-2, 1e-6  # of the policy
_STEP = 1.5  # factor by which it follows the divergence


class PpoState(NamedTuple):
    """What updates change.

    Attributes:
        policy: network of normalized observations to mean actions.
        values: network of normalized observations to the discounted return.
        moments: of Adam, of policy and values.
        rate: () learning rate of the policy.
    """

    policy: tuple
    values: tuple
    moments: tuple
    rate: Any


class Horizon(NamedTuple):
    """Transitions of a horizon; leading axis (steps,).

    Attributes:
        observations: (steps, size), normalized.
        actions: (steps, joints), not clipped.
        means: (steps, joints) mean actions of the acting policy.
        advantages: (steps,) mean 0, standard deviation 1.
        returns: (steps,) targets of the value function.
    """

    observations: Any
    actions: Any
    means: Any
    advantages: Any
    returns: Any


def begin(
    hp: ProximalPolicy, architecture: Architecture, random: np.random.Generator, policy: tuple | None = None
) -> PpoState:
    """Draw the networks; with a given policy only that of values."""
    drawn = architecture.drawn(random, hp.hidden, last_gain=0.01)
    policy = drawn if policy is None else policy
    values = architecture.drawn_values(random, hp.hidden)
    adam = optax.scale_by_adam()
    moments = adam.init(policy), adam.init(values)
    return jax.tree.map(jnp.asarray, PpoState(policy, values, moments, np.float32(hp.policy_rate)))


predict_mean_actions = jax.jit(lambda architecture, policy, x: architecture.actions(policy, x), static_argnums=0)
predict_values = jax.jit(lambda architecture, values, x: architecture.values(values, x), static_argnums=0)


def estimate_advantages(hp: ProximalPolicy, rewards, values, next_values, terminated, ended):
    """Return generalized advantage estimates (steps, num_envs) (Schulman et al., 2016).

    Args:
        hp: hyperparameters, for `discount` and `gae_lambda`.
        rewards: (steps, num_envs)
        values: (steps, num_envs) of the observations before the step.
        next_values: (steps, num_envs) of the observations after the step, also after an episode's last; of those
            before a step that began another command.
        terminated: (steps, num_envs) booleans: the return after the step is 0.
        ended: (steps, num_envs) booleans: the next step is of another episode, or follows another command.
    """
    numpy = rewards.__array_namespace__()
    surprise = rewards + hp.discount * numpy.where(terminated, 0.0, next_values) - values
    found, last = [], 0.0
    for step in reversed(range(len(surprise))):
        last = surprise[step] + hp.discount * hp.gae_lambda * numpy.where(ended[step], 0.0, last)
        found.append(last)
    return numpy.stack(found[::-1])


@functools.partial(jax.jit, static_argnums=(0, 1, 6), donate_argnums=2)
def update(
    hp: ProximalPolicy,
    architecture: Architecture,
    state: PpoState,
    batch: Horizon,
    orders,
    schedules,
    with_policy: bool = True,
):
    """Make an update with each minibatch.

    Args:
        hp: hyperparameters.
        architecture: of the networks.
        state: before.
        batch: transitions.
        orders: (updates, minibatch) indices of transitions.
        schedules: standard deviation of actions, and desired divergence.
        with_policy: whether the policy learns too.

    Returns:
        The state, the Kullback-Leibler divergence of the policy from the acting policy, and the mean value loss.
    """
    std, desired_kl = schedules
    adam = optax.scale_by_adam()

    def divergence(policy, part: Horizon):
        apart = architecture.actions(policy, part.observations) - part.means
        return (apart**2).sum(axis=-1).mean() / (2.0 * std**2)

    def policy_loss(policy, part: Horizon):
        means = architecture.actions(policy, part.observations)
        nearer = ((part.actions - part.means) ** 2 - (part.actions - means) ** 2).sum(axis=-1)
        ratio = jnp.exp(nearer / (2.0 * std**2))
        clipped = ratio.clip(1.0 - hp.clip, 1.0 + hp.clip)
        return -jnp.minimum(ratio * part.advantages, clipped * part.advantages).mean()

    def value_loss(values, part: Horizon):
        return ((architecture.values(values, part.observations) - part.returns) ** 2).mean()

    def stepped(network, gradient, moments, rate):
        length = jnp.sqrt(sum((leaf**2).sum() for leaf in jax.tree.leaves(gradient)))
        shorter = jnp.minimum(1.0, hp.gradient_norm / (length + 1e-12))
        gradient = jax.tree.map(lambda leaf: leaf * shorter, gradient)
        direction, moments = adam.update(gradient, moments)
        return jax.tree.map(lambda weight, step: weight - rate * step, network, direction), moments

    def once(state, order):
        part = jax.tree.map(lambda array: array[order], batch)
        of_policy, of_values = state.moments
        policy = state.policy
        if with_policy:
            policy, of_policy = stepped(policy, jax.grad(policy_loss)(policy, part), of_policy, state.rate)
        loss, gradient = jax.value_and_grad(value_loss)(state.values, part)
        values, of_values = stepped(state.values, gradient, of_values, hp.value_rate)
        return PpoState(policy, values, (of_policy, of_values), state.rate), loss

    state, losses = jax.lax.scan(once, state, orders)
    # Without the mirrored transitions at the end, which no policy has acted in.
    kl = divergence(state.policy, jax.tree.map(lambda array: array[: hp.num_envs * hp.horizon], batch))
    if with_policy:
        factor = jnp.where(kl > 2.0 * desired_kl, 1.0 / _STEP, jnp.where(kl < 0.5 * desired_kl, _STEP, 1.0))
        state = state._replace(rate=(state.rate * factor).clip(_LEAST_RATE, _MOST_RATE))
    return state, kl, losses.mean()
