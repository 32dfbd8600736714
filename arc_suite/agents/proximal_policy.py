"""Proximal policy optimisation (Schulman et al., "Proximal policy optimization algorithms", 2017), pure functions.

The policy is a normal distribution about a network's output, whose standard deviation is set from
outside. Everything random is an input.
"""

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax

from arc_suite.agents import networks
from arc_suite.agents.hyperparameters import ProximalPolicy

ACTIVATION = "elu"
_MOST_RATE, _LEAST_RATE = 1e-2, 1e-6  # of the policy
_STEP = 1.5  # by which it follows the divergence


class State(NamedTuple):
    """What updates change.

    Attributes:
        policy: network of normalised observations to mean actions.
        values: network of the same to the discounted sum of what will be earned.
        moments: of Adam, of policy and values.
        rate: () of learning of the policy.
    """

    policy: tuple
    values: tuple
    moments: tuple
    rate: Any


class Batch(NamedTuple):
    """What the updates learn from; leading axis (steps,).

    Attributes:
        observations: (steps, size), normalised.
        actions: (steps, joints), not clipped.
        means: (steps, joints) mean actions of the policy that acted.
        advantages: (steps,) mean 0, standard deviation 1.
        returns: (steps,) that values learn.
    """

    observations: Any
    actions: Any
    means: Any
    advantages: Any
    returns: Any


def begin(
    row: ProximalPolicy, random: np.random.Generator, size: int, joints: int, policy: tuple | None = None
) -> State:
    """Draw the networks, or only that of values beside a policy that there is."""
    sizes = (size, row.hidden, row.hidden)
    drawn = networks.mlp(random, (*sizes, joints), "orthogonal", gain=2**0.5, last_gain=0.01)
    policy = drawn if policy is None else policy
    values = networks.mlp(random, (*sizes, 1), "orthogonal", gain=2**0.5)
    adam = optax.scale_by_adam()
    return jax.tree.map(
        jnp.asarray, State(policy, values, (adam.init(policy), adam.init(values)), np.float32(row.policy_rate))
    )


mean_action = jax.jit(lambda policy, observations: networks.forward(policy, observations, ACTIVATION))
value = jax.jit(lambda values, observations: networks.forward(values, observations, ACTIVATION)[..., 0])


def advantages(row: ProximalPolicy, rewards, values, following, terminated, ended):
    """Return generalised advantage estimates (steps, rows) (Schulman et al., 2016).

    Args:
        row: for the discount and the trace.
        rewards: (steps, rows)
        values: (steps, rows) of the observations that were acted on.
        following: (steps, rows) of those after the step, of an episode's last one too.
        terminated: (steps, rows) booleans: nothing is earned after the step.
        ended: (steps, rows) booleans: another episode follows; one that was cut off would have earned `following`.
    """
    surprise = rewards + row.discount * np.where(terminated, 0.0, following) - values
    found, last = np.zeros_like(surprise), np.zeros_like(surprise[0])
    for step in reversed(range(len(surprise))):
        last = surprise[step] + row.discount * row.trace * np.where(ended[step], 0.0, last)
        found[step] = last
    return found


@functools.partial(jax.jit, static_argnums=(0, 5), donate_argnums=1)
def update(row: ProximalPolicy, state: State, batch: Batch, orders, numbers, with_policy: bool = True):
    """Make an update for each of some minibatches.

    Args:
        row: for the clip, the rate of values and the bound of gradients.
        state: as it is.
        batch: of which minibatches are taken.
        orders: (updates, minibatch) indices of steps.
        numbers: standard deviation of actions, and the divergence that is wanted.
        with_policy: whether the policy learns too.

    Returns:
        The state, the divergence of the policy from that which acted, and the mean loss of values.
    """
    std, wanted = numbers
    adam = optax.scale_by_adam()

    def divergence(policy, part: Batch):
        apart = networks.forward(policy, part.observations, ACTIVATION) - part.means
        return (apart**2).sum(axis=-1).mean() / (2.0 * std**2)

    def policy_loss(policy, part: Batch):
        means = networks.forward(policy, part.observations, ACTIVATION)
        nearer = ((part.actions - part.means) ** 2 - (part.actions - means) ** 2).sum(axis=-1)
        ratio = jnp.exp(nearer / (2.0 * std**2))
        clipped = ratio.clip(1.0 - row.clip, 1.0 + row.clip)
        return -jnp.minimum(ratio * part.advantages, clipped * part.advantages).mean()

    def value_loss(values, part: Batch):
        return ((networks.forward(values, part.observations, ACTIVATION)[..., 0] - part.returns) ** 2).mean()

    def stepped(network, gradient, moments, rate):
        length = jnp.sqrt(sum((leaf**2).sum() for leaf in jax.tree.leaves(gradient)))
        shorter = jnp.minimum(1.0, row.gradient_norm / (length + 1e-12))
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
        values, of_values = stepped(state.values, gradient, of_values, row.value_rate)
        return State(policy, values, (of_policy, of_values), state.rate), loss

    state, losses = jax.lax.scan(once, state, orders)
    # Images come last: what the policy would do in the mirror is told by nothing that acted.
    apart = divergence(state.policy, jax.tree.map(lambda array: array[: row.rows * row.horizon], batch))
    if with_policy:
        factor = jnp.where(apart > 2.0 * wanted, 1.0 / _STEP, jnp.where(apart < 0.5 * wanted, _STEP, 1.0))
        state = state._replace(rate=(state.rate * factor).clip(_LEAST_RATE, _MOST_RATE))
    return state, apart, losses.mean()
