"""Policies as ONNX, which game engines and onnxruntime run: all layers of a network, its normaliser among them.

The input `observations` is (num_envs, size) float32, flat: the task's blocks one after the other. The output
`actions` is (num_envs, joints) in [-1, 1]. The metadata hold what else a game needs, JSON by name; see `metadata`.
"""

import json
import os
from collections.abc import Callable, Mapping

import numpy as np

from arc_suite import files, versions
from arc_suite.envs.setup import Setup
from arc_suite.policies.network import EPSILON, Layer, Network
from arc_suite.policies.onnx_universal import Graph, added
from arc_suite.policies.universal import Universal

OPSET = 17  # the first with LayerNormalization
IR_VERSION = 8  # of the same time, so that older runtimes read it

INPUT, OUTPUT = "observations", "actions"


def metadata(network: Network) -> dict:
    """Return the metadata of a policy's file, by name.

    robot, task, task_kwargs    the setup it was trained in, or that of the body it was exported for
    blocks                      size of every block of the observation by name, in order
    control_timestep            s between two actions
    substeps                    of the simulation between them
    joints                      names, in the order of the actions
    gears                       N m that an action of 1 is, by joint
    gait_clock                  how the block of that name follows from time; only where there is one
    """
    return _metadata(network.setup, network.blocks)


def _metadata(setup: Setup, blocks: Mapping[str, int]) -> dict:
    task, model = setup.prepared()
    step = task.scene.control_timestep
    known = setup.to_dict() | {
        "blocks": dict(blocks),
        "control_timestep": step,
        "substeps": round(step / model.opt.timestep),
        "joints": list(task.scene.body.joint_names),
        "gears": model.actuator_gear[:, 0].tolist(),
    }
    if "gait_clock" in blocks and task.parameters is not None:
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
    graph, present = Graph(), INPUT
    for layer in network.layers:
        for operator, arrays, attributes in _operators(layer):
            present = graph(operator, present, *arrays, **attributes)
    _write(path, graph, present, network.size, network.joints, metadata(network))


def save_universal(path: str | os.PathLike, network: Network, setup: Setup) -> None:
    """Write a policy of many bodies as ONNX for one body in a task, atomically.

    Raises:
        ValueError: the package onnx is not installed, or a body or task that does not fit.
        OSError: the file cannot be written.
    """
    graph, policy = Graph(), Universal(network, setup.definition)
    result = added(graph, policy, INPUT)
    task = policy.task
    _write(path, graph, result, task.size, len(policy.reach), _metadata(setup, task.blocks))


def _write(path: str | os.PathLike, graph: Graph, result: str, size: int, joints: int, known: Mapping) -> None:
    try:
        import onnx
        from onnx import TensorProto, helper, numpy_helper
    except ImportError as error:
        raise versions.MissingExtra("ONNX needs the package onnx", "onnx", error) from None
    made = helper.make_graph(
        [
            helper.make_node(operator, names, [OUTPUT if found == result else found], **attributes)
            for operator, names, found, attributes in graph.nodes
        ],
        "policy",
        [helper.make_tensor_value_info(INPUT, TensorProto.FLOAT, ["num_envs", size])],
        [helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, ["num_envs", joints])],
        [numpy_helper.from_array(np.ascontiguousarray(array), name) for name, array in graph.constants.items()],
    )
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION)
    model.producer_name = "arc_suite"
    texts = {name: value if isinstance(value, str) else json.dumps(value) for name, value in known.items()}
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
