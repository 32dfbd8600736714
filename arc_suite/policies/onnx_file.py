"""Policies as ONNX, which game engines and onnxruntime run: all layers of a network, its normaliser among them.

The input `observations` is (num_envs, size) float32, flat: the task's blocks one after the other. The output
`actions` is (num_envs, joints) in [-1, 1]. The metadata hold what else a game needs, JSON by name; see `metadata`.
"""

import json
import os
from collections.abc import Callable

import numpy as np

from arc_suite import files, versions
from arc_suite.policies.network import EPSILON, Layer, Network

OPSET = 17  # the first with LayerNormalization
IR_VERSION = 8  # of the same time, so that older runtimes read it

INPUT, OUTPUT = "observations", "actions"


def metadata(network: Network) -> dict:
    """Return the metadata of a policy's file, by name.

    robot, task, task_kwargs    the setup it was trained in
    blocks                      size of every block of the observation by name, in order
    control_timestep            s between two actions
    substeps                    of the simulation between them
    joints                      names, in the order of the actions
    gears                       N m that an action of 1 is, by joint
    gait_clock                  how the block of that name follows from time; only where there is one
    """
    task, model = network.setup.prepared()
    step = task.scene.control_timestep
    known = network.setup.to_dict() | {
        "blocks": dict(network.blocks),
        "control_timestep": step,
        "substeps": round(step / model.opt.timestep),
        "joints": list(task.scene.body.joint_names),
        "gears": model.actuator_gear[:, 0].tolist(),
    }
    if "gait_clock" in network.blocks and task.parameters is not None:
        frequency = task.parameters.gait_frequency
        known["gait_clock"] = {
            "frequency": frequency,
            "rule": "sine and cosine of 2 pi frequency t, t = control_timestep x control steps since the start",
        }
    return known


def save(path: str | os.PathLike, network: Network) -> None:
    """Write a policy as ONNX, atomically.

    Raises:
        ValueError: the package onnx is not installed.
        OSError: the file cannot be written.
    """
    try:
        import onnx
        from onnx import TensorProto, helper, numpy_helper
    except ImportError as error:
        raise versions.MissingExtra("ONNX needs the package onnx", "onnx", error) from None
    operators = [operator for layer in network.layers for operator in _operators(layer)]
    nodes, constants, present = [], [], INPUT
    for index, (operator, arrays, attributes) in enumerate(operators):
        names = [f"{index}.{place}" for place in range(len(arrays))]
        constants += [numpy_helper.from_array(array, name) for array, name in zip(arrays, names, strict=True)]
        result = OUTPUT if index == len(operators) - 1 else f"after_{index}"
        nodes.append(helper.make_node(operator, [present, *names], [result], **attributes))
        present = result
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info(INPUT, TensorProto.FLOAT, ["num_envs", network.size])],
        [helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, ["num_envs", network.joints])],
        constants,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION)
    model.producer_name = "arc_suite"
    texts = {name: value if isinstance(value, str) else json.dumps(value) for name, value in metadata(network).items()}
    helper.set_model_props(model, texts)
    onnx.checker.check_model(model)
    with files.writing(path) as temporary:
        temporary.write_bytes(model.SerializeToString())


def _operators(layer: Layer) -> list[tuple[str, list[np.ndarray], dict]]:
    """The operators of a layer: names, constants after the input, attributes."""
    arrays = [np.ascontiguousarray(array, np.float32) for array in layer.arrays]
    one = np.float32(1.0)
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
        "clip": lambda: [("Clip", [np.array(-one), np.array(one)], {})],
    }
    return operators[layer.kind]()
