"""Graphs of trained policies, as nodes and arrays, and the interpreter that computes them.

A node applies an operator of a table to arrays, to observations and to results of earlier nodes. All numbers are
float32; a truth value is 1 or 0. Results have a leading axis for environments.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite import checks, parsers

INPUT = "observations"
EPSILON = 1e-5  # of a layer norm, as in PyTorch

_MAX_NODES = 1 << 10
_MAX_NAME = 40  # characters of an operator in an error
_MAX_NUMBERS = 1 << 22  # of all results, for one environment
_MAX_PRODUCTS = 1 << 26  # of two numbers, in all matrix products, for one environment

Shape = tuple[int, ...]


class Node(NamedTuple):
    """An operator and its inputs.

    Attributes:
        operator: a name of `OPERATORS`.
        inputs: `INPUT`, names of arrays, and indices of earlier nodes.
    """

    operator: str
    inputs: tuple[str | int, ...]


class Graph(NamedTuple):
    """A function from observations (num_envs, size) to actions (num_envs, joints).

    Attributes:
        nodes: in order of computation; the result of the last one is the actions.
        arrays: constants by name, float32, or int32 for indices.
    """

    nodes: tuple[Node, ...]
    arrays: Mapping[str, np.ndarray]

    def __call__(self, observations: np.ndarray) -> np.ndarray:
        """Return actions (num_envs, joints) for observations (num_envs, size), float32.

        Actions of each environment have the same bits as if they were computed alone.
        """
        values: dict[Any, np.ndarray] = {**self.arrays, INPUT: observations}
        for index, (operator, inputs) in enumerate(self.nodes):
            values[index] = OPERATORS[operator].function(*(values[name] for name in inputs))
        last = len(self.nodes) - 1
        return values[last]


class Operator(NamedTuple):
    """An operator.

    Attributes:
        function: function of arrays.
        inputs: number of inputs; 0 for any.
        shape: function from the shapes of the inputs to that of the result; axes of environments have length 1.
    """

    function: Callable[..., np.ndarray]
    inputs: int
    shape: Callable[..., Shape] = np.broadcast_shapes


def _product(x, weight):
    # In a product of matrices, BLAS would round differently by the number of environments and threads.
    return np.einsum("ri,io->ro", x, weight)


def _product_shape(x: Shape, weight: Shape, bias: Shape | None = None) -> Shape:
    if len(weight) != 2 or x[-1:] != weight[:1] or bias not in (None, weight[1:]):
        raise ValueError(f"weight {weight}{'' if bias is None else f' and bias {bias}'} do not fit {x}")
    return (*x[:-1], weight[1])


def _layer_norm(x, scale, offset):
    centered = x - x.mean(axis=-1, keepdims=True)
    variance = (centered * centered).mean(axis=-1, keepdims=True)
    return centered / np.sqrt(variance + np.float32(EPSILON)) * scale + offset


def _elu(x):
    return np.where(x > 0.0, x, np.expm1(np.minimum(x, np.float32(0.0))))


def _place(rows, mask):
    result = np.zeros((*mask.shape, rows.shape[-1]), np.float32)
    result[mask > 0.0] = rows
    return result


def _clip_shape(x: Shape, low: Shape, high: Shape) -> Shape:
    if low or high:
        raise ValueError(f"expected a number for each limit, got {low} and {high}")
    return x


def _masked_shape(x: Shape, mask: Shape) -> Shape:
    if mask != x[:-1]:
        raise ValueError(f"mask {mask} does not fit {x}")
    return x


def _truth(compare: np.ufunc) -> Operator:
    return Operator(lambda a, b: compare(a, b).astype(np.float32), 2)


# Take returns numbers of an environment by their indices, in the shape of the indices. Concat returns all numbers of
# its inputs as one vector. Sum sums over the first axis after that of environments.
# Pick returns the rows (n, size) of an array (num_envs, count, size) where a mask (num_envs, count) is not 0, so that
# later nodes compute these rows alone. Place puts rows back, with 0 elsewhere. As operators between them compute each
# row by itself, an export that computes all rows has the same results.
OPERATORS = {
    "Add": Operator(np.add, 2),
    "Clip": Operator(lambda x, low, high: x.clip(low, high), 3, _clip_shape),
    "Concat": Operator(
        lambda *parts: _concatenate([part.reshape(len(part), -1) for part in parts]),
        0,
        lambda *shapes: (1, sum(map(math.prod, shapes))),
    ),
    "Div": Operator(np.divide, 2),
    "Elu": Operator(_elu, 1),
    "Equal": _truth(np.equal),
    "Greater": _truth(np.greater),
    "GreaterOrEqual": _truth(np.greater_equal),
    "LayerNorm": Operator(_layer_norm, 3),
    "Linear": Operator(lambda x, weight, bias: _product(x, weight) + bias, 3, _product_shape),
    "Max": Operator(np.maximum, 2),
    "Mul": Operator(np.multiply, 2),
    "Neg": Operator(np.negative, 1),
    "Pick": Operator(lambda x, mask: x[mask > 0.0], 2, _masked_shape),
    "Place": Operator(_place, 2, _masked_shape),
    "Product": Operator(_product, 2, _product_shape),
    "Relu": Operator(lambda x: np.maximum(x, np.float32(0.0)), 1),
    "Sqrt": Operator(np.sqrt, 1),
    "Sub": Operator(np.subtract, 2),
    "Sum": Operator(lambda x: x.sum(axis=1), 1, lambda x: (x[0], *x[2:])),
    "Take": Operator(lambda x, places: x.reshape(len(x), -1).take(places, axis=1), 2, lambda x, places: (1, *places)),
    "Tanh": Operator(np.tanh, 1),
}


def _concatenate(parts: list[np.ndarray]) -> np.ndarray:
    num_envs = max(map(len, parts))  # constants have a length of 1
    return np.concatenate([np.broadcast_to(part, (num_envs, part.shape[1])) for part in parts], axis=1)


def check_graph(graph: Graph, size: int) -> Graph:
    """Return a graph from a file after a check that it fits observations of a size.

    Raises:
        ValueError: too many nodes or numbers, an unknown operator, inputs that do not fit, or no actions at the end.
    """
    if size > _MAX_NUMBERS:
        raise ValueError(f"expected at most {_MAX_NUMBERS} numbers of an observation, got {size}")
    if not 0 < len(graph.nodes) <= _MAX_NODES:
        raise ValueError(f"expected 1 to {_MAX_NODES} nodes, got {len(graph.nodes)}")
    for name, array in graph.arrays.items():
        if array.dtype not in (np.float32, np.int32) or not array.size:
            raise ValueError(f"array {name}: expected float32 or int32, got {array.dtype} {array.shape}")
        if array.dtype == np.int32 and array.min() < 0:
            raise ValueError(f"array {name}: expected indices, got {array.min()}")
        if not np.isfinite(array).all():
            raise ValueError(f"array {name} is not finite")
    # Results of samples, zeros and random numbers, show faults that shapes do not.
    sample = np.zeros((3, size), np.float32)
    sample[1:] = np.random.default_rng(0).standard_normal((2, size))
    shapes: dict[Any, Shape] = {name: array.shape for name, array in graph.arrays.items()} | {INPUT: (1, size)}
    values: dict[Any, np.ndarray] = {**graph.arrays, INPUT: sample}
    numbers = 0
    products = 0
    for index, node in enumerate(graph.nodes):
        with parsers.guard(f"node {index}, {checks.quote(node.operator)[:_MAX_NAME]}"):
            shapes[index] = shape_of(node, shapes)
            numbers += math.prod(shapes[index])
            if numbers > _MAX_NUMBERS:
                raise ValueError(f"expected at most {_MAX_NUMBERS} numbers of an environment, got {numbers}")
            products += _count_products(node, shapes)
            if products > _MAX_PRODUCTS:
                raise ValueError(f"expected at most {_MAX_PRODUCTS} products of an environment, got {products}")
            with np.errstate(all="ignore"):
                values[index] = OPERATORS[node.operator].function(*(values[name] for name in node.inputs))
            if values[index].dtype != np.float32:
                raise ValueError(f"expected float32, got {values[index].dtype}")
    if len(shapes[index]) != 2 or values[index].shape != (len(sample), shapes[index][1]):
        raise ValueError(f"node {index}, {node.operator}: expected actions of every environment, got {shapes[index]}")
    return graph


def _count_products(node: Node, shapes: Mapping[str | int, Shape]) -> int:
    """Return how many products of two numbers a node computes for one environment."""
    if node.operator not in ("Linear", "Product"):
        return 0
    x, weight = node.inputs[:2]
    _, outputs = shapes[weight]
    return math.prod(shapes[x]) * outputs


def shape_of(node: Node, shapes: Mapping[str | int, Shape]) -> Shape:
    """Return the shape of a node's result, from the shapes of all before it; axes of environments have length 1.

    Raises:
        ValueError: an unknown operator, or inputs that do not fit.
    """
    operator = OPERATORS[checks.name(node.operator, OPERATORS, "operator")]
    if not node.inputs or operator.inputs not in (0, len(node.inputs)):
        raise ValueError(f"expected {operator.inputs or 'one or more'} inputs, got {len(node.inputs)}")
    for name in node.inputs:
        if isinstance(name, bool) or name not in shapes:  # True would stand for 1
            raise ValueError(f"unknown input {name!r}")
    shape = operator.shape(*(shapes[name] for name in node.inputs))
    if shape[:1] != (1,):
        raise ValueError(f"expected a leading axis for environments, got {shape}")
    return shape
