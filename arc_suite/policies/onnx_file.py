"""Policies as ONNX, which game engines and onnxruntime run: all layers of a network, its normaliser among them.

The input `observations` is (num_envs, size) float32, flat: the task's blocks one after the other. The output
`actions` is (num_envs, joints) in [-1, 1]. The metadata hold what else a game needs, JSON by name; see `metadata`.
"""

import json
import os
from collections.abc import Mapping

from arc_suite import files, versions
from arc_suite.envs.setup import Setup
from arc_suite.policies import graphs
from arc_suite.policies.graphs import INPUT, OUTPUT, Graph
from arc_suite.policies.network import Network
from arc_suite.policies.universal import Universal

OPSET = 17  # the first with LayerNormalization
IR_VERSION = 8  # of the same time, so that older runtimes read it


def metadata(network: Network) -> dict:
    """Return the metadata of a policy's file, by name.

    robot, task, task_kwargs    the setup it was trained in, or that of the body it was exported for
    blocks                      size of every block of the observation by name, in order
    control_timestep            s between two actions
    substeps                    of the simulation between them
    joints                      names, in the order of the actions
    gears                       N m that an action of 1 is, by joint
    gait_clock                  how the block of that name follows from time; only where there is one

    Raises:
        ValueError: a policy of many bodies.
    """
    if network.setup.several:
        raise ValueError(f"policy of {network.setup.robot}: expected one of one body; save_universal takes others")
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
    """Write a policy of one body as ONNX, atomically.

    Raises:
        ValueError: the package onnx is not installed, or a policy of many bodies.
        OSError: the file cannot be written.
    """
    known = metadata(network)
    _write(path, graphs.of(network), network.size, network.joints, known)


def save_universal(path: str | os.PathLike, network: Network, setup: Setup) -> None:
    """Write a policy of many bodies as ONNX for one body in a task, atomically.

    Raises:
        ValueError: the package onnx is not installed, or a body or task that does not fit.
        OSError: the file cannot be written.
    """
    policy = Universal(network, setup.definition)
    _write(path, graphs.of(policy), policy.task.size, len(policy.reach), _metadata(setup, policy.task.sizes))


def _write(path: str | os.PathLike, graph: Graph, size: int, joints: int, known: Mapping) -> None:
    try:
        import onnx
        from onnx import TensorProto, helper, numpy_helper
    except ImportError as error:
        raise versions.MissingExtra("ONNX needs the package onnx", "onnx", error) from None
    made = helper.make_graph(
        [helper.make_node(node.operator, node.inputs, [node.result], **node.attributes) for node in graph.nodes],
        "policy",
        [helper.make_tensor_value_info(INPUT, TensorProto.FLOAT, ["num_envs", size])],
        [helper.make_tensor_value_info(OUTPUT, TensorProto.FLOAT, ["num_envs", joints])],
        [numpy_helper.from_array(array, name) for name, array in graph.constants.items()],
    )
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=IR_VERSION)
    model.producer_name = "arc_suite"
    texts = {name: value if isinstance(value, str) else json.dumps(value) for name, value in known.items()}
    helper.set_model_props(model, texts)
    onnx.checker.check_model(model)
    with files.writing(path) as temporary:
        temporary.write_bytes(model.SerializeToString())
