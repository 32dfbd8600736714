"""Base of the tasks that prescribe a gait: its clock, and the work of the motors in it."""

import functools

import numpy as np

from arc_suite.tasks import energy
from arc_suite.tasks.clock import Clock
from arc_suite.tasks.contract import Task
from arc_suite.tasks.energy import Energy
from arc_suite.tasks.parameters import Parameters
from arc_suite.tasks.readings import Readings


class GaitTask(Task):
    """A task whose settings have a field `parameters`, the prescribed gait."""

    @functools.cached_property
    def parameters(self) -> Parameters:
        """The prescribed gait."""
        return self.settings.parameters

    @functools.cached_property
    def clock(self) -> Clock:
        """The clock of the prescribed gait."""
        gait = self.parameters
        return Clock.make(
            gait.gait_frequency, gait.duty_factor, gait.phase_offsets, self.scene.control_timestep, self.step_limit
        )

    @functools.cached_property
    def _torques(self) -> np.ndarray:
        """(joints,) greatest torques over the weight, m."""
        return energy.torques(self.scene.body)

    @functools.cached_property
    def _heat(self) -> np.ndarray:
        """(joints,) heat of a control step at the greatest torques over the weight, m."""
        return energy.heat(self.scene.body)

    def add_work(self, work: Energy, action, readings: Readings) -> Energy:
        """Return the memory of the motors' work after a control step, given its action (..., joints)."""
        efforts = readings.effort(action)  # (..., joints) torques as shares of the largest
        return energy.after(work, self._torques, self._heat, efforts, readings.joint_angles)
