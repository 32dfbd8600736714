"""Named rows of modifiers: tasks that are others, disturbed."""

from arc_suite.tasks.ground import Rough
from arc_suite.tasks.steer import Steer


class Shoved(Steer):
    """Following a velocity command under kicks."""

    name = "shoved"
    modifiers = {"kicks": 1.5}


class Limp(Steer):
    """Following a velocity command with a leg, drawn for each episode, whose motors give out."""

    name = "limp"
    modifiers = {"limp": True}


class Roam(Rough):
    """Walking over rough ground under kicks."""

    name = "roam"
    modifiers = {"kicks": 1.5}
