"""The demonstrator `sighted`: feet step along paths in space, and land where the scanned ground carries them.

In stance a foot moves against the requested velocity; in swing it goes to its foothold, shifted along
its path to the nearest ground. Joint angles follow by inverse kinematics of the legs: the shifts are
too long for the directions of joints by which the law of `steering` walks.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.cpg import footholds
from arc_suite.cpg.command_law import CommandLaw, Request, read_vertical
from arc_suite.models import foot_paths, posture
from arc_suite.models.kinematics import Legs, path_weights, point_velocities, tilt_heights
from arc_suite.tasks.contract import Task
from arc_suite.tasks.fitting import reach
from arc_suite.tasks.sensors import SCAN


class SightedParameters(NamedTuple):
    """How a demonstrator that sees walks.

    Attributes:
        lift: height of a foot in mid-swing, in standing heights.
        ride: height of the torso, in standing heights: lower than one, for feet to reach further.
        gain: gain of the feedback on the motion's error: forward, left and turning.
        integral: gain of the same error, added up over a cycle of the gait.
        most: largest request, in units of the command.
        attitude: how far a foot is pushed down, as a share of how far the torso's tilt lowers the foot's rest.
        lead: lead of all legs over the gait's clock, cycles.
        longer: time by which the swing is longer than in the task's gait, cycles, since feet follow late.
        trust: weight of the requested velocity against the measured one, from 0 to 1, in the prediction of
            where the torso is when a foot lands. The mean of the measured velocity comes late.
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


_SCAN_COUNT = 6  # scans that are remembered
_ARRIVAL_STEPS = 1.0  # control steps before landing at which a foot is to be over its foothold
_FIXED_CYCLES = 0.1  # cycles before landing in which a foothold is no longer changed
_SLIP_WEIGHT = 0.3  # of a foot's slip across its path against its motion along it
_REST_WEIGHTS = np.diag((0.2, 0.2, 1.0))  # of errors of soles forward, left and up, in the search for angles at rest
_IK_ITERATIONS = 2  # of inverse kinematics in a control step


class SightedState(NamedTuple):
    """What this law adds to the state of a `CommandLaw`.

    Attributes:
        feet: (environments, legs, 3) planned positions of the soles, m.
        angles: (environments, legs, links) planned for them, rad.
        shifts: (environments, legs) shifts of the footholds, m.
        heights: (environments, scans, points) the latest scans, in standing heights; -inf before there were any.
        moved: (environments, scans, 2) displacement of the torso since each scan, m.
    """

    feet: np.ndarray
    angles: np.ndarray
    shifts: np.ndarray
    heights: np.ndarray
    moved: np.ndarray


class Sighted(CommandLaw):
    """Follows a command over ground that the block `scan` shows.

    Attributes:
        legs: their kinematics.
        rest_soles: (legs, 3) positions of the soles at rest, m.
        support_points: (n,) along a foot's path, from its foothold, standing heights: all must have ground.
    """

    support_points = footholds.SUPPORT_POINTS
    reads = (*CommandLaw.reads, "scan")

    def __init__(self, task: Task, parameters: SightedParameters):
        """Fit the law to a task; see `CommandLaw`."""
        super().__init__(task, parameters)
        self.duty_factor -= parameters.longer
        self.legs = Legs.of(self.body)
        self._reach = reach(self.body)
        ride_height = parameters.ride * self.mechanics.height  # m
        sole_goals = np.where((True, True, False), self.mechanics.soles, -ride_height)
        rest_angles = self.legs.relaxed_joint_angles(sole_goals, _REST_WEIGHTS, posture.IK_DAMPING * ride_height)
        self.rest_soles, _ = self.legs.soles(rest_angles)
        self._first_state = SightedState(
            feet=self.rest_soles,
            angles=rest_angles,
            shifts=np.zeros(len(rest_angles)),
            heights=np.full((_SCAN_COUNT, SCAN.shape[1]), -np.inf),
            moved=np.zeros((_SCAN_COUNT, 2)),
        )

    def initial_paths(self, count: int) -> SightedState:
        """Return feet at rest and no scans, for a number of environments."""
        return SightedState(*(np.tile(array, (count, *[1] * array.ndim)) for array in self._first_state))

    def follow_request(self, state: SightedState, request: Request, observation: Mapping) -> tuple:
        """Return the next state, target angles (environments, joints), rad, and their change; see `CommandLaw`."""
        parameters = self.parameters
        state = self._add_scan(state, observation["scan"], observation["velocities"][:, :2])
        velocity = request.size * request.motion.clip(-parameters.most, parameters.most) * self.units
        measured_motion = observation["command"][:, 3:]  # units of the command
        trust = parameters.trust
        predicted_velocity = trust * velocity + (1.0 - trust) * measured_motion * self.units
        leg_phases = (request.phase[:, None] + self.phase_offsets + request.advance[:, None]) % 1.0
        vertical = read_vertical(observation)
        feet, shifts = self._next_feet(state, leg_phases, velocity, predicted_velocity, request.size, vertical)
        weights = path_weights(point_velocities(velocity, feet), _SLIP_WEIGHT)
        damping = posture.IK_DAMPING * self.mechanics.height
        angles = self.legs.solve_joint_angles(state.angles, feet, weights, damping, _IK_ITERATIONS)
        angles = self.legs.relax_redundant_joints(angles, self._first_state.angles, foot_paths.RELAXING_SHARE, damping)
        angles = self.correct_bends(angles)
        targets = self.legs.by_joint(state.angles)
        changes = self.legs.by_joint(angles) - targets
        return state._replace(feet=feet, angles=angles, shifts=shifts), targets, changes

    def correct_bends(self, angles):
        """Return angles (environments, legs, links), with the angles at rest for legs that bend the other way.

        Legs of three links that are stretched out may bend either way next, and stay so.
        """
        if angles.shape[-1] != 3:
            return angles
        xp = angles.__array_namespace__()
        rest_angles = self._first_state.angles
        # The sign of a Jacobian's determinant changes where a leg is stretched out.
        bend = xp.linalg.det(self.legs.soles(angles)[1])
        rest_bend = xp.linalg.det(self.legs.soles(rest_angles)[1])
        bends_other_way = bend * rest_bend < 0.0
        return xp.where(bends_other_way[..., None], rest_angles, angles)

    def _add_scan(self, state: SightedState, scan, velocity) -> SightedState:
        """Return the state with one more scan (environments, points), in place of the oldest one.

        Args:
            state: with the scans before.
            scan: (environments, points) heights, in standing heights.
            velocity: (environments, 2) velocity of the torso, forward and left, m/s.
        """
        xp = scan.__array_namespace__()
        moved = state.moved[:, :-1] + velocity[:, None] * self.control_timestep
        return state._replace(
            heights=xp.concatenate([scan[:, None], state.heights[:, :-1]], axis=1),
            moved=xp.concatenate([xp.zeros_like(moved[:, :1]), moved], axis=1),
        )

    def _next_feet(self, state: SightedState, leg_phases, velocity, predicted_velocity, gait_size, vertical) -> tuple:
        """Return positions (environments, legs, 3) of the soles in the next control step, m, and shifts of footholds.

        Args:
            state: with the latest scan.
            leg_phases: (environments, legs) in the next control step, cycles.
            velocity: (environments, 3) requested, m/s and rad/s.
            predicted_velocity: (environments, 3) until feet land, m/s and rad/s.
            gait_size: (environments, 1) from 0 to 1.
            vertical: (environments, 3) the world's, in the torso's frame.
        """
        xp = leg_phases.__array_namespace__()
        swing_places, shifts = self._move_to_footholds(state, leg_phases, velocity, predicted_velocity)
        stance_places = self._move_with_ground(state, leg_phases, velocity)
        is_stance = leg_phases < self.duty_factor
        ground_positions = xp.where(is_stance[..., None], stance_places, swing_places)
        heights = self._lift_feet(leg_phases, gait_size, vertical)
        return xp.concatenate([ground_positions, heights[..., None]], axis=-1), shifts

    def _move_to_footholds(self, state: SightedState, leg_phases, velocity, predicted_velocity) -> tuple:
        """Return where feet in swing are next, (environments, legs, 2) m, and shifts of footholds; see `_next_feet`.

        In each control step a foot covers an equal part of the way that is left to its foothold.
        """
        xp = leg_phases.__array_namespace__()
        is_stance = leg_phases < self.duty_factor
        steps_to_landing = xp.where(is_stance, 0.0, (1.0 - leg_phases) / self.cycles_per_step)  # from the next step
        arrival_steps = xp.minimum(steps_to_landing, _ARRIVAL_STEPS)
        # How far the torso moves over the ground in a control step, at each foot, m.
        torso_drift = point_velocities(predicted_velocity, self.rest_soles) * self.control_timestep
        is_fixed = is_stance | (steps_to_landing + 1.0 < _FIXED_CYCLES / self.cycles_per_step)
        torso_displacement = torso_drift * (steps_to_landing + 1.0)[..., None]
        footholds_at_landing, shifts = self._find_footholds(state, velocity, torso_displacement, is_fixed)
        swing_goals = footholds_at_landing + torso_drift * arrival_steps[..., None]
        remaining_steps = (xp.floor(steps_to_landing - arrival_steps) + 1.0)[..., None]
        positions = state.feet[..., :2]
        return positions + (swing_goals - positions) / remaining_steps, shifts

    def _move_with_ground(self, state: SightedState, leg_phases, velocity):
        """Return where feet in stance are next, (environments, legs, 2) m; see `_next_feet`.

        A foot moves against the velocity, in its first step only since it landed.
        """
        stance_steps = (leg_phases / self.cycles_per_step).clip(max=1.0)[..., None]
        foot_travel = point_velocities(velocity, state.feet) * self.control_timestep * stance_steps
        return state.feet[..., :2] - foot_travel

    def _lift_feet(self, leg_phases, gait_size, vertical):
        """Return the heights (environments, legs) of the soles in the torso's frame, m; see `_next_feet`."""
        xp = leg_phases.__array_namespace__()
        tilt = tilt_heights(vertical, self.rest_soles)
        swing_progress = ((leg_phases - self.duty_factor) / (1.0 - self.duty_factor)).clip(0.0)
        lift = gait_size * self.parameters.lift * self.mechanics.height * xp.sin(np.pi * swing_progress)
        return self.rest_soles[:, 2] + lift + self.parameters.attitude * tilt

    def _find_footholds(self, state: SightedState, velocity, torso_displacement, is_fixed) -> tuple:
        """Return footholds (environments, legs, 2), m from the torso when feet land, and their shifts, m.

        Args:
            state: with the latest scan.
            velocity: (environments, 3) requested, m/s and rad/s.
            torso_displacement: (environments, legs, 2) until feet land, at the feet, m.
            is_fixed: (environments, legs) whether the last shift stays.

        Returns:
            The footholds, and shifts (environments, legs) along paths, forward positive.
        """
        xp = velocity.__array_namespace__()
        half_path = 0.5 * self.stance_duration * point_velocities(velocity, self.rest_soles)
        length = xp.maximum(xp.hypot(half_path[..., 0], half_path[..., 1]), 1e-9)
        direction = half_path / length[..., None]
        landing = self.rest_soles[:, :2] + half_path
        view = footholds.View(state.heights, state.moved, self._reach)
        found_shifts, _ = footholds.find_landings(
            view,
            landing + torso_displacement,
            direction,
            self.rest_soles[:, :2],
            self.mechanics.height,
            self.support_points,
        )
        shifts = xp.where(is_fixed, state.shifts, found_shifts)
        return landing + shifts[..., None] * direction, shifts
