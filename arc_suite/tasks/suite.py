"""The twelve tasks that follow a command: each is a command on a ground, with what differs in numbers."""

from collections.abc import Mapping
from typing import ClassVar

from arc_suite.tasks.command import AlongLane, Schedule, ToGoal
from arc_suite.tasks.command_task import COSTS, CommandTask
from arc_suite.tasks.gait_and_pose import GaitAndPose
from arc_suite.tasks.ground import Lanes, PillarField

_STACKED = ("clock", "clearances", "context", "_torques")  # what follows from body and settings


class Steer(CommandTask):
    """Following a velocity forward, sideways and in turning, stops included."""

    name, command, from_body = "steer", Schedule(), _STACKED


class Shoved(CommandTask):
    """Following a velocity command under kicks."""

    name, command, modifiers, from_body = "shoved", Schedule(), {"kicks": 1.5}, _STACKED


class Limp(CommandTask):
    """Following a velocity command with a leg, drawn for each episode, whose motors fail."""

    name, command, modifiers, from_body = "limp", Schedule(), {"actuator_failure": True}, _STACKED


class Directed(CommandTask):
    """Following a velocity in a pose and a gait by command."""

    name, command, gait_and_pose, from_body = "directed", Schedule(), GaitAndPose(), _STACKED
    demonstrators = ("balanced", "steered")
    weights: ClassVar[Mapping[str, float]] = {
        "progress": 0.25,
        "tracking": 0.25,
        "healthy": 1.0,
        "obedience": 3.0,
        **COSTS,
    }


class Rough(CommandTask):
    """Walking over rough ground."""

    from_body = _STACKED
    name, yaw = "rough", 0.3
    command, ground = AlongLane(), Lanes(("rough",))
    demonstrators = ("balanced", "surefooted")


class Slopes(CommandTask):
    """Walking up and down slopes."""

    from_body = _STACKED
    name, yaw = "slopes", 0.3
    command, ground = AlongLane(), Lanes(("slopes",))
    demonstrators = ("balanced", "surefooted")


class Stairs(CommandTask):
    """Walking up and down flights of stairs."""

    from_body = _STACKED
    name, yaw = "stairs", 0.3
    command, ground = AlongLane(), Lanes(("stairs",), copies=(4, 1))
    demonstrators = ("balanced", "surefooted")


class Gaps(CommandTask):
    """Walking over trenches."""

    from_body = _STACKED
    name, yaw = "gaps", 0.3
    command, ground = AlongLane(), Lanes(("gaps",), copies=(4, 1))
    demonstrators = ("sighted",)


class Course(CommandTask):
    """Walking over one of the four kinds of ground, drawn for every episode."""

    from_body = _STACKED
    name, yaw = "course", 0.3
    command, ground = AlongLane(), Lanes(("rough", "slopes", "stairs", "gaps"), copies=(2, 1))
    demonstrators = ("balanced", "surefooted")


class Leap(CommandTask):
    """Leaping over trenches or hurdles, drawn for every episode."""

    from_body = _STACKED
    name, yaw = "leap", 0.3
    command, ground = AlongLane(), Lanes(("trenches", "hurdles"), copies=(4, 1), difficulty=0.0)
    demonstrators = ("leaping", "sighted")


class Roam(CommandTask):
    """Following a velocity command over rough ground under kicks; a curriculum judges by the mean tracking."""

    from_body = _STACKED
    name, modifiers = "roam", {"kicks": 1.5}
    command, ground = Schedule(), Lanes(("rough",), middle=0.5, thresholds=(0.25, 0.5))
    demonstrators = ("balanced", "surefooted")


class Navigate(CommandTask):
    """Reaching goal after goal among pillars."""

    from_body = _STACKED
    name = "navigate"
    command, ground = ToGoal(), PillarField()
    demonstrators = ("planned",)
    weights: ClassVar[Mapping[str, float]] = {
        "progress": 1.5,
        "healthy": 1.0,
        "obedient_gait": 2.5,
        "goal": 10.0,
        **COSTS,
    }
