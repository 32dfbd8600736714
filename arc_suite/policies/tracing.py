"""Tracing of functions: a function of `Traced` numbers, written as if they were NumPy arrays, gives a graph."""

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn

import numpy as np
from numpy.typing import DTypeLike

from arc_suite import checks
from arc_suite.policies.graph import INPUT, Graph, Node, Shape, shape_of

# By names of NumPy. Truth values are 1 and 0, so that "or" is the maximum, and "and" the product.
_OPERATORS = {
    "add": "Add",
    "bitwise_and": "Mul",
    "bitwise_or": "Max",
    "divide": "Div",
    "equal": "Equal",
    "greater": "Greater",
    "greater_equal": "GreaterOrEqual",
    "matmul": "Product",
    "maximum": "Max",
    "multiply": "Mul",
    "negative": "Neg",
    "sqrt": "Sqrt",
    "subtract": "Sub",
    "tanh": "Tanh",
}

# Functions that move numbers and compute none: applied to indices, they give the indices of the moved numbers.
_MOVES = {
    *(np.array_split, np.broadcast_to, np.concatenate, np.expand_dims, np.flip, np.moveaxis, np.ravel, np.repeat),
    *(np.reshape, np.roll, np.split, np.squeeze, np.stack, np.swapaxes, np.take, np.take_along_axis),
    *(np.tile, np.transpose),
}

_CURES = {
    "absolute": "np.maximum(x, -x)",
    "clip": "x.clip(low, high)",
    "dot": "x @ weight",
    "mean": "x.sum(axis) / count",
    "power": "x * x",
    "sum": "x.sum(axis)",
    "where": "mask * a + (1.0 - mask) * b",
}


def traced(function: Callable[["Traced"], "Traced"], size: int) -> Graph:
    """Return the graph of a function, from observations (1, size) of one environment to its actions (1, joints).

    Raises:
        ValueError: inputs of a node do not fit, the function asks NumPy for what no operator computes, or returns
            something else than traced numbers.
    """
    writer = _Writer(size)
    actions = function(writer.array(INPUT))
    if not isinstance(actions, Traced):
        raise ValueError(f"expected actions computed from the observations, got {checks.preview(actions)}")
    if actions.name != len(writer.nodes) - 1:
        actions.node("Take", np.arange(actions.places.size))
    return Graph(tuple(writer.nodes), writer.arrays)


class _Writer:
    """A graph to which nodes are added, with the shapes of its arrays and nodes."""

    def __init__(self, size: int):
        self.nodes: list[Node] = []
        self.arrays: dict[str, np.ndarray] = {}
        self.shapes: dict[str | int, Shape] = {INPUT: (1, size)}

    def array(self, name: str | int) -> "Traced":
        """Return the numbers of an array, of a node or of the observations."""
        shape = self.shapes[name]
        return Traced(self, name, np.arange(math.prod(shape)).reshape(shape))

    def constant(self, value: Any, dtype: DTypeLike = np.float32) -> "Traced":
        """Add an array, of int32 for indices."""
        array = np.asarray(value)
        name = str(len(self.arrays))
        self.arrays[name] = array.astype(dtype, order="C")
        self.shapes[name] = array.shape
        return self.array(name)

    def node(self, operator: str, *names: str | int) -> "Traced":
        """Add a node."""
        node = Node(operator, names)
        index = len(self.nodes)
        self.shapes[index] = shape_of(node, self.shapes)
        self.nodes.append(node)
        return self.array(index)


class Traced(np.lib.mixins.NDArrayOperatorsMixin):
    """Numbers that a graph computes, in place of an array of one environment (1, ...).

    Arithmetic adds nodes. Indexing, reshaping and joining only change `places`; a node is added once another one takes
    the numbers.

    Attributes:
        source: name of the array, index of the node, or `INPUT`, that holds the numbers.
        places: (1, ...) indices of the numbers in the source.
    """

    def __init__(self, writer: _Writer, source: str | int, places: np.ndarray):
        """Refer to numbers of a source."""
        self._writer = writer
        self.source = source
        self.places = places

    shape = property(lambda self: self.places.shape)
    T = property(lambda self: self._at(self.places.T))

    @functools.cached_property
    def name(self) -> str | int:
        """Name of the array, or index of the node, that gives these numbers in this shape."""
        all_places = self._writer.array(self.source).places
        if np.array_equal(all_places, self.places):
            return self.source
        if self.places.shape[:1] != (1,):
            raise ValueError(f"expected a first axis of length 1, of environments, got shape {self.places.shape}")
        indices = self._writer.constant(self.places[0], np.int32)
        return self._writer.node("Take", self.source, indices.name).source

    def node(self, operator: str, *operands: Any) -> "Traced":
        """Return the result of an operator of these numbers and further operands, of the graph or of NumPy."""
        return self._node(operator, self, *operands)

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

    def __bool__(self):
        raise ValueError("traced numbers have no truth value: multiply by the comparison, which is 1 or 0")

    def __getitem__(self, key):
        return self._at(self.places[key])

    def __array_ufunc__(self, ufunc, method, *inputs, **options):
        """Add the node of a function that computes each number by itself."""
        name = ufunc.__name__ if method == "__call__" else f"{ufunc.__name__}.{method}"
        if name not in _OPERATORS:
            _refuse(name)
        if options:
            raise ValueError(f"np.{name} of traced numbers takes no {', '.join(options)}")
        return self._node(_OPERATORS[name], *inputs)

    def __array_function__(self, function, types, arguments, options):
        """Apply a function that moves numbers, such as `np.concatenate` or `np.split`, to the places."""
        if function not in _MOVES:
            _refuse(function.__name__)
        operand, *further_arguments = arguments
        if isinstance(operand, Traced):
            result = function(operand.places, *further_arguments, **options)
            if isinstance(result, list):
                return [operand._at(places) for places in result]
            return operand._at(result)
        parts = [part if isinstance(part, Traced) else self._writer.constant(part) for part in operand]
        sources = list(dict.fromkeys(part.source for part in parts))
        sizes = [math.prod(self._writer.shapes[source]) for source in sources]
        starts = dict(zip(sources, np.cumsum([0, *sizes]).tolist(), strict=False))  # in the joined source
        joined_source = sources[0] if len(sources) == 1 else self._writer.node("Concat", *sources).source
        places_of_parts = [part.places + starts[part.source] for part in parts]
        return Traced(self._writer, joined_source, function(places_of_parts, *further_arguments, **options))

    def _at(self, places: np.ndarray) -> "Traced":
        return Traced(self._writer, self.source, places)

    def _node(self, operator: str, *inputs: Any) -> "Traced":
        dtype = np.int32 if operator == "Take" else np.float32
        operands = [
            operand if isinstance(operand, Traced) else self._writer.constant(operand, dtype) for operand in inputs
        ]
        return self._writer.node(operator, *(operand.name for operand in operands))


def _refuse(name: str) -> NoReturn:
    """Raise ValueError for a function of NumPy that no operator computes."""
    cure = f"use {_CURES[name]}" if name in _CURES else f"there are: {', '.join(_OPERATORS)}, and operators by x.node"
    raise ValueError(f"a graph does not compute np.{name}; {cure}")


def apply_graph(graph: Graph, inputs: Traced) -> Traced:
    """Return the results of a graph for inputs (1, size) that another graph computes."""
    results: dict[str | int, Traced] = {INPUT: inputs}
    results |= {name: inputs._writer.constant(array, array.dtype) for name, array in graph.arrays.items()}
    for index, (operator, names) in enumerate(graph.nodes):
        results[index] = inputs._node(operator, *(results[name] for name in names))
    last = len(graph.nodes) - 1
    return results[last]


def perceptron(x: Traced, layers: Sequence[Mapping], activation: str = "relu") -> Traced:
    """Write the nodes of a multilayer perceptron, its last layer linear.

    Args:
        x: (1, inputs)
        layers: mappings to `weight`, `bias`, and `scale` and `offset` where a layer norm follows.
        activation: activation of hidden layers, relu, elu or tanh.
    """
    *hidden_layers, last_layer = layers
    for layer in hidden_layers:
        x = activate(linear(x, layer), layer, activation)
    return linear(x, last_layer)


def linear(x: Traced, layer: Mapping) -> Traced:
    """Write the node of a layer's weight and bias."""
    return x.node("Linear", layer["weight"], layer["bias"])


def activate(x: Traced, layer: Mapping, activation: str = "relu") -> Traced:
    """Write the nodes of a layer's norm, if it has one, and of an activation."""
    if "scale" in layer:
        x = x.node("LayerNorm", layer["scale"], layer["offset"])
    return x.node(activation.capitalize())
