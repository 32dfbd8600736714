"""The demonstrators that step: one law for any body that follows a command of velocities, without sight.

Feet follow paths in space. In stance a foot moves against the requested velocity, in swing it returns and is lifted.
Joint angles follow by inverse kinematics, which folds legs that stand near the bounds of their joints. A leg with
four joints or more returns to its pose at rest, as far as its foot leaves it free.

Where a task observes a pose and a gait by command, feet step in that gait under a torso in that pose: both are read
anew in every step, so that they may change at any time. Feedback on height, roll and pitch makes up for what joints
give way.

A body of few legs that is thrown lands its feet aside of the footholds of the command: by the distance that its weight
falls aside of its feet, and by the distance that an unwanted velocity carries it, as in the capture point of a linear
inverted pendulum (Pratt et al., "Capture point: a step toward humanoid push recovery", 2006) or Raibert's foothold
("Legged robots that balance", 1986).
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from arc_suite.cpg.command_law import CommandLaw, Request, read_vertical
from arc_suite.models import foot_paths, overlap, posture
from arc_suite.models.kinematics import path_weights, point_velocities
from arc_suite.models.standing import GRAVITY
from arc_suite.robots import gaits
from arc_suite.robots.spec import Body
from arc_suite.tasks.contract import Task

_MAX_POSE_INTEGRAL = 0.2  # standing heights or rad
_MAX_POSE_ERROR = 0.05  # standing heights or rad; larger errors count as this one
_MEASURED_NUMBERS = np.array((0, 3, 4))  # indices of height, roll and pitch among the six numbers of a pose
_SLOWING_TILT = 0.3  # sine of the torso's tilt above which it walks slower; at twice as much it stops
_MIN_PATH_LENGTH = 1e-9  # m, of a foot that moves
_MAX_TILT_SUM = 0.4  # rad cycles
_NO_BOUND = 1e9  # m, in place of infinity, which JSON does not have
_TAKE_OFF_SHARE = 0.6  # share of the shift for balance that is left when a foot takes off


class SteppingParameters(NamedTuple):
    """How a demonstrator that steps walks.

    Attributes:
        wider: how much further out feet stand than in the body's pose at rest, see `posture.find_wide_pose`, in
            standing heights.
        lower: how much lower the torso is than in that pose, in standing heights. Of both numbers a body takes the
            share that its legs reach and its motors carry. Where a task commands the pose, they have no effect.
        ahead: how much further ahead the torso is over the feet of the pose at rest, in standing heights.
        higher: how much higher the torso is over them, in standing heights. Both numbers have no effect on a body that
            stands wide, or where a task commands the pose.
        across: weight of a foot's slip across its path, against its motion along it.
        lift: height of a foot in mid-swing, in standing heights.
        gain: gain of the feedback on the motion's error: forward, left and turning.
        integral: gain of the same error, added up over a cycle of the gait.
        most: largest request, in units of the command; feedback on a body that cannot go on would throw it.
        lead: lead of all legs over the gait's clock, cycles.
        lean: shift of footholds, as a share of the distance by which the torso's weight falls aside of the feet.
        capture: shift of footholds, as a share of the distance that an unwanted velocity carries an inverted pendulum.
        lift_by_pace: whether `lift` has the factor that suits the speed of the command, see `gaits.Pace`.
    """

    wider: float = 0.0
    lower: float = 0.0
    ahead: float = 0.0
    higher: float = 0.0
    across: float = foot_paths.SLIP_WEIGHT
    lift: float = foot_paths.FOOT_CLEARANCE
    gain: tuple[float, float, float] = (3.0, 3.0, 1.5)
    integral: float = 0.6
    most: float = 2.0
    lead: float = 0.0
    lean: float = 0.5
    capture: float = 0.3
    lift_by_pace: bool = False


class GaitTiming(NamedTuple):
    """When the feet of a gait stand, in the next control step.

    Attributes:
        leg_phases: (environments, legs) cycles.
        duty_factor: a number or (environments, 1); (environments, legs) where it differs between legs.
        stance_duration: s, a number or (environments, 1, 1); (environments, legs, 1) where it differs between legs.
    """

    leg_phases: Any
    duty_factor: Any
    stance_duration: Any


def observes_gait_and_pose(task: Task) -> bool:
    """Return whether a task observes pose and gait by command."""
    return task.gait_and_pose is not None and task.blocks.keys() >= {*task.gait_and_pose.observed}


class SteppingState(NamedTuple):
    """What a law that steps adds to the state of a `CommandLaw`.

    Attributes:
        joint_angles: (environments, legs, links) planned, rad.
        pose_integral: (environments, 3) integral of the errors of height, standing heights, roll and pitch, rad.
        lift_factor: (environments, 1) multiple of the height of a foot in mid-swing.
    """

    joint_angles: np.ndarray
    pose_integral: np.ndarray
    lift_factor: np.ndarray


class Stepping(CommandLaw):
    """Steps along paths of feet.

    Attributes:
        directed: whether pose and gait are by command.
        proportional_gain: gain of the feedback on the error of a pose.
        legs: their kinematics.
        rest_soles: (legs, 3) positions of the soles at rest, in the torso's frame, m.
        rest_angles: (legs, links) angles of the joints at rest, rad.
        ride_height: height of the torso at rest, m.
        pendulum_time: time constant of an inverted pendulum of this height, s.
        foot_lift: height of a foot in mid-swing, m.
    """

    def __init__(self, task: Task, parameters: SteppingParameters):
        """Fit the law to a task; see `CommandLaw`."""
        super().__init__(task, parameters)
        standing_height = self.mechanics.height
        self._rate_unit = (GRAVITY / standing_height) ** 0.5  # Hz, in which commands give the gait's frequency
        self._ik_damping = foot_paths.IK_DAMPING * standing_height  # m
        self._relaxing_damping = posture.IK_DAMPING * standing_height  # m
        self.foot_lift = parameters.lift * standing_height
        # Proportional feedback replaces an integral: with both, gaits are disturbed.
        if parameters.integral:
            self.proportional_gain = 0.0
        else:
            self.proportional_gain = min(1.0, parameters.gain[0])
        self.directed = observes_gait_and_pose(task)
        if self.directed:
            self.reads = (*self.reads, *task.gait_and_pose.observed)
        self._rest_pose = self.choose_rest_pose(task.scene.body)
        self.legs = self._rest_pose.legs
        self.rest_soles = self._rest_pose.sole_positions
        self.rest_angles = self._rest_pose.joint_angles
        self.ride_height = -self.rest_soles[:, 2].mean()  # m
        self.pendulum_time = math.sqrt(self.ride_height / GRAVITY)
        self._longest_half_path = self._find_longest_half_path(task)

    def _find_longest_half_path(self, task: Task) -> float:
        """Return how far from their positions at rest feet may step, m: further, legs would pass through each other."""
        half_path = 0.5 * self.stance_duration * self.units[0]  # at the target velocity

        def stretch_steps(stretch: float) -> np.ndarray:
            return foot_paths.cycle_angles(
                self._rest_pose,
                self.phase_offsets,
                self.duty_factor,
                stretch * half_path,
                self.foot_lift,
                self._ik_damping,
            )

        return half_path * overlap.find_largest_stretch(task.scene.body, stretch_steps, self.parameters.most)

    def choose_rest_pose(self, body: Body) -> posture.RestPose:
        """Return the pose over whose feet a body walks."""
        parameters = self.parameters
        if self.directed:
            return posture.find_pose_with_room(body)
        if parameters.wider or parameters.lower:
            return posture.find_wide_pose(body, parameters.wider, parameters.lower)
        return posture.find_shifted_pose(body, parameters.ahead, parameters.higher)

    def initial_paths(self, count: int) -> SteppingState:
        """Return the angles at rest, an integral of 0 and a factor of 1, for a number of environments."""
        return SteppingState(np.tile(self.rest_angles, (count, 1, 1)), np.zeros((count, 3)), np.ones((count, 1)))

    def follow_request(self, state: SteppingState, request: Request, observation: Mapping) -> tuple:
        """Return the next state, target angles (environments, joints), rad, and their change; see `CommandLaw`."""
        torso_height = observation["posture"][:, 0]  # m
        vertical = read_vertical(observation)
        balance_vertical = vertical
        if self.directed:
            # Balance is about the commanded attitude: it must not work against it.
            pose = observation["pose"]
            balance_vertical = (posture.rotation_of(pose[:, 3:]) @ vertical[..., None])[..., 0]

        timing = self.gait_timing(request, observation)
        velocity, foothold_shift = self.balance(request.motion, balance_vertical, observation)
        lift_factor = state.lift_factor
        if self.parameters.lift_by_pace:
            desired_factor = gaits.lifts_under_commands(observation["command"][:, :3])[:, None]
            lift_factor = lift_factor + self.smoothing * (desired_factor - lift_factor)
        soles = self.next_feet(timing, velocity, foothold_shift, request.size, lift_factor)
        pose_integral = state.pose_integral
        if self.directed:
            pose_integral, corrected_pose = self._correct_pose(pose_integral, pose, torso_height, vertical)
            soles = posture.move_ground_points(soles, corrected_pose, self.mechanics.height)

        joint_angles, target_angles, angle_changes = self.move_feet(state.joint_angles, soles, velocity)
        return SteppingState(joint_angles, pose_integral, lift_factor), target_angles, angle_changes

    def move_feet(self, joint_angles, soles, velocity) -> tuple:
        """Return the next planned joint angles, target angles (environments, joints), rad, and their change.

        Args:
            joint_angles: (environments, legs, links) planned in the latest control step, rad.
            soles: (environments, legs, 3) goals of the soles, m.
            velocity: (environments, 3) requested of the torso, m/s and rad/s.
        """
        weights = path_weights(point_velocities(velocity, self.rest_soles), self.parameters.across)
        next_angles = self.legs.solve_joint_angles(
            joint_angles, soles, weights, self._ik_damping, foot_paths.IK_ITERATIONS
        )
        next_angles = self.legs.relax_redundant_joints(
            next_angles, self.rest_angles, foot_paths.RELAXING_SHARE, self._relaxing_damping
        )
        target_angles = self.legs.by_joint(joint_angles)
        return next_angles, target_angles, self.legs.by_joint(next_angles) - target_angles

    def gait_timing(self, request: Request, observation: Mapping) -> GaitTiming:
        """Return when feet stand, by the command where there is one, else by the task."""
        if not self.directed:
            leg_phases = (request.phase[:, None] + self.phase_offsets + request.advance[:, None]) % 1.0
            return GaitTiming(leg_phases, self.duty_factor, self.stance_duration)
        gait = observation["gait"]  # sines and cosines of the phases of all legs, the duty factor and the frequency
        xp = gait.__array_namespace__()
        leg_count = len(self.phase_offsets)
        sines = gait[:, :leg_count]
        cosines = gait[:, leg_count : 2 * leg_count]
        commanded_phases = xp.arctan2(sines, cosines) / (2.0 * np.pi)
        duty_factor = gait[:, -2:-1]
        frequency = gait[:, -1:] * self._rate_unit  # Hz
        is_walking = request.advance[:, None] > 0.0
        advance = frequency * self.control_timestep * is_walking
        leg_phases = (commanded_phases + self.parameters.lead + advance) % 1.0
        return GaitTiming(leg_phases, duty_factor, stance_duration=(duty_factor / frequency)[..., None])

    def balance(self, motion, vertical, observation: Mapping) -> tuple:
        """Return the velocity (environments, 3) that feet give the torso, m/s and rad/s, and shifts of footholds.

        Args:
            motion: (environments, 3) requested, in units of the command.
            vertical: (environments, 3) the world's, in the frame of a torso in the commanded attitude.
            observation: blocks by name.

        Returns:
            The velocity, and shifts (environments, 2) of all footholds, forward and left, m.
        """
        xp = motion.__array_namespace__()
        parameters = self.parameters
        full_velocity = motion.clip(-parameters.most, parameters.most) * self.units
        tilt = xp.hypot(vertical[:, :1], vertical[:, 1:2])  # sine of its angle
        velocity = full_velocity * (2.0 - tilt / _SLOWING_TILT).clip(0.0, 1.0)
        commanded_velocity = observation["command"][:, :2] * self.units[:2]  # m/s
        unwanted_velocity = observation["velocities"][:, :2] - commanded_velocity
        capture_shift = parameters.capture * self.pendulum_time * unwanted_velocity
        lean_shift = parameters.lean * self.ride_height * vertical[:, :2]
        return velocity, capture_shift - lean_shift

    def _correct_pose(self, pose_integral, pose, torso_height, vertical) -> tuple:
        """Return the next integral of the error of a pose, and a pose (environments, 6) that makes up for the error.

        Args:
            pose_integral: (environments, 3); see `SteppingState`.
            pose: (environments, 6) commanded.
            torso_height: (environments,) m.
            vertical: (environments, 3) the world's, in the torso's frame.
        """
        xp = pose.__array_namespace__()
        height_above_rest = (torso_height / self.mechanics.height - self._rest_pose.ride_height)[:, None]
        measured = xp.concatenate([height_above_rest, posture.roll_and_pitch_of(vertical)], axis=-1)
        error = (pose[:, _MEASURED_NUMBERS] - measured).clip(-_MAX_POSE_ERROR, _MAX_POSE_ERROR)
        pose_integral = pose_integral + self.parameters.integral * self.cycles_per_step * error
        pose_integral = pose_integral.clip(-_MAX_POSE_INTEGRAL, _MAX_POSE_INTEGRAL)
        correction = pose_integral + self.proportional_gain * error
        height = correction[:, :1]
        roll_and_pitch = correction[:, 1:]
        zero = xp.zeros_like(height)  # of the numbers without feedback: forward, left and yaw
        return pose_integral, pose + xp.concatenate([height, zero, zero, roll_and_pitch, zero], axis=-1)

    def next_feet(self, timing: GaitTiming, velocity, foothold_shift, gait_size, lift_factor=1.0):
        """Return positions (environments, legs, 3) of the soles in the next control step, m, under a level torso.

        Args:
            timing: when feet stand, in the next control step.
            velocity: (environments, 3) requested of the torso, m/s and rad/s.
            foothold_shift: (environments, 2) shift of all footholds for balance, m.
            gait_size: (environments, 1) from 0 to 1.
            lift_factor: multiple of the height of a foot in mid-swing, a number or (environments, 1).
        """
        xp = timing.leg_phases.__array_namespace__()
        path_position, swing_progress = foot_paths.find_path_position(timing.leg_phases, timing.duty_factor)
        path_position = path_position[..., None]
        half_path = 0.5 * timing.stance_duration * point_velocities(velocity, self.rest_soles)
        longest_half_path = xp.hypot(half_path[..., 0], half_path[..., 1]).max(axis=-1)[:, None, None]  # of any foot
        half_path = half_path * (self._longest_half_path / longest_half_path.clip(_MIN_PATH_LENGTH)).clip(max=1.0)
        shift_share = _TAKE_OFF_SHARE + (1.0 - _TAKE_OFF_SHARE) * 0.5 * (1.0 + path_position)
        shift = shift_share * foothold_shift[:, None]
        ground = self.rest_soles[:, :2] + gait_size[..., None] * (path_position * half_path + shift)
        lift = lift_factor * self.foot_lift * xp.sin(np.pi * swing_progress)
        heights = self.rest_soles[:, 2] + gait_size * lift
        return xp.concatenate([ground, heights[..., None]], axis=-1)

    def add_tilt(self, tilt_sum, tilt, gait_size):
        """Return the next sum (environments, 2) of a tilt, rad cycles; while the gait grows nothing is added.

        Args:
            tilt_sum: (environments, 2) before the control step, rad cycles.
            tilt: (environments, 2) of the vertical in the torso's frame, forward and left, rad.
            gait_size: (environments, 1) from 0 to 1.
        """
        is_grown = gait_size >= 1.0
        return (tilt_sum + self.cycles_per_step * tilt * is_grown).clip(-_MAX_TILT_SUM, _MAX_TILT_SUM)

    def tilt_shift(self, tilt, rate_share: float, turning):
        """Return the shift (environments, 2) of feet under the weight of a torso that tilts, m.

        Args:
            tilt: (environments, 2) of the vertical in the torso's frame, forward and left, rad.
            rate_share: share of the distance by which the rate of tilt moves the weight within `pendulum_time`.
            turning: (environments, 2) rates of roll and pitch, rad/s.
        """
        xp = turning.__array_namespace__()
        tilt_rate = xp.stack([-turning[:, 1], turning[:, 0]], axis=-1)  # rad/s, of the vertical in the torso's frame
        return -self.ride_height * (tilt + rate_share * self.pendulum_time * tilt_rate)

    def constants(self) -> dict:
        """Return what the law computes with, arrays and numbers by name: all that a port to another language needs."""
        return {
            "legs": self._leg_constants(),
            "stiffness": self.drive.stiffness,
            "damping": self.drive.damping,
            "reach": self.drive.reach,
            "units": self.units,
            "most": self.parameters.most,
            "longest": min(self._longest_half_path, _NO_BOUND),
            "gain": self.parameters.gain,
            "smoothing": self.smoothing,
            "integral": self.parameters.integral * self.cycles_per_step,
            "proportional": self.proportional_gain,
            "onset": self.onset,
            "lead": self.parameters.lead,
            "height": self.mechanics.height,
            "ride": self._rest_pose.ride_height,
            "lift": self.foot_lift,
            "paces": [list(pace) for pace in gaits.PACES_BY_SPEED] if self.parameters.lift_by_pace else None,
            "across": self.parameters.across,
            "damping_of_feet": self._ik_damping,
            "steps": foot_paths.IK_ITERATIONS,
            "relaxing_share": foot_paths.RELAXING_SHARE,
            "relaxing_damping": self._relaxing_damping,
            "largest": _MAX_POSE_ERROR,
            "most_off": _MAX_POSE_INTEGRAL,
            "rate": self._rate_unit,
            "step": self.control_timestep,
            "lean": self.parameters.lean * self.ride_height,
            "capture": self.parameters.capture * self.pendulum_time,
            "slowing_tilt": _SLOWING_TILT,
            "take_off_share": _TAKE_OFF_SHARE,
        }

    def _leg_constants(self) -> list[dict]:
        """Return the constants of each leg by name."""
        arrays_of_legs = {
            "mount": self.legs.mounts,
            "turn": self.legs.mount_rotations,
            "axes": self.legs.axes,
            "ends": self.legs.ends,
            "radius": self.legs.radii,
            "joints": self.legs.joint_indices,
            "moves": self.legs.has_joint,
            "low": self.legs.low,
            "high": self.legs.high,
            "place": self.rest_soles,
            "angles": self.rest_angles,
        }
        leg_count = len(self.rest_soles)
        return [{name: array[leg] for name, array in arrays_of_legs.items()} for leg in range(leg_count)]
