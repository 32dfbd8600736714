"""Policies for robots: a folder with policy.onnx, policy.json and run.py, which needs NumPy and onnxruntime alone.

`policy.json` says how run.py builds the observation from sensors, and what each motor does; see `describe_machine`.
"""

import json
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from arc_suite import files
from arc_suite.envs.setup import Setup
from arc_suite.learning import onnx_file, policy_metadata
from arc_suite.models import source
from arc_suite.policies.network import Network
from arc_suite.robots.spec import Body
from arc_suite.tasks import Task
from arc_suite.tasks.fitting import STANCE_HEIGHT, velocity_units
from arc_suite.tasks.modified_task import has_active
from arc_suite.tasks.modifiers import SensorsOnly

RUNNER = Path(__file__).with_name("runner.py")
FILES = ("policy.onnx", "policy.json", "run.py")

# Parts of the blocks that the runner builds, in the order of the block.
_PARTS = {
    "posture": ("height", "orientation", "angles"),
    "velocities": ("velocity", "rates", "speeds"),
    "contact_forces": ("forces",),
    "gait_clock": ("clock",),
    "command": ("desired", "desired", "motion", "motion"),  # each of a planar velocity and a turning velocity
    "history": ("history",),
}
_ESTIMATED = {"height": "torso's height", "velocity": "torso's velocity", "motion": "mean velocity"}
_ABSENT = "absent"  # before the name of a part that is 0


def save(folder: str | os.PathLike[str], network: Network, training: Setup | None = None) -> list[str]:
    """Write the files of a policy of one body into a folder, and return a line for each thing that its user must know.

    Args:
        folder: the folder.
        network: the policy.
        training: setup in which it learned, None for that of the policy.

    Raises:
        ValueError: the observation has a block that sensors do not give, or as `onnx_file.save`.
        OSError: a file cannot be written.
    """
    facts = describe_machine(network, training)
    folder = files.folder(folder)
    onnx_path, json_path, runner_path = (folder / name for name in FILES)
    onnx_file.save(onnx_path, network, training)
    with files.writing(json_path) as temporary:
        temporary.write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
    with files.writing(runner_path) as temporary:
        temporary.write_bytes(RUNNER.read_bytes())
    return list(_notes(facts))


def describe_machine(network: Network, training: Setup | None = None) -> dict[str, Any]:
    """Return the content of policy.json, given the setup of the training; see `save`.

    robot, task, task_kwargs    setup of the training; the name of the robot alone
    control_timestep            s between two actions
    actions, torque_held, delay see `policy_metadata.metadata`
    motors                      in the order of the robot's file: motor, its joint there; joint, its name in the suite;
                                action, its index in an action; home, reach, stiffness, damping and limit as in
                                `policy_metadata.metadata`; low and high, its range, rad
    imu                         orientation of the file's root frame, in which the IMU measures, in the torso's frame
    held                        joints outside of the legs by name, and the angle at which training holds each, rad
    substeps                    simulation steps between two actions in training
    observation                 [part, size] in order; those named "absent ..." are 0, as in training
    estimated                   parts that are estimated from the feet that stand, though training saw the simulation's
    history                     steps, and [part, size] of each
    follows_commands            whether there is a command; else the policy walks into the first heading
    command_units               m/s, m/s and rad/s of a desired velocity of 1
    command_ranges              least and greatest desired velocity in training: forward and left, m/s, turning, rad/s
    gait_frequency              of the clock, Hz
    leak                        weight of the latest step in the mean velocity
    legs, stance_band           for the estimates: joints (indices of actions), axes and anchors of joints, and the foot
                                in the torso's frame of the standing pose, m; radius of the foot, m; height over the
                                lowest foot below which a foot stands, m

    Raises:
        ValueError: the observation has a block that sensors do not give, or a policy of many bodies.
    """
    metadata = policy_metadata.metadata(network, training)
    task = network.setup.definition
    body = task.scene.body
    parts = {name: _parts_of_block(task, name) for name in network.blocks}
    names = [part for block_parts in parts.values() for part, _ in block_parts]
    history = metadata.get("history", {"steps": 0, "blocks": []})
    gait = task.parameters
    follows_commands = "command" in task.unwrapped.blocks
    units = velocity_units(body, gait.target_velocity) if follows_commands else np.ones(3)
    learned_task = (training or network.setup).definition
    ranges = learned_task.unwrapped.velocity_ranges or [(-1.0, 1.0)] * len(units)
    height = body.torso.standing_height
    return {
        "robot": network.setup.name,
        "task": metadata["task"],
        "task_kwargs": metadata["task_kwargs"],
        "control_timestep": metadata["control_timestep"],
        "substeps": metadata["substeps"],
        "actions": metadata["actions"],
        "torque_held": metadata["torque_held"],
        "delay": metadata.get("delay", [0, 0]),
        "motors": _list_motors(body, metadata),
        "held": {joint.name: source.angles_at_home(body)[joint.name] for joint in body.held},
        "imu": source.file_orientation(body).tolist(),
        "observation": [part for block_parts in parts.values() for part in block_parts],
        "estimated": [name for name in _ESTIMATED if name in names],
        "history": {
            "steps": history["steps"],
            "parts": [part for name in history["blocks"] for part in _parts_of_block(task, name)],
        },
        "follows_commands": follows_commands,
        "command_units": units.tolist(),
        "command_ranges": (np.array(ranges) * units[:, None]).tolist(),
        "gait_frequency": 0.0 if gait is None else gait.gait_frequency,
        "leak": task.context.leak if follows_commands else 0.0,  # type: ignore[attr-defined]
        "legs": list(_describe_legs(body)),
        "stance_band": STANCE_HEIGHT * height,
    }


def _parts_of_block(task: Task, name: str) -> list[tuple[str, int]]:
    """Return name and size of each part of a block, for the runner.

    Raises:
        ValueError: sensors do not give the block, or it is another than the suite's.
    """
    block = task.blocks[name]
    part_names = _PARTS.get(name, ())
    is_by_command = name == "gait_clock" and task.gait_and_pose is not None
    if len(part_names) != len(block.parts) or is_by_command:
        raise ValueError(f"block {name}: run.py cannot build it from sensors; train with exclude_blocks={name}")
    leaves_out = has_active(task, SensorsOnly)
    parts = []
    for part_name, part, is_sensed in zip(
        part_names, block.parts, np.broadcast_to(block.sensed, len(part_names)), strict=True
    ):
        if leaves_out and not is_sensed:
            part_name = f"{_ABSENT} {part_name}"
        elif part_name == "forces":
            cure = "train with exclude_blocks=contact_forces or sensors_only=true"
            raise ValueError(f"block {name}: sensors do not give it; {cure}")
        parts.append((part_name, part.size))
    return _merge(parts)


def _merge(parts: list[tuple[str, int]]) -> list[tuple[str, int]]:
    """Return parts with neighbors of one name as one."""
    merged_parts: list[tuple[str, int]] = []
    for name, size in parts:
        if merged_parts and merged_parts[-1][0] == name:
            size += merged_parts.pop()[1]
        merged_parts.append((name, size))
    return merged_parts


def _list_motors(body: Body, metadata: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the motors in the order of the robot's file, or that of the joints of a body without one."""
    servos = metadata.get("servos")
    if servos is None:
        servos = policy_metadata.servos_of_motors(body, np.array(metadata["gears"]))
    motors = []
    for index, (name, joint) in enumerate(zip(body.joint_names, body.joints, strict=True)):
        servo = dict(servos[name])
        motor_name = servo.pop("alias") or name
        low, high = (servo["home"] + math.radians(limit) for limit in joint.range_deg)
        motors.append({"motor": motor_name, "joint": name, "action": index, **servo, "low": low, "high": high})
    places = {name: place for place, name in enumerate(body.file_joints)}
    return sorted(motors, key=lambda motor: places.get(motor["motor"], len(places)))


def _describe_legs(body: Body) -> Iterator[dict[str, Any]]:
    """Yield the kinematics of each leg; see `describe_machine`."""
    first_joint = 0
    for leg in body.legs:
        yaw = math.radians(leg.yaw_deg)
        mount_rotation = np.array(
            [(math.cos(yaw), -math.sin(yaw), 0.0), (math.sin(yaw), math.cos(yaw), 0.0), (0, 0, 1)]
        )
        axes = []
        anchors = []
        for link, point in zip(leg.links, leg.points[:-1], strict=True):
            if link.joint:
                axis = mount_rotation @ link.joint.axis
                axes.append((axis / np.linalg.norm(axis)).tolist())
                anchors.append(np.array(point).tolist())
        yield {
            "joints": list(range(first_joint, first_joint + len(axes))),
            "axes": axes,
            "anchors": anchors,
            "foot": np.array(leg.foot_position).tolist(),
            "radius": leg.foot.radius,
        }
        first_joint += len(axes)


def _notes(facts: dict[str, Any]) -> Iterator[str]:
    """Yield a line for each thing that the user of the files must know."""
    for index, motor in enumerate(facts["motors"]):
        yield f"motor {index} {motor['motor']}: action {motor['action']} {motor['joint']}"
    if facts["held"]:
        names = ", ".join(f"{name} at {angle:.3g}" for name, angle in facts["held"].items())
        yield f"held in training, and not moved by run.py: {names}"
    if facts["estimated"]:
        names = ", ".join(_ESTIMATED[name] for name in facts["estimated"])
        yield f"estimated from the feet that stand: {names}; training saw those of the simulation"
    if facts["follows_commands"]:
        ranges = zip(("forward", "left", "turning"), facts["command_ranges"], strict=True)
        texts = [f"{direction} {low:.2f} to {high:.2f}" for direction, (low, high) in ranges]
        yield f"commands of training, m/s and rad/s: {', '.join(texts)}; run.py cuts others"
    low, high = facts["delay"]
    if high:
        yield f"delay: trained with {low} to {high} control steps between an action and the motors"
