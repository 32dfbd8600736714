"""What the file of a policy says of the machine that it is for: actions, observation, and timing."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from arc_suite.envs.setup import Setup
from arc_suite.models import sizing, source
from arc_suite.models.standing import measure_standing
from arc_suite.policies.network import Network
from arc_suite.robots.spec import Body, Joint
from arc_suite.tasks import Task
from arc_suite.tasks.modified_task import has_active
from arc_suite.tasks.modifiers import Delay, History


def metadata(network: Network, training: Setup | None = None) -> dict:
    """Return the metadata of a policy's file, by name; given the setup in which it learned, None for the policy's.

    robot, task, task_kwargs    setup of the training, or the setup that the policy was exported for
    blocks                      size of every block of the observation by name, in order
    control_timestep            s between two actions
    substeps                    simulation steps between two actions
    actions                     what an action is: "torque", or "position"
    joints                      names of the joints, in the order of the actions
    gears                       torques of an action of 1 by joint, N m; only for torques
    servos                      only for positions, by joint: alias, its name in the imported file; home, its angle in
                                the standing pose, rad; reach, change of the angle by an action of 1, rad; stiffness,
                                N m/rad; damping, N m s/rad; limit, N m; where torques fall with speed, no_load_speed,
                                rad/s, and stall, N m
    motor_delays                s after which a control acts, by joint; only where motors have delays
    torque_held                 how long a torque holds: "control step", or "substep" of servos of imported bodies
    file_joints                 names of the joints in the order of the imported file; only of imported bodies
    gait_clock                  frequency, Hz, and rule of the block of that name; only if the task has this block
    history                     control steps, blocks and layout of the block of that name; only with a history
    delay                       lowest and highest delay of actions in training, control steps; only with a delay

    Raises:
        ValueError: a policy of many bodies.
    """
    if network.setup.several:
        raise ValueError(f"policy of {network.setup.robot}: expected one of one body; see universal.for_body")
    task, model = network.setup.prepare()
    body = task.scene.body
    control_timestep = task.scene.control_timestep
    values = network.setup.to_dict()
    values["blocks"] = dict(network.blocks)
    values["control_timestep"] = control_timestep
    values["substeps"] = round(control_timestep / model.opt.timestep)
    values["actions"] = task.actions
    values["joints"] = list(body.joint_names)
    if task.actions == "torque":
        values["gears"] = model.actuator_gear[:, 0].tolist()
    elif body.source:
        values["servos"] = _imported_servos(body)
    else:
        values["servos"] = servos_of_motors(body, model.actuator_gear[:, 0])
    motor_delays = [joint.drive.delay if joint.drive else 0.0 for joint in body.joints]
    if any(motor_delays):
        values["motor_delays"] = dict(zip(body.joint_names, motor_delays, strict=True))
    values["torque_held"] = "substep" if body.source else "control step"
    if body.source:
        values["file_joints"] = list(body.file_joints)
    if "gait_clock" in network.blocks and task.parameters is not None:
        values["gait_clock"] = {"frequency": task.parameters.gait_frequency, "rule": _clock_rule(task)}
    return values | dict(_timing(task, (training or network.setup).definition))


def _clock_rule(task: Task) -> str:
    """Return the rule of the block `gait_clock`."""
    if task.gait_and_pose is not None:
        return "sine and cosine of the phase of the gait by command; zeros while the command is a stop"
    rule = "sine and cosine of 2 pi frequency t, t = control_timestep x control steps since the start"
    if "command" in task.unwrapped.blocks:
        return f"{rule} in which the command is no stop; zeros while it is a stop"
    return rule


def _imported_servos(body: Body) -> dict[str, dict]:
    """Return the servos of an imported body by joint."""
    home_angles = source.angles_at_home(body)
    reaches = sizing.action_reaches(body).tolist()
    servos = {}
    for name, joint, reach in zip(body.joint_names, body.joints, reaches, strict=True):
        servos[name] = {
            "alias": joint.alias,
            "home": home_angles[name],
            "reach": reach,
            "stiffness": joint.servo.stiffness,
            "damping": joint.servo.damping,
            "limit": joint.servo.limit,
            **_speed_limit(joint),
        }
    return servos


def servos_of_motors(body: Body, gears: np.ndarray) -> dict[str, dict]:
    """Return by joint the servos that position control makes of motors, given their gears (joints,), N m."""
    stiffness, damping = sizing.position_gains(sizing.size_body(body), measure_standing(body).inertias)
    columns = {
        "reach": sizing.action_reaches(body),
        "stiffness": stiffness * gears,
        "damping": damping * gears,
        "limit": gears,
    }
    servos = {}
    for index, name in enumerate(body.joint_names):
        numbers = {column: float(values[index]) for column, values in columns.items()}
        servos[name] = {"alias": None, "home": 0.0, **numbers, **_speed_limit(body.joints[index])}
    return servos


def _speed_limit(joint: Joint) -> dict[str, float]:
    """Return the speed without load and the stall torque of a joint whose torque falls with speed; else nothing."""
    drive = joint.drive
    if drive is None or drive.no_load_speed is None:
        return {}
    return {"no_load_speed": drive.no_load_speed, "stall": drive.stall_torque}


def _timing(task: Task, training_task: Task) -> Mapping[str, Any]:
    """Return the metadata of the history of a task and of the delay in training, where they have them."""
    values: dict[str, Any] = {}
    if has_active(task, History):
        history = task.modifier(History)  # type: ignore[attr-defined]
        values["history"] = {
            "steps": history.history,
            "blocks": list(history.names),
            "layout": "of each control step its blocks and the action after them, the newest step first; "
            "before the start the first observation, with actions of 0",
        }
    if has_active(training_task, Delay):
        values["delay"] = list(training_task.modifier(Delay).delay)  # type: ignore[attr-defined]
    return values
