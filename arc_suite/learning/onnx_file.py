"""Policies as ONNX files, which game engines and onnxruntime run.

The graph includes the normalization of observations. The input `observations` is (num_envs, size) float32, flat: the
task's blocks one after the other. The output `actions` is (num_envs, joints) in [-1, 1]. The metadata, JSON by name,
hold the rest that a game or a robot needs; see `policy_metadata`.
"""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from arc_suite import files, versions
from arc_suite.envs.setup import Setup
from arc_suite.learning.policy_metadata import metadata
from arc_suite.policies.graph import EPSILON, INPUT, Graph
from arc_suite.policies.network import Network

OUTPUT = "actions"
OPSET = 17  # the first with LayerNormalization
IR_VERSION = 8  # the format of the same release, so that older runtimes read it


def save(path: str | os.PathLike[str], network: Network, training: Setup | None = None) -> None:
    """Write a policy of one body as ONNX, atomically.

    Args:
        path: path of the file.
        network: the policy.
        training: setup in which it learned, None for that of the policy.

    Raises:
        ValueError: the package onnx is not installed, or a policy of many bodies.
        OSError: the file cannot be written.
    """
    metadata_texts = {}
    for name, value in metadata(network, training).items():
        metadata_texts[name] = value if isinstance(value, str) else json.dumps(value)
    with versions.require_extra("ONNX needs the package onnx", "learn"):
        import onnx
        from onnx import TensorProto, helper, numpy_helper
    nodes, arrays = _convert_graph(network.graph)
    onnx_nodes = [helper.make_node(node.operator, node.inputs, [node.output], **node.attributes) for node in nodes]
    graph = helper.make_graph(
        onnx_nodes,
        "policy",
        [helper.make_tensor_value_info(INPUT, TensorProto.FLOAT, ["num_envs", network.size])],
        [helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, ["num_envs", network.joints])],
        [numpy_helper.from_array(array, name) for name, array in arrays.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION)
    model.producer_name = "arc_suite"
    helper.set_model_props(model, metadata_texts)
    onnx.checker.check_model(model)
    with files.writing(path) as temporary:
        temporary.write_bytes(model.SerializeToString())


class _Node(NamedTuple):
    """A node of an ONNX graph.

    Attributes:
        operator: name of the operator in ONNX.
        inputs: names of the inputs.
        output: name of the output.
        attributes: attributes of the operator.
    """

    operator: str
    inputs: list[str]
    output: str
    attributes: Mapping[str, Any]


class _Step(NamedTuple):
    """A node of ONNX that one of the suite's operators becomes.

    Attributes:
        operator: name of the operator in ONNX.
        inputs: index of an input of the suite's node, name of an array of `_CONSTANTS`, or `PREVIOUS`.
        attributes: attributes of the operator.
    """

    operator: str
    inputs: Sequence[int | str]
    attributes: Mapping[str, Any] = MappingProxyType({})


# Arrays that nodes of ONNX take and the suite's nodes do not.
_CONSTANTS = {
    "flat": np.array((0, -1), np.int64),
    "one": np.array((1,), np.int64),
    "two": np.array((2,), np.int64),
}

PREVIOUS = -1  # input: the output of the previous step
_BOOLEAN_TO_FLOAT = _Step("Cast", (PREVIOUS,), {"to": 1})

# Steps by operator of the suite. An operator that is not listed has the same name in ONNX.
_STEPS: dict[str, tuple[_Step, ...]] = {
    "Equal": (_Step("Equal", (0, 1)), _BOOLEAN_TO_FLOAT),
    "Greater": (_Step("Greater", (0, 1)), _BOOLEAN_TO_FLOAT),
    "GreaterOrEqual": (_Step("GreaterOrEqual", (0, 1)), _BOOLEAN_TO_FLOAT),
    "LayerNorm": (_Step("LayerNormalization", (0, 1, 2), {"axis": -1, "epsilon": EPSILON}),),
    "Linear": (_Step("MatMul", (0, 1)), _Step("Add", (PREVIOUS, 2))),
    # The suite computes the rows of a mask alone; here all rows are computed, and those outside the mask become 0.
    "Pick": (_Step("Identity", (0,)),),
    "Place": (_Step("Unsqueeze", (1, "two")), _Step("Mul", (0, PREVIOUS))),
    "Product": (_Step("MatMul", (0, 1)),),
    "Sum": (_Step("ReduceSum", (0, "one"), {"keepdims": 0}),),
    "Take": (_Step("Reshape", (0, "flat")), _Step("Gather", (PREVIOUS, 1), {"axis": 1})),
}


def _convert_graph(graph: Graph) -> tuple[list[_Node], dict[str, np.ndarray]]:
    """Return the nodes of ONNX, and their arrays by name."""
    arrays = _CONSTANTS | {f"array_{name}": array for name, array in graph.arrays.items()}
    nodes = [
        _Node("Shape", [INPUT], "num_envs", {"end": 1}),
        _Node("Concat", ["num_envs", "one"], "rows", {"axis": 0}),
    ]
    # Names in ONNX by what nodes of the suite name: the input, an array, or the index of a node.
    onnx_names: dict[Any, str] = {INPUT: INPUT} | {name: f"array_{name}" for name in graph.arrays}
    last = len(graph.nodes) - 1
    for index, node in enumerate(graph.nodes):
        output = OUTPUT if index == last else f"node_{index}"
        inputs = [onnx_names[name] for name in node.inputs]
        if node.operator == "Concat":
            nodes += _concatenate(inputs, output)
        else:
            same_operator = _Step(node.operator, range(len(inputs)))
            nodes += _apply_steps(_STEPS.get(node.operator, (same_operator,)), inputs, output)
        onnx_names[index] = output
    # A runtime warns of arrays that no node takes.
    used_names = {name for node in nodes for name in node.inputs}
    return nodes, {name: array for name, array in arrays.items() if name in used_names}


def _apply_steps(steps: Sequence[_Step], inputs: list[str], output: str) -> Iterator[_Node]:
    """Yield the nodes of steps; the last one has the name of the output."""
    outputs = [f"{output}_{number}" for number in range(len(steps) - 1)] + [output]
    for number, step in enumerate(steps):
        names = []
        for step_input in step.inputs:
            if isinstance(step_input, str):
                names.append(step_input)
            elif step_input == PREVIOUS:
                names.append(outputs[number - 1])
            else:
                names.append(inputs[step_input])
        yield _Node(step.operator, names, outputs[number], step.attributes)


def _concatenate(inputs: list[str], output: str) -> Iterator[_Node]:
    """Yield the nodes that concatenate flat inputs; arrays are repeated for every environment."""
    parts = [f"{output}_{number}" for number in range(len(inputs))]
    for name, part in zip(inputs, parts, strict=True):
        yield _Node("Reshape", [name, "flat"], f"{part}_flat", {})
        yield _Node("Expand", [f"{part}_flat", "rows"], part, {})
    yield _Node("Concat", parts, output, {"axis": 1})
