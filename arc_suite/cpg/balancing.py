"""The demonstrator `balanced`: feet step along paths in space, towards where the body tips.

On ground that tilts it, a body of few legs lands its feet aside of the footholds of the command alone:
by the distance that its weight falls aside of its feet, and by the distance that an unwanted velocity
carries it, as in the capture point of a linear inverted pendulum (Pratt et al., "Capture point: a step
toward humanoid push recovery", 2006) or Raibert's foothold ("Legged robots that balance", 1986). Joint
angles follow by inverse kinematics, which folds legs that stand near the bounds of their joints, where
no direction of joints lifts a foot.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.cpg.gait import gait_of
from arc_suite.cpg.stepping import Stepping
from arc_suite.models import posture
from arc_suite.models.kinematics import Legs
from arc_suite.models.standing import GRAVITY
from arc_suite.tasks.contract import Task


class BalancingParameters(NamedTuple):
    """How a demonstrator that keeps its balance walks.

    Attributes:
        feet: places of the soles at ease, for each rank of legs from the front: forward, outward and
            up from the torso, in standing heights; None for those of the standing pose.
        lift: of a foot in mid-swing, in standing heights.
        gain: of the motion's error, forward, left and turning.
        integral: of the same, a cycle of the gait.
        most: largest request, in units of the command.
        shorter: stance than the gait prescribes, cycles.
        lead: of all legs over the gait's clock, cycles.
        attitude: how far a foot is pushed down, as a share of how far the torso's tilt sinks its place.
        lean: share of the distance by which the torso's weight falls aside of the feet, by which they follow.
        capture: share of the distance that an unwanted velocity carries an inverted pendulum, by which
            feet follow.
    """

    feet: tuple[tuple[float, float, float], ...] | None = None
    lift: float = 0.2
    gain: tuple[float, float, float] = (0.3, 0.3, 0.3)
    integral: float = 0.1
    most: float = 1.4
    shorter: float = 0.0
    lead: float = 0.0
    attitude: float = 0.0
    lean: float = 0.0
    capture: float = 0.45


_STEEP = 0.3  # sine of the torso's tilt above which it walks slower; at twice as much it stops
_KEPT = 0.6  # share of the shift for balance that is left when a foot takes off


class Balanced(Stepping):
    """Follows a command, and keeps its balance by where it steps."""

    def __init__(self, task: Task, parameters: BalancingParameters):
        """Fit the law to a task; see `CommandLaw`.

        Raises:
            ValueError: `feet` is for another number of ranks of legs.
        """
        body, feet = task.scene.body, parameters.feet
        if feet is not None and len(feet) != (ranks := max(body.ranks) + 1):
            raise ValueError(f"preset: {body.name} has {ranks} ranks of legs, and feet is for {len(feet)}")
        super().__init__(task, parameters)
        self.shorter, self.attitude, self.most = parameters.shorter, parameters.attitude, parameters.most
        self.duty_factor -= parameters.shorter
        self.stance_duration = self.duty_factor / gait_of(task).frequency
        self._ride = -self.rest_soles[:, 2].mean()
        self._fall = math.sqrt(self._ride / GRAVITY)  # s, of an inverted pendulum as high

    def _eased(self, task: Task) -> tuple:
        body, feet, places = task.scene.body, self.parameters.feet, self.pose.soles.copy()
        if feet is not None:
            places = np.array([feet[rank] for rank in body.ranks]) * self.pose.height
            places[:, 1] *= [1.0 if leg.side == "left" else -1.0 for leg in body.legs]
        legs = Legs.of(self.body, posture.JOINT_RANGE_SHARE)
        return legs, places, legs.relaxed_joint_angles(places, np.eye(3), self._damping)

    def balance(self, motion, vertical, observation: Mapping) -> tuple:
        """Return the velocity that feet give, and shifts of footholds; see `Stepping`."""
        numpy, p = motion.__array_namespace__(), self.parameters
        motion, _ = super().balance(motion, vertical, observation)
        motion = motion * (2.0 - numpy.hypot(vertical[:, :1], vertical[:, 1:2]) / _STEEP).clip(0.0, 1.0)
        surplus = observation["velocities"][:, :2] - observation["command"][:, :2] * self.units[:2]
        return motion, p.capture * self._fall * surplus - p.lean * self._ride * vertical[:, :2]

    def _kept(self, along):
        return _KEPT + (1.0 - _KEPT) * 0.5 * (1.0 + along)
