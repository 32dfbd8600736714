"""DAgger: imitation of a demonstrator, labeled wherever the learner goes.

The demonstrator acts in the first half of the environments and the network in the second half, all with noise. The
demonstrator labels every observation with its action (Ross, Gordon and Bagnell, "A reduction of imitation learning and
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
from arc_suite.tasks.modified_task import has_active, sensed_mask
from arc_suite.tasks.modifiers import SensorsOnly

UPDATES_PER_CALL = 20  # of `fit`


class DaggerState(NamedTuple):
    """What an update changes.

    Attributes:
        layers: layers of the network.
        moments: state of Adam.
    """

    layers: tuple
    moments: Any


def learn(hp: DAgger, context: RunContext) -> Iterator[Slice]:
    """Learn; see `arc_suite.learning.agents`.

    Raises:
        ValueError: the body has no such preset, or the run is too short to learn.
    """
    environment = _open_environment(context, hp.num_envs)
    is_visible = _visible_mask(context)
    architecture = architectures.of_environment(environment)
    teacher = Teacher(environment, hp.preset)
    state = begin(architecture.draw_policy(generator(context.seed, "networks", 0), hp.hidden))
    moments = Moments.empty(architecture.inputs)
    normalize = architecture.normalize(moments)
    length = -(-context.steps // hp.num_envs)  # control steps of each environment in the run, rounded up
    if length <= hp.left_out:
        reason = f"as the first {hp.left_out} control steps of an episode are not learned from"
        raise ValueError(f"steps: expected more than {hp.left_out * hp.num_envs}, {reason}, got {context.steps}")
    dataset = {
        "observations": np.zeros((length, hp.num_envs, architecture.size), np.float32),
        "labels": np.zeros((length, hp.num_envs, architecture.joints), np.float32),
        "ages": np.zeros((length, hp.num_envs), int),  # control steps since the episode's start
    }
    control_steps = 0  # of each environment
    step = 0  # environment steps
    observation, _ = environment.reset()
    age = np.zeros(hp.num_envs, int)

    saved = context.checkpoint
    if saved is not None:
        with learner.restoring():
            state = networks.restore_tree("state", state, saved)
            control_steps = len(saved["labels"])
            age = saved["age"]
            step = min(control_steps * hp.num_envs, context.steps)
            for name, array in dataset.items():
                array[:control_steps] = saved[name]
            normalize = Normalizer(*map(np.asarray, networks.restore_tree("normalizer", tuple(normalize), saved)))
            observation = learner.restore_environment(environment, saved)
            teacher.restore(saved)

    network_envs = slice(hp.num_envs // 2, None)  # in which the network acts, and not the demonstrator
    while True:
        # Act for a round, and store the demonstrator's labels.
        random = generator(context.seed, "round", control_steps)
        steps_to_evaluation = -(-(context.next_evaluation(step) - step) // hp.num_envs)  # rounded up
        rewards = []
        for _ in range(min(hp.round, steps_to_evaluation)):
            teacher.reset(np.flatnonzero(age == 0))
            label = teacher.act(environment.task.split(observation), np.zeros(hp.num_envs)).clip(-1.0, 1.0)
            seen_observation = np.where(is_visible, observation, 0.0)
            action = label.copy()
            action[network_envs] = _act(architecture, state.layers, normalize(seen_observation[network_envs]))
            action += hp.noise * random.standard_normal(action.shape)
            dataset["observations"][control_steps] = seen_observation
            dataset["labels"][control_steps] = label
            dataset["ages"][control_steps] = age
            observation, reward, terminated, truncated, _ = environment.step(action.clip(-1.0, 1.0))
            age = np.where(terminated | truncated, 0, age + 1)
            rewards.append(float(reward.mean()))
            control_steps += 1
        step = min(control_steps * hp.num_envs, context.steps)

        # Fit the network to all labels so far; the last fit is longer, with a learning rate that falls to 0.
        observations, labels = _learned_pairs(hp, dataset, control_steps)
        error = 0.0
        if len(labels):
            normalize = architecture.normalize(moments.with_vectors(architecture.moment_vectors(observations)))
            if control_steps == length:
                rates = hp.learning_rate * np.linspace(1.0, 0.0, hp.last_updates, endpoint=False)
            else:
                rates = hp.learning_rate * np.ones(hp.updates)
            capacity = length * hp.num_envs  # arrays of one shape in every round, so `fit` is compiled once
            padded_observations = _pad(normalize(observations), capacity)
            padded_labels = _pad(labels, capacity)
            for first in range(0, len(rates), UPDATES_PER_CALL):
                call_rates = rates[first : first + UPDATES_PER_CALL].astype(np.float32)
                batches = random.integers(len(labels), size=(len(call_rates), hp.batch))
                state, error = fit(architecture, state, padded_observations, padded_labels, batches, call_rates)

        metrics = {"reward": float(np.mean(rewards)), "error": float(error)}
        checkpoint = {
            **networks.flatten_tree("state", state),
            **{name: array[:control_steps] for name, array in dataset.items()},
            "age": age,
            **networks.flatten_tree("normalizer", tuple(normalize)),
            **learner.environment_arrays(environment),
            **teacher.snapshot(),
        }
        yield Slice(metrics, architectures.policy_graph(architecture, normalize, state.layers), checkpoint)


def _open_environment(context: RunContext, num_envs: int):
    """Return the environments to learn in, whose observations the demonstrator reads.

    Where the network sees what sensors give alone, the demonstrator sees everything.
    """
    if not _sees_sensors_only(context):
        return context.environment(num_envs)
    training = context.training.with_settings({"sensors_only": False})
    return context._replace(training=training).environment(num_envs)


def _visible_mask(context: RunContext) -> np.ndarray:
    """Return which numbers of the observation the network sees; others are 0 for it."""
    if not _sees_sensors_only(context):
        return np.ones(1, bool)
    return sensed_mask(context.training.definition)


def _sees_sensors_only(context: RunContext) -> bool:
    training = context.training
    return not training.several and has_active(training.definition, SensorsOnly)


def _learned_pairs(hp: DAgger, dataset, control_steps: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the observations (n, size) and labels (n, joints) to learn from, without the first ones of episodes."""
    is_learned = dataset["ages"][:control_steps].ravel() >= hp.left_out
    observations = dataset["observations"][:control_steps].reshape(is_learned.size, -1)
    labels = dataset["labels"][:control_steps].reshape(is_learned.size, -1)
    return observations[is_learned], labels[is_learned]


def _pad(array: np.ndarray, length: int) -> jax.Array:
    """Return an array (n, size) as float32 (length, size), with zeros at its end."""
    padded_array = np.zeros((length, array.shape[-1]), np.float32)
    padded_array[: len(array)] = array
    return jnp.asarray(padded_array)


def begin(layers) -> DaggerState:
    """Return the state before the first update of a network."""
    return jax.tree.map(jnp.asarray, DaggerState(layers, optax.scale_by_adam().init(layers)))


@functools.partial(jax.jit, static_argnums=0, donate_argnums=1)
def fit(
    architecture: Architecture, state: DaggerState, observations, labels, batches, rates
) -> tuple[DaggerState, Any]:
    """Make updates by Adam towards the least squared distance from labels.

    Args:
        architecture: architecture of the network.
        state: before the updates.
        observations: (n, size), normalized.
        labels: (n, joints)
        batches: (updates, batch) indices.
        rates: (updates,) learning rates.

    Returns:
        The state, and the mean squared error over the batches.
    """

    def mean_squared_error(layers, batch):
        actions = architecture.actions(layers, observations[batch])
        return ((actions - labels[batch]) ** 2).mean()

    def update(state, batch_and_rate):
        batch, rate = batch_and_rate
        error, gradient = jax.value_and_grad(mean_squared_error)(state.layers, batch)
        direction, moments = optax.scale_by_adam().update(gradient, state.moments)
        layers = jax.tree.map(lambda weight, step: weight - rate * step, state.layers, direction)
        return DaggerState(layers, moments), error

    state, errors = jax.lax.scan(update, state, (batches, rates))
    return state, errors.mean()


@functools.partial(jax.jit, static_argnums=0)
def _act(architecture: Architecture, layers, observations):
    """Return the actions (..., joints) of the network for normalized observations."""
    return architecture.actions(layers, observations).clip(-1.0, 1.0)
