"""The ten tasks that follow a command: each is a command on a ground, with what differs in numbers."""

from collections.abc import Mapping
from typing import ClassVar

from arc_suite.arenas import terrain
from arc_suite.tasks.command import AlongLane, Schedule, ToGoal
from arc_suite.tasks.command_task import COSTS, CommandTask
from arc_suite.tasks.ground import Lanes, PillarField

_LEVEL = ("clock", "clearances", "context", "_torques")  # what follows from the body on level ground


class Steer(CommandTask):
    """Following a velocity forward, sideways and in turning, stops included."""

    name, command, from_body = "steer", Schedule(), _LEVEL


class Shoved(CommandTask):
    """Following a velocity command under kicks."""

    name, command, modifiers, from_body = "shoved", Schedule(), {"kicks": 1.5}, _LEVEL


class Limp(CommandTask):
    """Following a velocity command with a leg, drawn for each episode, whose motors fail."""

    name, command, modifiers, from_body = "limp", Schedule(), {"actuator_failure": True}, _LEVEL


class Rough(CommandTask):
    """Walking over rough ground."""

    name, yaw = "rough", 0.3
    command, ground = AlongLane(), Lanes(("rough",))
    demonstrators = ("balanced", "surefooted")


class Slopes(CommandTask):
    """Walking up and down slopes."""

    name, yaw = "slopes", 0.3
    command, ground = AlongLane(), Lanes(("slopes",))
    demonstrators = ("balanced", "surefooted")


class Stairs(CommandTask):
    """Walking up and down flights of stairs."""

    name, yaw = "stairs", 0.3
    command, ground = AlongLane(), Lanes(("stairs",), copies=(4, 1))
    demonstrators = ("balanced", "surefooted")


class Gaps(CommandTask):
    """Walking over trenches."""

    name, yaw = "gaps", 0.3
    command, ground = AlongLane(), Lanes(("gaps",), copies=(4, 1))
    demonstrators = ("sighted",)


class Course(CommandTask):
    """Walking over one of the four kinds of ground, drawn for every episode."""

    name, yaw = "course", 0.3
    command, ground = AlongLane(), Lanes(terrain.KINDS, copies=(2, 1))
    demonstrators = ("balanced", "surefooted")


class Roam(CommandTask):
    """Following a velocity command over rough ground under kicks; a curriculum judges by the mean tracking."""

    name, modifiers = "roam", {"kicks": 1.5}
    command, ground = Schedule(), Lanes(("rough",), middle=0.5, thresholds=(0.25, 0.5))
    demonstrators = ("balanced", "surefooted")


class Navigate(CommandTask):
    """Reaching goal after goal among pillars."""

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
