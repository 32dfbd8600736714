"""Learns to act as a demonstrator does, from what it does where the learner goes (DAgger).

Half of the rows act by the demonstrator and half by the network, all with noise, and the demonstrator
says in every row what it would do (Ross, Gordon and Bagnell, "A reduction of imitation learning and
structured prediction to no-regret online learning", 2011). The network learns to say the same from the
observation alone, so it needs neither the demonstrator's clock nor its memory. What it learns is no
better than who is imitated: a law that was searched for.
"""

import functools
from collections.abc import Mapping
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import optax

from arc_suite import policies
from arc_suite.agents import networks, normaliser
from arc_suite.agents.hyperparameters import Imitation
from arc_suite.agents.learner import Stage, environment_arrays, generator, restore_environment
from arc_suite.agents.normaliser import Moments
from arc_suite.cpg.demonstrator import suited_preset
from arc_suite.policies.network import Layer, forward

ACTIVATION = "elu"
CHUNK = 20  # updates of one call


class State(NamedTuple):
    """What an update changes.

    Attributes:
        layers: of the network.
        moments: of Adam.
    """

    layers: tuple
    moments: Any


def begin(row: Imitation, stage: Stage) -> "Imitator":
    """Return the learner; see `arc_suite.agents`."""
    return Imitator(row, stage)


@functools.partial(jax.jit, donate_argnums=0)
def fit(state: State, observations, labels, batches, rates) -> tuple[State, Any]:
    """Make updates by Adam towards the least squared distance from labels.

    Args:
        state: as it is.
        observations: (n, size), normalised.
        labels: (n, joints)
        batches: (updates, batch) indices.
        rates: (updates,) of learning.

    Returns:
        The state, and the mean squared error over the batches.
    """

    def error(layers, batch):
        said = networks.forward(layers, observations[batch], ACTIVATION)
        return ((said - labels[batch]) ** 2).mean()

    def update(state, given):
        batch, rate = given
        loss, gradient = jax.value_and_grad(error)(state.layers, batch)
        steps, moments = optax.scale_by_adam().update(gradient, state.moments)
        layers = jax.tree.map(lambda layer, step: layer - rate * step, state.layers, steps)
        return State(layers, moments), loss

    state, losses = jax.lax.scan(update, state, (batches, rates))
    return state, losses.mean()


_said = jax.jit(lambda layers, observations: networks.forward(layers, observations, ACTIVATION).clip(-1.0, 1.0))


class Imitator:
    """A learner that imitates; what it has seen is all that it goes on from, the demonstrator's memory too."""

    def __init__(self, row: Imitation, stage: Stage):
        """Draw the network and begin the first episodes.

        Raises:
            ValueError: the body has no such preset, or nothing would be learned from; one line.
        """
        self._row, self._stage = row, stage
        self._environment = stage.environment(row.rows)
        task = self._environment.task
        self._joints = self._environment.single_action_space.shape[0]
        preset = row.preset or suited_preset(task)
        self._teacher = policies.policy("cpg", stage.body, preset, row.rows, task=task)
        layers = networks.mlp(
            generator(stage.seed, "networks", 0),
            (task.size, row.hidden, row.hidden, self._joints),
            "orthogonal",
            gain=2**0.5,
        )
        self._state = jax.tree.map(jnp.asarray, State(layers, optax.scale_by_adam().init(layers)))
        self._normaliser = Moments.none(task.size).layer()
        length = -(-stage.steps // row.rows)  # control steps of each row
        if length <= row.left_out:
            first = f"as the first {row.left_out} control steps of an episode are not learned from"
            raise ValueError(f"steps: expected more than {row.left_out * row.rows}, {first}, got {stage.steps}")
        self._observations = np.zeros((length, row.rows, task.size), np.float32)
        self._labels = np.zeros((length, row.rows, self._joints), np.float32)
        self._ages = np.zeros((length, row.rows), int)  # control steps since the episode's start
        self._length = 0
        self._observation, _ = self._environment.reset()
        self._age = np.zeros(row.rows, int)

    @property
    def step(self) -> int:
        """Environment steps that are done with."""
        return min(self._length * self._row.rows, self._stage.steps)

    def advance(self, limit: int) -> Mapping[str, float]:
        """Act for a round, and learn from all that was seen so far; see `Learner`."""
        row, rewards = self._row, []
        random = generator(self._stage.seed, "round", self._length)
        for _ in range(min(row.round, -(-(limit - self.step) // row.rows))):
            rewards.append(self._act(random))
        ends = self._length == len(self._labels)
        seen = self._ages[: self._length].ravel() >= row.left_out
        observations, labels = (
            array[: self._length].reshape(seen.size, -1)[seen] for array in (self._observations, self._labels)
        )
        if not len(labels):
            return {"reward": float(np.mean(rewards)), "error": 0.0}
        self._normaliser = Moments.none(observations.shape[-1]).after(observations).layer()
        return {"reward": float(np.mean(rewards)), "error": self._fitted(random, observations, labels, ends)}

    def policy(self) -> tuple[Layer, ...]:
        """Return the layers of the network, which acts without noise."""
        return self._normaliser, *networks.exported(self._state.layers, ACTIVATION), Layer("clip")

    def arrays(self) -> dict[str, np.ndarray]:
        """Return all that it goes on from."""
        seen = (self._observations, self._labels, self._ages)
        names = ("observations", "labels", "ages")
        return {
            **networks.named("state", self._state),
            **{name: array[: self._length] for name, array in zip(names, seen, strict=True)},
            "age": self._age,
            **normaliser.stored(self._normaliser),
            **environment_arrays(self._environment),
        }

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from what `arrays` returned."""
        self._state = networks.restored("state", self._state, arrays)
        self._length, self._age = len(arrays["labels"]), arrays["age"]
        for ours, name in ((self._observations, "observations"), (self._labels, "labels"), (self._ages, "ages")):
            ours[: self._length] = arrays[name]
        self._normaliser = normaliser.restored(arrays)
        self._observation = restore_environment(self._environment, arrays)
        for observation, age in zip(self._observations[: self._length], self._ages, strict=False):
            self._taught(observation, age)

    def _act(self, random: np.random.Generator) -> float:
        """Act in all rows for a control step, take down what the demonstrator says, and return the mean reward."""
        row = self._row
        label = self._taught(self._observation, self._age).clip(-1.0, 1.0)
        action = label.copy()
        own = slice(row.rows // 2, None)
        action[own] = _said(self._state.layers, forward([self._normaliser], self._observation[own]))
        action += row.noise * random.standard_normal(action.shape)
        for array, values in ((self._observations, self._observation), (self._labels, label), (self._ages, self._age)):
            array[self._length] = values
        self._length += 1
        self._observation, rewards, terminated, truncated, _ = self._environment.step(action.clip(-1.0, 1.0))
        self._age = np.where(terminated | truncated, 0, self._age + 1)
        return float(rewards.mean())

    def _taught(self, observation: np.ndarray, age: np.ndarray) -> np.ndarray:
        """What the demonstrator would do, whose episodes begin in rows of age 0."""
        rows = np.flatnonzero(age == 0).tolist()
        self._teacher.begin(rows, [0] * len(rows))  # demonstrators are the same in all episodes
        return self._teacher.act(self._environment.task.split(observation), np.zeros(len(age)))

    def _fitted(self, random: np.random.Generator, observations, labels, ends: bool) -> float:
        """Fit the network, longer and with a falling rate if this is the end, and return the mean squared error."""
        row = self._row
        updates = row.last_updates if ends else row.updates
        rates = row.learning_rate * (np.linspace(1.0, 0.0, updates, endpoint=False) if ends else np.ones(updates))
        capacity = self._ages.size  # the same shapes in every round: one program
        inputs, wanted = (np.zeros((capacity, array.shape[-1]), np.float32) for array in (observations, labels))
        inputs[: len(labels)] = forward([self._normaliser], observations)
        wanted[: len(labels)] = labels
        inputs, wanted, errors = jnp.asarray(inputs), jnp.asarray(wanted), []
        for first in range(0, updates, CHUNK):
            part = rates[first : first + CHUNK].astype(np.float32)
            batches = random.integers(len(labels), size=(len(part), row.batch))
            self._state, error = fit(self._state, inputs, wanted, batches, part)
            errors.append(float(error))
        return errors[-1]
