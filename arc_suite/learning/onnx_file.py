"""Policies as ONNX, which game engines and onnxruntime run: the whole graph, its normalization among it.

The input `observations` is (num_envs, size) float32, flat: the task's blocks one after the other. The output
`actions` is (num_envs, joints) in [-1, 1]. The metadata hold what else a game needs, JSON by name; see `metadata`.
"""

import dataclasses
import json
import os
from collections.abc import Iterator
from typing import Any

import numpy as np

from arc_suite import files, versions
from arc_suite.models import sizing, source
from arc_suite.policies.graph import EPSILON, INPUT, Graph
from arc_suite.policies.network import Network
from arc_suite.robots.spec import Body

OUTPUT = "actions"
OPSET = 17  # the first with LayerNormalization
IR_VERSION = 8  # of the same time, so that older runtimes read it


def metadata(network: Network) -> dict:
    """Return the metadata of a policy's file, by name.

    robot, task, task_kwargs    the setup it was trained in, or that of the body it was exported for
    blocks                      size of every block of the observation by name, in order
    control_timestep            s between two actions
    substeps                    of the simulation between them
    joints                      names, in the order of the actions
    gears                       N m that an action of 1 is, by joint; only of motors
    servos                      by joint: its name in the file that it comes from, its angle in the standing pose and
                                how far from it an action of 1 is, rad, stiffness, N m/rad, damping, N m s/rad, limit,
                                N m; only of servos
    file_joints                 names of the joints in the order of that file
    gait_clock                  how the block of that name follows from time; only where there is one

    Raises:
        ValueError: a policy of many bodies.
    """
    if network.setup.several:
        raise ValueError(f"policy of {network.setup.robot}: expected one of one body; see universal.for_body")
    setup, blocks = network.setup, network.blocks
    task, model = setup.prepare()
    step = task.scene.control_timestep
    known = (
        setup.to_dict()
        | {
            "blocks": dict(blocks),
            "control_timestep": step,
            "substeps": round(step / model.opt.timestep),
            "joints": list(task.scene.body.joint_names),
        }
        | _driven(task.scene.body, model)
    )
    if "gait_clock" in blocks and task.parameters is not None:
        frequency = task.parameters.gait_frequency
        known["gait_clock"] = {
            "frequency": frequency,
            "rule": "sine and cosine of 2 pi frequency t, t = control_timestep x control steps since the start",
        }
    return known


def _driven(body: Body, model: Any) -> dict:
    """Return what actions ask of the joints of a body."""
    if not body.source:
        return {"gears": model.actuator_gear[:, 0].tolist()}
    home = source.angles_at_home(body)
    servos = {
        name: {"alias": joint.alias, "home": home[name], "reach": reach} | dataclasses.asdict(joint.servo)
        for name, joint, reach in zip(body.joint_names, body.joints, sizing.action_reaches(body).tolist(), strict=True)
    }
    return {"servos": servos, "file_joints": list(body.file_joints)}


def save(path: str | os.PathLike, network: Network) -> None:
    """Write a policy of one body as ONNX, atomically.

    Raises:
        ValueError: the package onnx is not installed, or a policy of many bodies.
        OSError: the file cannot be written.
    """
    known = metadata(network)
    with versions.require_extra("ONNX needs the package onnx", "learn"):
        import onnx
        from onnx import TensorProto, helper, numpy_helper
    nodes, arrays = _standard(network.graph)
    made = helper.make_graph(
        [helper.make_node(operator, names, [result], **attributes) for operator, names, result, attributes in nodes],
        "policy",
        [helper.make_tensor_value_info(INPUT, TensorProto.FLOAT, ["num_envs", network.size])],
        [helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, ["num_envs", network.joints])],
        [numpy_helper.from_array(array, name) for name, array in arrays.items()],
    )
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION)
    model.producer_name = "arc_suite"
    texts = {name: value if isinstance(value, str) else json.dumps(value) for name, value in known.items()}
    helper.set_model_props(model, texts)
    onnx.checker.check_model(model)
    with files.writing(path) as temporary:
        temporary.write_bytes(model.SerializeToString())


# Arrays that nodes of ONNX take where ours have none.
_ARRAYS = {name: np.array(values, np.int64) for name, values in {"flat": (0, -1), "one": (1,), "two": (2,)}.items()}

# The nodes of ONNX that each of ours is: operator, inputs, attributes. An input is one of ours by its number, an array
# by its name, or the result before, BEFORE. Operators that are missing are the same.
BEFORE = -1
_TRUTH = ("Cast", (BEFORE,), {"to": 1})
_STANDARD: dict[str, tuple] = {
    "Equal": (("Equal", (0, 1), {}), _TRUTH),
    "Greater": (("Greater", (0, 1), {}), _TRUTH),
    "GreaterOrEqual": (("GreaterOrEqual", (0, 1), {}), _TRUTH),
    "LayerNorm": (("LayerNormalization", (0, 1, 2), {"axis": -1, "epsilon": EPSILON}),),
    "Linear": (("MatMul", (0, 1), {}), ("Add", (BEFORE, 2), {})),
    # Every row is computed, and those that are not there become 0.
    "Pick": (("Identity", (0,), {}),),
    "Place": (("Unsqueeze", (1, "two"), {}), ("Mul", (0, BEFORE), {})),
    "Product": (("MatMul", (0, 1), {}),),
    "Sum": (("ReduceSum", (0, "one"), {"keepdims": 0}),),
    "Take": (("Reshape", (0, "flat"), {}), ("Gather", (BEFORE, 1), {"axis": 1})),
}


def _standard(graph: Graph) -> tuple[list[tuple], dict[str, np.ndarray]]:
    """Return nodes (operator, inputs, result, attributes) of ONNX, and their arrays by name."""
    arrays = _ARRAYS | {f"array_{name}": array for name, array in graph.arrays.items()}
    nodes: list[tuple] = [("Shape", [INPUT], "num_envs", {"end": 1})]
    nodes.append(("Concat", ["num_envs", "one"], "rows", {"axis": 0}))
    known: dict[Any, str] = {INPUT: INPUT} | {name: f"array_{name}" for name in graph.arrays}
    for index, node in enumerate(graph.nodes):
        known[index] = OUTPUT if index == len(graph.nodes) - 1 else f"node_{index}"
        inputs = [known[name] for name in node.inputs]
        if node.operator == "Concat":
            nodes += _joined(inputs, known[index])
        else:
            steps = _STANDARD.get(node.operator, ((node.operator, range(len(inputs)), {}),))
            nodes += _steps(steps, inputs, known[index])
    return nodes, arrays


def _steps(steps: tuple, inputs: list[str], result: str) -> Iterator[tuple]:
    results = [f"{result}_{place}" for place in range(len(steps) - 1)] + [result]
    for place, (operator, own, attributes) in enumerate(steps):
        given = [each if isinstance(each, str) else [*inputs, results[place - 1]][each] for each in own]
        yield operator, given, results[place], attributes


def _joined(inputs: list[str], result: str) -> Iterator[tuple]:
    """All numbers of inputs, one after the other; arrays are the same in every environment."""
    flat = [f"{result}_{place}" for place in range(len(inputs))]
    for name, part in zip(inputs, flat, strict=True):
        yield "Reshape", [name, "flat"], f"{part}_flat", {}
        yield "Expand", [f"{part}_flat", "rows"], part, {}
    yield "Concat", flat, result, {"axis": 1}
