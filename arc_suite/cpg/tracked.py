"""The demonstrator `tracked`: holds the poses of a motion by position control, with the torques that carry the weight.

It shows whether a motion is within the reach of the motors. Nothing balances the torso.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.cpg.drives import drive
from arc_suite.cpg.law import Clock, proprioception
from arc_suite.models.sizing import size_body
from arc_suite.models.standing import measure_standing, mechanics_of_poses
from arc_suite.tasks.contract import Task
from arc_suite.tasks.motion_tables import MotionTables, split_next_angles


class TrackingParameters(NamedTuple):
    """How a demonstrator follows a motion.

    Attributes:
        stiffness: multiple of the stiffness of position control; the damping stays critical.
    """

    stiffness: float = 1.0


class Tracked:
    """Follows the motion of the task `mimic`."""

    reads: tuple[str, ...] = ("posture", "velocities", "motion", "next_poses")

    def __init__(self, task: Task, parameters: TrackingParameters):
        """Fit the law to a task, whose body loads its joints in every pose as it carries its weight.

        Raises:
            ValueError: the task has no motion.
        """
        tables = getattr(task.unwrapped, "tables", None)
        if not isinstance(tables, MotionTables):
            raise ValueError(f"task {task.name}: `tracked` follows the motion of a task, such as mimic")
        body = size_body(task.scene.body)
        self._drive = drive(body, measure_standing(body).inertias).stiffen(parameters.stiffness)
        self._tables = tables
        self._control_timestep = task.scene.control_timestep
        torques = np.array([joint.torque for joint in body.joints])
        mechanics = mechanics_of_poses(body, zip(tables.angles, tables.planted, strict=True))
        self._loads = np.stack([pose.loads for pose in mechanics]) / torques  # (rows, joints)

    def initial(self, count: int) -> Clock:
        """Return the state at the start of episodes in a number of environments."""
        return Clock(np.zeros(count, int))

    def __call__(self, state: Clock, observation: Mapping) -> tuple:
        """Return the next state and the actions (environments, joints); see `law`."""
        _, angles, velocities = proprioception(observation)
        first, second = split_next_angles(observation["next_poses"], angles.shape[-1])
        speeds = (second - first) / self._control_timestep
        xp = angles.__array_namespace__()
        loads = xp.asarray(self._loads)[self._row(observation["motion"])]
        return Clock(state.steps + 1), self._drive.actions(first, speeds, angles, velocities, loads)

    def _row(self, block):
        """Return the row (environments,) of the next control step, given the block `motion`."""
        tables = self._tables
        xp = block.__array_namespace__()
        motion = block[:, 3:].argmax(axis=-1) if len(tables.counts) > 1 else xp.zeros(len(block), dtype=int)
        share = xp.arctan2(block[:, 0], block[:, 1]) / (2.0 * np.pi) % 1.0  # of the cycle
        counts = xp.asarray(tables.counts)[motion]
        tick = xp.round(share * counts).astype(int) % counts
        side = (block[:, 2] < 0.0).astype(int)
        return xp.asarray(tables.starts)[motion] + tick + side * tables.mirror_offset + 1
