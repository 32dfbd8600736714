"""The gait that a task prescribes, to which laws are fitted."""

from typing import NamedTuple

import numpy as np

from arc_suite.robots.spec import Body
from arc_suite.tasks import TASKS, Task
from arc_suite.tasks.parameters import Parameters


class Gait(NamedTuple):
    """When feet stand, and how fast the body is to move.

    Attributes:
        frequency: Hz.
        duty_factor: share of a cycle in stance.
        offsets: (legs,) cycles, added to the phase of the clock.
        target_velocity: m/s.
        tempo: frequency, as a share of the frequency in walk with default settings.
        pace: target velocity, as a share of that in walk with default settings.
    """

    frequency: float
    duty_factor: float
    offsets: np.ndarray
    target_velocity: float
    tempo: float
    pace: float


def gait_of(task: Task) -> Gait:
    """Return the gait that a task prescribes, or that of walk with default settings where it prescribes none.

    Raises:
        ValueError: a gait without a cycle, or without stance or swing.
    """
    usual = _usual(task.scene.body)
    found = task.parameters or usual
    frequency, duty_factor, velocity = found.gait_frequency, found.duty_factor, found.target_velocity
    if not (frequency > 0.0 and 0.0 < duty_factor < 1.0):
        raise ValueError(
            f"task {task.name}: a demonstrator needs a gait_frequency above 0 and a duty_factor between 0 and 1, "
            f"got {frequency:g} and {duty_factor:g}"
        )
    return Gait(
        frequency,
        duty_factor,
        np.array(found.phase_offsets) / (2.0 * np.pi),
        velocity,
        frequency / (usual.gait_frequency or frequency),
        velocity / (usual.target_velocity or velocity or 1.0),
    )


def _usual(body: Body) -> Parameters:
    return TASKS["walk"].settings_for(body, {}).parameters
