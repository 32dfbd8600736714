"""The demonstrator `leaping`: walks as `sighted`, and leaps over what no step crosses.

It leaps as soon as a trench that the scan shows is close to a foot, if every foot would land on
ground. A trial on level ground tells how far a leap carries. In the air feet are shifted to where
the scan shows ground.
"""

import math
import warnings
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.cpg import footholds, leaps
from arc_suite.cpg.command_law import Request, read_vertical
from arc_suite.cpg.leaps import Leap
from arc_suite.cpg.sighted import Sighted, SightedParameters, SightedState
from arc_suite.models import posture
from arc_suite.tasks.contract import Task


class LeapingParameters(NamedTuple):
    """How a demonstrator that leaps moves; lengths in standing heights.

    Attributes:
        walk: between leaps.
        choice: leaps to choose from; the body takes the farthest one that lands on level ground.
        widest: trench that it steps over.
        near: distance of a foot from a trench at which it leaps.
        most: largest distance by which a foot may be shifted in the air.
    """

    walk: SightedParameters = SightedParameters()
    choice: tuple[Leap, ...] = (Leap(),)
    widest: float = 0.6
    near: float = 0.3
    most: float = 0.36


_MIN_LEAP = leaps.MIN_DISTANCE  # standing heights; a body with a shorter leap gets a warning, and walks
_GATHERING_CYCLES = 4  # cycles on the spot before it walks on; it may leap after each, and in the last one
_SUPPORT_POINTS = 1.6 * footholds.SUPPORT_POINTS  # of a landing, standing heights along the path
_PROBE_SPACING = 0.1  # standing heights between the points ahead of a foot that are looked at
_MAX_FOOT_DROP = 0.15  # standing heights; a foot that is so far below the median foot does not stand
_IK_ITERATIONS = 3  # of inverse kinematics in a control step
_TURN_ALONE = np.array((0.0, 0.0, 1.0))  # factors of a motion forward, left and turning, for a walk on the spot


class LeapingState(NamedTuple):
    """What this law adds to the state of a `CommandLaw`.

    Attributes:
        walk: state of the law that walks.
        step: (environments,) 0 while it walks and looks for what to leap over; from 1 on control steps of a leap, then
            of a cycle of the walk after a leap was given up; below 0 those until a leap, on the spot.
        shifts: (environments, legs) shifts of the footholds, m.
        moved: (environments,) distance that the torso has moved forward since the leap began, m.
    """

    walk: SightedState
    step: np.ndarray
    shifts: np.ndarray
    moved: np.ndarray


class Leaping(Sighted):
    """Follows a command over ground that the block `scan` shows, and leaps.

    Attributes:
        leap: the leap of the body.
        flight: what the leap does on level ground.
    """

    support_points = np.array((-0.24, -0.12, 0.0, 0.12))  # more behind: feet come late, and so land short

    def __init__(self, task: Task, parameters: LeapingParameters):
        """Fit the law to a task, and warn of a body that cannot leap; see `CommandLaw`."""
        super().__init__(task, parameters.walk)
        self._leaping_parameters = parameters
        rest_angles = self._first_state.angles
        self._cycle_steps = math.ceil(1.0 / self.cycles_per_step)
        joint_angles = tuple(self.legs.by_joint(rest_angles).tolist())
        self.leap, self.flight = leaps.find_best_leap(task.scene.body, joint_angles, parameters.choice)
        self._movement = leaps.lay_out_movement(self.body, self.legs, rest_angles, self.leap)
        self._last_step = len(self._movement.sole_offsets)  # of a leap
        distance = self.flight.distance if self.flight.landed else 0.0
        self._can_leap = distance >= _MIN_LEAP
        if not self._can_leap:
            text = f"{self.body.name} cannot leap: its feet get {distance:.2f} h ahead, and {_MIN_LEAP} h are needed"
            warnings.warn(f"{text}; leaping walks as sighted", stacklevel=2)

    def initial_paths(self, count: int) -> LeapingState:
        """Return the state of the walk at its start, and no leap."""
        walk = super().initial_paths(count)
        return LeapingState(walk, np.zeros(count, int), walk.shifts, np.zeros(count))

    def follow_request(self, state: LeapingState, request: Request, observation: Mapping) -> tuple:
        """Return the next state, target angles (environments, joints), rad, and their change; see `CommandLaw`."""
        walk_motion = _where(state.step < 0, _TURN_ALONE * request.motion, request.motion)
        walk_request = request._replace(motion=walk_motion)
        walk, walk_targets, walk_changes = super().follow_request(state.walk, walk_request, observation)
        if not self._can_leap:
            return state._replace(walk=walk), walk_targets, walk_changes

        view = footholds.View(walk.heights, walk.moved, self._reach)
        moved = state.moved + observation["velocities"][:, 0] * self.control_timestep
        moved = _where(_is_within(state.step, 1, self._last_step - 1), moved, 0.0 * moved)
        landing_shifts, has_ground = self._find_landings(view, moved)
        may_leap = has_ground.all(axis=-1) & (request.size[:, 0] >= 1.0) & self._is_trench_close(view, observation)
        step = self._next_step(state.step, may_leap)
        is_leap = _is_within(step, 1, self._last_step)
        is_flight = _is_within(step, self._movement.stretch_end, self._movement.landing_step)
        # In the air shifts follow the scans; from the landing on they stay.
        leap_shifts = _where(is_flight[:, None] & has_ground, landing_shifts, state.shifts)
        shifts = _where(is_leap, leap_shifts, 0.0 * landing_shifts)
        leap_walk = self._leap_walk(state.walk, walk, step, shifts)
        walk = walk._replace(
            feet=_where(is_leap, leap_walk.feet, walk.feet),
            angles=_where(is_leap, leap_walk.angles, walk.angles),
            shifts=_where(is_leap, leap_walk.shifts, walk.shifts),
        )
        # The drive is added to targets, not to the state's angles: from those inverse kinematics would bend legs the
        # other way.
        targets = walk_targets + self._drive_of_joints(state.step)
        next_targets = self.legs.by_joint(walk.angles) + self._drive_of_joints(step)
        return LeapingState(walk, step, shifts, moved), targets, next_targets - targets

    def _next_step(self, step, may_leap):
        """Return the next step (environments,) of a state; see `LeapingState`.

        Args:
            step: (environments,) step of the state.
            may_leap: (environments,) whether a trench is close, and all feet would land on ground.
        """
        xp = step.__array_namespace__()
        first_after_leap = self._last_step + 1  # of a cycle of the walk, in which it does not leap
        last_after_leap = self._last_step + self._cycle_steps
        # A leap that ends, and a walk that ends, lead back to the search for a trench.
        ends = (step == self._last_step) | (step == last_after_leap)
        next_step = xp.where(ends, 0, step + 1)
        next_step = xp.where(step == -1, first_after_leap, next_step)
        is_end_of_cycle = step % self._cycle_steps == self._cycle_steps - 1
        # In the last cycle it leaps at any time: ends of cycles could all fall into swings, in which it may not leap.
        is_last_cycle = step >= -self._cycle_steps
        has_gathered = (step < 0) & (is_end_of_cycle | is_last_cycle)
        next_step = xp.where(has_gathered & may_leap, 1, next_step)
        first_gathering = xp.where(may_leap, -_GATHERING_CYCLES * self._cycle_steps, 0)
        return xp.where(step == 0, first_gathering, next_step)

    def _find_landings(self, view: footholds.View, moved) -> tuple:
        """Return shifts (environments, legs) of where feet land, m, and whether they find ground there.

        Args:
            view: view of the ground.
            moved: (environments,) distance that the torso has moved since the leap began, m.
        """
        xp = moved.__array_namespace__()
        standing_height = self.mechanics.height
        remaining = (self.flight.distance * standing_height - moved).clip(0.0)
        displacement = xp.stack([remaining, 0.0 * remaining], axis=-1)  # forward and left
        landing = self.rest_soles[:, :2] + displacement[:, None]
        forward = xp.broadcast_to(np.array((1.0, 0.0)), landing.shape)
        shifts, has_ground = footholds.find_landings(
            view, landing, forward, self.rest_soles[:, :2], standing_height, _SUPPORT_POINTS
        )
        is_short = abs(shifts) <= self._leaping_parameters.most * standing_height
        return shifts, has_ground & is_short

    def _is_trench_close(self, view: footholds.View, observation: Mapping):
        """Return whether (environments,) all feet stand, and one is close to a trench that it cannot step over."""
        posture_block = observation["posture"]  # height, quaternion and joint angles
        xp = posture_block.__array_namespace__()
        standing_height = self.mechanics.height
        parameters = self._leaping_parameters
        soles, _ = self.legs.soles(self.legs.by_leg(posture_block[:, 5:]))
        sole_heights = (soles * read_vertical(observation)[:, None]).sum(axis=-1)
        median_height = xp.median(sole_heights, axis=-1)[:, None]
        all_stand = (sole_heights > median_height - _MAX_FOOT_DROP * standing_height).all(axis=-1)

        probe_count = math.ceil((parameters.near + parameters.widest) / _PROBE_SPACING) + 1
        near_count = math.ceil(parameters.near / _PROBE_SPACING) + 1
        probe_x = soles[..., :1] + standing_height * _PROBE_SPACING * np.arange(probe_count)  # ahead of each sole
        probe_y = soles[..., 1:2] + 0.0 * probe_x
        ground = view.ground(probe_x, probe_y)  # (environments, legs, probes)
        level = xp.median(ground[..., 0], axis=-1)[:, None, None]
        is_trench = ground < level - footholds.MAX_FOOTHOLD_DROP
        is_wide = _PROBE_SPACING * is_trench.sum(axis=-1) >= parameters.widest
        is_close = is_trench[..., :near_count].any(axis=-1)
        return all_stand & (is_wide & is_close).any(axis=-1)

    def _leap_walk(self, previous: SightedState, walk: SightedState, step, shifts) -> SightedState:
        """Return the state of the walk after a control step of a leap.

        Args:
            previous: state of the walk before the control step.
            walk: the same after a step of the walk.
            step: (environments,) step of the leap.
            shifts: (environments, legs) shifts of the footholds, m.
        """
        xp = step.__array_namespace__()
        sole_offsets = xp.concatenate([np.zeros((1, 3)), self._movement.sole_offsets])
        leap_step = step.clip(0, self._last_step)
        offset = sole_offsets[leap_step]
        offset_change = offset - sole_offsets[(leap_step - 1).clip(0)]
        # A leap begins with feet where the walk has them, on level ground. Until the stretch ends they stay planted.
        rest_heights = xp.broadcast_to(self.rest_soles[:, 2:], walk.feet[..., 2:].shape)
        start = xp.concatenate([walk.feet[..., :2], rest_heights], axis=-1)
        planted = _where(step == 1, start, previous.feet) + offset_change[:, None]
        shifts_in_space = xp.stack([shifts, 0.0 * shifts, 0.0 * shifts], axis=-1)
        flying = self.rest_soles + shifts_in_space + offset[:, None]
        feet = _where(step > self._movement.stretch_end, flying, planted)
        weights = xp.broadcast_to(leaps.sole_weights(len(self.rest_soles)), (*feet.shape, 3))
        damping = posture.IK_DAMPING * self.mechanics.height
        angles = self.legs.solve_joint_angles(previous.angles, feet, weights, damping, _IK_ITERATIONS)
        return walk._replace(feet=feet, angles=self.correct_bends(angles), shifts=0.0 * shifts)

    def _drive_of_joints(self, step):
        """Return what a control step (environments,) of a leap adds to the angles (environments, joints), rad."""
        is_stretch = _is_within(step, self._movement.crouch_end + 1, self._movement.stretch_end)
        return is_stretch[:, None] * self.legs.by_joint(self._movement.joint_drive)


def _is_within(step, first: int, last: int):
    """Return whether steps (environments,) are from a first to a last one."""
    return (step >= first) & (step <= last)


def _where(mask, values, values_elsewhere):
    """Return values (environments, ...) where a mask over their first axes holds, and other values elsewhere."""
    xp = mask.__array_namespace__()
    missing_axes = values.ndim - mask.ndim
    return xp.where(mask.reshape(*mask.shape, *[1] * missing_axes), values, values_elsewhere)
