"""Names and units of every entry of an observation."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from arc_suite.models import posture
from arc_suite.tasks import TASKS, sensors
from arc_suite.tasks.command_task import CommandTask
from arc_suite.tasks.contract import Task
from website import markdown

BLOCKS = {
    "posture": "torso height, torso quaternion (w first), joint angles",
    "velocities": "torso velocity, torso angular velocity, joint velocities",
    "contact_forces": "torque and force of the contacts on each rigid part, clipped to [-1, 1]",
    "gait_clock": "sine and cosine of the gait's phase",
    "command": "desired velocity, and the measured motion, a leaky mean over a gait cycle",
    "pose": "height, forward and left of the torso at rest; roll, pitch and yaw",
    "gait": "sine and cosine of the phase of each foot, duty factor and frequency of the gait",
    "goal": "direction of the goal as cosine and sine, and its distance, at most 1",
    "scan": "height of the ground at 25 x 7 points around the torso, clipped to [-1, 1]; 0 is level ground",
    "ranges": "distance of the nearest pillar along 24 rays, at most 1",
}


class Entry(NamedTuple):
    """One number of an observation.

    Attributes:
        block: its name.
        name: of the number.
        unit: of the number; empty without one.
    """

    block: str
    name: str
    unit: str


def entries(task: Task) -> list[Entry]:
    """Return the entries of a task's observation in the order of the vector."""
    return [Entry(block, *named) for block in task.blocks for named in _NAMES[block](task)]


def listed(task: Task, title: str) -> str:
    """Return the table of all entries, which a click unfolds."""
    lines = ([str(index), entry.block, entry.name, entry.unit] for index, entry in enumerate(entries(task)))
    return markdown.dropdown(title, ("index", "block", "entry", "unit"), lines)


def _posture(task: Task) -> Iterator[tuple[str, str]]:
    yield "torso height", "m"
    yield from ((f"torso quaternion {part}", "") for part in "wxyz")
    yield from ((f"angle of {joint}", "rad") for joint in task.scene.body.joint_names)


def _velocities(task: Task) -> Iterator[tuple[str, str]]:
    headed = issubclass(TASKS[task.name], CommandTask)
    directions = ("forward", "left", "up") if headed else ("world x", "world y", "world z")
    yield from ((f"torso velocity, {direction}", "m/s") for direction in directions)
    yield from ((f"torso angular velocity, {axis}", "rad/s") for axis in ("roll", "pitch", "yaw"))
    yield from ((f"velocity of {joint}", "rad/s") for joint in task.scene.body.joint_names)


def _contact_forces(task: Task) -> Iterator[tuple[str, str]]:
    headed = issubclass(TASKS[task.name], CommandTask)
    directions = ("forward", "left", "up") if headed else ("x", "y", "z")
    units = ("weight x h", "weight") if headed else ("N m", "N")
    for part in task.scene.body.part_names:
        for what, unit in zip(("torque", "force"), units, strict=True):
            yield from ((f"{what} on {part}, {direction}", unit) for direction in directions)


def _gait_clock(task: Task) -> Iterator[tuple[str, str]]:
    yield from ((f"{function} of the phase", "") for function in ("sine", "cosine"))


def _command(task: Task) -> Iterator[tuple[str, str]]:
    units = {"forward": "v*", "left": "v*", "turning": "v* / R"}
    for what in ("desired", "measured"):
        yield from ((f"{what} {direction}", unit) for direction, unit in units.items())


def _pose(task: Task) -> Iterator[tuple[str, str]]:
    yield from zip(posture.NAMES, ("h", "h", "h", "rad", "rad", "rad"), strict=True)


def _gait(task: Task) -> Iterator[tuple[str, str]]:
    for function in ("sine", "cosine"):
        yield from ((f"{function} of the phase of {leg.name}", "") for leg in task.scene.body.legs)
    yield "duty factor", ""
    yield "frequency", "sqrt(g / h)"


def _goal(task: Task) -> Iterator[tuple[str, str]]:
    yield from ((f"{function} of the goal's direction", "") for function in ("cosine", "sine"))
    yield "distance of the goal", f"{sensors.FAR:g} R"


def _scan(task: Task) -> Iterator[tuple[str, str]]:
    yield from ((f"ground {forward:.2f} R forward, {left:.2f} R left", "h") for forward, left in sensors.SCAN.T)


def _ranges(task: Task) -> Iterator[tuple[str, str]]:
    degrees = np.degrees(np.arctan2(sensors.RAYS[1], sensors.RAYS[0])) % 360.0
    yield from ((f"range at {angle:.0f} degrees to the left", f"{sensors.SIGHT:g} R") for angle in degrees)


_NAMES = {
    "posture": _posture,
    "velocities": _velocities,
    "contact_forces": _contact_forces,
    "gait_clock": _gait_clock,
    "command": _command,
    "pose": _pose,
    "gait": _gait,
    "goal": _goal,
    "scan": _scan,
    "ranges": _ranges,
}
