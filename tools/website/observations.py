"""Names and units of every entry of an observation."""

from typing import NamedTuple

from arc_suite.tasks.contract import Task
from website import markdown

# What the blocks of an observation contain, by name.
BLOCK_CONTENTS = {
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
    "motion": "sine and cosine of the phase in the motion; 1, or -1 for its mirror image; which motion",
    "next_poses": "in one and two control steps: place and quaternion of the motion's torso, joint angles",
    "vertical": "the world's up axis in the torso's frame",
}


class Entry(NamedTuple):
    """One number of an observation.

    Attributes:
        block: name of its block.
        name: name of the number.
        unit: unit of the number; empty if it has none.
    """

    block: str
    name: str
    unit: str


def entries(task: Task) -> list[Entry]:
    """Return the entries of a task's observation in the order of the vector."""
    all_entries = []
    for block_name, block in task.blocks.items():
        for name, unit in block.entries():
            all_entries.append(Entry(block_name, name, unit))
    return all_entries


def entries_table(task: Task, title: str) -> str:
    """Return the table of all entries, which a click on its title unfolds."""
    lines = [[str(index), entry.block, entry.name, entry.unit] for index, entry in enumerate(entries(task))]
    return markdown.dropdown(title, ("index", "block", "entry", "unit"), lines)
