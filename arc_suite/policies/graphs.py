"""Policies as graphs of ONNX operators: layers one after the other, or a policy of many bodies for one of them.

`onnx_file` writes a graph as a file, and pages to play in compute it in JavaScript; see web/graph.js.
"""

import itertools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from arc_suite.policies.network import EPSILON, Layer, Network
from arc_suite.policies.universal import Universal
from arc_suite.tasks import tokens
from arc_suite.tasks.tokens import JOINTS

INPUT, OUTPUT = "observations", "actions"


class Node(NamedTuple):
    """An operator.

    Attributes:
        operator: its name in ONNX.
        inputs: names of results of other nodes, of constants, or `INPUT`.
        result: name of what it gives.
        attributes: of the operator.
    """

    operator: str
    inputs: list[str]
    result: str
    attributes: dict


class Graph:
    """What computes actions (num_envs, joints) from flat observations (num_envs, size).

    Attributes:
        nodes: in order; the last gives `OUTPUT`.
        constants: float32, or int64 for indices and shapes, by name.
    """

    def __init__(self):
        """Begin without any node."""
        self.nodes: list[Node] = []
        self.constants: dict[str, np.ndarray] = {}

    def __call__(self, operator: str, *inputs: str | np.ndarray | float, **attributes) -> str:
        """Add a node, and return the name of its result; arrays and numbers become constants."""
        names = [each if isinstance(each, str) else self._constant(each) for each in inputs]
        result = f"{operator.lower()}_{len(self.nodes)}"
        self.nodes.append(Node(operator, names, result, attributes))
        return result

    def finished(self) -> "Graph":
        """Return this graph, whose last node gives the actions."""
        self.nodes[-1] = self.nodes[-1]._replace(result=OUTPUT)
        return self

    def _constant(self, value) -> str:
        name = f"constant_{len(self.constants)}"
        kind = np.int64 if np.asarray(value).dtype.kind == "i" else np.float32
        self.constants[name] = np.array(value, kind, order="C")
        return name


def of(policy: Network | Universal) -> Graph:
    """Return the graph of a network, or of a policy of many bodies for its one body."""
    graph = Graph()
    if isinstance(policy, Universal):
        _add_universal(graph, policy)
    else:
        present = INPUT
        for operator, arrays, attributes in itertools.chain(*map(_operators, policy.layers)):
            present = graph(operator, present, *arrays, **attributes)
    return graph.finished()


def _operators(layer: Layer) -> list[tuple[str, list[np.ndarray], dict]]:
    """The operators of a layer: names, constants after the input, attributes."""
    arrays = list(layer.arrays)
    operators: dict[str, Callable[[], list]] = {
        "linear": lambda: [("Gemm", arrays, {})],
        "layer_norm": lambda: [("LayerNormalization", arrays, {"axis": -1, "epsilon": EPSILON})],
        "normalise": lambda: [
            ("Sub", arrays[:1], {}),
            ("Mul", arrays[1:2], {}),
            ("Clip", [-arrays[2].reshape(()), arrays[2].reshape(())], {}),
        ],
        "relu": lambda: [("Relu", [], {})],
        "elu": lambda: [("Elu", [], {"alpha": 1.0})],
        "tanh": lambda: [("Tanh", [], {})],
        "clip": lambda: [("Clip", [np.array(-1.0), np.array(1.0)], {})],
    }
    return operators[layer.kind]()


def _add_universal(graph: Graph, policy: Universal) -> None:
    """Add the nodes of a policy of many bodies for one, whose description is constants."""
    seen, there = _inputs(graph, policy)
    kinds = {layer.kind: layer.arrays for layer in policy.network.layers}
    if "normalise" in kinds:
        mean, factor, limit = kinds["normalise"]
        mean, factor = (tokens.leg_inputs(array[None])[0][0, 0] for array in (mean, factor))
        seen = graph("Mul", graph("Sub", seen, mean), factor)
        seen = graph("Clip", seen, -limit.reshape(()), limit.reshape(()))
    first, first_bias, second, second_bias, own, mean, bias, last, last_bias = kinds["legs"]
    features = graph("Elu", graph("Add", graph("MatMul", seen, first), first_bias))
    features = graph("Elu", graph("Add", graph("MatMul", features, second), second_bias))
    context = graph("MatMul", graph("ReduceMean", features, axes=[1], keepdims=1), mean)
    hidden = graph("Add", graph("MatMul", features, own), graph("Add", context, bias))
    found = graph("Add", graph("MatMul", graph("Elu", hidden), last), last_bias)
    flat = graph("Reshape", found, np.array((0, JOINTS * len(there))))
    positions = graph("Clip", graph("Gather", flat, np.flatnonzero(there), axis=1), -1.0, 1.0)
    if policy.task.actions == "position":
        return
    # Torques of motors that hold the positions with the body's own gains.
    stiffness, damping = policy.gains
    _, _, angles, speeds, *_ = policy.tokens.parts(policy.tokens.places[0])
    own = np.flatnonzero(there)
    angles, speeds = (graph("Gather", INPUT, columns[own], axis=1) for columns in (angles, speeds))
    pulled = graph("Mul", graph("Sub", graph("Mul", positions, policy.reach), angles), stiffness)
    graph("Clip", graph("Sub", pulled, graph("Mul", speeds, damping)), -1.0, 1.0)


def _inputs(graph: Graph, policy: Universal) -> tuple[str, np.ndarray]:
    """Add what the network of legs sees, (num_envs, legs, 81); see `Tokens.observed`.

    Returns:
        Its name, and which joints there are, (legs, 4) booleans.
    """
    own, (descriptions, torso_description) = policy.tokens, policy.descriptions
    legs = int(own.legs[0].sum())
    mask = own.mask[0, :legs]
    pose, velocities, angles, speeds, forces, clock, command = own.parts(own.places[0])

    def columns(indices, shape=()):
        found = graph("Gather", INPUT, indices, axis=1)
        return graph("Reshape", found, np.array((0, *shape))) if shape else found

    angles = graph("Mul", columns(angles[: JOINTS * legs], (legs, JOINTS)), mask)
    speeds = graph("Mul", columns(speeds[: JOINTS * legs], (legs, JOINTS)), mask / own.rate[0])
    sine, cosine = columns(clock[:1]), columns(clock[1:])
    (leg_sine, leg_cosine), (middle_sine, middle_cosine) = own.offset[0, :legs].T, own.middle[0]
    ahead = graph("Add", graph("Mul", sine, leg_cosine), graph("Mul", cosine, leg_sine))
    aside = graph("Sub", graph("Mul", cosine, leg_cosine), graph("Mul", sine, leg_sine))
    nearness = graph("Add", graph("Mul", ahead, middle_sine), graph("Mul", aside, middle_cosine))
    going = graph("Greater", graph("ReduceMax", graph("Abs", columns(clock)), axes=[1], keepdims=1), 0.0)
    stands = graph("Or", graph("GreaterOrEqual", nearness, middle_cosine), graph("Not", going))
    loaded = graph("GreaterOrEqual", columns(forces[:legs]), own.loaded[0])
    stands, loaded = (graph("Cast", each, to=1) for each in (stands, loaded))
    phase = [graph("Reshape", each, np.array((0, legs, 1))) for each in (ahead, aside, stands, loaded)]

    posture, motion = ([columns(each[[i]]) for i in range(len(each))] for each in (pose, velocities))
    torso, desired = _torso(graph, own, posture, motion)
    if len(command) and "command" in policy.task.blocks:
        desired = columns(command)
    shared = graph("Concat", torso, desired, axis=1)
    shared = graph("Reshape", shared, np.array((0, 1, tokens.TORSO + tokens.COMMAND)))
    ones = graph("Add", graph("Mul", phase[0], 0.0), 1.0)  # (num_envs, legs, 1), to spread what legs share
    parts = *phase, graph("Mul", ones, descriptions[0, :legs]), graph("Mul", ones, shared)
    about = graph("Mul", ones, torso_description[0])
    return graph("Concat", angles, speeds, *parts, about, axis=2), mask > 0.0


def _torso(graph: Graph, own, pose: list[str], velocities: list[str]) -> tuple[str, str]:
    """Add the token of the torso, and the command of a task without one: straight ahead along world x."""
    height, w, x, y, z = pose

    def product(*factors):
        found = factors[0]
        for factor in factors[1:]:
            found = graph("Mul", found, factor)
        return found

    up = [
        product(graph("Sub", product(x, z), product(w, y)), 2.0),
        product(graph("Add", product(y, z), product(w, x)), 2.0),
        graph("Sub", 1.0, product(graph("Add", product(x, x), product(y, y)), 2.0)),
    ]
    ahead = graph("Sub", 1.0, product(graph("Add", product(y, y), product(z, z)), 2.0))
    aside = product(graph("Add", product(x, y), product(w, z)), 2.0)
    level = graph("Max", graph("Sqrt", graph("Add", product(ahead, ahead), product(aside, aside))), 1e-6)
    cos, sin = graph("Div", ahead, level), graph("Div", aside, level)
    vx, vy, vz, *angular = velocities
    forward = graph("Add", product(cos, vx), product(sin, vy))
    sideways = graph("Sub", product(cos, vy), product(sin, vx))
    linear = [product(speed, 1.0 / own.speed[0]) for speed in (forward, sideways, vz)]
    rates = [*linear, *(product(speed, 1.0 / own.rate[0]) for speed in angular)]
    torso = graph("Concat", product(height, 1.0 / own.height[0]), *up, ahead, aside, *rates, axis=1)
    turn = graph("Clip", product(sin, -own.turn[0]), -1.0, 1.0)
    desired = [product(cos, own.forward[0]), product(sin, -own.forward[0]), turn]
    motion = (forward, sideways, angular[2])
    units = [product(speed, 1.0 / unit) for speed, unit in zip(motion, own.units[0], strict=True)]
    return torso, graph("Concat", *desired, *units, axis=1)
