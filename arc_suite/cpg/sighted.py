"""The demonstrator `sighted`: feet step along paths in space, and land where the scanned ground carries them.

In stance a foot moves against the requested velocity; in swing it goes to its foothold, shifted along
its path to the nearest ground. Joint angles follow by inverse kinematics of the legs, since the shifts
are too long for the directions of joints by which the law of `steering` walks.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.cpg import footholds
from arc_suite.cpg.command_law import CommandLaw, Request
from arc_suite.models import posture
from arc_suite.models.kinematics import Legs, path_weights, point_velocities, tilt_heights
from arc_suite.tasks.contract import Task
from arc_suite.tasks.fitting import reach
from arc_suite.tasks.sensors import SCAN


class SightedParameters(NamedTuple):
    """How a demonstrator that sees walks.

    Attributes:
        lift: of a foot in mid-swing, in standing heights.
        ride: height of the torso, in standing heights: lower than one, for feet to reach further.
        gain: of the motion's error, forward, left and turning.
        integral: of the same, a cycle of the gait.
        most: largest request, in units of the command.
        attitude: how far a foot is pushed down, as a share of how far the torso's tilt sinks its place.
        lead: of all legs over the gait's clock, cycles.
        longer: swing than the gait prescribes, cycles, since feet follow late.
        trust: from 0 to 1, in the requested velocity against the measured one, whose mean comes late,
            in the prediction of where the torso is when a foot lands.
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


_SCANS = 6  # that are remembered
_EARLY = 1.0  # control steps before landing, at which a foot is to be over its foothold
_HELD = 0.1  # cycles before landing, in which its foothold is no longer changed
_ACROSS = 0.3  # weight of a foot's slip across its path against its motion along it
_STEPS = 2  # of it in a control step


class SightedState(NamedTuple):
    """The law's own state.

    Attributes:
        feet: (environments, legs, 3) planned places of the soles, m.
        angles: (environments, legs, links) planned for them, rad.
        shifts: (environments, legs) of where feet land, m.
        heights: (environments, scans, points) the latest scans, in standing heights; -inf before there were any.
        moved: (environments, scans, 2) displacement of the torso since, m.
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
        places: (legs, 3) of the soles at ease, m.
        around: ground that a foot needs, standing heights along its path.
    """

    around = footholds.SUPPORT_POINTS
    reads = (*CommandLaw.reads, "scan")

    def __init__(self, task: Task, parameters: SightedParameters):
        """Fit the law to a task; see `CommandLaw`."""
        super().__init__(task, parameters)
        self.duty_factor -= parameters.longer
        self.legs, self._reach, ride = Legs.of(self.body), reach(self.body), parameters.ride * self.mechanics.height
        soles = np.where((True, True, False), self.mechanics.soles, -ride)
        angles = self.legs.relaxed_joint_angles(soles, np.diag((0.2, 0.2, 1.0)), posture.IK_DAMPING * ride)
        self.rest_soles = self.legs.soles(angles)[0]
        scans = np.full((_SCANS, SCAN.shape[1]), -np.inf)
        self._first = SightedState(self.rest_soles, angles, np.zeros(len(angles)), scans, np.zeros((_SCANS, 2)))

    def initial_paths(self, count: int) -> SightedState:
        """Return feet at ease, and nothing seen."""
        return SightedState(*(np.tile(first, (count, *[1] * first.ndim)) for first in self._first))

    def planned(self, paths: SightedState, request: Request, observation: Mapping) -> tuple:
        """Return the next paths of the feet, target angles (environments, joints), rad, and their change."""
        p, height = self.parameters, self.mechanics.height
        paths = self._looked(paths, observation["scan"], observation["velocities"][:, :2])
        motion = request.size * request.motion.clip(-p.most, p.most) * self.units
        cycle = (
            request.phase[:, None] + self.phase_offsets + request.advance[:, None]
        ) % 1.0  # in the next control step
        predicted = p.trust * motion + (1.0 - p.trust) * observation["command"][:, 3:] * self.units
        feet, shifts = self._next_feet(paths, cycle, motion, predicted, request.size, observation["posture"][:, 1:5])
        aims = path_weights(point_velocities(motion, feet), _ACROSS)
        angles = self.correct_bends(
            self.legs.solve_joint_angles(paths.angles, feet, aims, posture.IK_DAMPING * height, _STEPS)
        )
        targets = self.legs.by_joint(paths.angles)
        change = self.legs.by_joint(angles) - targets
        return paths._replace(feet=feet, angles=angles, shifts=shifts), targets, change

    def correct_bends(self, angles):
        """Return angles (environments, legs, links), with those at ease of legs that bend the other way.

        Legs of three links, stretched out to a place that they do not reach, may bend either way next, and stay so.
        """
        if angles.shape[-1] != 3:
            return angles
        numpy = angles.__array_namespace__()
        bent, at_ease = (numpy.linalg.det(self.legs.soles(each)[1]) for each in (angles, self._first.angles))
        return numpy.where((bent * at_ease < 0.0)[..., None], self._first.angles, angles)

    def _looked(self, paths: SightedState, scan, velocity) -> SightedState:
        """The paths with one more scan (environments, points), given the torso's velocity (environments, 2), m/s."""
        numpy = scan.__array_namespace__()
        moved = paths.moved[:, :-1] + velocity[:, None] * self.control_timestep
        return paths._replace(
            heights=numpy.concatenate([scan[:, None], paths.heights[:, :-1]], axis=1),
            moved=numpy.concatenate([numpy.zeros_like(moved[:, :1]), moved], axis=1),
        )

    def _next_feet(self, paths: SightedState, cycle, motion, predicted, size, quaternion) -> tuple:
        """Places (environments, legs, 3) of the soles in the next control step, m, and shifts of where they land.

        Args:
            paths: with the latest scan.
            cycle: (environments, legs) phases of the legs then.
            motion: (environments, 3) requested velocity, m/s and rad/s.
            predicted: (environments, 3) velocity until feet land.
            size: (environments, 1) of the gait.
            quaternion: (environments, 4) of the torso.
        """
        numpy, duty = cycle.__array_namespace__(), self.duty_factor
        feet, stands = paths.feet, cycle < duty
        left = numpy.where(stands, 0.0, (1.0 - cycle) / self.cycles_per_step)  # control steps from then to landing
        early = numpy.minimum(left, _EARLY)
        drift = (
            point_velocities(predicted, self.rest_soles) * self.control_timestep
        )  # of the torso over the ground, a control step
        held = stands | (left + 1.0 < _HELD / self.cycles_per_step)
        goal, shifts = self._landing(paths, motion, drift * (left + 1.0)[..., None], held)
        goal = goal + drift * early[..., None]
        swung = feet[..., :2] + (goal - feet[..., :2]) / (numpy.floor(left - early) + 1.0)[..., None]
        stood = (cycle / self.cycles_per_step).clip(max=1.0)[..., None]  # control steps, at most the latest
        stood = feet[..., :2] - point_velocities(motion, feet) * self.control_timestep * stood
        tilt = tilt_heights(
            rotations.matrix(quaternion)[:, 2], self.rest_soles
        )  # by the world's vertical in the torso's frame
        progress = ((cycle - duty) / (1.0 - duty)).clip(0.0)
        lift = size * self.parameters.lift * self.mechanics.height * numpy.sin(np.pi * progress)
        heights = self.rest_soles[:, 2] + lift + self.parameters.attitude * tilt
        ground = numpy.where(stands[..., None], stood, swung)
        return numpy.concatenate([ground, heights[..., None]], axis=-1), shifts

    def _landing(self, paths: SightedState, motion, moved, held) -> tuple:
        """Where feet land (environments, legs, 2), m from where the torso is then, and shifts (environments, legs).

        Args:
            paths: with the latest scan.
            motion: (environments, 3) requested velocity, m/s and rad/s.
            moved: (environments, legs, 2) displacement of the torso until then, at the feet, m.
            held: (environments, legs) whether the last choice stays.
        """
        numpy = motion.__array_namespace__()
        half = 0.5 * self.stance_duration * point_velocities(motion, self.rest_soles)
        along = half / numpy.maximum(numpy.hypot(half[..., 0], half[..., 1]), 1e-9)[..., None]
        landing, view = self.rest_soles[:, :2] + half, footholds.View(paths.heights, paths.moved, self._reach)
        near, height = self.rest_soles[:, :2], self.mechanics.height
        found, _ = footholds.find_landings(view, landing + moved, along, near, height, self.around)
        shifts = numpy.where(held, paths.shifts, found)
        return landing + shifts[..., None] * along, shifts
