"""The demonstrator that climbs: it steps along paths of feet, as `stepping` does, over ground that a task scans.

Feet stand as much higher or lower than at rest as the ground below them, so that the torso stays level on stairs. In
swing they pass over the ground ahead of them, and keep their height over it while the torso tilts.

A body that trots stands on two of four feet, and tips about the line between them unless its weight is above that line.
Footholds shift by the rate and by the sum of the torso's tilt, which brings the line under the weight.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite.cpg.command_law import Request, read_vertical
from arc_suite.cpg.footholds import find_scan_points
from arc_suite.cpg.stepping import Stepping, SteppingParameters
from arc_suite.models import foot_paths, posture
from arc_suite.models.kinematics import point_velocities, tilt_heights
from arc_suite.robots.spec import Body
from arc_suite.tasks.contract import Task
from arc_suite.tasks.fitting import reach
from arc_suite.tasks.sensors import SCAN

_LOOKS_AHEAD = (0.0, 0.5, 1.0)  # shares of the look ahead at which a foot in swing sees the ground
_MAX_STEP = 0.5  # standing heights, between the ground at a foot and that under the torso
_TRENCH_DEPTH = 0.5  # standing heights below most of the ground under the torso; feet do not reach further down
_MAX_LEVELING = 0.4  # standing heights, of a foot in swing
_FULL_ROUGHNESS = 0.06  # standing heights, of the ground's deviation from a plane, at which corrections have full size
_MIN_DIRECTION = 1e-9  # m/s, of a foot that moves


class ClimbingParameters(NamedTuple):
    """How a demonstrator that climbs walks.

    The corrections `rough_lift`, `reserve`, `tilt_sum` and `leveling` grow with the ground's roughness: a plane, level
    or not, needs none of them.

    Attributes:
        steps: how its feet step. Where legs cannot lift their feet in this pose, the torso is lower.
        rough_lift: by how much a foot in mid-swing is higher on rough ground, in standing heights.
        reserve: largest request beyond the measured motion, in units of the command: where a step holds the body up,
            longer strides do not help.
        tilt_rate: shift of footholds, as a share of the distance by which the torso's rate of tilt moves its weight
            within the time constant of an inverted pendulum.
        tilt_sum: shift of footholds, as a share of the distance by which the tilt's sum over cycles moves the weight.
        leveling: share of a tilt that a foot in swing makes up for.
        slope: share of the ground's slope by which the torso tilts.
        preview: how far ahead along its path a foot in mid-swing clears the ground, in standing heights.
    """

    steps: SteppingParameters
    rough_lift: float = 0.0
    reserve: float = math.inf
    tilt_rate: float = 0.0
    tilt_sum: float = 0.0
    leveling: float = 0.0
    slope: float = 0.6
    preview: float = 0.4


class ClimbingState(NamedTuple):
    """What this law adds to the state of a `CommandLaw`.

    Attributes:
        joint_angles: (environments, legs, links) planned, rad.
        tilt_sum: (environments, 2) sum of the tilt's error, forward and left, rad cycles.
    """

    joint_angles: np.ndarray
    tilt_sum: np.ndarray


class Climbing(Stepping):
    """Steps over ground that the block `scan` shows.

    Attributes:
        climbing: parameters of this law; `parameters` are those of its steps.
        scan_places: (2, points) of a scan, forward and left, m.
        is_under_torso: (points,) whether a point of a scan lies between the feet.
        ground_fit: (3, points) takes a scan, m, to the plane under the feet: its height, m, and slopes.
    """

    reads = (*Stepping.reads, "scan")

    def __init__(self, task: Task, parameters: ClimbingParameters):
        """Fit the law to a task; see `CommandLaw`."""
        super().__init__(task, parameters.steps)
        self.climbing = parameters
        self._reach = reach(self.body)  # m, the unit of a scan's points
        self.scan_places = SCAN * self._reach
        nearest = self.rest_soles[:, :2].min(axis=0)[:, None]
        furthest = self.rest_soles[:, :2].max(axis=0)[:, None]
        self.is_under_torso = ((self.scan_places >= nearest) & (self.scan_places <= furthest)).all(axis=0)
        if not self.is_under_torso.any():
            # The feet of a biped stand side by side, between two points of a scan.
            self.is_under_torso[np.hypot(*self.scan_places).argmin()] = True
        self.ground_fit = self._fit_ground()

    def choose_rest_pose(self, body: Body) -> posture.RestPose:
        """Return a pose in which every leg can lift its foot."""
        return posture.find_climbing_pose(body, self.parameters.wider, self.parameters.lower)

    def _fit_ground(self) -> np.ndarray:
        """Return `ground_fit`, by least squares over the points of a scan between the feet."""
        places = self.scan_places[:, self.is_under_torso]
        columns = np.column_stack([np.ones(places.shape[1]), *places])
        fit = np.zeros((3, len(self.is_under_torso)))
        fit[:, self.is_under_torso] = np.linalg.pinv(columns)
        return fit

    def initial_paths(self, count: int) -> ClimbingState:
        """Return the angles at rest and a sum of 0, for a number of environments."""
        return ClimbingState(np.tile(self.rest_angles, (count, 1, 1)), np.zeros((count, 2)))

    def follow_request(self, state: ClimbingState, request: Request, observation: Mapping) -> tuple:
        """Return the next state, target angles (environments, joints), rad, and their change; see `CommandLaw`."""
        vertical = read_vertical(observation)
        scan = observation["scan"] * self.mechanics.height  # m, over the ground of a torso at the standing height
        heights = self.fill_trenches(scan)
        # A product of matrices would round otherwise in a batch.
        plane = (heights[:, None] * self.ground_fit).sum(axis=-1)
        timing = self.gait_timing(request, observation)

        roughness = self._measure_roughness(heights, plane)
        motion = self._limit_motion(request.motion, observation["command"][:, 3:], roughness)
        velocity, foothold_shift = self.balance(motion, vertical, observation)
        tilt = vertical[:, :2] - self.climbing.slope * plane[:, 1:]
        tilt_sum = self.add_tilt(state.tilt_sum, tilt, request.size)
        foothold_shift = foothold_shift + self.tilt_shift(
            self.climbing.tilt_sum * (roughness * tilt_sum), self.climbing.tilt_rate, observation["velocities"][:, 3:5]
        )
        soles = self.next_feet(timing, velocity, foothold_shift, request.size)
        _, swing_progress = foot_paths.find_path_position(timing.leg_phases, timing.duty_factor)
        correction_size = roughness * request.size
        soles = self.step_on_ground(soles, swing_progress, velocity, correction_size, heights, plane, vertical)

        joint_angles, target_angles, angle_changes = self.move_feet(state.joint_angles, soles, velocity)
        return ClimbingState(joint_angles, tilt_sum), target_angles, angle_changes

    def fill_trenches(self, heights):
        """Return heights of the ground (environments, points), m, with trenches as high as the ground about them."""
        xp = heights.__array_namespace__()
        level = xp.median(heights[:, self.is_under_torso], axis=-1)[:, None]
        is_trench = heights < level - _TRENCH_DEPTH * self.mechanics.height
        return xp.where(is_trench, level, heights)

    def _measure_roughness(self, heights, plane):
        """Return how far the ground between the feet deviates from a plane, (environments, 1) from 0 to 1."""
        xp = heights.__array_namespace__()
        slopes = plane[:, 1:2] * self.scan_places[0] + plane[:, 2:3] * self.scan_places[1]
        deviations = heights - plane[:, :1] - slopes
        squares = (deviations**2 * self.is_under_torso).sum(axis=-1, keepdims=True)
        deviation = xp.sqrt(squares / self.is_under_torso.sum())  # m
        return (deviation / (_FULL_ROUGHNESS * self.mechanics.height)).clip(max=1.0)

    def _limit_motion(self, motion, measured, roughness):
        """Return a requested motion (environments, 3) that on rough ground is at most `reserve` beyond the measured."""
        xp = motion.__array_namespace__()
        fastest = measured.clip(0.0) + self.climbing.reserve
        slowest = measured.clip(max=0.0) - self.climbing.reserve
        limited_motion = xp.minimum(xp.maximum(motion, slowest), fastest)
        return motion + roughness * (limited_motion - motion)

    def step_on_ground(self, soles, swing_progress, velocity, correction_size, heights, plane, vertical):
        """Return positions (environments, legs, 3) of soles over uneven ground, m.

        Args:
            soles: (environments, legs, 3) for level ground, m.
            swing_progress: (environments, legs) from 0 to 1; 0 in stance.
            velocity: (environments, 3) requested of the torso, m/s and rad/s.
            correction_size: (environments, 1) size of corrections, from 0 to 1.
            heights: (environments, points) of the scan, m.
            plane: (environments, 3) height, m, and slopes of the ground under the feet.
            vertical: (environments, 3) the world's, in the torso's frame.
        """
        xp = soles.__array_namespace__()
        standing_height = self.mechanics.height
        places = soles[..., :2]
        foot_velocity = point_velocities(velocity, self.rest_soles)
        speed = xp.hypot(foot_velocity[..., 0], foot_velocity[..., 1])[..., None]
        direction = foot_velocity / xp.maximum(speed, _MIN_DIRECTION)
        # A foot looks ahead in mid-swing, and lands on the ground below it.
        swing_share = (4.0 * swing_progress * (1.0 - swing_progress)).clip(max=1.0)[..., None]
        preview = self.climbing.preview * standing_height * swing_share
        grounds = [self._ground_at(heights, places + share * preview * direction) for share in _LOOKS_AHEAD]
        ground = xp.stack(grounds).max(axis=0)

        slopes = self.climbing.slope * (plane[:, 1:2] * places[..., 0] + plane[:, 2:3] * places[..., 1])
        step = ground - plane[:, :1] - slopes
        max_step = _MAX_STEP * standing_height
        sole_heights = soles[..., 2] + step.clip(-max_step, max_step)

        rough_lift = correction_size * self.climbing.rough_lift * standing_height * xp.sin(np.pi * swing_progress)
        sole_heights = sole_heights + rough_lift
        foot_lift = soles[..., 2] - self.rest_soles[:, 2] + rough_lift
        level_heights = ground - standing_height + foot_lift - tilt_heights(vertical, places)
        max_leveling = _MAX_LEVELING * standing_height
        leveling = (level_heights - sole_heights).clip(-max_leveling, max_leveling)
        share = self.climbing.leveling * correction_size * (swing_progress > 0.0)
        sole_heights = sole_heights + share * leveling
        return xp.concatenate([places, sole_heights[..., None]], axis=-1)

    def _ground_at(self, heights, places):
        """Return heights of the ground (environments, legs), m, interpolated between the points of a scan.

        Args:
            heights: (environments, points) of the scan, m.
            places: (environments, legs, 2) forward and left of the torso, m.
        """
        xp = places.__array_namespace__()
        points = find_scan_points(places[..., 0] / self._reach, places[..., 1] / self._reach)
        before = xp.take_along_axis(heights, points.before, axis=-1)
        behind = xp.take_along_axis(heights, points.behind, axis=-1)
        return before + points.share * (behind - before)
