"""The demonstrator `leaping`: walks as `sighted`, and leaps over what no step crosses.

It leaps as soon as a trench that the scan shows is close to a foot, if every foot would land on
ground. How far a leap carries follows from a trial on level ground. In the air feet are shifted to where
the scan shows ground.
"""

import math
import warnings
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.cpg import footholds, leaps
from arc_suite.cpg.command_law import Request
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
        most: by which a foot may be shifted in the air.
    """

    walk: SightedParameters = SightedParameters()
    choice: tuple[Leap, ...] = (Leap(),)
    widest: float = 0.6
    near: float = 0.3
    most: float = 0.36


_LEAST = leaps.MIN_BY_MEASURE["distance"]  # least leap; a body with a shorter one gets a warning, and walks
_GATHER = 4  # cycles on the spot before it walks on; it may leap after each
_AROUND = 1.6 * footholds.SUPPORT_POINTS
_PROBE = 0.1  # standing heights between the points ahead of a foot that are looked at
_SUNK = 0.15  # standing heights below the others, at which a foot does not stand
_STEPS = 3  # of inverse kinematics in a control step
_TURNING = np.array((0.0, 0.0, 1.0))  # of a motion, what remains on the spot


class LeapingState(NamedTuple):
    """The law's own state.

    Attributes:
        walk: of the law that walks.
        step: (environments,) 0 while it walks and looks for what to leap over; from 1 on control steps of a leap, then
            of a cycle of the walk after a leap was given up; below 0 those until a leap, on the spot.
        shifts: (environments, legs) of where feet land, m.
        moved: (environments,) of the torso since the leap began, forward, m.
    """

    walk: SightedState
    step: np.ndarray
    shifts: np.ndarray
    moved: np.ndarray


class Leaping(Sighted):
    """Follows a command over ground that the block `scan` shows, and leaps.

    Attributes:
        leap: that it leaps.
        flight: what it does on level ground.
    """

    around = np.array((-0.24, -0.12, 0.0, 0.12))  # feet come late, and so land short

    def __init__(self, task: Task, parameters: LeapingParameters):
        """Fit the law to a task, and warn of a body that cannot leap; see `CommandLaw`."""
        super().__init__(task, parameters.walk)
        self.parameters, rest = parameters.walk, self._first.angles
        self._leaping, self._cycle = parameters, math.ceil(1.0 / self.cycles_per_step)
        at_rest = tuple(self.legs.by_joint(rest).tolist())
        self.leap, self.flight = leaps.find_best_leap(task.scene.body, at_rest, parameters.choice)
        self._movement = leaps.plan_movement(self.body, self.legs, rest, self.leap)
        self._last, far = len(self._movement.sole_offsets), self.flight.distance * self.flight.landed
        self._leaps = far >= _LEAST
        if not self._leaps:
            text = f"{self.body.name} cannot leap: its feet get {far:.2f} h ahead, and {_LEAST} h are needed"
            warnings.warn(f"{text}; leaping walks as sighted", stacklevel=2)

    def initial_paths(self, count: int) -> LeapingState:
        """Return feet at ease, and nothing seen."""
        walk = super().initial_paths(count)
        return LeapingState(walk, np.zeros(count, int), walk.shifts, np.zeros(count))

    def planned(self, paths: LeapingState, request: Request, observation: Mapping) -> tuple:
        """Return the next state, target angles (environments, joints), rad, and their change; see `CommandLaw`."""
        request = request._replace(motion=_where(paths.step < 0, _TURNING * request.motion, request.motion))
        walk, targets, change = super().planned(paths.walk, request, observation)
        if not self._leaps:
            return paths._replace(walk=walk), targets, change
        view = footholds.View(walk.heights, walk.moved, self._reach)
        moved = paths.moved + observation["velocities"][:, 0] * self.control_timestep
        moved = _where(_within(paths.step, 1, self._last - 1), moved, 0.0 * moved)
        found, safe = self._landings(view, moved)
        ready = safe.all(axis=-1) & (request.size[:, 0] >= 1.0) & self._close(view, observation)
        step = self._next(paths.step, ready)
        leaps_on = _within(step, 1, self._last)
        flies = _within(step, self._movement.stretch_end, self._movement.landing_step)
        shifts = _where(leaps_on, _where(flies[:, None] & safe, found, paths.shifts), 0.0 * found)
        leapt = self._leapt(paths.walk, walk, step, shifts)
        walk = walk._replace(**{name: _where(leaps_on, each, getattr(walk, name)) for name, each in leapt.items()})
        # Not to the state's angles, from which inverse kinematics would bend legs the other way.
        targets, later = targets + self._driven(paths.step), self.legs.by_joint(walk.angles) + self._driven(step)
        return LeapingState(walk, step, shifts, moved), targets, later - targets

    def _next(self, step, ready):
        """The next step (environments,) of a state, given whether (environments,) all is ready for a leap."""
        where, last = step.__array_namespace__().where, self._last
        onward = (step + 1) * (step != last + self._cycle)
        onward = where(step == -1, last + 1, onward * (step != last))
        gathered = (step < 0) & (step % self._cycle == self._cycle - 1)
        onward = where(ready & gathered, 1, onward)
        return where(step == 0, -_GATHER * self._cycle * ready, onward)

    def _landings(self, view: footholds.View, moved) -> tuple:
        """Shifts (environments, legs) of where feet land, m, and whether there is ground, given the way so far, m."""
        numpy, height = moved.__array_namespace__(), self.mechanics.height
        left = (self.flight.distance * height - moved).clip(0.0)
        landing = self.rest_soles[:, :2] + numpy.stack([left, 0.0 * left], axis=-1)[:, None]
        along = numpy.broadcast_to(np.array((1.0, 0.0)), landing.shape)
        shifts, safe = footholds.find_landings(view, landing, along, self.rest_soles[:, :2], height, _AROUND)
        return shifts, safe & (abs(shifts) <= self._leaping.most * height)

    def _close(self, view: footholds.View, observation: Mapping):
        """Whether (environments,) all feet stand, and one is close to what it cannot step over."""
        numpy, height, p = observation["posture"].__array_namespace__(), self.mechanics.height, self._leaping
        soles = self.legs.soles(self.legs.by_leg(observation["posture"][:, 5:]))[0]
        high = (soles * rotations.matrix(observation["posture"][:, 1:5])[:, None, 2]).sum(axis=-1)
        stands = (high > numpy.median(high, axis=-1)[:, None] - _SUNK * height).all(axis=-1)
        ahead = soles[..., :1] + height * _PROBE * np.arange(math.ceil((p.near + p.widest) / _PROBE) + 1)
        ground = view.ground(ahead, soles[..., 1:2] + 0.0 * ahead)
        level = numpy.median(ground[..., 0], axis=-1)[:, None, None]
        missing = ground < level - footholds.MAX_FOOTHOLD_DROP
        wide = _PROBE * missing.sum(axis=-1) >= p.widest
        close = missing[..., : math.ceil(p.near / _PROBE) + 1].any(axis=-1)
        return stands & (wide & close).any(axis=-1)

    def _leapt(self, before: SightedState, walk: SightedState, step, shifts) -> dict:
        """Feet, angles and shifts of the paths after a control step of a leap.

        Args:
            before: the paths.
            walk: after a step of the walk.
            step: (environments,) of the leap.
            shifts: (environments, legs) of where feet land, m.
        """
        numpy, made, height = step.__array_namespace__(), self._movement, self.mechanics.height
        offsets = numpy.concatenate([np.zeros((1, 3)), made.sole_offsets])
        now = step.clip(0, self._last)
        level = numpy.broadcast_to(self.rest_soles[:, 2:], walk.feet[..., 2:].shape)
        start = numpy.concatenate([walk.feet[..., :2], level], axis=-1)
        planted = _where(step == 1, start, before.feet) + (offsets[now] - offsets[(now - 1).clip(0)])[:, None]
        flying = self.rest_soles + numpy.stack([shifts, 0.0 * shifts, 0.0 * shifts], axis=-1) + offsets[now][:, None]
        feet = _where(step > made.stretch_end, flying, planted)
        aims = numpy.broadcast_to(leaps.sole_weights(len(self.rest_soles)), (*feet.shape, 3))
        angles = self.correct_bends(
            self.legs.solve_joint_angles(before.angles, feet, aims, posture.IK_DAMPING * height, _STEPS)
        )
        return {"feet": feet, "angles": angles, "shifts": 0.0 * shifts}

    def _driven(self, step):
        """What a control step (environments,) of a leap adds to the angles of all joints, rad."""
        stretches = _within(step, self._movement.crouch_end + 1, self._movement.stretch_end)
        return stretches[:, None] * self.legs.by_joint(self._movement.joint_drive)


def _within(step, first: int, last: int):
    return (step >= first) & (step <= last)


def _where(mask, one, other):
    """Return arrays (environments, ...) where a mask (environments, ...) holds, and others elsewhere."""
    return mask.__array_namespace__().where(mask.reshape(*mask.shape, *[1] * (one.ndim - mask.ndim)), one, other)
