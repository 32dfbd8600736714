"""Architectures of networks: what maps vectors of observations to actions and to values.

An architecture is a frozen value with the methods of `Perceptron`: how networks see observations (..., size), and how
they give actions (..., joints) and values (...). Learners draw its parameters, normalize its observations and apply it.
"""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, Self

import jax.numpy as jnp
import numpy as np

from arc_suite.envs.bodies import BodiesEnv
from arc_suite.envs.vector import VectorEnv
from arc_suite.learning.agents import networks
from arc_suite.learning.agents.normalizer import Moments, Normalizer
from arc_suite.policies.graph import Graph
from arc_suite.policies.tracing import perceptron, traced
from arc_suite.tasks import Task, tokens
from arc_suite.tasks.tokens import JOINTS, LEGS

ACTIVATION = "elu"


class Perceptron(NamedTuple):
    """Multilayer perceptrons of two hidden layers, for one body.

    Normalized numbers of a block are scaled, so that the variances of every block have the same sum. Otherwise 150
    contact forces would outweigh a clock of two numbers.

    Attributes:
        blocks: sizes of the observation's blocks, in order.
        joints: of an action.
        privileged: sizes of blocks that follow those of the observation, and that values alone depend on.
        size: of an observation.
        inputs: numbers whose moments normalize observations, privileged ones counted.
    """

    blocks: tuple[int, ...]
    joints: int
    privileged: tuple[int, ...] = ()

    size = property(lambda self: sum(self.blocks))
    inputs = property(lambda self: self.size + sum(self.privileged))

    @classmethod
    def of(cls, task: Task, critic_blocks: Iterable[str] = ()) -> Self:
        """Return the architecture for a task, given names of privileged blocks for networks of values."""
        privileged = tuple(task.privileged_blocks[name].size for name in critic_blocks)
        return cls(tuple(task.sizes.values()), len(task.scene.body.joint_names), privileged)

    def drawn(self, random, hidden, last_gain=1.0):
        """Draw the parameters of a network of actions."""
        sizes = (self.size, hidden, hidden, self.joints)
        return networks.mlp(random, sizes, "orthogonal", gain=2**0.5, last_gain=last_gain)

    def drawn_values(self, random, hidden):
        """Draw the parameters of a network of values."""
        return networks.mlp(random, (self.inputs, hidden, hidden, 1), "orthogonal", gain=2**0.5)

    def actions(self, parameters, observations):
        """Return the actions (..., joints) for normalized observations (..., size or inputs)."""
        return networks.forward(parameters, observations[..., : self.size] * self.scale, ACTIVATION)

    def values(self, parameters, observations):
        """Return the values (...) of normalized observations (..., inputs)."""
        return networks.forward(parameters, observations * _scale(self.blocks + self.privileged), ACTIVATION)[..., 0]

    @property
    def scale(self) -> np.ndarray:
        """(size,) factors of normalized numbers; their mean square is 1, so that gains of first weights hold."""
        return _scale(self.blocks)

    def seen(self, observations):
        """Return the vectors (n, inputs) whose moments normalize observations (..., size)."""
        return observations

    def normalize(self, moments: Moments) -> Normalizer:
        """Return what normalizes observations, from the moments of what was seen."""
        return moments.normalizer()

    def exported(self, parameters, x):
        """Write the nodes of the actions (1, joints) for a normalized observation (1, size)."""
        first, *others = parameters
        return perceptron(x, ({**first, "weight": first["weight"] * self.scale[:, None]}, *others), ACTIVATION)

    def imported(self, weights):
        """Return the parameters from the weights and biases of the nodes that `exported` wrote, in order.

        Raises:
            ValueError: others.
        """
        first, *others = map(_layer, weights[::2], weights[1::2])
        return {**first, "weight": first["weight"] / self.scale[:, None]}, *others


class PerLeg(NamedTuple):
    """Networks of any body: one for all legs, which sees a leg, the torso, and the mean of what it finds of all legs.

    Observations are those of a flat `BodiesEnv`. A first network maps each leg, with torso, command and description, to
    features. A second one maps the features of a leg and their mean over all legs to actions of its joints. Values
    are means over legs.
    """

    inputs: int = tokens.LEG_INPUTS
    size: int = sum(tokens.FLAT.values())
    joints: int = LEGS * JOINTS

    def drawn(self, random, hidden, last_gain=1.0):
        """Draw the parameters of a network of actions."""
        return self._drawn(random, hidden, JOINTS, last_gain)

    def drawn_values(self, random, hidden):
        """Draw the parameters of a network of values."""
        return self._drawn(random, hidden, 1)

    def actions(self, parameters, observations):
        """Return the actions (..., 48), 0 where there is no joint."""
        found, mask = _of_legs(parameters, observations)
        return jnp.where(mask, found, 0.0).reshape(*found.shape[:-2], -1)

    def values(self, parameters, observations):
        """Return the values (...)."""
        found, mask = _of_legs(parameters, observations)
        legs = mask.any(axis=-1)
        return jnp.where(legs, found[..., 0], 0.0).sum(axis=-1) / legs.sum(axis=-1)

    def seen(self, observations):
        """Return the inputs (n, 81) of all legs that there are."""
        legs, mask = tokens.leg_inputs(observations)
        return legs[mask.any(axis=-1)]

    def normalize(self, moments: Moments) -> Normalizer:
        """Return what normalizes 664 numbers, the same for every leg; it leaves the number of joints as it is."""
        mean, factor, limit = moments.normalizer()
        return Normalizer(tokens.of_all_legs(mean, 0.0), tokens.of_all_legs(factor, 1.0), limit)

    def exported(self, parameters, x):
        """Write the nodes of a network of actions, which compute the legs that there are."""
        (first, second), (head, last) = parameters
        own, mean = np.split(np.asarray(head["weight"]), 2)
        inputs, mask = tokens.leg_inputs(x)
        there = mask.sum(axis=-1) > 0.0
        features = perceptron(inputs.node("Pick", there), (first, second), ACTIVATION).node("Elu")
        context = features.node("Place", there).sum(axis=1) / there.sum(axis=1)[:, None]
        context = context.node("Linear", mean, head["bias"])[:, None]
        context = np.broadcast_to(context, (1, LEGS, context.shape[-1])).node("Pick", there)
        hidden = features.node("Product", own) + context
        found = hidden.node("Elu").node("Linear", last["weight"], last["bias"])
        return (found.node("Place", there) * mask).reshape(1, -1)

    def imported(self, weights):
        """Return the parameters."""
        first, first_bias, second, second_bias, mean, bias, own, last, last_bias = weights
        head = _layer(np.concatenate([own, mean]), bias), _layer(last, last_bias)
        return (_layer(first, first_bias), _layer(second, second_bias)), head

    def _drawn(self, random, hidden, outputs, last_gain=1.0):
        gain = 2**0.5
        features = networks.mlp(random, (self.inputs, hidden, hidden), "orthogonal", gain=gain, last_gain=gain)
        head = networks.mlp(random, (2 * hidden, hidden, outputs), "orthogonal", gain=gain, last_gain=last_gain)
        return features, head


Architecture = Perceptron | PerLeg


def of(environment: VectorEnv | BodiesEnv, critic_blocks: Iterable[str] = ()) -> Architecture:
    """Return the architecture that suits environments, given names of privileged blocks for networks of values."""
    if isinstance(environment, BodiesEnv):
        return PerLeg()
    return Perceptron.of(environment.task.definition, critic_blocks)


def policy(architecture: Architecture, normalize: Normalizer, parameters) -> Graph:
    """Return the graph of a policy: a normalizer and a network of actions."""
    mean, factor, limit = normalize
    own = Normalizer(mean[: architecture.size], factor[: architecture.size], limit)
    return traced(lambda x: architecture.exported(parameters, own(x)).clip(-1.0, 1.0), architecture.size)


def read(architecture: Architecture, graph: Graph) -> tuple[Normalizer, Any]:
    """Return the normalizer and the parameters of a graph that `policy` gave.

    Raises:
        ValueError: another graph.
    """
    try:
        normalize = Normalizer(*(graph.arrays[str(node.inputs[-1])] for node in graph.nodes[:3]))
        names = [node.inputs[1:] for node in graph.nodes if node.operator in ("Linear", "Product")]
        parameters = architecture.imported([graph.arrays[str(name)] for own in names for name in own])
        same = policy(architecture, normalize, parameters).nodes == graph.nodes
    except (KeyError, TypeError, ValueError):
        same = False
    if not same:
        raise ValueError("a policy of dagger, bc or ppo, with two hidden layers")
    return normalize, parameters


def _scale(blocks: Sequence[int]) -> np.ndarray:
    counts = [count for count in blocks if count]
    squares = [sum(counts) / (len(counts) * count) for count in counts]
    return np.sqrt(np.repeat(squares, counts)).astype(np.float32)


def _layer(weight: np.ndarray, bias: np.ndarray) -> dict[str, np.ndarray]:
    return {"weight": weight, "bias": bias}


def _of_legs(parameters, observations):
    """Return the outputs (..., 12, outputs) of networks of legs, and the mask (..., 12, 4) of joints."""
    features, head = parameters
    legs, mask = tokens.leg_inputs(observations)
    found = networks.hidden(features, legs, ACTIVATION)
    there = mask.any(axis=-1)[..., None]
    mean = jnp.where(there, found, 0.0).sum(axis=-2, keepdims=True) / there.sum(axis=-2, keepdims=True)
    both = jnp.concatenate([found, jnp.broadcast_to(mean, found.shape)], axis=-1)
    return networks.forward(head, both, ACTIVATION), mask
