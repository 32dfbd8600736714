"""The gait that a task prescribes, to which laws are fitted."""

from typing import NamedTuple

import numpy as np

from arc_suite.robots.spec import Body
from arc_suite.tasks import TASKS, Task
from arc_suite.tasks.parameters import Parameters


class Gait(NamedTuple):
    """When feet stand, and how fast the body is to move.

    Attributes:
        frequency: frequency of the cycle, Hz.
        duty_factor: share of a cycle in stance.
        offsets: (legs,) cycles, added to the phase of the clock.
        target_velocity: m/s.
        tempo: frequency as a multiple of that in walk with default settings.
        pace: target velocity as a multiple of that in walk with default settings.
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
    walk = _walk_parameters(task.scene.body)
    parameters = task.parameters or walk
    frequency = parameters.gait_frequency
    duty_factor = parameters.duty_factor
    velocity = parameters.target_velocity
    if not (frequency > 0.0 and 0.0 < duty_factor < 1.0):
        raise ValueError(
            f"task {task.name}: a demonstrator needs a gait_frequency above 0 and a duty_factor between 0 and 1, "
            f"got {frequency:g} and {duty_factor:g}"
        )
    return Gait(
        frequency=frequency,
        duty_factor=duty_factor,
        offsets=np.array(parameters.phase_offsets) / (2.0 * np.pi),
        target_velocity=velocity,
        # A body may have no frequency or velocity in walk: then the task's is its own measure.
        tempo=frequency / (walk.gait_frequency or frequency),
        pace=velocity / (walk.target_velocity or velocity or 1.0),
    )


def _walk_parameters(body: Body) -> Parameters:
    """Return the parameters of walk with default settings."""
    return TASKS["walk"].settings_for(body, {}).parameters
