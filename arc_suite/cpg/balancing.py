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
        feet: positions of the soles at rest, for each rank of legs from the front: forward, outward and
            up from the torso, in standing heights; None for those of the standing pose.
        lift: height of a foot in mid-swing, in standing heights.
        gain: gain of the feedback on the motion's error: forward, left and turning.
        integral: gain of the same error, added up over a cycle of the gait.
        most: largest request, in units of the command.
        shorter: time by which the stance is shorter than in the task's gait, cycles.
        lead: lead of all legs over the gait's clock, cycles.
        attitude: how far a foot is pushed down, as a share of how far the torso's tilt lowers the foot's rest.
        lean: shift of footholds, as a share of the distance by which the torso's weight falls aside of the feet.
        capture: shift of footholds, as a share of the distance that an unwanted velocity carries an inverted
            pendulum.
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


_SLOWING_TILT = 0.3  # sine of the torso's tilt above which it walks slower; at twice as much it stops
_TAKE_OFF_SHARE = 0.6  # share of the shift for balance that is left when a foot takes off


class Balanced(Stepping):
    """Follows a command, and keeps its balance by where it steps."""

    def __init__(self, task: Task, parameters: BalancingParameters):
        """Fit the law to a task; see `CommandLaw`.

        Raises:
            ValueError: `feet` is for another number of ranks of legs.
        """
        body = task.scene.body
        rank_count = max(body.ranks) + 1
        if parameters.feet is not None and len(parameters.feet) != rank_count:
            raise ValueError(
                f"preset: {body.name} has {rank_count} ranks of legs, and feet is for {len(parameters.feet)}"
            )
        super().__init__(task, parameters)
        self.stance_reduction = parameters.shorter
        self.tilt_share = parameters.attitude
        self.max_request = parameters.most
        self.duty_factor -= parameters.shorter
        self.stance_duration = self.duty_factor / gait_of(task).frequency
        self._ride_height = -self.rest_soles[:, 2].mean()  # m
        self._pendulum_time = math.sqrt(self._ride_height / GRAVITY)  # s, of an inverted pendulum of this height

    def _find_rest(self, task: Task) -> tuple[Legs, np.ndarray, np.ndarray]:
        body = task.scene.body
        feet_by_rank = self.parameters.feet
        if feet_by_rank is None:
            rest_soles = self.mechanics.soles.copy()
        else:
            rest_soles = np.array([feet_by_rank[rank] for rank in body.ranks]) * self.mechanics.height
            rest_soles[:, 1] *= [1.0 if leg.side == "left" else -1.0 for leg in body.legs]
        legs = Legs.of(self.body, posture.JOINT_RANGE_SHARE)
        return legs, rest_soles, legs.relaxed_joint_angles(rest_soles, np.eye(3), self._ik_damping)

    def balance(self, motion, vertical, observation: Mapping) -> tuple:
        """Return the velocity that feet give the torso, and shifts of footholds; see `Stepping`."""
        xp = motion.__array_namespace__()
        full_velocity, _ = super().balance(motion, vertical, observation)
        tilt = xp.hypot(vertical[:, :1], vertical[:, 1:2])  # sine of its angle
        velocity = full_velocity * (2.0 - tilt / _SLOWING_TILT).clip(0.0, 1.0)
        commanded_velocity = observation["command"][:, :2] * self.units[:2]  # m/s
        unwanted_velocity = observation["velocities"][:, :2] - commanded_velocity
        capture_shift = self.parameters.capture * self._pendulum_time * unwanted_velocity
        lean_shift = self.parameters.lean * self._ride_height * vertical[:, :2]
        return velocity, capture_shift - lean_shift

    def _shift_share(self, path_position):
        return _TAKE_OFF_SHARE + (1.0 - _TAKE_OFF_SHARE) * 0.5 * (1.0 + path_position)
