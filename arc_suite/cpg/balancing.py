"""The demonstrator that keeps its balance: feet step along paths in space, towards where the body tips.

On ground that tilts it, a body of few legs lands its feet beside where the command alone would have
them: by the way that its weight falls aside of its feet, and by how far it is carried on by a velocity
that is not asked for, as in the capture point of a linear inverted pendulum (Pratt et al., "Capture
point: a step toward humanoid push recovery", 2006) or Raibert's foothold ("Legged robots that
balance", 1986). Joint angles follow by inverse kinematics, which folds legs that stand near the
bounds of their joints, where no direction of joints lifts a foot.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.cpg.following import Following, phase
from arc_suite.cpg.kinematics import Legs, flows, rises, weights
from arc_suite.cpg.law import blocks, felt, torques
from arc_suite.models.sizing import GRAVITY, control_timestep, position_gains, sized
from arc_suite.models.standing import standing
from arc_suite.robots.spec import Body
from arc_suite.tasks.fitting import velocity_units
from arc_suite.tasks.walk import Walk


class Balance(NamedTuple):
    """How a demonstrator that keeps its balance walks.

    Attributes:
        feet: places of the soles at ease, for each rank of legs from the front: forward, outward and
            up from the torso, in standing heights.
        lift: of a foot in mid-swing, in standing heights.
        gain: of the motion's shortfall, forward, left and turning.
        integral: of the same, a cycle of the gait.
        most: that is asked for, in units of the command.
        shorter: stance than the gait prescribes, cycles.
        lead: of all legs over the gait's clock, cycles.
        attitude: how far a foot is pushed down, as a share of how far the torso's tilt sinks its place.
        lean: share, of the way by which the torso's weight falls aside of the feet, by which they follow.
        capture: share, of the way by which a velocity that is not asked for carries an inverted
            pendulum on, by which feet follow.
    """

    feet: tuple[tuple[float, float, float], ...]
    lift: float
    gain: tuple[float, float, float]
    integral: float
    most: float
    shorter: float
    lead: float
    attitude: float
    lean: float
    capture: float


# Of robots that have the preset `balanced`; found by trying.
BALANCES = {
    "leaper": Balance(
        feet=((0.59, 0.9, -0.62), (-0.55, 0.64, -0.64)),
        lift=0.32,
        gain=(0.5, 0.3, 0.5),
        integral=0.5,
        most=1.2,
        shorter=0.06,
        lead=0.06,
        attitude=0.3,
        lean=0.5,
        capture=0.45,
    )
}

_STEEP = 0.3  # sine of the torso's tilt above which it walks slower; at twice as much it stops
_KEPT = 0.6  # share of the shift for balance that is left when a foot takes off
_ACROSS = 1.0  # how much it matters, beside its way and its height, that a foot does not slip across its way
_USED = 0.98  # share of a joint's range, about its middle, that targets may use
_DAMPING = 0.02  # of inverse kinematics, in standing heights
_STEPS = 3  # of it in a control step


class Balanced:
    """Follows the block `command` as `Steered` does, and catches itself by where it steps, in rows of a batch."""

    def __init__(self, body: Body, balance: Balance):
        """Fit the law to a body.

        Args:
            body: any body with as many ranks of legs as `balance` has places for.
            balance: how it walks.
        """
        body, self._parts = sized(body), len(body.part_names)
        parameters, pose = Walk.fitted(body, {}).parameters, standing(body)
        self._balance, self._legs = balance, Legs.of(body, _USED)
        self._step, self._height = control_timestep(body), pose.height
        self._cycles = parameters.gait_frequency * self._step  # a control step
        self._duty = parameters.duty_factor - balance.shorter
        self._stance = self._duty / parameters.gait_frequency  # s
        self._offsets = np.array(parameters.phase_offsets) / (2.0 * np.pi) + balance.lead
        self._units = velocity_units(body, parameters.target_velocity)
        self._stiffness, self._damping = position_gains(body, pose.inertias)
        self._following = Following(balance.gain, balance.integral, self._cycles)
        self._places = np.array([balance.feet[rank] for rank in body.ranks]) * pose.height
        self._places[:, 1] *= [1.0 if leg.side == "left" else -1.0 for leg in body.legs]
        self._ride = -self._places[:, 2].mean()
        self._fall = math.sqrt(self._ride / GRAVITY)  # s, of an inverted pendulum as high
        self._first = self._legs.at_ease(self._places, np.eye(3), _DAMPING * pose.height)
        self._angles = None

    def begin(self, rows: Sequence[int]) -> None:
        """Start episodes in some rows, given by their indices."""
        self._following.begin(rows)
        if self._angles is not None:
            self._angles[rows] = self._first

    def act(self, observation: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the actions (rows, joints) of a control step; see `Demonstrator.act`."""
        quaternion, angles, velocities = felt(observation, len(self._stiffness), self._parts)
        commanded, clock, motion = blocks(observation, "steer", "command", "gait_clock", "velocities")
        if self._angles is None or len(self._angles) != len(angles):
            self._angles = np.tile(self._first, (len(angles), 1, 1))
        asked, size = self._following.asked(clock, commanded)
        asked = asked.clip(-self._balance.most, self._balance.most) * self._units
        vertical = rotations.matrix(quaternion)[:, 2]  # the world's, in the torso's frame
        asked *= (2.0 - np.hypot(vertical[:, :1], vertical[:, 1:2]) / _STEEP).clip(0.0, 1.0)
        surplus = motion[:, :2] - commanded[:, :2] * self._units[:2]
        shift = self._balance.capture * self._fall * surplus - self._balance.lean * self._ride * vertical[:, :2]
        cycle = (phase(clock)[:, None] + self._offsets + self._cycles) % 1.0  # at the next control step
        feet = self._planned(cycle, asked, shift, size, vertical)
        aims = weights(flows(asked, self._places), _ACROSS)
        planned = self._legs.reached(self._angles, feet, aims, _DAMPING * self._height, _STEPS)
        targets, ahead = self._legs.by_joint(self._angles), self._legs.by_joint(planned)
        self._angles[:] = planned
        speeds = (ahead - targets) / self._step
        return torques(targets, angles, velocities - speeds, self._stiffness, self._damping)

    def _planned(self, cycle, asked, shift, size, vertical) -> np.ndarray:
        """Places (rows, legs, 3) of the soles at the next control step, m.

        Args:
            cycle: (rows, legs) phases of the legs then.
            asked: (rows, 3) velocity, m/s and rad/s.
            shift: (rows, 2) of footholds for the sake of balance, m.
            size: (rows, 1) of the gait.
            vertical: (rows, 3) the world's, in the torso's frame.
        """
        stands, swung = cycle < self._duty, ((cycle - self._duty) / (1.0 - self._duty)).clip(0.0)
        along = np.where(stands, 1.0 - 2.0 * cycle / self._duty, 2.0 * swung - 1.0)[..., None]  # from 1 to -1 in stance
        half = 0.5 * self._stance * flows(asked, self._places)
        kept = _KEPT + (1.0 - _KEPT) * 0.5 * (1.0 + along)
        ground = self._places[:, :2] + size[..., None] * (along * half + kept * shift[:, None])
        lift = self._balance.lift * self._height * np.sin(np.pi * swung)
        heights = self._places[:, 2] + size * (lift + self._balance.attitude * rises(vertical, self._places))
        return np.concatenate([ground, heights[..., None]], axis=-1)
