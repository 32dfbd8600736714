"""DAgger: imitation of a demonstrator, labeled wherever the learner goes.

The demonstrator acts in half of the environments and the network in the other half, all with noise; the demonstrator
labels every observation with its own action (Ross, Gordon and Bagnell, "A reduction of imitation learning and
structured prediction to no-regret online learning", 2011). The network learns the labels from the observation alone,
without the demonstrator's clock and memory.
"""

import functools
from collections.abc import Iterator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax

from arc_suite.learning.agents import architectures, learner, networks
from arc_suite.learning.agents.architectures import Architecture
from arc_suite.learning.agents.hyperparameters import DAgger
from arc_suite.learning.agents.learner import RunContext, Slice, generator
from arc_suite.learning.agents.normalizer import Moments, Normalizer
from arc_suite.learning.teachers import Teacher

UPDATES_PER_CALL = 20  # updates of one call


class DaggerState(NamedTuple):
    """What an update changes.

    Attributes:
        layers: of the network.
        moments: of Adam.
    """

    layers: tuple
    moments: Any


def learn(hp: DAgger, context: RunContext) -> Iterator[Slice]:
    """Learn; see `arc_suite.learning.agents`.

    Raises:
        ValueError: the body has no such preset, or the run is too short to learn.
    """
    environment = context.environment(hp.num_envs)
    architecture, teacher = architectures.of_environment(environment), Teacher(environment, hp.preset)
    state = begin(architecture.drawn(generator(context.seed, "networks", 0), hp.hidden))
    moments = Moments.empty(architecture.inputs)
    normalize = architecture.normalize(moments)
    length = -(-context.steps // hp.num_envs)  # control steps of each environment
    if length <= hp.left_out:
        first = f"as the first {hp.left_out} control steps of an episode are not learned from"
        raise ValueError(f"steps: expected more than {hp.left_out * hp.num_envs}, {first}, got {context.steps}")
    dataset = {
        "observations": np.zeros((length, hp.num_envs, architecture.size), np.float32),
        "labels": np.zeros((length, hp.num_envs, architecture.joints), np.float32),
        "ages": np.zeros((length, hp.num_envs), int),  # control steps since the episode's start
    }
    done, step = 0, 0  # control steps of each environment, environment steps
    observation, _ = environment.reset()
    age = np.zeros(hp.num_envs, int)

    if (saved := context.checkpoint) is not None:
        with learner.restoring():
            state = networks.restore_tree("state", state, saved)
            done, age = len(saved["labels"]), saved["age"]
            step = min(done * hp.num_envs, context.steps)
            for name, array in dataset.items():
                array[:done] = saved[name]
            normalize = Normalizer(*map(np.asarray, networks.restore_tree("normalizer", tuple(normalize), saved)))
            observation = learner.restore_environment(environment, saved)
            teacher.restore(saved)

    while True:
        # Act for a round, by the demonstrator in the first half of the environments, and store its labels.
        rewards, random = [], generator(context.seed, "round", done)
        for _ in range(min(hp.round, -(-(context.next_evaluation(step) - step) // hp.num_envs))):
            teacher.reset(np.flatnonzero(age == 0))
            label = teacher.act(environment.task.split(observation), np.zeros(hp.num_envs)).clip(-1.0, 1.0)
            action, own = label.copy(), slice(hp.num_envs // 2, None)
            action[own] = _act(architecture, state.layers, normalize(observation[own]))
            action += hp.noise * random.standard_normal(action.shape)
            for array, value in zip(dataset.values(), (observation, label, age), strict=True):
                array[done] = value
            observation, reward, terminated, truncated, _ = environment.step(action.clip(-1.0, 1.0))
            age = np.where(terminated | truncated, 0, age + 1)
            rewards.append(float(reward.mean()))
            done += 1
        step = min(done * hp.num_envs, context.steps)

        # Fit the network to all labels so far; the last fit is longer, with a learning rate that falls to 0.
        known = dataset["ages"][:done].ravel() >= hp.left_out
        observations, labels, _ = (array[:done].reshape(known.size, -1)[known] for array in dataset.values())
        error = 0.0
        if len(labels):
            normalize = architecture.normalize(moments.with_vectors(architecture.seen(observations)))
            rates = hp.learning_rate * np.ones(hp.updates)
            if done == length:
                rates = hp.learning_rate * np.linspace(1.0, 0.0, hp.last_updates, endpoint=False)
            most = length * hp.num_envs  # of one shape in every round, so compiled once
            inputs, outputs = (np.zeros((most, array.shape[-1]), np.float32) for array in (observations, labels))
            inputs[: len(labels)], outputs[: len(labels)] = normalize(observations), labels
            inputs, outputs = jnp.asarray(inputs), jnp.asarray(outputs)
            for first in range(0, len(rates), UPDATES_PER_CALL):
                part = rates[first : first + UPDATES_PER_CALL].astype(np.float32)
                batches = random.integers(len(labels), size=(len(part), hp.batch))
                state, error = fit(architecture, state, inputs, outputs, batches, part)

        metrics = {"reward": float(np.mean(rewards)), "error": float(error)}
        checkpoint = {
            **networks.flatten_tree("state", state),
            **{name: array[:done] for name, array in dataset.items()},
            "age": age,
            **networks.flatten_tree("normalizer", tuple(normalize)),
            **learner.environment_arrays(environment),
            **teacher.snapshot(),
        }
        yield Slice(step, metrics, architectures.policy_graph(architecture, normalize, state.layers), checkpoint)


def begin(layers) -> DaggerState:
    """Return the state before the first update of a network."""
    return jax.tree.map(jnp.asarray, DaggerState(layers, optax.scale_by_adam().init(layers)))


@functools.partial(jax.jit, static_argnums=0, donate_argnums=1)
def fit(
    architecture: Architecture, state: DaggerState, observations, labels, batches, rates
) -> tuple[DaggerState, Any]:
    """Make updates by Adam towards the least squared distance from labels.

    Args:
        architecture: of the network.
        state: before.
        observations: (n, size), normalized.
        labels: (n, joints)
        batches: (updates, batch) indices.
        rates: (updates,) learning rates.

    Returns:
        The state, and the mean squared error over the batches.
    """

    def error(layers, batch):
        actions = architecture.actions(layers, observations[batch])
        return ((actions - labels[batch]) ** 2).mean()

    def update(state, given):
        batch, rate = given
        loss, gradient = jax.value_and_grad(error)(state.layers, batch)
        steps, moments = optax.scale_by_adam().update(gradient, state.moments)
        layers = jax.tree.map(lambda layer, step: layer - rate * step, state.layers, steps)
        return DaggerState(layers, moments), loss

    state, losses = jax.lax.scan(update, state, (batches, rates))
    return state, losses.mean()


_act = jax.jit(lambda architecture, layers, x: architecture.actions(layers, x).clip(-1.0, 1.0), static_argnums=0)
