"""Armatures of joints for which a file has none: a URDF cannot have any, and joints of light links then buzz."""

import copy
from collections.abc import Callable, Mapping

from arc_suite.importing.motors import format_span
from arc_suite.importing.tree import Robot
from arc_suite.robots.spec import Body, Servo, SpecError
from arc_suite.simulation.stillness import calming_armature, measure_stillness

_MAX_ARMATURE = 1e6  # kg m^2


def add_armature(robot: Robot, armature: float) -> tuple[Robot, tuple[str, ...]]:
    """Return a robot with an armature, kg m^2, at each joint for which the file has none, and a note.

    Raises:
        SpecError: the armature is no number from 0.
    """
    if not 0.0 <= armature <= _MAX_ARMATURE:
        raise SpecError(f"armature: expected a number from 0 to {_MAX_ARMATURE:g}, got {armature:g}")
    joints = _joints_without_armature(robot)
    robot_with_armature = _set_armatures(robot, dict.fromkeys(joints, armature))
    if not joints:
        return robot, ("armature: all joints have those of the file",)
    return robot_with_armature, (f"armature: {armature:g} kg m^2 at {len(joints)} joints, which have none in the file",)


def calm(
    body: Body, robot: Robot, servos: Mapping[int, Servo], write_body: Callable[[Robot], Body]
) -> tuple[Body, tuple[str, ...]]:
    """Return a body that stands still if armatures help, and a note if it has armatures that the file has not.

    Args:
        body: as the file has it.
        robot: robot of the file.
        servos: by joint.
        write_body: makes the body of a robot.
    """
    joints = _joints_without_armature(robot)
    if not joints:
        return body, ()
    stillness = measure_stillness(body)
    if not stillness.buzzes and not stillness.falls:
        return body, ()
    timestep = body.simulation.timestep
    armatures = {joint: calming_armature(servos[joint].stiffness, timestep) for joint in joints}
    calm_body = write_body(_set_armatures(robot, armatures))
    calm_stillness = measure_stillness(calm_body)
    if calm_stillness.buzzes or calm_stillness.falls:
        return body, ()
    span = format_span(min(armatures.values()), max(armatures.values()))
    problem = "the robot falls" if stillness.falls else f"they buzz at {stillness.joint_speed:.2g} rad/s"
    note = (
        f"armature: {span} kg m^2 at {len(joints)} joints, which have none in the file: without it {problem} "
        "in the standing pose; --armature 0 leaves it out"
    )
    return calm_body, (note,)


def _joints_without_armature(robot: Robot) -> list[int]:
    dofs = robot.model.jnt_dofadr
    motors = [joint for joint in robot.joints if joint not in robot.passive]
    return [joint for joint in motors if robot.model.dof_armature[dofs[joint]] == 0.0]


def _set_armatures(robot: Robot, armatures: Mapping[int, float]) -> Robot:
    """Return a robot with other armatures, kg m^2, by joint."""
    model = copy.copy(robot.model)
    for joint, armature in armatures.items():
        model.dof_armature[model.jnt_dofadr[joint]] = armature
    return robot._replace(model=model)
