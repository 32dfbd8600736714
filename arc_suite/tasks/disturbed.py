"""Named rows of modifiers: tasks that are others, disturbed."""

import numpy as np

from arc_suite.tasks.contract import Start
from arc_suite.tasks.ground import Carry, Memory, Rough
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
    """Following a velocity command over rough ground under kicks; a curriculum judges by the mean tracking."""

    name = "roam"
    modifiers = {"kicks": 1.5}
    yaw, thresholds = Steer.yaw, (0.25, 0.5)
    wanted = Steer.wanted

    def start(self, random: np.random.RandomState, carry: Carry) -> Start:
        """Draw a start of `Rough`, and move it to the middle of the lane's length, as the way leads anywhere."""
        start = super().start(random, carry)
        start.qpos[0] += 0.5 * self.scene.arena.length * self.scene.arena.unit
        return start

    def progress(self, memory: Memory) -> dict:
        """Return those of `Rough` without `distance`, which nobody asks for."""
        return {name: figure for name, figure in super().progress(memory).items() if name != "distance"}

    def outcome(self, memory: Memory):
        """Return the mean tracking (...) of the steps that `asked` counts."""
        return memory.tracking / self.asked(memory)
