"""The demonstrator `rising`: holds the standing pose by position control, with which a body rises from its belly.

It does not turn a torso that lies on its side or back.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite.cpg.drives import drive
from arc_suite.cpg.law import Clock, proprioception
from arc_suite.models.sizing import size_body
from arc_suite.models.standing import measure_standing
from arc_suite.tasks.contract import Task


class RisingParameters(NamedTuple):
    """How a demonstrator rises.

    Attributes:
        stiffness: multiple of the stiffness of position control; the damping stays critical.
    """

    stiffness: float = 1.0


class Rising:
    """Holds the standing pose."""

    reads: tuple[str, ...] = ("posture", "velocities")

    def __init__(self, task: Task, parameters: RisingParameters):
        """Fit the law to the body of a task."""
        body = size_body(task.scene.body)
        self._drive = drive(body, measure_standing(body).inertias).stiffen(parameters.stiffness)

    def constants(self) -> dict[str, Any]:
        """Return the constants of the law, as pages take them."""
        drive = self._drive
        return {"stiffness": drive.stiffness, "damping": drive.damping, "servos": drive.reach is not None}

    def initial(self, count: int) -> Clock:
        """Return the state at the start of episodes in a number of environments."""
        return Clock(np.zeros(count, int))

    def __call__(self, state: Clock, observation: Mapping) -> tuple:
        """Return the next state and the actions (environments, joints); see `law`."""
        _, angles, velocities = proprioception(observation)
        return Clock(state.steps + 1), self._drive.actions(0.0 * angles, 0.0 * angles, angles, velocities)
