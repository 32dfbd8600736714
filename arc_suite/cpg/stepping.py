"""Laws that plan paths of feet in space, and follow them by inverse kinematics.

In stance a foot moves against the requested velocity, in swing it returns and is lifted. Where a task
observes a pose and a gait by command, feet step in that gait under a torso in that pose: both are read
anew in every step, so that they may change at any time. Feedback on height, roll and pitch makes up for
what joints give way.
"""

from abc import abstractmethod
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from arc_suite import rotations
from arc_suite.cpg.command_law import CommandLaw, Request
from arc_suite.models import posture
from arc_suite.models.kinematics import Legs, path_weights, point_velocities, tilt_heights
from arc_suite.models.standing import GRAVITY
from arc_suite.tasks.contract import Task

_IK_ITERATIONS = 3  # of inverse kinematics in a control step
_MAX_POSE_INTEGRAL = 0.2  # standing heights or rad
_MAX_POSE_ERROR = 0.05  # standing heights or rad; larger errors count as this one
_MEASURED_NUMBERS = np.array((0, 3, 4))  # indices of height, roll and pitch among the six numbers of a pose


def observes_gait_and_pose(task: Task) -> bool:
    """Return whether a task observes pose and gait by command."""
    return task.gait_and_pose is not None and task.blocks.keys() >= {*task.gait_and_pose.observed}


class SteppingState(NamedTuple):
    """What a law that steps adds to the state of a `CommandLaw`.

    Attributes:
        joint_angles: (environments, legs, links) planned, rad.
        pose_integral: (environments, 3) integral of the errors of height, standing heights, roll and pitch, rad.
    """

    joint_angles: np.ndarray
    pose_integral: np.ndarray


class Stepping(CommandLaw):
    """Plans paths of feet.

    Attributes:
        directed: whether pose and gait are by command.
        proportional_gain: gain of the feedback on the error of a pose.
        legs: their kinematics.
        rest_soles: (legs, 3) positions of the soles at rest, in the torso's frame, m.
        rest_angles: (legs, links) angles of the joints at rest, rad.
        foot_lift: height of a foot in mid-swing, m.
        slip_weight: weight of a foot's slip across its path against its motion along it.
        stance_reduction: time by which the stance is shorter than in the commanded gait, cycles.
        tilt_share: how far a foot is pushed down, as a share of how far the torso's tilt lowers the foot's rest.
        relative_ik_damping: damping of inverse kinematics, standing heights.
        max_request: the largest request, in units of the command.
    """

    slip_weight = 1.0
    stance_reduction = 0.0
    tilt_share = 0.0
    relative_ik_damping = posture.IK_DAMPING
    max_request = np.inf

    def __init__(self, task: Task, parameters):
        """Fit the law to a task; see `CommandLaw`."""
        super().__init__(task, parameters)
        standing_height = self.mechanics.height
        self._rate_unit = (GRAVITY / standing_height) ** 0.5  # Hz, in which commands give the gait's frequency
        self._ik_damping = self.relative_ik_damping * standing_height  # m
        self.foot_lift = parameters.lift * standing_height
        # Proportional feedback replaces an integral: with both, gaits are disturbed.
        if parameters.integral:
            self.proportional_gain = 0.0
        else:
            self.proportional_gain = min(1.0, parameters.gain[0])
        self.directed = observes_gait_and_pose(task)
        if self.directed:
            self.reads = (*self.reads, *task.gait_and_pose.observed)
            self._rest_pose = posture.find_rest_pose(task.scene.body)
        self.legs, self.rest_soles, self.rest_angles = self._find_rest(task)

    @abstractmethod
    def _find_rest(self, task: Task) -> tuple[Legs, np.ndarray, np.ndarray]:
        """Return the legs, positions (legs, 3) of their soles at rest, m, and angles (legs, links) at rest, rad."""

    def initial_paths(self, count: int) -> SteppingState:
        """Return the angles at rest and an integral of 0, for a number of environments."""
        return SteppingState(np.tile(self.rest_angles, (count, 1, 1)), np.zeros((count, 3)))

    def follow_request(self, state: SteppingState, request: Request, observation: Mapping) -> tuple:
        """Return the next state, target angles (environments, joints), rad, and their change; see `CommandLaw`."""
        torso_height = observation["posture"][:, 0]  # m
        torso_quaternion = observation["posture"][:, 1:5]
        vertical = rotations.matrix(torso_quaternion)[:, 2]  # the world's, in the torso's frame
        balance_vertical = vertical
        if self.directed:
            # Balance is about the commanded attitude: it must not work against it.
            pose = observation["pose"]
            balance_vertical = (posture.rotation_of(pose[:, 3:]) @ vertical[..., None])[..., 0]

        leg_phases, duty_factor, stance_duration = self._gait_timing(request, observation)
        velocity, foothold_shift = self.balance(request.motion, balance_vertical, observation)
        soles = self.next_feet(
            leg_phases, velocity, foothold_shift, request.size, balance_vertical, duty_factor, stance_duration
        )
        pose_integral = state.pose_integral
        if self.directed:
            pose_integral, corrected_pose = self._correct_pose(pose_integral, pose, torso_height, vertical)
            soles = posture.move_ground_points(soles, corrected_pose, self.mechanics.height)

        weights = path_weights(point_velocities(velocity, self.rest_soles), self.slip_weight)
        joint_angles = self.legs.solve_joint_angles(
            state.joint_angles, soles, weights, self._ik_damping, _IK_ITERATIONS
        )
        target_angles = self.legs.by_joint(state.joint_angles)
        angle_changes = self.legs.by_joint(joint_angles) - target_angles
        return SteppingState(joint_angles, pose_integral), target_angles, angle_changes

    def _gait_timing(self, request: Request, observation: Mapping) -> tuple:
        """Return when feet stand, by the command where there is one, else by the task.

        Returns:
            The phases (environments, legs) of the legs in the next control step, cycles; the duty factor; and the
            duration of a stance, s. Both are numbers, or arrays (environments, 1) and (environments, 1, 1).
        """
        if not self.directed:
            leg_phases = (request.phase[:, None] + self.phase_offsets + request.advance[:, None]) % 1.0
            return leg_phases, self.duty_factor, self.stance_duration
        gait = observation["gait"]  # sines and cosines of the phases of all legs, the duty factor and the frequency
        xp = gait.__array_namespace__()
        leg_count = len(self.phase_offsets)
        sines = gait[:, :leg_count]
        cosines = gait[:, leg_count : 2 * leg_count]
        commanded_phases = xp.arctan2(sines, cosines) / (2.0 * np.pi)
        duty_factor = gait[:, -2:-1] - self.stance_reduction
        frequency = gait[:, -1:] * self._rate_unit  # Hz
        is_walking = request.advance[:, None] > 0.0
        advance = frequency * self.control_timestep * is_walking
        leg_phases = (commanded_phases + self.parameters.lead + advance) % 1.0
        return leg_phases, duty_factor, (duty_factor / frequency)[..., None]

    def balance(self, motion, vertical, observation: Mapping) -> tuple:
        """Return the velocity (environments, 3) that feet give the torso, m/s and rad/s, and shifts of footholds.

        Args:
            motion: (environments, 3) requested, in units of the command.
            vertical: (environments, 3) the world's, in the frame of a torso in the commanded attitude.
            observation: blocks by name.

        Returns:
            The velocity, and shifts (environments, 2) of all footholds, forward and left, m.
        """
        velocity = motion.clip(-self.max_request, self.max_request) * self.units
        no_shift = motion[:, :2] * 0.0
        return velocity, no_shift

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

    def next_feet(self, leg_phases, velocity, foothold_shift, gait_size, vertical, duty_factor, stance_duration):
        """Return positions (environments, legs, 3) of the soles in the next control step, m, under a level torso.

        Args:
            leg_phases: (environments, legs) in the next control step, cycles.
            velocity: (environments, 3) requested of the torso, m/s and rad/s.
            foothold_shift: (environments, 2) shift of all footholds for balance, m.
            gait_size: (environments, 1) from 0 to 1.
            vertical: (environments, 3) the world's, in the torso's frame.
            duty_factor: a number or (environments, 1).
            stance_duration: s, a number or (environments, 1, 1).
        """
        xp = leg_phases.__array_namespace__()
        is_stance = leg_phases < duty_factor
        swing_progress = ((leg_phases - duty_factor) / (1.0 - duty_factor)).clip(0.0)
        stance_position = 1.0 - 2.0 * leg_phases / duty_factor
        swing_position = 2.0 * swing_progress - 1.0
        # Along the path of a foot, from 1 in front to -1 at its end.
        path_position = xp.where(is_stance, stance_position, swing_position)[..., None]
        half_path = 0.5 * stance_duration * point_velocities(velocity, self.rest_soles)
        shift = self._shift_share(path_position) * foothold_shift[:, None]
        ground = self.rest_soles[:, :2] + gait_size[..., None] * (path_position * half_path + shift)
        lift = self.foot_lift * xp.sin(np.pi * swing_progress)
        tilt_push = self.tilt_share * tilt_heights(vertical, self.rest_soles)
        heights = self.rest_soles[:, 2] + gait_size * (lift + tilt_push)
        return xp.concatenate([ground, heights[..., None]], axis=-1)

    def _shift_share(self, path_position):
        """Return the share of the shift for balance that applies at a position along a foot's path, from 1 to -1."""
        return 1.0


class Directed(Stepping):
    """Follows a velocity in a pose and a gait by command, on level ground, without sight."""

    slip_weight = 0.3
    relative_ik_damping = 0.1  # standing heights; with less of it, legs that are stretched out jump
    max_request = 2.0  # units of the command; feedback on a body that cannot go on would throw it

    def _find_rest(self, task: Task) -> tuple[Legs, np.ndarray, np.ndarray]:
        return self._rest_pose.legs, self._rest_pose.sole_positions, self._rest_pose.joint_angles

    def constants(self) -> dict:
        """Return what the law computes with, arrays and numbers by name: all that a port to another language needs."""
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
        return {
            "legs": [{name: array[leg] for name, array in arrays_of_legs.items()} for leg in range(leg_count)],
            "stiffness": self.drive.stiffness,
            "damping": self.drive.damping,
            "reach": self.drive.reach,
            "units": self.units,
            "most": self.max_request,
            "gain": self.parameters.gain,
            "smoothing": self.smoothing,
            "integral": self.parameters.integral * self.cycles_per_step,
            "proportional": self.proportional_gain,
            "onset": self.onset,
            "lead": self.parameters.lead,
            "height": self.mechanics.height,
            "ride": self._rest_pose.ride_height,
            "lift": self.foot_lift,
            "across": self.slip_weight,
            "damping_of_feet": self._ik_damping,
            "steps": _IK_ITERATIONS,
            "largest": _MAX_POSE_ERROR,
            "most_off": _MAX_POSE_INTEGRAL,
            "rate": self._rate_unit,
            "step": self.control_timestep,
        }
