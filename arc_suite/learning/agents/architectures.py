"""Architectures of networks: what maps vectors of observations to actions and to values.

An architecture is a value with the methods of `Perceptron`: how networks view observations, and how they give actions
(..., joints) and values (...). Learners draw its parameters, normalize what it views and apply it. JAX compiles for
each value: equal ones must compute the same.
"""

import dataclasses
from collections.abc import Iterable
from typing import Any, Self

import numpy as np

from arc_suite import registry
from arc_suite.bodies import BodiesEnv
from arc_suite.envs.vector import VectorEnv
from arc_suite.learning.agents import networks
from arc_suite.learning.agents.hyperparameters import NETWORKS
from arc_suite.learning.agents.leg_networks import AnyLegs, Legs
from arc_suite.learning.agents.networks import ACTIVATION
from arc_suite.learning.agents.normalizer import Moments, Normalizer
from arc_suite.policies.graph import Graph
from arc_suite.policies.tracing import perceptron, traced
from arc_suite.tasks import Task


@dataclasses.dataclass(frozen=True)
class Perceptron:
    """Multilayer perceptrons of two hidden layers, for one body.

    Normalized numbers of a block are scaled, so that the variances of every block have the same sum. Otherwise 150
    contact forces would outweigh a clock of two numbers.

    Attributes:
        blocks: sizes of the observation's blocks, in order.
        joints: of an action.
        privileged: sizes of blocks that follow those of the observation, and that values alone depend on.
        size: of an observation.
        own: numbers of a view that actions depend on, which are its first.
        inputs: numbers whose moments normalize views, privileged ones counted.
        symmetric: whether the networks treat left and right alike, whatever their parameters.
    """

    blocks: tuple[int, ...]
    joints: int
    privileged: tuple[int, ...] = ()

    symmetric = False
    size = own = property(lambda self: sum(self.blocks))
    inputs = property(lambda self: self.size + sum(self.privileged))

    @classmethod
    def of(cls, task: Task, critic_blocks: Iterable[str] = (), symmetric: bool = False) -> Self:
        """Return the architecture for a task.

        Args:
            task: whose observations networks see.
            critic_blocks: names of privileged blocks for networks of values.
            symmetric: makes no difference: mirrored transitions teach both sides.
        """
        privileged = tuple(task.privileged_blocks[name].size for name in critic_blocks)
        return cls(tuple(task.sizes.values()), len(task.scene.body.joint_names), privileged)

    def viewed(self, observations):
        """Return observations (..., size), privileged blocks after them, as networks view them."""
        return observations

    def drawn(self, random, hidden, last_gain=1.0):
        """Draw the parameters of a network of actions."""
        sizes = (self.size, hidden, hidden, self.joints)
        return networks.mlp(random, sizes, "orthogonal", gain=2**0.5, last_gain=last_gain)

    def drawn_values(self, random, hidden):
        """Draw the parameters of a network of values."""
        return networks.mlp(random, (self.inputs, hidden, hidden, 1), "orthogonal", gain=2**0.5)

    def actions(self, parameters, views):
        """Return the actions (..., joints) for normalized views (..., own or more)."""
        return networks.forward(parameters, views[..., : self.size] * self.scale, ACTIVATION)

    def values(self, parameters, views):
        """Return the values (...) of normalized views."""
        scale = networks.equalizing_scale(self.blocks + self.privileged)
        return networks.forward(parameters, views * scale, ACTIVATION)[..., 0]

    @property
    def scale(self) -> np.ndarray:
        """(size,) factors of normalized numbers; their mean square is 1, so that gains of first weights hold."""
        return networks.equalizing_scale(self.blocks)

    def seen(self, views):
        """Return the vectors (..., inputs) whose moments normalize views."""
        return views

    def normalize(self, moments: Moments) -> Normalizer:
        """Return what normalizes views, from the moments of what was seen."""
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
        first, *others = map(networks.make_linear_layer, weights[::2], weights[1::2])
        return {**first, "weight": first["weight"] / self.scale[:, None]}, *others


Architecture = Perceptron | Legs | AnyLegs


# What learners use of an architecture.
_ATTRIBUTES = (
    *("symmetric", "size", "own", "inputs", "viewed", "seen", "normalize"),
    *("drawn", "drawn_values", "actions", "values", "exported", "imported"),
)


def of(
    task: Task, network: str = "perceptron", critic_blocks: Iterable[str] = (), symmetric: bool = True
) -> Perceptron | Legs:
    """Return the architecture for a task of one body.

    Args:
        task: whose observations networks see.
        network: "perceptron", "legs", or that of another package. Its function takes the other arguments.
        critic_blocks: names of privileged blocks for networks of values.
        symmetric: whether legs on the left and on the right share their network, if the task is symmetric.

    Raises:
        ValueError: an unknown network, or a function that returns no architecture.
    """
    architecture = registry.find("network", network, NETWORKS)(task, critic_blocks, symmetric)
    if missing := [name for name in _ATTRIBUTES if not hasattr(architecture, name)]:
        raise ValueError(f"network {network!r}: has no {' and no '.join(missing)}, which architectures have")
    return architecture


def of_environment(environment: VectorEnv | BodiesEnv, *options, **more) -> Architecture:
    """Return the architecture for environments: `AnyLegs` for several bodies, else what `of` returns."""
    return AnyLegs() if isinstance(environment, BodiesEnv) else of(environment.task.definition, *options, **more)


def policy_graph(architecture: Architecture, normalize: Normalizer, parameters) -> Graph:
    """Return the graph of a policy: a normalizer and a network of actions."""
    mean, factor, limit = normalize
    own = Normalizer(mean[: architecture.own], factor[: architecture.own], limit)

    def actions(x):
        return architecture.exported(parameters, own(architecture.viewed(x))).clip(-1.0, 1.0)

    return traced(actions, architecture.size)


def read_policy_graph(architecture: Architecture, graph: Graph) -> tuple[Normalizer, Any]:
    """Return the normalizer and the parameters of a graph that `policy_graph` gave.

    Raises:
        ValueError: another graph.
    """
    try:
        first = [node.operator for node in graph.nodes].index("Sub")
        normalize = Normalizer(*(graph.arrays[str(node.inputs[-1])] for node in graph.nodes[first : first + 3]))
        names = [node.inputs[1:] for node in graph.nodes if node.operator in ("Linear", "Product")]
        parameters = architecture.imported([graph.arrays[str(name)] for own in names for name in own])
        same = policy_graph(architecture, normalize, parameters).nodes == graph.nodes
    except (KeyError, TypeError, ValueError):
        same = False
    if not same:
        raise ValueError("a policy of dagger, bc or ppo, of the same network")
    return normalize, parameters
