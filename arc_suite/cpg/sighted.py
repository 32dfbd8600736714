"""The demonstrator that sees: feet step along paths in space, and land where the scanned ground carries them.

In stance a foot moves against the velocity that is asked for; in swing it goes to where it is to
land, shifted along its way to the nearest foothold. Joint angles follow by inverse kinematics of the
legs, since the shifts are too long for the directions of joints by which the other demonstrators walk.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.cpg import footholds
from arc_suite.cpg.following import Following, phase
from arc_suite.cpg.kinematics import Legs, flows, rises, weights
from arc_suite.cpg.law import blocks, felt, torques
from arc_suite.models.sizing import control_timestep, position_gains, sized
from arc_suite.models.standing import standing
from arc_suite.robots.spec import Body
from arc_suite.tasks.fitting import reach, velocity_units
from arc_suite.tasks.sensors import SCAN
from arc_suite.tasks.walk import Walk


class Tread(NamedTuple):
    """How a demonstrator that sees walks.

    Attributes:
        lift: of a foot in mid-swing, in standing heights.
        ride: height of the torso, in standing heights: lower than one, for feet to reach further.
        gain: of the motion's shortfall, forward, left and turning.
        integral: of the same, a cycle of the gait.
        most: that is asked for, in units of the command.
        attitude: how far a foot is pushed down, as a share of how far the torso's tilt sinks its place.
        lead: of all legs over the gait's clock, cycles.
        longer: swing than the gait prescribes, cycles, since feet follow late.
        trust: from 0 to 1, in the velocity that is asked for against the measured one, whose mean comes
            late, in foreseeing where the torso is when a foot lands.
    """

    lift: float = 0.3
    ride: float = 0.85
    gain: tuple[float, float, float] = (1.0, 1.0, 0.5)
    integral: float = 0.3
    most: float = 1.6
    attitude: float = 0.1
    lead: float = 0.16
    longer: float = 0.08
    trust: float = 1.0


# Of bodies that do not walk as all others; found by trying.
TREADS = {"queen": Tread(ride=0.93), "bastion": Tread(lift=0.35, lead=0.06, longer=0.0), "tick": Tread(trust=0.5)}


_SCANS = 6  # that are remembered
_EARLY = 1.0  # control steps before landing, at which a foot is to be over its foothold
_HELD = 0.1  # cycles before landing, in which its foothold is no longer changed
_ACROSS = 0.3  # how much it matters, beside its way and its height, that a foot does not slip across its way
_DAMPING = 0.02  # of inverse kinematics, in standing heights
_STEPS = 2  # of it in a control step


class _State(NamedTuple):
    """What is remembered of rows.

    Attributes:
        feet: (rows, legs, 3) planned places of the soles, m.
        angles: (rows, legs, links) planned for them, rad.
        shifts: (rows, legs) of where feet land, m.
        heights: (rows, scans, points) the latest scans, in standing heights; -inf before there were any.
        moved: (rows, scans, 2) way of the torso since, m.
    """

    feet: np.ndarray
    angles: np.ndarray
    shifts: np.ndarray
    heights: np.ndarray
    moved: np.ndarray


class Sighted:
    """Follows the block `command` as `Steered` does, over ground that the block `scan` shows, in rows of a batch."""

    def __init__(self, body: Body, tread: Tread):
        """Fit the law to a body.

        Args:
            body: any body.
            tread: how it walks.
        """
        body, self._parts = sized(body), len(body.part_names)
        parameters, pose = Walk.fitted(body, {}).parameters, standing(body)
        self._tread, self._height, self._legs = tread, pose.height, Legs.of(body)
        self._step = control_timestep(body)
        self._cycles = parameters.gait_frequency * self._step  # a control step
        self._stance = parameters.duty_factor / parameters.gait_frequency  # s
        self._duty = parameters.duty_factor - tread.longer
        self._offsets = np.array(parameters.phase_offsets) / (2.0 * np.pi) + tread.lead
        self._units = velocity_units(body, parameters.target_velocity)
        self._reach = reach(body)
        self._stiffness, self._damping = position_gains(body, pose.inertias)
        self._following = Following(tread.gain, tread.integral, self._cycles)
        soles = np.where((True, True, False), pose.soles, -tread.ride * pose.height)
        angles = self._legs.at_ease(soles, np.diag((0.2, 0.2, 1.0)), _DAMPING * tread.ride * pose.height)
        self._places = self._legs.soles(angles)[0]
        scans = np.full((_SCANS, SCAN.shape[1]), -np.inf)
        self._first = _State(self._places, angles, np.zeros(len(angles)), scans, np.zeros((_SCANS, 2)))
        self._state = None

    def begin(self, rows: Sequence[int]) -> None:
        """Start episodes in some rows, given by their indices."""
        self._following.begin(rows)
        if self._state is not None:
            for field, first in zip(self._state, self._first, strict=True):
                field[rows] = first

    def act(self, observation: Mapping[str, np.ndarray]) -> np.ndarray:
        """Return the actions (rows, joints) of a control step; see `Demonstrator.act`."""
        quaternion, angles, velocities = felt(observation, len(self._stiffness), self._parts)
        commanded, clock, motion = blocks(observation, "steer", "command", "gait_clock", "velocities")
        (scan,) = blocks(observation, "rough", "scan")
        rows = len(angles)
        if self._state is None or len(self._state.feet) != rows:
            self._state = _State(*(np.tile(first, (rows, *[1] * first.ndim)) for first in self._first))
        self._remember(scan, motion[:, :2])
        asked, size = self._following.asked(clock, commanded)
        asked = size * asked.clip(-self._tread.most, self._tread.most) * self._units
        cycle = (phase(clock)[:, None] + self._offsets + self._cycles) % 1.0  # at the next control step
        trust = self._tread.trust
        foreseen = trust * asked + (1.0 - trust) * commanded[:, 3:] * self._units
        feet = self._planned(cycle, asked, foreseen, size, quaternion)
        aims = weights(flows(asked, feet), _ACROSS)
        planned = self._legs.reached(self._state.angles, feet, aims, _DAMPING * self._height, _STEPS)
        targets, ahead = self._legs.by_joint(self._state.angles), self._legs.by_joint(planned)
        self._state.feet[:], self._state.angles[:] = feet, planned
        speeds = (ahead - targets) / self._step
        return torques(targets, angles, velocities - speeds, self._stiffness, self._damping)

    def _remember(self, scan, velocity) -> None:
        """Take in a scan (rows, points), and how far the torso has moved at a velocity (rows, 2), m/s."""
        heights, moved = self._state.heights, self._state.moved
        heights[:, 1:] = heights[:, :-1].copy()
        moved[:, 1:] = moved[:, :-1] + velocity[:, None] * self._step
        heights[:, 0], moved[:, 0] = scan, 0.0

    def _planned(self, cycle, asked, foreseen, size, quaternion) -> np.ndarray:
        """Places (rows, legs, 3) of the soles at the next control step, m.

        Args:
            cycle: (rows, legs) phases of the legs then.
            asked: (rows, 3) velocity, m/s and rad/s.
            foreseen: (rows, 3) velocity until feet land.
            size: (rows, 1) of the gait.
            quaternion: (rows, 4) of the torso.
        """
        feet, stands = self._state.feet, cycle < self._duty
        left = np.where(stands, 0.0, (1.0 - cycle) / self._cycles)  # control steps from then to landing
        early = np.minimum(left, _EARLY)
        drift = flows(foreseen, self._places) * self._step  # of the torso over the ground, a control step
        goal = self._landing(asked, drift * (left + 1.0)[..., None], stands | (left + 1.0 < _HELD / self._cycles))
        goal += drift * early[..., None]
        swung = feet[..., :2] + (goal - feet[..., :2]) / (np.floor(left - early) + 1.0)[..., None]
        stood = (cycle / self._cycles).clip(max=1.0)[..., None]  # control steps, at most the latest
        stood = feet[..., :2] - flows(asked, feet) * self._step * stood
        tilt = rises(rotations.matrix(quaternion)[:, 2], self._places)  # by the world's vertical in the torso's frame
        progress = ((cycle - self._duty) / (1.0 - self._duty)).clip(0.0)
        lift = size * self._tread.lift * self._height * np.sin(np.pi * progress)
        heights = self._places[:, 2] + lift + self._tread.attitude * tilt
        return np.concatenate([np.where(stands[..., None], stood, swung), heights[..., None]], axis=-1)

    def _landing(self, asked, moved, held) -> np.ndarray:
        """Where feet land (rows, legs, 2), m from where the torso is when they do.

        Args:
            asked: (rows, 3) velocity, m/s and rad/s.
            moved: (rows, legs, 2) way of the torso until then, at the feet, m.
            held: (rows, legs) whether what was chosen stays.
        """
        half = 0.5 * self._stance * flows(asked, self._places)
        along = half / np.maximum(np.hypot(half[..., 0], half[..., 1]), 1e-9)[..., None]
        landing, shifts = self._places[:, :2] + half, self._state.shifts
        view = footholds.View(self._state.heights, self._state.moved, self._reach)
        found = footholds.shifts(view, landing + moved, along, self._places[:, :2], self._height)
        shifts[:] = np.where(held, shifts, found)
        return landing + shifts[..., None] * along
