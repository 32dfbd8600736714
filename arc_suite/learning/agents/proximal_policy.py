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

# The learning rate of the policy rises where the policy moves too little in an iteration, and falls where too much.
_MAX_POLICY_RATE = 1e-2
_MIN_POLICY_RATE = 1e-6
_RATE_FACTOR = 1.5  # of one change of the rate
_KL_TOLERANCE = 2.0  # factor between divergence and desired divergence, beyond which the rate changes

_TINY_NORM = 1e-12  # added to the norm of a gradient, which may be 0


class PpoState(NamedTuple):
    """What updates change.

    Attributes:
        policy: network of normalized observations to mean actions.
        values: network of normalized observations to the discounted return.
        moments: states of Adam, of policy and values.
        rate: () learning rate of the policy.
    """

    policy: tuple
    values: tuple
    moments: tuple
    rate: Any


class Horizon(NamedTuple):
    """Transitions of a horizon; leading axis (transitions,).

    Attributes:
        observations: (transitions, size), normalized.
        actions: (transitions, joints), not clipped.
        means: (transitions, joints) mean actions of the acting policy.
        advantages: (transitions,) mean 0, standard deviation 1.
        returns: (transitions,) targets of the value function.
    """

    observations: Any
    actions: Any
    means: Any
    advantages: Any
    returns: Any


def begin(
    hp: ProximalPolicy, architecture: Architecture, random: np.random.Generator, policy: tuple | None = None
) -> PpoState:
    """Draw the networks, and return the state before the first update.

    Args:
        hp: hyperparameters.
        architecture: architecture of the networks.
        random: generator to draw from.
        policy: parameters of the policy to start from; None for drawn ones.
    """
    drawn_policy = architecture.draw_policy(random, hp.hidden, last_gain=0.01)
    if policy is None:
        policy = drawn_policy
    values = architecture.draw_values(random, hp.hidden)
    adam = optax.scale_by_adam()
    moments = (adam.init(policy), adam.init(values))
    return jax.tree.map(jnp.asarray, PpoState(policy, values, moments, np.float32(hp.policy_rate)))


@functools.partial(jax.jit, static_argnums=0)
def predict_mean_actions(architecture: Architecture, policy, observations):
    """Return the mean actions (..., joints) of a policy for normalized observations (..., size)."""
    return architecture.actions(policy, observations)


@functools.partial(jax.jit, static_argnums=0)
def predict_values(architecture: Architecture, values, observations):
    """Return the predicted returns (...) of normalized observations (..., size)."""
    return architecture.values(values, observations)


def estimate_advantages(hp: ProximalPolicy, rewards, values, next_values, terminated, ended):
    """Return generalized advantage estimates (steps, num_envs) (Schulman et al., 2016).

    Args:
        hp: hyperparameters, for `discount` and `gae_lambda`.
        rewards: (steps, num_envs)
        values: (steps, num_envs) values of the observations before the step.
        next_values: (steps, num_envs) values of the observations after the step, also after the last step of an
            episode. If the step began another command, of the observation before it.
        terminated: (steps, num_envs) booleans: the return after the step is 0.
        ended: (steps, num_envs) booleans: the next step is of another episode, or follows another command.
    """
    xp = rewards.__array_namespace__()
    errors = rewards + hp.discount * xp.where(terminated, 0.0, next_values) - values  # of temporal differences

    def step_back(advantage, step):
        error, has_ended = step
        advantage = error + hp.discount * hp.gae_lambda * xp.where(has_ended, 0.0, advantage)
        return advantage, advantage

    no_advantage = xp.zeros_like(errors[0])  # after the last step
    if isinstance(errors, jax.Array):
        _, advantages = jax.lax.scan(step_back, no_advantage, (errors, ended), reverse=True)
        return advantages
    advantage = no_advantage
    advantages = []  # from the last step to the first
    for step in zip(errors[::-1], ended[::-1], strict=True):
        advantage, _ = step_back(advantage, step)
        advantages.append(advantage)
    return xp.stack(advantages[::-1])


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
        architecture: architecture of the networks.
        state: before the updates.
        batch: transitions.
        orders: (updates, minibatch) indices of transitions.
        schedules: standard deviation of actions, and desired divergence.
        with_policy: whether the policy learns too.

    Returns:
        The state, the Kullback-Leibler divergence of the policy from the acting policy, and the mean value loss.
    """
    std, desired_kl = schedules

    def update_once(state: PpoState, order):
        minibatch = jax.tree.map(lambda array: array[order], batch)
        policy = state.policy
        policy_moments, value_moments = state.moments
        if with_policy:
            policy_gradient = jax.grad(_policy_loss, argnums=2)(hp, architecture, policy, minibatch, std)
            policy, policy_moments = _adam_step(hp, policy, policy_gradient, policy_moments, state.rate)
        value_loss, value_gradient = jax.value_and_grad(_value_loss, argnums=1)(architecture, state.values, minibatch)
        values, value_moments = _adam_step(hp, state.values, value_gradient, value_moments, hp.value_rate)
        return PpoState(policy, values, (policy_moments, value_moments), state.rate), value_loss

    state, value_losses = jax.lax.scan(update_once, state, orders)

    # Mirrored transitions, at the end of the batch, do not count: no policy has acted in them.
    acted = jax.tree.map(lambda array: array[: hp.num_envs * hp.horizon], batch)
    kl = _mean_divergence(architecture, state.policy, acted, std)
    if with_policy:
        moved_too_far = kl > _KL_TOLERANCE * desired_kl
        moved_too_little = kl < desired_kl / _KL_TOLERANCE
        factor = jnp.where(moved_too_far, 1.0 / _RATE_FACTOR, jnp.where(moved_too_little, _RATE_FACTOR, 1.0))
        state = state._replace(rate=(state.rate * factor).clip(_MIN_POLICY_RATE, _MAX_POLICY_RATE))
    return state, kl, value_losses.mean()


def _policy_loss(hp: ProximalPolicy, architecture: Architecture, policy, minibatch: Horizon, std):
    """Return minus the mean of the clipped objective."""
    means = architecture.actions(policy, minibatch.observations)
    # Of normal distributions with the same standard deviation, the ratio of probabilities depends on squared distances.
    acting_distances = (minibatch.actions - minibatch.means) ** 2
    distances = (minibatch.actions - means) ** 2
    ratio = jnp.exp((acting_distances - distances).sum(axis=-1) / (2.0 * std**2))
    clipped_ratio = ratio.clip(1.0 - hp.clip, 1.0 + hp.clip)
    return -jnp.minimum(ratio * minibatch.advantages, clipped_ratio * minibatch.advantages).mean()


def _value_loss(architecture: Architecture, values, minibatch: Horizon):
    """Return the mean squared error of the predicted returns."""
    return ((architecture.values(values, minibatch.observations) - minibatch.returns) ** 2).mean()


def _adam_step(hp: ProximalPolicy, parameters, gradient, moments, rate):
    """Return parameters after a step of Adam, with a gradient whose norm is limited, and the moments."""
    norm = jnp.sqrt(sum((leaf**2).sum() for leaf in jax.tree.leaves(gradient)))
    factor = jnp.minimum(1.0, hp.gradient_norm / (norm + _TINY_NORM))
    gradient = jax.tree.map(lambda leaf: leaf * factor, gradient)
    direction, moments = optax.scale_by_adam().update(gradient, moments)
    return jax.tree.map(lambda weight, step: weight - rate * step, parameters, direction), moments


def _mean_divergence(architecture: Architecture, policy, batch: Horizon, std):
    """Return the mean Kullback-Leibler divergence of a policy from the acting policy."""
    differences = architecture.actions(policy, batch.observations) - batch.means
    return (differences**2).sum(axis=-1).mean() / (2.0 * std**2)
