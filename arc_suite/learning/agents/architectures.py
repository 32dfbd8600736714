"""Architectures of networks: what maps vectors of observations to actions and to values.

An architecture is a value with the methods of `Perceptron`. They say how networks view observations, and how networks
give actions (..., joints) and values (...). Learners draw its parameters, normalize its views and apply it. JAX
compiles for each architecture: equal ones must compute the same.
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

_GAIN = 2**0.5  # of the weights of hidden layers


@dataclasses.dataclass(frozen=True)
class Perceptron:
    """Multilayer perceptrons of two hidden layers, for one body.

    Normalized numbers of a block are scaled, so that the variances of every block have the same sum. Otherwise 150
    contact forces would outweigh a clock of two numbers.

    Attributes:
        blocks: sizes of the observation's blocks, in order.
        joints: numbers of an action.
        privileged: sizes of the privileged blocks after the observation, which only values depend on.
        size: numbers of an observation.
        action_inputs: numbers of a view that actions depend on; they come first.
        inputs: numbers of a view, privileged ones counted; the size of the moments that normalize it.
        symmetric: whether the networks treat left and right alike, whatever their parameters.
    """

    blocks: tuple[int, ...]
    joints: int
    privileged: tuple[int, ...] = ()

    symmetric = False

    @property
    def size(self) -> int:
        """Numbers of an observation."""
        return sum(self.blocks)

    @property
    def action_inputs(self) -> int:
        """Numbers of a view that actions depend on; they come first."""
        return sum(self.blocks)

    @property
    def inputs(self) -> int:
        """Numbers of a view, privileged ones counted."""
        return self.size + sum(self.privileged)

    @classmethod
    def of(cls, task: Task, critic_blocks: Iterable[str] = (), symmetric: bool = False) -> Self:
        """Return the architecture for a task.

        Args:
            task: task whose observations networks see.
            critic_blocks: names of privileged blocks for networks of values.
            symmetric: makes no difference: mirrored transitions teach both sides.
        """
        privileged = tuple(task.privileged_blocks[name].size for name in critic_blocks)
        return cls(tuple(task.sizes.values()), len(task.scene.body.joint_names), privileged)

    def view(self, observations):
        """Return observations (..., size), with privileged blocks after them, as networks view them."""
        return observations

    def draw_policy(self, random, hidden, last_gain=1.0):
        """Draw the parameters of a network of actions."""
        sizes = (self.size, hidden, hidden, self.joints)
        return networks.mlp(random, sizes, "orthogonal", gain=_GAIN, last_gain=last_gain)

    def draw_values(self, random, hidden):
        """Draw the parameters of a network of values."""
        return networks.mlp(random, (self.inputs, hidden, hidden, 1), "orthogonal", gain=_GAIN)

    def actions(self, parameters, views):
        """Return the actions (..., joints) for normalized views (..., own or more)."""
        return networks.forward(parameters, views[..., : self.size] * self.scale, ACTIVATION)

    def values(self, parameters, views):
        """Return the values (...) of normalized views (..., inputs)."""
        scale = networks.equalizing_scale(self.blocks + self.privileged)
        return networks.forward(parameters, views * scale, ACTIVATION)[..., 0]

    @property
    def scale(self) -> np.ndarray:
        """(size,) factors of normalized numbers; see `networks.equalizing_scale`."""
        return networks.equalizing_scale(self.blocks)

    def moment_vectors(self, views):
        """Return the vectors (..., inputs) whose moments normalize views."""
        return views

    def normalize(self, moments: Moments) -> Normalizer:
        """Return the normalizer of views, from the moments of the vectors of `moment_vectors`."""
        return moments.normalizer()

    def export_actions(self, parameters, x):
        """Write the nodes of the actions (1, joints) for a normalized observation (1, size)."""
        first_layer, *later_layers = parameters
        scaled_layer = {**first_layer, "weight": first_layer["weight"] * self.scale[:, None]}
        return perceptron(x, (scaled_layer, *later_layers), ACTIVATION)

    def import_actions(self, weights):
        """Return the parameters from the weights and biases of the nodes that `export_actions` wrote, in order.

        Raises:
            ValueError: they are of another network.
        """
        scaled_layer, *later_layers = map(networks.make_linear_layer, weights[::2], weights[1::2])
        first_layer = {**scaled_layer, "weight": scaled_layer["weight"] / self.scale[:, None]}
        return first_layer, *later_layers


Architecture = Perceptron | Legs | AnyLegs


# Attributes and methods that learners use of an architecture.
_ATTRIBUTES = (
    "symmetric",
    "size",
    "action_inputs",
    "inputs",
    "view",
    "moment_vectors",
    "normalize",
    "draw_policy",
    "draw_values",
    "actions",
    "values",
    "export_actions",
    "import_actions",
)


def of(
    task: Task, network: str = "perceptron", critic_blocks: Iterable[str] = (), symmetric: bool = True
) -> Perceptron | Legs:
    """Return the architecture for a task of one body.

    Args:
        task: task whose observations networks see.
        network: "perceptron", "legs", or that of another package. Its function takes the other arguments.
        critic_blocks: names of privileged blocks for networks of values.
        symmetric: whether legs on the left and on the right share their network, if the task is symmetric.

    Raises:
        ValueError: an unknown network, or a function that returns no architecture.
    """
    make_architecture = registry.find("network", network, NETWORKS)
    architecture = make_architecture(task, critic_blocks, symmetric)
    missing = [name for name in _ATTRIBUTES if not hasattr(architecture, name)]
    if missing:
        raise ValueError(f"network {network!r}: has no {' and no '.join(missing)}, which architectures have")
    return architecture


def of_environment(
    environment: VectorEnv | BodiesEnv,
    network: str = "perceptron",
    critic_blocks: Iterable[str] = (),
    symmetric: bool = True,
) -> Architecture:
    """Return the architecture for environments: `AnyLegs` for several bodies, otherwise that of `of`."""
    if isinstance(environment, BodiesEnv):
        return AnyLegs()
    return of(environment.task.definition, network, critic_blocks, symmetric)


def policy_graph(architecture: Architecture, normalize: Normalizer, parameters) -> Graph:
    """Return the graph of a policy: a normalizer and a network of actions."""
    action_inputs = architecture.action_inputs
    normalize_action_inputs = Normalizer(
        normalize.mean[:action_inputs], normalize.factor[:action_inputs], normalize.limit
    )

    def trace_actions(observation):
        view = normalize_action_inputs(architecture.view(observation))
        return architecture.export_actions(parameters, view).clip(-1.0, 1.0)

    return traced(trace_actions, architecture.size)


def read_policy_graph(architecture: Architecture, graph: Graph) -> tuple[Normalizer, Any]:
    """Return the normalizer and the parameters of a graph that `policy_graph` made.

    Raises:
        ValueError: another graph.
    """
    try:
        normalize = _read_normalizer(graph)
        parameters = architecture.import_actions(_layer_arrays(graph))
        is_same_graph = policy_graph(architecture, normalize, parameters).nodes == graph.nodes
    except (KeyError, TypeError, ValueError):
        is_same_graph = False
    if not is_same_graph:
        raise ValueError("a policy of dagger, bc or ppo, of the same network")
    return normalize, parameters


def _read_normalizer(graph: Graph) -> Normalizer:
    """Return the normalizer of a graph: its first difference, and the product and the clip after it."""
    operators = [node.operator for node in graph.nodes]
    first = operators.index("Sub")
    mean, factor, limit = (graph.arrays[str(node.inputs[-1])] for node in graph.nodes[first : first + 3])
    return Normalizer(mean, factor, limit)


def _layer_arrays(graph: Graph) -> list[np.ndarray]:
    """Return the weights and biases of a graph's layers, in order."""
    arrays = []
    for node in graph.nodes:
        if node.operator in ("Linear", "Product"):
            _, *array_names = node.inputs
            arrays += [graph.arrays[str(name)] for name in array_names]
    return arrays
