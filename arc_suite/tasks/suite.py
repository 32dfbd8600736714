"""The twelve tasks with a command: each is a command on a ground, with its own numbers."""

from typing import ClassVar

from arc_suite.tasks.command import AlongLane, Schedule, ToGoal
from arc_suite.tasks.command_task import COSTS, CommandTask
from arc_suite.tasks.gait_and_pose import GaitAndPose
from arc_suite.tasks.ground import Lanes, PillarField

# Attributes that follow from body and settings; see `Task.from_body`.
_FROM_BODY = ("clock", "clearances", "context", "_torques", "_heat")


class Steer(CommandTask):
    """Following a velocity forward, sideways and in turning, stops included."""

    name = "steer"
    command = Schedule()
    from_body = _FROM_BODY


class Shoved(CommandTask):
    """Following a velocity command under kicks."""

    name = "shoved"
    command = Schedule()
    modifiers = {"kicks": 1.5}
    from_body = _FROM_BODY
    demonstrators = ("braced",)


class Limp(CommandTask):
    """Following a velocity command with a leg, drawn for each episode, whose motors fail."""

    name = "limp"
    command = Schedule()
    modifiers = {"actuator_failure": True}
    from_body = _FROM_BODY
    demonstrators = ("limping", "braced")


class Directed(CommandTask):
    """Following a velocity in a pose and a gait by command."""

    name = "directed"
    command = Schedule()
    gait_and_pose = GaitAndPose()
    from_body = _FROM_BODY
    demonstrators = ("posed", "steered")
    weights: ClassVar[dict[str, float]] = {
        "progress": 0.25,
        "tracking": 0.25,
        "healthy": 1.0,
        "obedience": 3.0,
        **COSTS,
    }


class Rough(CommandTask):
    """Walking over rough ground."""

    name = "rough"
    yaw = 0.3
    command = AlongLane()
    ground = Lanes(("rough",))
    from_body = _FROM_BODY
    demonstrators = ("hiking", "climbing", "surefooted")


class Slopes(CommandTask):
    """Walking up and down slopes."""

    name = "slopes"
    yaw = 0.3
    command = AlongLane()
    ground = Lanes(("slopes",))
    from_body = _FROM_BODY
    demonstrators = ("hiking", "climbing", "surefooted")


class Stairs(CommandTask):
    """Walking up and down flights of stairs."""

    name = "stairs"
    yaw = 0.3
    command = AlongLane()
    ground = Lanes(("stairs",), copies=(4, 1))
    from_body = _FROM_BODY
    demonstrators = ("climbing", "surefooted")


class Gaps(CommandTask):
    """Walking over trenches."""

    name = "gaps"
    yaw = 0.3
    command = AlongLane()
    ground = Lanes(("gaps",), copies=(4, 1))
    from_body = _FROM_BODY
    demonstrators = ("sighted",)


class Course(CommandTask):
    """Walking over one of the four kinds of ground, drawn for every episode."""

    name = "course"
    yaw = 0.3
    command = AlongLane()
    ground = Lanes(("rough", "slopes", "stairs", "gaps"), copies=(2, 1))
    from_body = _FROM_BODY
    demonstrators = ("crossing", "climbing", "surefooted")


class Leap(CommandTask):
    """Leaping over trenches or hurdles, drawn for every episode."""

    name = "leap"
    yaw = 0.3
    command = AlongLane()
    ground = Lanes(("trenches", "hurdles"), copies=(4, 1), difficulty=0.0)
    from_body = _FROM_BODY
    demonstrators = ("leaping", "sighted")


class Roam(CommandTask):
    """Following a velocity command over rough ground under kicks; a curriculum judges by the mean tracking."""

    name = "roam"
    modifiers = {"kicks": 1.5}
    command = Schedule()
    ground = Lanes(("rough",), middle=0.5, thresholds=(0.25, 0.5), roams=True)
    from_body = _FROM_BODY
    demonstrators = ("braced",)


class Navigate(CommandTask):
    """Reaching goal after goal among pillars."""

    name = "navigate"
    command = ToGoal()
    ground = PillarField()
    from_body = _FROM_BODY
    demonstrators = ("planned",)
    weights: ClassVar[dict[str, float]] = {
        "progress": 1.5,
        "healthy": 1.0,
        "obedient_gait": 2.5,
        "goal": 10.0,
        **COSTS,
    }
