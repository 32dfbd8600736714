"""Functions of arrays as graphs: the text that computes with NumPy also writes the nodes that compute the same."""

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from arc_suite.policies.graph import INPUT, Graph, Node, Shape, shape_of

# Truth values are 1 and 0: the larger one is their "or", the product their "and".
_UFUNCS = {
    np.add: "Add",
    np.bitwise_and: "Mul",
    np.bitwise_or: "Max",
    np.divide: "Div",
    np.equal: "Equal",
    np.greater: "Greater",
    np.greater_equal: "GreaterOrEqual",
    np.maximum: "Max",
    np.multiply: "Mul",
    np.negative: "Neg",
    np.sqrt: "Sqrt",
    np.subtract: "Sub",
}


def traced(function: Callable[["Traced"], "Traced"], size: int) -> Graph:
    """Return the graph of a function, from observations (1, size) of one environment to its actions (1, joints).

    Raises:
        ValueError: inputs of a node that do not fit.
    """
    writer = _Writer(size)
    actions = function(writer.array(INPUT))
    if actions.name != len(writer.nodes) - 1:
        actions.node("Take", np.arange(actions.places.size))
    return Graph(tuple(writer.nodes), writer.arrays)


class _Writer:
    """A graph that grows, and the shapes of all that it holds."""

    def __init__(self, size: int):
        self.nodes: list[Node] = []
        self.arrays: dict[str, np.ndarray] = {}
        self.shapes: dict[str | int, Shape] = {INPUT: (1, size)}

    def array(self, name: str | int) -> "Traced":
        """Return all numbers of an array, of a node or of the observations."""
        shape = self.shapes[name]
        return Traced(self, name, np.arange(math.prod(shape)).reshape(shape))

    def constant(self, value: Any) -> "Traced":
        """Add an array."""
        array, name = np.asarray(value), str(len(self.arrays))
        self.arrays[name] = array.astype(np.int32 if array.dtype.kind == "i" else np.float32, order="C")
        self.shapes[name] = array.shape
        return self.array(name)

    def node(self, operator: str, *names: str | int) -> "Traced":
        """Add a node."""
        node, index = Node(operator, names), len(self.nodes)
        self.shapes[index] = shape_of(node, self.shapes)
        self.nodes.append(node)
        return self.array(index)


class Traced(np.lib.mixins.NDArrayOperatorsMixin):
    """Numbers that a graph computes, in place of an array of one environment (1, ...).

    Arithmetic adds nodes. Indexing, reshaping and joining only change `places`, until a node needs the numbers.

    Attributes:
        source: what computes them: an array, a node or the observations.
        places: (1, ...) their indices in it.
    """

    def __init__(self, writer: _Writer, source: str | int, places: np.ndarray):
        """Refer to numbers of a source."""
        self._writer, self.source, self.places = writer, source, places

    shape = property(lambda self: self.places.shape)
    T = property(lambda self: self._at(self.places.T))

    @functools.cached_property
    def name(self) -> str | int:
        """Name of the array, or index of the node, that gives these numbers in this shape."""
        whole = self._writer.array(self.source).places
        if np.array_equal(whole, self.places):
            return self.source
        return self._writer.node("Take", self.source, self._writer.constant(self.places[0]).name).source

    def node(self, operator: str, *others: Any) -> "Traced":
        """Return the result of an operator of these numbers and others, of the graph or of NumPy."""
        return self._node(operator, self, *others)

    def clip(self, low, high) -> "Traced":
        """Return the numbers within limits."""
        return self.node("Clip", low, high)

    def sum(self, axis: int) -> "Traced":
        """Return the sums over an axis."""
        return self._at(np.moveaxis(self.places, axis, 1)).node("Sum")

    def reshape(self, *shape) -> "Traced":
        """Return the numbers in another shape."""
        return self._at(self.places.reshape(*shape))

    def astype(self, dtype) -> "Traced":
        """Return the numbers, which are float32 already."""
        return self

    def __array_namespace__(self):
        return np

    def __len__(self):
        return len(self.places)

    def __getitem__(self, key):
        return self._at(self.places[key])

    def __array_ufunc__(self, ufunc, method, *inputs, **options):
        return self._node(_UFUNCS[ufunc], *inputs)

    def __array_function__(self, function, types, arguments, options):
        """Do with the places what a function does that moves numbers, such as `np.concatenate` and `np.split`."""
        first, *others = arguments
        if isinstance(first, Traced):
            found = function(first.places, *others, **options)
            return [first._at(each) for each in found] if isinstance(found, list) else first._at(found)
        parts = [part if isinstance(part, Traced) else self._writer.constant(part) for part in first]
        sources = list(dict.fromkeys(part.source for part in parts))
        sizes = [math.prod(self._writer.shapes[source]) for source in sources]
        starts = dict(zip(sources, np.cumsum([0, *sizes]).tolist(), strict=False))
        joined = sources[0] if len(sources) == 1 else self._writer.node("Concat", *sources).source
        places = [part.places + starts[part.source] for part in parts]
        return Traced(self._writer, joined, function(places, *others, **options))

    def _at(self, places: np.ndarray) -> "Traced":
        return Traced(self._writer, self.source, places)

    def _node(self, operator: str, *inputs: Any) -> "Traced":
        given = [each if isinstance(each, Traced) else self._writer.constant(each) for each in inputs]
        return self._writer.node(operator, *(each.name for each in given))


def repeated(graph: Graph, inputs: Traced) -> Traced:
    """Return the results of a graph for inputs (1, size) that another graph computes."""
    known: dict[str | int, Traced] = {INPUT: inputs}
    known |= {name: inputs._writer.constant(array) for name, array in graph.arrays.items()}
    for index, (operator, names) in enumerate(graph.nodes):
        known[index] = inputs._node(operator, *(known[name] for name in names))
    return known[len(graph.nodes) - 1]


def perceptron(x: Traced, layers: Sequence[Mapping], activation: str = "relu") -> Traced:
    """Write the nodes of a multilayer perceptron, its last layer linear.

    Args:
        x: (1, inputs)
        layers: mappings to `weight`, `bias`, and `scale` and `offset` where a layer norm follows.
        activation: of hidden layers, relu, elu or tanh.
    """
    for each in layers[:-1]:
        x = activated(linear(x, each), each, activation)
    return linear(x, layers[-1])


def linear(x: Traced, layer: Mapping) -> Traced:
    """Write the node of a layer's weight and bias."""
    return x.node("Linear", layer["weight"], layer["bias"])


def activated(x: Traced, layer: Mapping, activation: str = "relu") -> Traced:
    """Write the nodes of a layer's norm, if it has one, and of an activation."""
    x = x.node("LayerNorm", layer["scale"], layer["offset"]) if "scale" in layer else x
    return x.node(activation.capitalize())
