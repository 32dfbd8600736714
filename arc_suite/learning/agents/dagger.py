"""DAgger: imitation of a demonstrator, labeled wherever the learner goes.

The demonstrator acts in the first half of the environments and the network in the second half, all with noise. The
demonstrator labels every observation with its action (Ross, Gordon and Bagnell, "A reduction of imitation learning and
structured prediction to no-regret online learning", 2011). The network learns the labels from the observation alone,
without the demonstrator's clock and memory.
"""

import functools
import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax

from arc_suite.bodies import BodiesEnv
from arc_suite.envs.vector import VectorEnv
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
        ValueError: the body has no such preset, or the run or its episodes are too short to learn.
    """
    environment = _open_environment(context, hp.num_envs)
    architecture = architectures.of_environment(environment)
    collector = _Collector(hp, context, environment, architecture)
    state = begin(architecture.draw_policy(generator(context.seed, "networks", 0), hp.hidden))
    moments = Moments.empty(architecture.inputs)
    normalize = architecture.normalize(moments)

    saved = context.checkpoint
    if saved is not None:
        with learner.restoring():
            state = networks.restore_tree("state", state, saved)
            normalize = Normalizer(*map(np.asarray, networks.restore_tree("normalizer", tuple(normalize), saved)))
            collector.restore(saved)

    while True:
        random = generator(context.seed, "round", collector.control_steps)
        reward = collector.collect_round(random, state.layers, normalize)

        # Fit the network to all labels so far.
        observations, labels = collector.learned_pairs()
        error = 0.0
        if len(labels):
            normalize = architecture.normalize(moments.with_vectors(architecture.moment_vectors(observations)))
            # Arrays of one shape in every round, so `fit` is compiled once.
            padded_observations = _pad(normalize(observations), collector.capacity)
            padded_labels = _pad(labels, collector.capacity)
            for rates in _learning_rates(hp, is_last_round=collector.is_full):
                batches = random.integers(len(labels), size=(len(rates), hp.batch))
                state, error = fit(architecture, state, padded_observations, padded_labels, batches, rates)

        graph = architectures.policy_graph(architecture, normalize, state.layers)
        checkpoint = {
            **networks.flatten_tree("state", state),
            **collector.arrays(),
            **networks.flatten_tree("normalizer", tuple(normalize)),
        }
        yield Slice({"reward": reward, "error": float(error)}, graph, checkpoint)


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


def _open_environment(context: RunContext, num_envs: int):
    """Return the environments to learn in, whose observations the demonstrator reads.

    Where the network sees what sensors give alone, the demonstrator sees everything.
    """
    if not _sees_sensors_only(context):
        return context.environment(num_envs)
    training = context.training.with_settings({"sensors_only": False})
    return context._replace(training=training).environment(num_envs)


def _shortest_step_limit(environment: VectorEnv | BodiesEnv) -> float:
    """Return the fewest control steps of a time limit, may be infinite; each body and task has its own."""
    if isinstance(environment, BodiesEnv):
        return min(task.step_limit for task in environment.tasks)
    return environment.task.definition.step_limit


class _Collector:
    """Acts in the environments, and keeps all observations and labels of the run.

    Attributes:
        control_steps: control steps so far, of each environment.
        capacity: most observations of the run, over all environments.
    """

    def __init__(self, hp: DAgger, context: RunContext, environment: VectorEnv | BodiesEnv, architecture: Architecture):
        """Begin the first episodes.

        Raises:
            ValueError: as `learn`.
        """
        self._hp = hp
        self._context = context
        self._environment = environment
        self._architecture = architecture
        self._is_visible = _visible_mask(context)
        self._teacher = Teacher(environment, hp.preset)
        length = math.ceil(context.steps / hp.num_envs)  # control steps of each environment in the run
        if length <= hp.left_out:
            reason = f"as the first {hp.left_out} control steps of an episode are not learned from"
            raise ValueError(f"steps: expected more than {hp.left_out * hp.num_envs}, {reason}, got {context.steps}")
        shortest = _shortest_step_limit(environment)
        if shortest <= hp.left_out:
            raise ValueError(
                f"left_out: expected fewer than the {shortest:.0f} control steps of an episode, got {hp.left_out}"
            )
        self._dataset = {
            "observations": np.zeros((length, hp.num_envs, architecture.size), np.float32),
            "labels": np.zeros((length, hp.num_envs, architecture.joints), np.float32),
            "ages": np.zeros((length, hp.num_envs), int),  # control steps since the episode's start
        }
        self.control_steps = 0
        self.capacity = length * hp.num_envs
        self._observation, _ = environment.reset()
        self._age = np.zeros(hp.num_envs, int)

    @property
    def is_full(self) -> bool:
        """Whether all control steps of the run are made."""
        return self.control_steps * self._hp.num_envs == self.capacity

    def collect_round(self, random: np.random.Generator, layers, normalize: Normalizer) -> float:
        """Act for a round, or up to an evaluation; store the labels, and return the mean reward.

        Args:
            random: of the noise on actions.
            layers: layers of the network.
            normalize: normalizer of observations.
        """
        hp = self._hp
        network_envs = slice(hp.num_envs // 2, None)  # in which the network acts, and not the demonstrator
        rewards = []
        for _ in range(min(hp.round, self._steps_to_evaluation())):
            self._teacher.reset(np.flatnonzero(self._age == 0))
            blocks = self._environment.task.split(self._observation)
            label = self._teacher.act(blocks, np.zeros(hp.num_envs)).clip(-1.0, 1.0)
            visible_observation = np.where(self._is_visible, self._observation, 0.0)
            action = label.copy()
            action[network_envs] = _act(self._architecture, layers, normalize(visible_observation[network_envs]))
            action += hp.noise * random.standard_normal(action.shape)
            self._dataset["observations"][self.control_steps] = visible_observation
            self._dataset["labels"][self.control_steps] = label
            self._dataset["ages"][self.control_steps] = self._age
            self._observation, reward, terminated, truncated, _ = self._environment.step(action.clip(-1.0, 1.0))
            self._age = np.where(terminated | truncated, 0, self._age + 1)
            rewards.append(float(reward.mean()))
            self.control_steps += 1
        return float(np.mean(rewards))

    def _steps_to_evaluation(self) -> int:
        """Return the control steps of each environment up to the next evaluation."""
        step = min(self.control_steps * self._hp.num_envs, self._context.steps)
        return math.ceil((self._context.next_evaluation(step) - step) / self._hp.num_envs)

    def learned_pairs(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the observations (n, size) and labels (n, joints) to learn from.

        The first control steps of episodes are not among them.
        """
        stored = self._stored_arrays()
        is_learned = stored["ages"].ravel() >= self._hp.left_out
        observations = stored["observations"].reshape(is_learned.size, -1)
        labels = stored["labels"].reshape(is_learned.size, -1)
        return observations[is_learned], labels[is_learned]

    def arrays(self) -> dict[str, np.ndarray]:
        """Return what a checkpoint holds, arrays by name."""
        environment_arrays = learner.environment_arrays(self._environment)
        return {**self._stored_arrays(), "age": self._age, **environment_arrays, **self._teacher.snapshot()}

    def _stored_arrays(self) -> dict[str, np.ndarray]:
        """Return the dataset so far, arrays (control_steps, num_envs, ...) by name."""
        return {name: array[: self.control_steps] for name, array in self._dataset.items()}

    def restore(self, saved: Mapping[str, np.ndarray]) -> None:
        """Continue from the arrays of a checkpoint."""
        self.control_steps = len(saved["labels"])
        self._age = saved["age"]
        for name, array in self._stored_arrays().items():
            array[:] = saved[name]
        self._observation = learner.restore_environment(self._environment, saved)
        self._teacher.restore(saved)


def _visible_mask(context: RunContext) -> np.ndarray:
    """Return which numbers of the observation the network sees; others are 0 for it."""
    if not _sees_sensors_only(context):
        return np.ones(1, bool)
    return sensed_mask(context.training.definition)


def _sees_sensors_only(context: RunContext) -> bool:
    training = context.training
    return not training.several and has_active(training.definition, SensorsOnly)


@functools.partial(jax.jit, static_argnums=0)
def _act(architecture: Architecture, layers, observations):
    """Return the actions (..., joints) of the network for normalized observations."""
    return architecture.actions(layers, observations).clip(-1.0, 1.0)


def _learning_rates(hp: DAgger, is_last_round: bool) -> Iterator[np.ndarray]:
    """Yield the learning rates of a round for each call of `fit`.

    The last round has more updates, and its rates fall to 0.
    """
    if is_last_round:
        rates = hp.learning_rate * np.linspace(1.0, 0.0, hp.last_updates, endpoint=False)
    else:
        rates = hp.learning_rate * np.ones(hp.updates)
    for first in range(0, len(rates), UPDATES_PER_CALL):
        yield rates[first : first + UPDATES_PER_CALL].astype(np.float32)


def _pad(array: np.ndarray, length: int) -> jax.Array:
    """Return an array (n, size) as float32 (length, size), with zeros at its end."""
    padded_array = np.zeros((length, array.shape[-1]), np.float32)
    padded_array[: len(array)] = array
    return jnp.asarray(padded_array)
