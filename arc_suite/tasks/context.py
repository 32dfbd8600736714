"""Lengths and speeds of a body, in which tasks with a command measure, and the time constants of their means."""

import math
from typing import Any, NamedTuple

import numpy as np

from arc_suite.models.standing import GRAVITY, measure_standing, time_unit
from arc_suite.robots.spec import Body
from arc_suite.tasks.contract import STEPS
from arc_suite.tasks.fitting import velocity_units


class Context(NamedTuple):
    """Lengths and speeds to which the command, the ground and the health of a task are fitted.

    Attributes:
        arena: where the task takes place: an `arenas.Arena`, of the class that the command and the ground need.
        height: h, the standing height, m.
        reach: R, the mean distance of the feet from their center, m.
        units: (3,) units of commands: the target velocity, twice, m/s, and the turning velocity, rad/s, at which feet
            on a circle of radius R are as fast.
        force_unit: (1, 6) unit of contact forces: three times the weight times the standing height, N m, then
            three times the weight, N.
        step_units: (3,) displacements of a control step at `units`, m and rad.
        pace: displacement of a control step at the target velocity, m.
        leak: weight of the latest step in exponential moving averages over a cycle of the gait, called leaky means.
        leaks: (3,) the same weight, for means of vectors.
        steps: control steps over which an episode is judged: its limit, 1000 without one.
        tempo: time unit sqrt(h / g), control steps.
        reference: the `gait_and_pose.Reference` of a task with a commanded gait and pose; None for other tasks.
    """

    arena: Any
    height: float
    reach: float
    units: np.ndarray
    force_unit: np.ndarray
    step_units: np.ndarray
    pace: float
    leak: float
    leaks: np.ndarray
    steps: int
    tempo: float
    reference: Any = None

    @classmethod
    def of(cls, scene, parameters, step_limit: float, reference: Any = None) -> "Context":
        """Return the context of a task in a `contract.Scene` that prescribes `parameters.Parameters`."""
        body = scene.body
        units = velocity_units(body, parameters.target_velocity)
        leak = min(parameters.gait_frequency * scene.control_timestep, 1.0)
        return cls(
            arena=scene.arena,
            height=body.torso.standing_height,
            reach=units[0] / units[2],
            units=units,
            force_unit=force_unit(body),
            step_units=scene.control_timestep * units,
            pace=float(units[0] * scene.control_timestep),
            leak=leak,
            leaks=np.full(3, leak),
            steps=int(step_limit) if math.isfinite(step_limit) else STEPS,
            tempo=time_unit(body) / scene.control_timestep,
            reference=reference,
        )


def force_unit(body: Body) -> np.ndarray:
    """Return the unit (1, 6) of contact forces; see `Context.force_unit`."""
    pose = measure_standing(body)
    return pose.mass * GRAVITY * np.repeat((pose.height, 1.0), 3)[None]
