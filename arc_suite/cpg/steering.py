"""Demonstrators that feel: one law for any body that follows a command of velocities.

Each foot on the ground is to move, relative to the torso, against the velocity that is asked for
where it stands; in swing it returns and is lifted. Both are directions in a leg's joint space,
found by damped least squares at a neutral pose that leaves every joint room to both sides. What is
asked for is the command, corrected by how the measured motion falls short of it.
"""

import functools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import robots, rotations
from arc_suite.cpg.following import Following, phase
from arc_suite.cpg.kinematics import flows, rises
from arc_suite.cpg.law import blocks, felt, torques
from arc_suite.cpg.stride import lifted
from arc_suite.models.sizing import control_timestep, position_gains, sized
from arc_suite.models.standing import Standing, standing
from arc_suite.robots.spec import Body
from arc_suite.tasks.fitting import velocity_units
from arc_suite.tasks.walk import Walk


class Manner(NamedTuple):
    """How a steering demonstrator walks.

    Attributes:
        lift: of a foot in mid-swing, in standing heights.
        gain: of the motion's shortfall, forward, left and turning.
        integral: of the same, a cycle of the gait.
        attitude: how far the low side of the torso is pushed up, rad of lift per rad of tilt.
    """

    lift: float
    gain: tuple[float, float, float]
    integral: float
    attitude: float


STEERING = {
    "steered": Manner(lift=0.2, gain=(1.0, 1.0, 0.5), integral=0.3, attitude=0.0),
    "surefooted": Manner(lift=0.45, gain=(2.0, 2.0, 1.0), integral=0.6, attitude=0.3),
}


class Build(NamedTuple):
    """Numbers of the law that depend on how a body is built.

    Attributes:
        share: of a joint's range that the neutral pose leaves to either side.
        level: how much it matters that a foot does not rise or sink in stance.
        sweep: most that a joint is swept to either side, rad.
        unload: of the standing height, by which a leg is held up that cannot sweep as asked.
        lead: of all legs over the gait's clock, cycles.
    """

    share: float = 0.25
    level: float = 4.0
    sweep: float = 0.5
    unload: float = 0.1
    lead: float = 0.0


BUILDS = {
    "queen": Build(lead=0.12),
    "bastion": Build(lead=0.08),
    "tick": Build(lead=0.1),
    "leaper": Build(share=0.03, level=1.0, sweep=0.8, unload=0.0, lead=0.04),
}

_ACROSS = 0.1  # how much it matters that a foot does not slip across its way
_DAMPING = 0.1  # of the leg's largest Jacobian entry, for a joint with room for _ROOM
_ROOM = 0.5  # rad


class _Leg(NamedTuple):
    """A leg in the neutral pose.

    Attributes:
        joints: (n,) indices.
        jacobian: (3, n) of the sole.
        foot: (2,) place of the sole, from the centre of mass, m.
        room: (n,) to either side for sweeping, rad.
        lift: (n,) angles in mid-swing, rad.
        offset: cycles, over the clock.
    """

    joints: np.ndarray
    jacobian: np.ndarray
    foot: np.ndarray
    room: np.ndarray
    lift: np.ndarray
    offset: float


class Steered:
    """Follows the block `command` of a task in the rows of a batch, by the gait that the block `gait_clock` tells.

    Attributes:
        extent: of the feet from the centre of mass in the neutral pose, m.
    """

    def __init__(self, body: Body, manner: Manner, build: Build | None = None):
        """Fit the law to a body.

        Args:
            body: any body.
            manner: how it walks, one of `STEERING` or numbers of one's own.
            build: numbers for a body of another build; None for those of its name, or the usual ones.
        """
        self._manner = manner
        build = build or robots.row(BUILDS, body, "steering") or Build()
        body, self._parts = sized(body), len(body.part_names)
        parameters = Walk.fitted(body, {}).parameters
        self._duty, self._unload = parameters.duty_factor, build.unload / self._manner.lift
        self._neutral = _neutral(body, build.share)
        pose = standing(body, tuple(self._neutral))
        self._legs = _legs(body, pose, self._neutral, build, self._manner, parameters.phase_offsets)
        self._level, self._height = build.level, pose.height
        step = control_timestep(body)
        self._cycles = parameters.gait_frequency * step  # a control step
        self._step = step
        self._stance = parameters.duty_factor / parameters.gait_frequency  # s
        self._units = velocity_units(body, parameters.target_velocity)
        self._stiffness, self._damping = position_gains(body, pose.inertias)
        self._following = Following(manner.gain, manner.integral, self._cycles)
        self._feet = np.array([leg.foot for leg in self._legs])
        self.extent = float(max(np.hypot(*self._feet.T) + [leg.foot.radius for leg in body.legs]))

    def begin(self, rows: Sequence[int]) -> None:
        """Start episodes in some rows, given by their indices."""
        self._following.begin(rows)

    def act(self, observation: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the actions (rows, joints) of a control step; see `Demonstrator.act`."""
        quaternion, angles, velocities = felt(observation, len(self._neutral), self._parts)
        commanded, clock = blocks(observation, "steer", "command", "gait_clock")
        asked, size = self._following.asked(clock, commanded)
        sweeps, raised, lifts = self._directions(asked * self._units, quaternion)
        now = phase(clock)
        targets, ahead = (size * (raised + self._swung(at, sweeps, lifts)) for at in (now, now + self._cycles))
        speeds = (ahead - targets) / self._step
        return torques(self._neutral + targets, angles, velocities - speeds, self._stiffness, self._damping)

    def _directions(self, asked, quaternion):
        """Sweeps, raised poses and lifts of all joints, (rows, joints) each."""
        shape = (len(asked), len(self._neutral))
        sweeps, raised, lifts = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        ways = 0.5 * self._stance * flows(asked, self._feet)
        # The low side of the torso is pushed up: its feet go down.
        lows = -rises(rotations.matrix(quaternion)[:, 2], self._feet) / self._height
        for index, leg in enumerate(self._legs):
            sweep, able = _sweep(leg, ways[:, index], self._level)
            sweeps[:, leg.joints] = sweep
            low = lows[:, index : index + 1]
            raised[:, leg.joints] = ((1.0 - able) * self._unload - self._manner.attitude * low) * leg.lift
            lifts[:, leg.joints] = leg.lift
        return sweeps, raised, lifts

    def _swung(self, phase, sweeps, lifts) -> np.ndarray:
        """Departures (rows, joints) from the neutral pose at phases (rows,) of the clock, cycles."""
        targets = np.zeros_like(sweeps)
        for leg in self._legs:
            cycle = (phase + leg.offset) % 1.0
            stands = cycle < self._duty
            progress = np.where(stands, cycle / self._duty, (cycle - self._duty) / (1.0 - self._duty))[:, None]
            stands = stands[:, None]
            swept = np.where(stands, 1.0 - 2.0 * progress, 2.0 * progress - 1.0) * sweeps[:, leg.joints]
            lifted = np.where(stands, 0.0, np.sin(np.pi * progress)) * lifts[:, leg.joints]
            targets[:, leg.joints] = swept + lifted
        return targets


def _sweep(leg: _Leg, way, level: float):
    """Joint angles (rows, n) that move a foot by a way (rows, 2), and which share (rows, 1) of it they manage."""
    length = np.hypot(way[:, 0], way[:, 1])[:, None]
    along = way / np.maximum(length, 1e-9)
    frame = np.zeros((len(way), 3, 3))
    frame[:, 0, :2] = along
    frame[:, 1, 0], frame[:, 1, 1] = -_ACROSS * along[:, 1], _ACROSS * along[:, 0]
    frame[:, 2, 2] = level
    weighted = frame @ leg.jacobian
    damping = np.diag((_DAMPING * abs(leg.jacobian).max() * _ROOM / leg.room) ** 2)
    turned = np.swapaxes(weighted, -1, -2)
    angles = np.linalg.solve(turned @ weighted + damping, turned[..., :1] * length[..., None])[..., 0]
    moved = (weighted @ angles[..., None])[..., 0]
    angles *= moved[:, :1] * length / np.maximum((moved**2).sum(axis=-1, keepdims=True), 1e-12)
    angles *= np.minimum(1.0, (leg.room / np.maximum(abs(angles), 1e-12)).min(axis=-1, keepdims=True))
    # A product of each row by itself: one of all rows would round as their number has it.
    reached = (along * (leg.jacobian[:2] @ angles[..., None])[..., 0]).sum(axis=-1, keepdims=True)
    return angles, np.where(length > 1e-9, reached / np.maximum(length, 1e-9), 1.0).clip(0.0, 1.0)


def _ranges(body: Body) -> np.ndarray:
    """Bounds (2, joints) of the joints, rad."""
    return np.radians([joint.range_deg for leg in body.legs for joint in leg.joints]).T


@functools.lru_cache(maxsize=64)
def _neutral(body: Body, share: float) -> np.ndarray:
    """A pose (joints,) whose feet are level and whose joints have a share of their range to either side, rad."""
    low, high = _ranges(body)
    low, high = low + share * (high - low), high - share * (high - low)
    angles = np.zeros_like(low).clip(low, high)
    for _ in range(50):
        pose, first = standing(body, tuple(angles)), 0
        aim = np.median(pose.soles[:, 2])
        for leg, jacobian, sole in zip(body.legs, pose.jacobians, pose.soles, strict=True):
            last, rise = first + len(leg.joints), jacobian[2]
            angles[first:last] += 0.5 * (aim - sole[2]) * rise / max(rise @ rise, 1e-6 * pose.height**2)
            first = last
        angles = angles.clip(low, high)
    return angles


def _legs(body: Body, pose: Standing, neutral, build: Build, manner: Manner, offsets) -> list[_Leg]:
    low, high = _ranges(body) - neutral
    legs, first = [], 0
    for leg, jacobian, sole, offset in zip(body.legs, pose.jacobians, pose.soles, offsets, strict=True):
        joints = np.arange(first, first + len(leg.joints))
        first = joints[-1] + 1
        below, above = -0.95 * low[joints], 0.95 * high[joints]
        legs.append(
            _Leg(
                joints,
                jacobian,
                (sole - pose.centre)[:2],
                np.minimum(np.minimum(below, above), build.sweep).clip(1e-3),
                lifted(jacobian, manner.lift * pose.height, below, above),
                offset / (2.0 * np.pi) + build.lead,
            )
        )
    return legs
